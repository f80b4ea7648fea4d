"""The house from Python: what the commands do, as functions on values.

`import camtool` gives all of it. Values go from one call to the next; none of these calls writes
a file. Lengths are mm, angles rad, feeds mm/min, errors of reports µm. Whatever a user can do
wrong raises a CamtoolError with one line that says what, where, and how to mend it; what is wrong
with a part is no exception but a finding in the result.
"""

from __future__ import annotations

from camtool.api.jobs import job_of
from camtool.api.judging import calibrate, compare, verify
from camtool.api.machines import load_target, targets
from camtool.api.making import convert, plan, post
from camtool.api.pictures import Looks, preview
from camtool.api.reading import Reading, read_drawing, read_job
from camtool.errors import CamtoolError
from camtool.machine.registry import ListedTarget, LoadedTarget
from camtool.pipeline import Judging
from camtool.planning.job import Job, Operation, Placement, Stock, Tool
from camtool.results import (
    Calibration,
    Comparison,
    Converted,
    Drawing,
    Picture,
    Posted,
    Toolpath,
    Verification,
)
from camtool.simulation.motion import Effects
from camtool.verification.report import Gates

__all__ = [
    "Calibration",
    "CamtoolError",
    "Comparison",
    "Converted",
    "Drawing",
    "Effects",
    "Gates",
    "Job",
    "Judging",
    "ListedTarget",
    "LoadedTarget",
    "Looks",
    "Operation",
    "Picture",
    "Placement",
    "Posted",
    "Reading",
    "Stock",
    "Tool",
    "Toolpath",
    "Verification",
    "calibrate",
    "compare",
    "convert",
    "job_of",
    "load_target",
    "plan",
    "post",
    "preview",
    "read_drawing",
    "read_job",
    "targets",
    "verify",
]
