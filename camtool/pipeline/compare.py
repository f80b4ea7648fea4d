"""One program, run several ways: by other interpolators, with other play, without a part of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from camtool.pipeline.judge import Judging, verify_program
from camtool.units import UM_PER_MM

if TYPE_CHECKING:
    from camtool.geometry.drawing import Drawing
    from camtool.machine.registry import LoadedTarget
    from camtool.planning.job import Job
    from camtool.preview.overlay import Floats, Overlay
    from camtool.toolpath.moves import Toolpath
    from camtool.verification.contrast import Variant

WINDOW_STEPS = 30.0
"""The picture shows so many steps of the coarser axis to each side of the worst place ..."""

WINDOW_ERRORS = 1.5
"""... or so many times the largest error, where that is more ..."""

WHOLE = 2.0
"""... or the whole path, unless it is this many times larger than that."""


ROOM = 0.25
"""Paths are taken from a window larger by this share to each side: the page may show more."""


@dataclass(frozen=True, eq=False)
class Way:
    """One way to run a program: its name, the target with its settings, how it is judged."""

    name: str
    target: LoadedTarget
    judging: Judging


def compare_program(
    data: bytes,
    ways: Sequence[Way],
    *,
    source: str,
    drawing: Drawing | None = None,
    job: Job | None = None,
) -> list[Variant]:
    """The program read and judged each way; raises as `verify_program` does."""
    from camtool.verification.contrast import Variant

    variants = []
    for way in ways:
        _, found = verify_program(
            data, way.target, source=source, drawing=drawing, job=job, judging=way.judging
        )
        variants.append(Variant(way.name, way.target.machine, found))
    return variants


def compare_picture(
    data: bytes, ways: Sequence[Way], variants: Sequence[Variant], *, title: str
) -> Overlay:
    """The paths laid over each other about the place of the largest error: slides, or commanded
    positions where only the interpolator differs."""
    import numpy as np

    from camtool.preview.overlay import Overlay
    from camtool.simulation.motion import ALL, Options
    from camtool.simulation.simulate import model_of, simulate
    from camtool.verification.contrast import strokes_within, worst_place
    from camtool.verification.cuts import cut_moves

    commanded = all(way.judging.interpolator is not None for way in ways)
    first = ways[0].target
    decoded = first.post.read(data, first.machine)
    wanted = model_of(first.machine).held(decoded, first.machine)
    window = _window(wanted, variants)
    room = ROOM * (window[:, 1] - window[:, 0]).max()
    around = window + np.array([-room, room])
    runs = []
    for way in ways:
        machine = way.target.machine
        options = Options(way.judging.interpolator, way.judging.effects or ALL)
        moves = way.target.post.read(data, machine)
        cutting = cut_moves(moves, flat_cuts=True).is_cut
        chunks = simulate(moves, machine, options)
        runs.append((way.name, strokes_within(chunks, cutting, around, commanded=commanded)))
    what = "commanded positions" if commanded else "paths of the slides"
    x, y = worst_place(variants)
    note = f"{what}; the largest error of all is near ({x:.3f}, {y:.3f}) mm"
    return Overlay(title, window, wanted, runs, (note,))


def _window(wanted: Toolpath, variants: Sequence[Variant]) -> Floats:
    """[[xmin, xmax], [ymin, ymax]] mm: what the picture shows."""
    import numpy as np

    from camtool.toolpath.moves import toolpath_extents
    from camtool.verification.contrast import worst_place

    step = max(
        max(variant.machine.axes.x.coded_step_mm, variant.machine.axes.y.coded_step_mm)
        for variant in variants
    )
    error_um = max(variant.verification.report.error_um.total.max or 0.0 for variant in variants)
    half = max(WINDOW_STEPS * step, WINDOW_ERRORS * error_um / UM_PER_MM)
    whole = toolpath_extents(wanted)[:2]
    size = float((whole[:, 1] - whole[:, 0]).max())
    if size <= 2.0 * half * WHOLE:
        pad = max(0.05 * size, error_um / UM_PER_MM, step)
        return np.asarray(whole + np.array([-pad, pad]))
    x, y = worst_place(variants)
    return np.array([[x - half, x + half], [y - half, y + half]])
