"""The Content of a picture: what the layers draw of a scene, and the window that shows it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats
from camtool.geometry.drawing import Drawing
from camtool.geometry.polylines import POSITION_EPS_MM, Polyline, Polylines
from camtool.pictures.chains import (
    Chain,
    MoveChains,
    chains_between,
    chains_box,
    chains_of,
    cuts_of,
    moves_of,
    reversals_of,
    tapers,
)
from camtool.pictures.colours import DRAWING, LAYER_COLOURS
from camtool.pictures.engaged import EngagementTrace, engagement_trace
from camtool.pictures.options import AS_USUAL, PictureOptions
from camtool.pictures.scene import Scene
from camtool.pictures.trace import ErrorTrace, exaggerated, trace_of
from camtool.pictures.view import points_box, round_step, union, window
from camtool.records import replace

Place = tuple[float, float]
"""x, y in mm."""

MAX_NUMBERED = 100
"""If there are more contours than this, only every 2nd, 5th, 10th … is numbered."""

NOWHERE: Floats = np.empty((0, 2))
NO_MOVES = MoveChains((), (), (), NOWHERE, NOWHERE, np.zeros(2))


class Group(Struct, frozen=True):
    """Paths of one layer of the drawing, in one colour."""

    name: str
    colour: str
    chains: tuple[Chain, ...]


class SweptCut(Struct, frozen=True, eq=False):
    """The area that a tool of constant width cuts along `chains`; if the width is None, `chains`
    are the outlines of that area."""

    width_mm: float | None
    chains: tuple[Chain, ...]


class Places(Struct, frozen=True, eq=False):
    """Places (P, 2) mm of a drawing: open ends, drill centres, and crossings and branches, where
    a contour is ambiguous."""

    gaps: Floats
    points: Floats
    ambiguous: Floats


class Content(Struct, frozen=True, eq=False, dict=True):
    """The content of a picture of a scene.

    `outlines` are the paths of the drawing, in `groups` by its layers; `moves` those of the
    toolpath, empty without one; `places` belong to the drawing; `trace` is the predicted path
    where it is shown, and `engaged` the moves by engagement. `window` (2, 2) mm is the part of the
    plane that is shown, `crop_mm` the part that was asked for; `shown` are the names of layers,
    None: the usual ones; `times` is the factor by which errors are exaggerated."""

    scene: Scene
    groups: tuple[Group, ...]
    outlines: tuple[Chain, ...]
    moves: MoveChains
    places: Places
    trace: ErrorTrace | None
    engaged: EngagementTrace | None
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
        """True if there is nothing at all to draw."""
        outlines = self.shown is None or "drawing" in self.shown
        points = self.shown is None or "doubts" in self.shown
        marked = (outlines and self.outlines) or (points and len(self.places.points))
        return not (marked or self.scene.toolpath is not None or self.trace)

    @property
    def is_drawing_alone(self) -> bool:
        """True if there are neither moves nor a predicted path."""
        return self.scene.toolpath is None and self.trace is None

    @cached_property
    def starts(self) -> Floats:
        """Places (S, 2) mm where contours begin without a plunge."""
        starts, plunges = self.moves.starts, self.moves.plunges
        if not len(plunges):
            return starts
        plunged = {tuple(place) for place in _grid(plunges)}
        return starts[[tuple(place) not in plunged for place in _grid(starts)]]

    @cached_property
    def order(self) -> tuple[list[str], list[Place]]:
        """The numbers of contours, from 1, as texts, and the places where these begin; if there
        are many, only some."""
        starts: list[Place] = self.moves.starts.tolist()
        step = 1 if len(starts) <= MAX_NUMBERED else round(round_step(len(starts) / MAX_NUMBERED))
        numbers = [k for k in range(len(starts)) if k == 0 or (k + 1) % step == 0]
        return [str(k + 1) for k in numbers], [starts[k] for k in numbers]

    @cached_property
    def swept(self) -> tuple[SweptCut, ...]:
        """The cuts, each as wide as its tool cuts at the surface, if that is known."""
        scene, toolpath = self.scene, self.scene.toolpath
        swept: list[SweptCut] = []
        if scene.tool_mm:
            swept.append(SweptCut(scene.tool_mm, (*self.moves.feeds, *self.moves.ramps)))
        elif toolpath is not None and scene.nose is not None:
            swept.append(SweptCut(None, tapers(toolpath, scene.nose.radius_at)))
        elif toolpath is not None and scene.turns:
            begins = [row for row, _ in scene.turns]
            turn = np.searchsorted(begins, np.arange(len(toolpath)), side="right") - 1
            for tool in dict.fromkeys(tool for _, tool in scene.turns):
                own_turns = [k for k, (_, each) in enumerate(scene.turns) if each == tool]
                is_chosen = np.isin(turn.clip(min=0), own_turns)
                if tool.nose_mm or tool.kind in ("v", "drill"):
                    swept.append(SweptCut(None, tapers(toolpath, tool.radius_at, is_chosen)))
                elif tool.diameter_mm:
                    swept.append(SweptCut(tool.diameter_mm, cuts_of(toolpath, is_chosen)))
        return tuple(each for each in swept if each.chains)

    @property
    def stock(self) -> tuple[Chain, ...]:
        """The outline of the stock, if it is known."""
        return self._box(self.scene.stock_mm)

    @property
    def passed_over(self) -> tuple[Chain, ...]:
        """The box that tools and holders pass over, if it is known."""
        return self._box(self.scene.swept_mm)

    @staticmethod
    def _box(box_mm: tuple[float, float, float, float] | None) -> tuple[Chain, ...]:
        if box_mm is None:
            return ()
        left, low, right, high = box_mm
        corners = [[left, low, 0.0], [right, low, 0.0], [right, high, 0.0], [left, high, 0.0]]
        return chains_of(Polylines.of([Polyline(np.array(corners), closed=True)]))

    def straight(self, ends: Sequence[tuple[Place, Place]]) -> tuple[Chain, ...]:
        """Return a straight chain between the two places of each pair, if they differ."""
        lines = [
            Polyline(np.array([(*one, 0.0), (*other, 0.0)]))
            for one, other in ends
            if math.dist(one, other) > POSITION_EPS_MM
        ]
        return chains_of(Polylines.of(lines))

    @cached_property
    def reversals(self) -> Floats:
        """Places (R, 2) mm where X or Y reverses."""
        return NOWHERE if self.scene.toolpath is None else reversals_of(self.scene.toolpath)

    @cached_property
    def worst(self) -> Floats:
        """Places (W, 2) mm at which the marks of the largest errors are drawn."""
        places = np.array(self.scene.worst, dtype=np.float64).reshape(-1, 2)
        if self.scene.wanted is None or self.times == 1.0:
            return places
        return exaggerated(places, self.scene.wanted, self.times)


def content_of(scene: Scene, options: PictureOptions = AS_USUAL) -> Content:
    """Compute everything that the page and its layers draw of the scene."""
    moves = NO_MOVES if scene.toolpath is None else moves_of(scene.toolpath)
    trace = trace_of(scene, options.exaggerate)
    times = 1.0 if trace is None else trace.times
    if scene.toolpath is not None and times != 1.0 and scene.wanted is not None:
        moves = replace(moves, feeds=chains_between(scene.wanted), ramps=())
    outlines: tuple[Chain, ...] = ()
    groups: tuple[Group, ...] = ()
    places = Places(NOWHERE, NOWHERE, NOWHERE)
    if scene.drawing is not None:
        outlines = chains_of(scene.drawing.paths)
        is_alone = scene.toolpath is None and trace is None
        groups = _groups(scene.drawing, outlines, is_alone=is_alone)
        places = _places(scene.drawing)
    shown = options.layers
    with_path = shown is None or "path" in shown
    # Layers that are not shown do not change the window.
    widest = max((tool.diameter_mm for _, tool in scene.turns), default=None)
    tool_mm = (scene.tool_mm or widest) if shown is None or "swept" in shown else None
    stock = scene.stock_mm if shown is None or "stock" in shown else None
    return Content(
        scene=scene,
        groups=groups,
        outlines=outlines,
        moves=moves,
        places=places,
        trace=trace if with_path else None,
        engaged=engagement_trace(scene) if shown and "engagement" in shown else None,
        window=(
            _window(outlines, places.points, moves, trace, tool_mm, stock)
            if options.crop_mm is None
            else cropped(*options.crop_mm)
        ),
        shown=shown,
        crop_mm=options.crop_mm,
        times=times,
    )


def _groups(drawing: Drawing, chains: Sequence[Chain], *, is_alone: bool) -> tuple[Group, ...]:
    """Return the drawing's paths by layer, in the order of their first paths: pale below a
    toolpath, in strong colours if the drawing is alone."""
    names = tuple(dict.fromkeys(drawing.layers))
    members: dict[str, list[Chain]] = {name: [] for name in names}
    for name, chain in zip(drawing.layers, chains, strict=True):
        members[name].append(chain)
    return tuple(
        Group(
            name,
            LAYER_COLOURS[index % len(LAYER_COLOURS)] if is_alone else DRAWING,
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
    """Return the window (2, 2) mm, [[xmin, xmax], [ymin, ymax]], of a rectangle."""
    return np.array([[x, x + width], [y, y + height]])


def _window(
    outlines: tuple[Chain, ...],
    points: Floats,
    moves: MoveChains,
    trace: ErrorTrace | None,
    tool_mm: float | None,
    stock_mm: tuple[float, float, float, float] | None,
) -> Floats:
    part = [chains_box(outlines), points_box(points)]
    if stock_mm is not None:
        part.append(points_box(np.array(stock_mm).reshape(2, 2)))
    boxes = [points_box(np.zeros((1, 2)))]
    if trace is not None:
        part.append(points_box(trace.points[trace.cutting]))
    if moves is not NO_MOVES:
        cuts = union([chains_box(moves.feeds), chains_box(moves.ramps)])
        reach = 0.5 * (tool_mm or 0.0) * np.array([-1.0, 1.0])
        part += [None if cuts is None else cuts + reach, points_box(moves.plunges)]
        boxes += [chains_box(moves.rapids), points_box(moves.begin[None, :])]
    box = union(part)
    if box is None and moves is NO_MOVES:
        return window(None, None)
    return window(box, union(boxes))


def _grid(points: Floats) -> list[list[float]]:
    """Return points as whole multiples of `POSITION_EPS_MM`, to compare them."""
    counts: list[list[float]] = np.rint(points / POSITION_EPS_MM).tolist()
    return counts
