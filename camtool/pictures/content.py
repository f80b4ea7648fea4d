"""A scene sorted into what is drawn, and the legend of what was found in it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np

from camtool.arrays import Floats
from camtool.geometry.drawing import Drawing
from camtool.geometry.polylines import POSITION_EPS_MM
from camtool.pictures import legend, marks
from camtool.pictures.colours import DRAWING, FEED_PALE, OUTLINE, SWEPT, TRAVEL
from camtool.pictures.legend import Entry
from camtool.pictures.options import AS_USUAL, NOT_UNDER_PATH, USUAL, Options
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
from camtool.pictures.svg import Look
from camtool.pictures.trace import Trace, exaggerated, trace_of
from camtool.pictures.view import View, points_box, union, window

T = TypeVar("T")
NOWHERE: Floats = np.empty((0, 2))


@dataclass(frozen=True, eq=False)
class Places:
    """Places (P, 2) mm of a drawing: open ends, drill centres, and what is wrong or unclear."""

    gaps: Floats
    points: Floats
    doubts: Floats

    def looks(self) -> list[tuple[str, str, Floats, Look]]:
        """(id, name for people, places, look) of each kind."""
        return [
            ("gaps", "open end", self.gaps, marks.gap_look()),
            ("points", "point", self.points, marks.point_look()),
            ("doubts", "crossing or branch", self.doubts, marks.doubt_look()),
        ]


@dataclass(frozen=True, eq=False)
class Content:
    """`outlines` of the drawing, by layer in `groups`; `starts` (S, 2) mm are those of contours
    that no plunge marks; `places` are those that the drawing notes; `window` (2, 2) mm is what to
    show, and `crop_mm` whether that was asked for; `times` is how many times as large errors are
    drawn, and `notes` what is said above. `shown` are the names of layers; `swept`
    is what the tool covers, `arrows` along which directions are shown; `reversals` (R, 2) and
    `worst` (W, 2) are places in mm, empty when they are not shown."""

    scene: Scene
    groups: tuple[marks.Group, ...]
    outlines: tuple[Chain, ...]
    strokes: Strokes | None
    starts: Floats
    places: Places
    trace: Trace | None
    window: Floats
    shown: frozenset[str] = USUAL
    swept: tuple[Chain, ...] = ()
    arrows: tuple[Chain, ...] = ()
    reversals: Floats = field(default_factory=lambda: NOWHERE)
    worst: Floats = field(default_factory=lambda: NOWHERE)
    crop_mm: tuple[float, float, float, float] | None = None
    times: float = 1.0

    @property
    def notes(self) -> tuple[str, ...]:
        """The notes of the scene, and by how much errors are exaggerated."""
        if self.times == 1.0:
            return self.scene.notes
        factor = f"the path is drawn with its deviation from the wanted one × {self.times:g}"
        return (*self.scene.notes, factor)

    def zero_shown(self, view: View) -> bool:
        """Whether part zero is in the picture; one with nothing in it needs none."""
        return "zero" in self.shown and not self.is_empty and view.shows(0.0, 0.0)

    @property
    def is_empty(self) -> bool:
        """Whether there is nothing at all to draw."""
        return not (self.outlines or len(self.places.points) or self.strokes or self.trace)


def content_of(scene: Scene, options: Options = AS_USUAL) -> Content:
    """Everything that the page and its layers need to know of the scene."""
    strokes = None if scene.toolpath is None else strokes_of(scene.toolpath)
    trace = trace_of(scene, options.exaggerate)
    if (
        strokes is not None
        and trace is not None
        and trace.times != 1.0
        and scene.wanted is not None
    ):
        strokes = replace(strokes, feeds=chains_between(scene.wanted), ramps=())
    outlines: tuple[Chain, ...] = ()
    groups: tuple[marks.Group, ...] = ()
    places = Places(NOWHERE, NOWHERE, NOWHERE)
    if scene.drawing is not None:
        outlines = chains_of(scene.drawing.paths)
        alone = strokes is None and trace is None
        groups = marks.groups_of(scene.drawing, outlines, alone=alone)
        places = _places(scene.drawing)
    tool_mm = scene.tool_mm if "swept" in options.layers else None
    content = Content(
        scene=scene,
        groups=groups,
        outlines=outlines,
        strokes=strokes,
        starts=bare_starts(strokes),
        places=places,
        trace=trace,
        window=(
            _window(outlines, places.points, strokes, trace, tool_mm)
            if options.crop_mm is None
            else cropped(*options.crop_mm)
        ),
        crop_mm=options.crop_mm,
        times=1.0 if trace is None else trace.times,
    )
    return _shown(content, options.layers)


def _shown(content: Content, layers: frozenset[str]) -> Content:
    """The content without what is in no layer that is to be seen; the window stays."""
    scene, strokes = content.scene, content.strokes

    def kept(layer: str, value: T, otherwise: T) -> T:
        return value if layer in layers else otherwise

    if strokes is not None:
        strokes = replace(
            strokes,
            feeds=kept("feeds", strokes.feeds, ()),
            ramps=kept("feeds", strokes.ramps, ()),
            rapids=kept("rapids", strokes.rapids, ()),
            plunges=kept("plunges", strokes.plunges, NOWHERE),
        )
    turns = NOWHERE
    if "reversals" in layers and scene.toolpath is not None:
        turns = turns_of(scene.toolpath)
    return replace(
        content,
        scene=replace(scene, travel_mm=kept("travel", scene.travel_mm, None)),
        groups=kept("drawing", content.groups, ()),
        outlines=kept("drawing", content.outlines, ()),
        strokes=strokes,
        starts=kept("starts", content.starts, NOWHERE),
        places=kept("doubts", content.places, Places(NOWHERE, NOWHERE, NOWHERE)),
        trace=kept("path", content.trace, None),
        reversals=turns,
        swept=kept("swept", _swept(content), ()),
        arrows=kept("arrows", content.strokes.feeds if content.strokes else (), ()),
        worst=kept("worst", _worst(content), NOWHERE),
        shown=layers,
    )


def _swept(content: Content) -> tuple[Chain, ...]:
    """What the tool covers is known where its diameter is."""
    strokes = content.strokes
    return (*strokes.feeds, *strokes.ramps) if strokes and content.scene.tool_mm else ()


def _worst(content: Content) -> Floats:
    """(W, 2) where the worst places are drawn."""
    scene = content.scene
    places = np.array(scene.worst, dtype=np.float64).reshape(-1, 2)
    if scene.wanted is None or content.times == 1.0:
        return places
    return exaggerated(places, scene.wanted, content.times)


def _places(drawing: Drawing) -> Places:
    def columns(points: list[tuple[float, float]]) -> Floats:
        return np.array(points, dtype=np.float64).reshape(-1, 2)

    doubts = [crossing.at_mm for crossing in drawing.healing.crossings]
    doubts += [branch.at_mm for branch in drawing.healing.branches]
    return Places(
        gaps=columns([gap.at_mm for gap in drawing.gaps]),
        points=columns([mark.at_mm for mark in drawing.marks]),
        doubts=columns(doubts),
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


def bare_starts(strokes: Strokes | None) -> Floats:
    """(S, 2) starts of contours where no plunge is marked."""
    if strokes is None:
        return np.empty((0, 2))
    starts = strokes.starts
    if not len(strokes.plunges):
        return starts
    marked = {tuple(place) for place in _grid(strokes.plunges)}
    return starts[[tuple(place) not in marked for place in _grid(starts)]]


def _grid(points: Floats) -> list[list[float]]:
    """Points as counts of the least distance that tells two positions apart."""
    counts: list[list[float]] = np.rint(points / POSITION_EPS_MM).tolist()
    return counts


# The legend: what is present in a picture and within its view.

MOST_LAYERS_NAMED = 7
"""More layers than this are counted, not named, in the legend."""


def entries_of(content: Content, view: View) -> list[Entry]:
    """The legend: only what is present and within view."""
    return [
        *_drawing_entries(content),
        *_toolpath_entries(content),
        *_mark_entries(content, view),
    ]


def _drawing_entries(content: Content) -> list[Entry]:
    if not content.outlines:
        return []
    if content.strokes is not None or content.trace is not None:
        return [Entry(legend.line_swatch(DRAWING, 5.0), "drawing")]
    if len(content.groups) == 1:
        name = content.groups[0].name
        named = f"drawing, layer {name}" if name.strip() else "drawing"
        return [Entry(legend.line_swatch(OUTLINE, 2.8), named)]
    named_groups = content.groups[:MOST_LAYERS_NAMED]
    entries = [
        Entry(legend.line_swatch(group.colour, 2.8), group.name or "(no layer)")
        for group in named_groups
    ]
    more = len(content.groups) - len(named_groups)
    return [*entries, Entry("", f"and {more} more layers")] if more else entries


def _path_name(trace: Trace) -> str:
    if trace.times == 1.0:
        return "predicted path, by error"
    return f"predicted path, error × {trace.times:g}"


def _below(trace: Trace) -> str:
    return "programmed path" if trace.times == 1.0 else "wanted path"


def _toolpath_entries(content: Content) -> list[Entry]:
    entries: list[Entry] = []
    strokes, trace = content.strokes, content.trace
    if trace is not None:
        entries.append(Entry(legend.map_swatch(4.0), _path_name(trace)))
    if strokes is None:
        return entries
    if strokes.feeds:
        pale = legend.line_swatch(FEED_PALE, 2.0)
        swatch = legend.line_swatch(*legend.FEED_SWATCH) if trace is None else pale
        entries.append(Entry(swatch, "feed" if trace is None else _below(trace)))
    if trace is not None:
        return entries
    if strokes.ramps:
        entries.append(Entry(legend.line_swatch(*legend.RAMP_SWATCH), "slope"))
    if strokes.rapids:
        entries.append(Entry(legend.line_swatch(*legend.RAPID_SWATCH), "rapid"))
    if len(strokes.plunges):
        entries.append(Entry(legend.dot_swatch(marks.plunge_look()), "plunge"))
    if len(content.starts):
        entries.append(Entry(legend.dot_swatch(marks.start_look()), "start"))
    return entries


def _mark_entries(content: Content, view: View) -> list[Entry]:
    entries: list[Entry] = []
    if content.swept:
        swept = f"tool {content.scene.tool_mm:.4g} mm wide"
        entries.append(Entry(legend.line_swatch(SWEPT, 9.0), swept))
    for name, places, look in (
        ("reversal", content.reversals, marks.reversal_look()),
        ("largest errors, by rank", content.worst, marks.worst_look()),
    ):
        if any(view.shows(*place) for place in places.tolist()):
            entries.append(Entry(legend.dot_swatch(look), name))
    for _, name, places, look in content.places.looks():
        if any(view.shows(*place) for place in places.tolist()):
            entries.append(Entry(legend.dot_swatch(look), name))
    if content.zero_shown(view):
        entries.append(Entry(legend.cross_swatch(), "part zero"))
    travel = content.scene.travel_mm
    if travel is not None and _frame_shown(travel, view):
        name = f"travel {travel[0]:g} × {travel[1]:g} mm"
        entries.append(Entry(legend.line_swatch(TRAVEL, 2.0), name))
    return entries


def _frame_shown(size: tuple[float, float], view: View) -> bool:
    """Whether a side of the frame 0 … size crosses the window."""
    (x0, x1), (y0, y1) = view.x_range, view.y_range
    overlaps = x0 <= size[0] and x1 >= 0.0 and y0 <= size[1] and y1 >= 0.0
    inside = x0 > 0.0 and x1 < size[0] and y0 > 0.0 and y1 < size[1]
    return overlaps and not inside


# Layers that hold nothing in a picture: who names one of them wants to hear of it.


def missing_layers(scene: Scene, options: Options, names: Iterable[str]) -> list[str]:
    """Those of the `names` of layers that hold nothing in the picture of the scene, wherever its
    window lies."""
    content = content_of(scene, options)
    return [name for name in names if not _holds(name, content)]


def _holds(name: str, content: Content) -> bool:
    if name in NOT_UNDER_PATH and content.trace is not None:
        return False
    return {
        "drawing": bool(content.outlines),
        "swept": bool(content.swept),
        "travel": content.scene.travel_mm is not None,
        "reversals": len(content.reversals) > 0,
        "path": content.trace is not None,
        "worst": len(content.worst) > 0,
        "zero": not content.is_empty,
        "doubts": any(len(places) for _, _, places, _ in content.places.looks()),
        **_moves(content),
    }[name]


def _moves(content: Content) -> dict[str, bool]:
    strokes = content.strokes
    return {
        "rapids": strokes is not None and bool(strokes.rapids),
        "feeds": strokes is not None and bool(strokes.feeds or strokes.ramps),
        "plunges": strokes is not None and len(strokes.plunges) > 0,
        "starts": len(content.starts) > 0,
        "order": strokes is not None and len(strokes.starts) > 0,
        "arrows": bool(content.arrows),
    }
