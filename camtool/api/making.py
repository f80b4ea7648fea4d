"""Drawings and programs as programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from camtool.api.machines import as_target
from camtool.api.reading import as_bytes, as_drawing
from camtool.geometry.drawing import Drawing as DrawingRecord
from camtool.machine.registry import LoadedTarget
from camtool.pipeline.judge import Posted as PostedRecord
from camtool.planning.job import Job
from camtool.results import Converted, Posted, Toolpath, Verification, extended
from camtool.toolpath.program import Program

if TYPE_CHECKING:
    from camtool.verification.report import Gates


def plan(
    drawing: DrawingRecord | str | Path, target: str | LoadedTarget, job: Job | None = None
) -> Toolpath:
    """The moves that cut the drawing: work frame, mm, mm/min, in order of execution.

    N rows in columns: `kind` (N,), `end` (N, 3), `centre` (N, 2), `feed` (N,). Without a job, all
    lines are followed with a tool of no width; `job_of(tool_diameter_mm=0.2, side="auto")` makes
    a simple one. Raises OptionError for what the job asks and the drawing or the machine cannot
    give. Of a file only the layers that the operations name are cut. Source: docs/toolpaths.md.
    """
    from camtool.planning.plan import plan as planned

    loaded, wanted = as_target(target), job or Job()
    read = as_drawing(drawing, loaded, wanted)
    made = planned(read, wanted, loaded.machine)
    return extended(Toolpath, made, drawing=read, job=wanted, target=loaded)


def post(
    drawing: DrawingRecord | str | Path,
    target: str | LoadedTarget,
    job: Job | None = None,
    *,
    check: bool = True,
    compensate: bool = False,
    gates: Gates | None = None,
) -> Posted:
    """The drawing as a program of the target, read back, simulated and judged.

    `data` are the program's bytes, `verification` the verdict (None with `check=False`),
    `findings` those of all stages. `compensate` bends the path against play, scale and
    squareness; `gates` are limits whose excess is a finding. Raises OptionError, and PostError
    for what the machine or its dialect cannot do. Source: docs/verifying.md.
    """
    from camtool.pipeline import post_drawing

    loaded, wanted = as_target(target), job or Job()
    read = as_drawing(drawing, loaded, wanted)
    made = post_drawing(read, wanted, loaded, check=check, compensate=compensate, gates=gates)
    verdict = verdict_on(made, loaded, drawing=read, job=wanted)
    context = {"drawing": read, "job": wanted, "target": loaded}
    return extended(Posted, made, verification=verdict, **context)


def convert(
    program: bytes | Program | str | Path,
    from_: str | LoadedTarget,
    to: str | LoadedTarget,
    *,
    feed_mm_min: float | None = None,
    check: bool = True,
) -> Converted:
    """A program of the machine `from_` as one of the machine `to`, read back, simulated and held
    against the first one's moves.

    `program`: its bytes, or the file they are in. `feed_mm_min` takes the place of all feeds.
    `data` are the new bytes, `verification` the verdict (None with `check=False`). Raises
    ProgramError with block and column, and PostError for what the second machine cannot do.
    Source: docs/verifying.md, docs/dialects.
    """
    from camtool.pipeline import convert_program

    before, after = as_target(from_), as_target(to)
    data, source = as_bytes(program)
    made = convert_program(data, before, after, file=source, feed_mm_min=feed_mm_min, check=check)
    return extended(
        Converted, made, verification=verdict_on(made, after), target=after, file=source
    )


def verdict_on(made: PostedRecord, target: LoadedTarget, **more: Any) -> Verification | None:
    """The verdict on a program with what it was made from; None where there is none."""
    if made.verification is None or made.decoded is None:
        return None
    data = b"" if made.program is None else made.program.data
    context = {"data": data, "decoded": made.decoded, "target": target}
    return extended(Verification, made.verification, **context, **more)
