"""The Content: a scene as what its layers draw, and the window that shows it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from camtool.arrays import Floats
from camtool.geometry.drawing import Drawing
from camtool.geometry.polylines import POSITION_EPS_MM
from camtool.pictures.colours import DRAWING, LAYER_COLOURS
from camtool.pictures.options import AS_USUAL, Options
from camtool.pictures.scene import Scene
from camtool.pictures.strokes import (
    Chain,
    Strokes,
    chains_between,
    chains_box,
    chains_of,
    strokes_of,
    turns_of,
)
from camtool.pictures.trace import Trace, exaggerated, trace_of
from camtool.pictures.view import points_box, round_step, union, window

Place = tuple[float, float]
"""x, y in mm."""

MOST_NUMBERED = 100
"""Of more contours than this only every 2nd, 5th, 10th … has its number."""

NOWHERE: Floats = np.empty((0, 2))
NO_MOVES = Strokes((), (), (), NOWHERE, NOWHERE, np.zeros(2))


@dataclass(frozen=True)
class Group:
    """Paths of one layer of the drawing, in one colour."""

    name: str
    colour: str
    chains: tuple[Chain, ...]


@dataclass(frozen=True, eq=False)
class Places:
    """Places (P, 2) mm of a drawing: open ends, drill centres, and crossings and branches, where
    a contour is ambiguous."""

    gaps: Floats
    points: Floats
    ambiguous: Floats


@dataclass(frozen=True, eq=False)
class Content:
    """`outlines` of the drawing, by layer in `groups`; `strokes` of the moves, None without any;
    `places` are those that the drawing notes; `trace` is what is shown of the predicted path.
    `window` (2, 2) mm is what to show, and `crop_mm` whether that was asked for; `shown` are the
    names of layers, None: the usual ones; `times` is how many times as large errors are drawn."""

    scene: Scene
    groups: tuple[Group, ...]
    outlines: tuple[Chain, ...]
    strokes: Strokes | None
    places: Places
    trace: Trace | None
    window: Floats
    shown: frozenset[str] | None
    crop_mm: tuple[float, float, float, float] | None
    times: float

    @property
    def notes(self) -> tuple[str, ...]:
        """The notes of the scene, and by how much errors are exaggerated."""
        if self.times == 1.0:
            return self.scene.notes
        factor = f"the path is drawn with its deviation from the wanted one × {self.times:g}"
        return (*self.scene.notes, factor)

    @property
    def is_empty(self) -> bool:
        """Whether there is nothing at all to draw."""
        outlines = self.shown is None or "drawing" in self.shown
        points = self.shown is None or "doubts" in self.shown
        marked = (outlines and self.outlines) or (points and len(self.places.points))
        return not (marked or self.strokes or self.trace)

    @property
    def moves(self) -> Strokes:
        """The strokes, without any where there are no moves."""
        return NO_MOVES if self.strokes is None else self.strokes

    @cached_property
    def starts(self) -> Floats:
        """(S, 2) starts of contours where no plunge is marked."""
        return bare_starts(self.moves)

    @cached_property
    def order(self) -> tuple[list[str], list[Place]]:
        """The numbers of contours, from 1, and where those begin; of many contours only some."""
        starts: list[Place] = self.moves.starts.tolist()
        step = (
            1 if len(starts) <= MOST_NUMBERED else round(round_step(len(starts) / MOST_NUMBERED))
        )
        chosen = [k for k in range(len(starts)) if k == 0 or (k + 1) % step == 0]
        return [str(k + 1) for k in chosen], [starts[k] for k in chosen]

    @property
    def swept(self) -> tuple[Chain, ...]:
        """What the tool covers, which is known where its diameter is."""
        return (*self.moves.feeds, *self.moves.ramps) if self.scene.tool_mm else ()

    @cached_property
    def reversals(self) -> Floats:
        """(R, 2) where X or Y turns back."""
        return NOWHERE if self.scene.toolpath is None else turns_of(self.scene.toolpath)

    @cached_property
    def worst(self) -> Floats:
        """(W, 2) where the worst places are drawn."""
        places = np.array(self.scene.worst, dtype=np.float64).reshape(-1, 2)
        if self.scene.wanted is None or self.times == 1.0:
            return places
        return exaggerated(places, self.scene.wanted, self.times)


def content_of(scene: Scene, options: Options = AS_USUAL) -> Content:
    """Everything that the page and its layers need to know of the scene."""
    strokes = None if scene.toolpath is None else strokes_of(scene.toolpath)
    trace = trace_of(scene, options.exaggerate)
    times = 1.0 if trace is None else trace.times
    if strokes is not None and times != 1.0 and scene.wanted is not None:
        strokes = replace(strokes, feeds=chains_between(scene.wanted), ramps=())
    outlines: tuple[Chain, ...] = ()
    groups: tuple[Group, ...] = ()
    places = Places(NOWHERE, NOWHERE, NOWHERE)
    if scene.drawing is not None:
        outlines = chains_of(scene.drawing.paths)
        groups = _groups(scene.drawing, outlines, alone=strokes is None and trace is None)
        places = _places(scene.drawing)
    shown = options.layers
    # The window is that of all there is, whatever is shown of it.
    tool_mm = scene.tool_mm if shown is None or "swept" in shown else None
    return Content(
        scene=scene,
        groups=groups,
        outlines=outlines,
        strokes=strokes,
        places=places,
        trace=trace if shown is None or "path" in shown else None,
        window=(
            _window(outlines, places.points, strokes, trace, tool_mm)
            if options.crop_mm is None
            else cropped(*options.crop_mm)
        ),
        shown=shown,
        crop_mm=options.crop_mm,
        times=times,
    )


def _groups(drawing: Drawing, chains: Sequence[Chain], *, alone: bool) -> tuple[Group, ...]:
    """The layers in order of first use: light below a toolpath, in strong colours when alone."""
    names = tuple(dict.fromkeys(drawing.layers))
    members: dict[str, list[Chain]] = {name: [] for name in names}
    for name, chain in zip(drawing.layers, chains, strict=True):
        members[name].append(chain)
    return tuple(
        Group(
            name,
            LAYER_COLOURS[index % len(LAYER_COLOURS)] if alone else DRAWING,
            tuple(members[name]),
        )
        for index, name in enumerate(names)
    )


def _places(drawing: Drawing) -> Places:
    def columns(points: list[tuple[float, float]]) -> Floats:
        return np.array(points, dtype=np.float64).reshape(-1, 2)

    ambiguous = [crossing.at_mm for crossing in drawing.healing.crossings]
    ambiguous += [branch.at_mm for branch in drawing.healing.branches]
    return Places(
        gaps=columns([gap.at_mm for gap in drawing.gaps]),
        points=columns([mark.at_mm for mark in drawing.marks]),
        ambiguous=columns(ambiguous),
    )


def cropped(x: float, y: float, width: float, height: float) -> Floats:
    """The window (2, 2) of a part that was asked for."""
    return np.array([[x, x + width], [y, y + height]])


def _window(
    outlines: tuple[Chain, ...],
    points: Floats,
    strokes: Strokes | None,
    trace: Trace | None,
    tool_mm: float | None,
) -> Floats:
    part = [chains_box(outlines), points_box(points)]
    around = [points_box(np.zeros((1, 2)))]
    if trace is not None:
        part.append(points_box(trace.points[trace.cutting]))
    if strokes is not None:
        cuts = union([chains_box(strokes.feeds), chains_box(strokes.ramps)])
        reach = 0.5 * (tool_mm or 0.0) * np.array([-1.0, 1.0])
        part += [None if cuts is None else cuts + reach, points_box(strokes.plunges)]
        around += [chains_box(strokes.rapids), points_box(strokes.begin[None, :])]
    whole = union(part)
    if whole is None and strokes is None:
        return window(None, None)
    return window(whole, union(around))


def bare_starts(strokes: Strokes) -> Floats:
    """(S, 2) starts of contours where no plunge is marked."""
    starts = strokes.starts
    if not len(strokes.plunges):
        return starts
    marked = {tuple(place) for place in _grid(strokes.plunges)}
    return starts[[tuple(place) not in marked for place in _grid(starts)]]


def _grid(points: Floats) -> list[list[float]]:
    """Points as counts of the least distance that tells two positions apart."""
    counts: list[list[float]] = np.rint(points / POSITION_EPS_MM).tolist()
    return counts
