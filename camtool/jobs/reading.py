"""A drawing read as finely as the part needs that a job makes of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from camtool.errors import OptionError

if TYPE_CHECKING:
    from camtool.geometry.drawing import Drawing
    from camtool.planning.job import Job

MOST_LOOKS = 4
"""A drawing whose scale follows from its own size is read no more often than this: its size is
known within the tolerance of the look before."""


def read_to_scale(read: Callable[[float], Drawing], job: Job | None) -> Drawing:
    """The drawing that `read` gives for the scale of the part, which is the job's; where the job
    fits the drawing into a size, that follows from a first look at what is drawn."""
    if job is None:
        return read(1.0)
    if job.placement.fit_mm is None:
        return read(job.placement.scale)
    from camtool.planning.place import SCALE_SHARE, part_scale

    drawing = read(1.0)
    for _ in range(MOST_LOOKS - 1):
        try:
            scale = part_scale(drawing, job)
        except OptionError:  # which planning says, with its place in the job
            return drawing
        if abs(scale - drawing.made_for) <= SCALE_SHARE * drawing.made_for:
            return drawing
        drawing = read(scale)
    return drawing
