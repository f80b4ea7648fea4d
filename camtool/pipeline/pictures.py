"""Any value on the way from drawing to report as the scene that `camtool.preview` draws."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import PurePath
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from camtool.geometry.drawing import Drawing
    from camtool.machine.model import Machine
    from camtool.machine.registry import LoadedTarget
    from camtool.pipeline.judge import Posted
    from camtool.planning.job import Job
    from camtool.preview.rounds import Round
    from camtool.preview.scene import Scene
    from camtool.preview.viewer.run import Run
    from camtool.toolpath.moves import Toolpath
    from camtool.toolpath.program import Listing
    from camtool.verification.verify import Verification


def picture(
    *,
    title: str,
    drawing: Drawing | None = None,
    job: Job | None = None,
    toolpath: Toolpath | None = None,
    verification: Verification | None = None,
    machine: Machine | None = None,
    listing: Callable[[], Listing | None] | None = None,
) -> Scene:
    """The scene of whatever is there; with a verification, the slides' path by its error.

    `job` tells where it places the drawing in the work frame; `listing` gives the program's lines
    to the viewer.
    """
    from camtool.pipeline.judge import cone_of, tool_mm
    from camtool.preview.scene import Scene, scene_of_drawing

    if drawing is not None and toolpath is None:
        return replace(scene_of_drawing(drawing), title=title)
    if drawing is not None and job is not None:
        from camtool.planning.place import place

        drawing = place(drawing, job)
    trace = verification.trace if verification is not None else None
    # A V bit is as wide as it is deep: one width for all of its path would be false.
    even = job is not None and cone_of(job) is None
    return Scene(
        title=title,
        drawing=drawing,
        toolpath=toolpath,
        trace_points=trace.points if trace is not None else None,
        trace_error_mm=trace.error_mm if trace is not None else None,
        trace_cutting=trace.cutting if trace is not None else None,
        travel_mm=_travel(toolpath, machine),
        notes=verification.report.notes() if verification is not None else (),
        wanted=verification.wanted.segments if verification is not None else None,
        worst=worst_places(verification),
        tool_mm=tool_mm(job) if job is not None and even else None,
        rounds=() if verification is None else rounds_of(verification),
        run=_run(toolpath, verification, machine, listing),
    )


def posted_scene(
    posted: Posted,
    target: LoadedTarget,
    *,
    title: str = "",
    drawing: Drawing | None = None,
    job: Job | None = None,
) -> Scene:
    """The scene of what was posted: the program's moves, or those that were planned where there is
    none, with the slides' path where they were judged. The title is the drawing's name unless
    another one is given."""
    from camtool.pipeline.viewing import posted_listing

    return picture(
        title=title or ("" if drawing is None else PurePath(drawing.file).name),
        drawing=drawing,
        job=job,
        toolpath=posted.decoded or posted.wanted,
        verification=posted.verification,
        machine=target.machine,
        listing=posted_listing(posted, target),
    )


def _run(
    toolpath: Toolpath | None,
    verification: Verification | None,
    machine: Machine | None,
    listing: Callable[[], Listing | None] | None,
) -> Callable[[], Run] | None:
    """What makes the run, when the viewer asks for it."""
    if toolpath is None or machine is None:
        return None
    from camtool.pipeline.viewing import run_of

    def run() -> Run:
        return run_of(toolpath, verification, machine, None if listing is None else listing())

    return run


def rounds_of(verification: Verification) -> tuple[Round, ...]:
    """The full circles as polar plots show them, each with the same one gone round the other way
    where there is that."""
    import numpy as np

    from camtool.preview.rounds import Round
    from camtool.verification.circles import Pairs, both_ways

    seen = verification.circles
    pairs = Pairs([one.circle for one in seen])
    found = []
    for index, one in enumerate(seen):
        partner, both_mm = pairs.partner(index), math.nan
        if partner is not None:
            bins = np.concatenate([one.bins, seen[partner].bins])
            both_mm = both_ways(one.circle, bins).circular_mm
        figures = one.figures
        found.append(
            Round(
                one.circle.centre_mm,
                one.circle.radius_mm,
                one.circle.ccw,
                one.bins,
                figures.circular_mm,
                (figures.radial_max_mm, figures.radial_min_mm, figures.radial_mean_mm),
                one.reversing.value,
                None if partner is None else partner + 1,
                both_mm,
            )
        )
    return tuple(found)


def worst_places(verification: Verification | None) -> tuple[tuple[float, float], ...]:
    """Where the largest errors are, mm, the largest first."""
    if verification is None:
        return ()
    return tuple(one.at_mm for one in verification.report.worst)


def _travel(toolpath: Toolpath | None, machine: Machine | None) -> tuple[float, float] | None:
    """The table's travel, mm, if the path lies in it with part zero at its lower-left corner:
    only then is there a place where the frame can honestly be drawn."""
    if toolpath is None or machine is None:
        return None
    from camtool.toolpath.moves import toolpath_extents

    x, y = machine.axes.x.travel_mm, machine.axes.y.travel_mm
    (left, right), (low, high), _ = toolpath_extents(toolpath).tolist()
    if x is None or y is None or left < 0.0 or low < 0.0 or right > x or high > y:
        return None
    return x, y
