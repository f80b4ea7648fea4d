"""The legend: what is present in a picture and within its view."""

from __future__ import annotations

from camtool.preview import legend, marks, numbers
from camtool.preview.colours import DRAWING, FEED_PALE, OUTLINE, SWEPT, TRAVEL
from camtool.preview.content import Content
from camtool.preview.legend import Entry
from camtool.preview.trace import Trace
from camtool.preview.view import View

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
        ("largest errors, by rank", content.worst, numbers.worst_look()),
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
