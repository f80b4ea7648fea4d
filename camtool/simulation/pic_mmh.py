"""The controller on the PIC18F8720: lines by DDA, arcs by direct search, one step at a time.

What it does with a row of the toolpath, in the order of this file:

1. Millimetres become steps, each coordinate by itself: round(mm / coded step), halves away from
   zero. Lines and arcs start where the controller stands.
2. XY first, then Z (2.5 axes). Lines, rapids and homing are DDA lines; arcs go by
   `controller.arcs` about the rounded centre until the position equals the rounded end.
3. Every output takes one period 1/f, f = feed / (60 · coded step), rapids run at
   `limits.rapid_step_rate_hz` (equation 3.1, L853-878). The link reports each step, and holds
   faster feeds at `limits.max_step_rate_hz` (L3196-3199). `time_base` "event": a pass without a
   pulse costs nothing (annex A.3 loops back at once); "iteration": each pass takes one period.
4. At each change of an axis's direction the compensation steps are issued, a period each.

What the controller takes for the end of an arc is not said (`controller.arc_end`,
`camtool.kernels.arc_stops`); it goes on from where the arc stopped. By "equal" an arc that passes
its end without standing on it goes round again on the real machine, mostly for ever. Here its
samples stop at the nearest approach to the end in the expected sweep, `ended` is False, and the
next row goes on from the programmed end, without a reversal on the way there. An arc that starts
at its centre has no samples and the same fate.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from camtool.findings import Finding
from camtool.kernels.lattice import to_steps
from camtool.machine.controllers import PicMmhController
from camtool.machine.model import Machine, controller_of
from camtool.simulation.motion import Chunk, Floats
from camtool.simulation.options import Options
from camtool.simulation.pic_mmh_legs import JudgedSteps
from camtool.simulation.pic_mmh_run import PicMmh
from camtool.toolpath.moves import Toolpath


def run(toolpath: Toolpath, machine: Machine, options: Options) -> Iterator[Chunk]:
    """The motion; see `camtool.simulation.models.ControllerModel`."""
    return PicMmh(toolpath, machine, options).run()


def held(toolpath: Toolpath, machine: Machine) -> Toolpath:
    """The same with start, ends and arc centres at their nearest steps."""
    coded_mm = [axis.coded_step_mm for axis in machine.axes]
    centre = _on_grid(np.where(toolpath.is_arc[:, None], toolpath.centre, 0.0), coded_mm[:2])
    return replace(
        toolpath,
        start=_on_grid(toolpath.start[None, :], coded_mm)[0],
        end=_on_grid(toolpath.end, coded_mm),
        centre=np.where(toolpath.is_arc[:, None], centre, np.nan),
    )


def judged_steps(toolpath: Toolpath, machine: Machine, options: Options) -> JudgedSteps | None:
    """The same motion as that of `run`, judged as it is made, without chunks; None where the
    mechanics needs these. Raises as `run` does, all at once."""
    return PicMmh(toolpath, machine, options).judged_steps()


def findings(toolpath: Toolpath, machine: Machine, options: Options) -> tuple[Finding, ...]:
    """Arcs that do not end alike by every reading of the thesis."""
    if interpolation(toolpath, machine, options) != "dsm" or not toolpath.is_arc.any():
        return ()
    from camtool.simulation.pic_mmh_ends import arc_end_findings

    return arc_end_findings(toolpath, machine, PicMmh(toolpath, machine, options).legs_as_said())


def spacing_mm(toolpath: Toolpath, machine: Machine) -> float:
    """A step: every output is a sample."""
    return min(machine.axes.x.coded_step_mm, machine.axes.y.coded_step_mm)


def interpolation(toolpath: Toolpath, machine: Machine, options: Options) -> str:
    """How arcs are made: dsm, dda or stairs."""
    return options.interpolator or controller_of(machine, PicMmhController).arcs


def assumptions(toolpath: Toolpath, machine: Machine) -> tuple[str, ...]:
    """What the times take for granted."""
    base = controller_of(machine, PicMmhController).time_base
    return (
        f"each {base} of the interpolator takes one period of the feed (controller.time_base)",
        f"rapids run at {machine.limits.rapid_step_rate_hz:g} steps/s (limits.rapid_step_rate_hz)",
        "each step of a compensation takes a period of its own",
    )


def _on_grid(points: Floats, coded_mm: list[float]) -> Floats:
    """Points (J, A) mm, each coordinate at its nearest step."""
    columns = [to_steps(points[:, axis], step) * step for axis, step in enumerate(coded_mm)]
    return np.column_stack(columns)
