"""Engraving: the tool centre runs on the line itself.

Open paths stay open and may be cut from either end; closed ones keep the direction in which they
are drawn and may begin anywhere. The material stays on both sides."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from camtool.arrays import Bools, Floats, distinct
from camtool.errors import OptionError
from camtool.findings import Finding
from camtool.geometry.measure import point_at
from camtool.geometry.polylines import POSITION_EPS_MM, Polyline, Polylines, Segments
from camtool.planning.findings import LINES_RUN_TOGETHER
from camtool.planning.items import Chosen, Setting, Work, contours_along
from camtool.planning.naming import at_place, key_of

CHORD_RAD = math.pi / 18.0
"""Arcs become chords of this angle when the distance of lines is measured: 0.4 % of the radius."""

MIN_GAP_SHARE = 0.1
"""Lines nearer to each other than this share of the groove's width touch ..."""

MIN_GAP_SHARE_AT_ENDS = 0.5
"""... and so do lines of which one ends within this share of it from the other: strokes of letters
are drawn so."""


FIRST_LINES, MAX_PAIRS = 128, 5_000
"""Lines that are compared: at least the first number, doubled as long as no more than the second
number of pairs are near each other. Hundreds of lines that cross enclose 100,000 places."""

WIDTH_SLACK = 0.01
"""A tool fits between lines that are nearer to each other than it is wide by this share of its
width."""


def engrave(chosen: Chosen, setting: Setting) -> Work:
    """Return a contour for each path, as it is drawn.

    OptionError for a direction other than "drawn": climb and conventional refer to a wall, and a
    groove has two."""
    operation = setting.operation
    if operation.direction != "drawn":
        raise OptionError(
            f"a tool on the line cannot run {operation.direction}: it cuts on both sides",
            where=key_of(operation, "direction"),
            mend='leave it out, or write "drawn"',
        )
    items = contours_along(chosen.lines, setting, chosen.names, chosen.source.tolist())
    return Work(items, tuple(run_together(chosen, setting)))


def run_together(chosen: Chosen, setting: Setting) -> Iterator[Finding]:
    """Yield one finding for places where lines are nearer to each other than the groove is wide at
    the depth of the tip, so that the material between them is lost. Lines that touch count only
    for what they enclose."""
    width = 2.0 * setting.operation.tool.radius_at(-setting.levels_mm[-1])
    groove = widest_groove(chosen.lines, width)
    if groove is None:
        return
    fits, place, row, count = groove
    yield LINES_RUN_TOGETHER(
        where=at_place(chosen.names[row], (place.x, place.y)),
        measured=width,
        limit=fits,
        more=count - 1,
    )


def leaves_all(lines: Polylines, width: float) -> bool:
    """Return True if a groove of this width, mm, leaves material between all lines."""
    return not len(lines) or not _narrow_places(_chords(lines, width), lines.closed, width)


def widest_groove(lines: Polylines, width: float) -> tuple[float, Any, int, int] | None:
    """Return (its width in mm, the place that limits it, the row of a line there, the number of
    places that are too narrow for a groove of `width` mm) for the widest groove that leaves
    material between all lines; None if a groove of `width` does."""
    if width == 0.0 or not len(lines):
        return None
    chords = _chords(lines, width)
    all_places = narrow_places = _narrow_places(chords, lines.closed, width)
    fits = None
    while narrow_places:  # lines that touch in a wide groove may be apart in a narrower one
        fits = min(narrow_places, key=lambda each: each[0])
        narrow_places = _narrow_places(chords, lines.closed, fits[0])
    return None if fits is None else (*fits, len(all_places))


def _narrow_places(lines: Any, closed: Bools, width: float) -> list[tuple[float, Any, int]]:
    """Return (width in mm, middle, row of one of the lines) for each place where a groove of this
    width removes all material between two lines."""
    import shapely

    near_rows, other = shapely.STRtree(lines).query(lines, predicate="dwithin", distance=width)
    is_first = near_rows < other
    near_rows, other = near_rows[is_first], other[is_first]
    gaps = shapely.distance(lines[near_rows], lines[other])
    spans = shapely.shortest_line(lines[near_rows], lines[other])
    ends = np.stack([shapely.get_point(lines, 0), shapely.get_point(lines, -1)], axis=1)
    ends[closed[: len(lines)]] = None
    at_end = np.zeros(len(near_rows), dtype=np.bool_)
    for rows in (near_rows, other):
        for end in (0, 1):
            end_distances = shapely.distance(ends[rows, end], spans)
            at_end |= np.where(np.isnan(end_distances), False, end_distances < POSITION_EPS_MM)
    at_end &= gaps < MIN_GAP_SHARE_AT_ENDS * width
    side_gaps = [
        shapely.length(
            shapely.intersection(lines[a], shapely.buffer(lines[b], 1.5 * gaps[at_end]))
        )
        for a, b in ((near_rows[at_end], other[at_end]), (other[at_end], near_rows[at_end]))
    ]
    # A line that ends at the other leads away at once; parallel lines stay beside each other.
    at_end[at_end] = np.minimum(*side_gaps) <= 2.0 * gaps[at_end]
    touching = at_end | (gaps < MIN_GAP_SHARE * width)
    group = _connected(len(lines), near_rows[touching], other[touching])
    is_apart = (group[near_rows] != group[other]) & (gaps < width * (1.0 - WIDTH_SLACK))
    places = [
        (float(gap), shapely.centroid(span), int(row))
        for gap, span, row in zip(
            gaps[is_apart], spans[is_apart], near_rows[is_apart].tolist(), strict=True
        )
    ]
    for row in distinct(group).tolist():
        places += [(*each, row) for each in _enclosed(lines[group == row], width)]
    return places


def _enclosed(lines: Any, width: float) -> Iterator[tuple[float, Any]]:
    """Yield (width in mm, middle) of each area that touching lines enclose and a groove of this
    width fills."""
    import shapely

    min_gap = MIN_GAP_SHARE * width
    thin = shapely.buffer(shapely.multilinestrings(list(lines)), 0.5 * min_gap)
    rings = [hole for part in shapely.get_parts(thin) for hole in shapely.get_rings(part)[1:]]
    faces = shapely.polygons(rings) if rings else np.empty(0, dtype=object)
    # A disc of radius r fits into every face whose area is r times the length of its edge.
    slim = shapely.area(faces) < 0.5 * (width - min_gap) * shapely.length(faces)
    for face in faces[slim]:
        spoke = shapely.maximum_inscribed_circle(face, tolerance=0.005 * width)
        wide = 2.0 * float(shapely.length(spoke)) + min_gap
        if 2.0 * min_gap < wide < width * (1.0 - WIDTH_SLACK):
            yield wide, shapely.get_point(spoke, 0)


def _connected(count: int, one: Any, other: Any) -> Any:
    """Return labels (N,) of connected components: the least index of each component of the graph
    with N nodes and the edges (`one`, `other`)."""
    label = np.arange(count)
    while True:
        min_label = label.copy()
        np.minimum.at(min_label, one, label[other])
        np.minimum.at(min_label, other, label[one])
        min_label = min_label[min_label]
        if (min_label == label).all():
            return label
        label = min_label


def _chords(lines: Polylines, width: float) -> Any:
    """Return the paths as shapely lines; only the first of them if all would have too many pairs
    nearer to each other than `width` mm."""
    import shapely

    chords = np.array([*map(_chord_line, lines)], dtype=object)
    count = FIRST_LINES
    while count < len(chords):
        first = chords[: 2 * count]
        near, _ = shapely.STRtree(first).query(first, predicate="dwithin", distance=width)
        if len(near) - len(first) > 2 * MAX_PAIRS:
            break
        count *= 2
    return chords[:count]


def _chord_line(path: Polyline) -> Any:
    """Return a path as a shapely line, arcs as chords."""
    import shapely

    segments = Segments.of(path)
    count = np.maximum(1, np.ceil(np.abs(segments.sweep) / CHORD_RAD)).astype(np.int64)
    count = np.where(segments.is_arc, count, 1)
    row = np.repeat(np.arange(len(segments)), count)
    first = np.repeat(np.cumsum(count) - count, count)
    share: Floats = (np.arange(len(row)) - first + 1.0) / count[row]
    points = point_at(segments, row, share)
    return shapely.linestrings(np.concatenate([path.vertices[:1, :2], points]))
