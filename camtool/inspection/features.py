"""Circles and straight edges of a drawing, and their assignment to dimensions.

A dimension names places (`camtool.inspection.dimensions`). A place belongs to a centre that lies
there, to an edge that it lies on and that is perpendicular to the direction of measurement, or to
the outermost point of a circle in that direction. A place that fits no feature, or several that
differ, is a finding, and the dimension is not inspected."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Literal

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats
from camtool.findings import Finding
from camtool.geometry.boxes import BoxIndex
from camtool.geometry.polylines import Polyline, Polylines, Segments
from camtool.inspection.dimensions import DEPTHS, Dimension, Place
from camtool.inspection.findings import DIMENSION_UNBOUND
from camtool.planning.place import AffineMap
from camtool.records import replace

BIND_MM = 0.01
"""A place belongs to a feature that is at most this far away: programs round the places of
dimensions to a hundredth."""

SAME_CIRCLE_MM = 1e-4
"""Arcs of one path whose centres and radii differ by at most this are one circle."""

SQUARE_RAD = 2e-3
"""Tolerance of right angles and of parallel directions: 0.1°."""

SAME_DIRECTION_RAD = 1e-6

FULL_TURN_RAD = 1e-6
"""Arcs form a closed circle if their sweeps lack at most this of a full turn."""


class CircleFeature(Struct, frozen=True, eq=False):
    """A circle or arcs of one: its centre and radius, mm, and its arcs (A, 2) as start angle and
    sweep, rad."""

    path: int
    centre_mm: Place
    radius_mm: float
    arcs: Floats

    @property
    def is_closed(self) -> bool:
        """True if the arcs close the circle."""
        return bool(np.abs(self.arcs[:, 1]).sum() >= 2.0 * math.pi - FULL_TURN_RAD)

    def has(self, angle: Floats, slack: float = 0.0) -> Bools:
        """Return the mask (K,) of the angles, rad, that lie on one of its arcs, or within
        `slack` beside it."""
        is_on_arc = np.zeros(np.shape(angle), dtype=np.bool_)
        for start, sweep in self.arcs:
            first = start if sweep > 0.0 else start + sweep
            angle_beyond = np.mod(angle - first + slack, 2.0 * math.pi)
            is_on_arc |= angle_beyond <= abs(sweep) + 2.0 * slack
        return is_on_arc

    def distance_mm(self, place: Place) -> float:
        """Return the radial distance of a place from the arcs; infinite at an angle that no arc
        covers."""
        x, y = place[0] - self.centre_mm[0], place[1] - self.centre_mm[1]
        slack = BIND_MM / max(self.radius_mm, BIND_MM)
        on_arc = self.has(np.array([math.atan2(y, x)]), slack)[0]
        return abs(math.hypot(x, y) - self.radius_mm) if on_arc else math.inf

    def in_work_frame(self, placement: AffineMap) -> CircleFeature:
        """Return the circle in the work frame."""
        turn = math.atan2(placement.matrix[1, 0], placement.matrix[0, 0])
        flip = -1.0 if np.linalg.det(placement.matrix) < 0.0 else 1.0
        arcs = np.column_stack([turn + flip * self.arcs[:, 0], flip * self.arcs[:, 1]])
        return CircleFeature(
            self.path, placement.point(self.centre_mm), placement.scale * self.radius_mm, arcs
        )


class EdgeFeature(Struct, frozen=True, eq=False):
    """A straight edge of the drawing from `start_mm` to `end_mm`, of one or more collinear
    segments."""

    path: int
    start_mm: Place
    end_mm: Place

    @property
    def along(self) -> Floats:
        """Unit vector (2,) from start to end."""
        vector = np.subtract(self.end_mm, self.start_mm)
        return np.asarray(vector / np.hypot(*vector))

    @property
    def length_mm(self) -> float:
        """Length of the edge."""
        return math.dist(self.start_mm, self.end_mm)

    def is_square_to(self, direction: Floats) -> bool:
        """Return True if the edge is perpendicular to a unit vector (2,)."""
        return abs(float(self.along @ direction)) <= SQUARE_RAD

    def distance_mm(self, place: Place) -> float:
        """Return the distance of a place from the edge."""
        offset = np.subtract(place, self.start_mm)
        position = float(np.clip(offset @ self.along, 0.0, self.length_mm))
        return float(np.hypot(*(offset - position * self.along)))

    def in_work_frame(self, placement: AffineMap) -> EdgeFeature:
        """Return the edge in the work frame."""
        return EdgeFeature(self.path, placement.point(self.start_mm), placement.point(self.end_mm))


Feature = CircleFeature | EdgeFeature


class OutlineFeature(Struct, frozen=True, eq=False):
    """A whole path whose profile is inspected, with all its circles and edges."""

    path: int
    features: tuple[Feature, ...]

    def in_work_frame(self, placement: AffineMap) -> OutlineFeature:
        """Return the outline in the work frame."""
        return OutlineFeature(
            self.path, tuple(each.in_work_frame(placement) for each in self.features)
        )


class DistanceEnd(Struct, frozen=True, eq=False):
    """One end of a distance: an edge, the centre of a circle, or the outermost point of a circle
    along the direction of measurement (`side` +1) or against it (−1)."""

    feature: Feature
    how: Literal["edge", "centre", "outermost"]
    side: int = 1

    def in_work_frame(self, placement: AffineMap) -> DistanceEnd:
        """Return the end in the work frame."""
        return DistanceEnd(self.feature.in_work_frame(placement), self.how, self.side)


class BoundDimension(Struct, frozen=True, eq=False):
    """A dimension with its features: one circle, edge or outline, or two ends of a distance along
    the unit vector `direction` (2,), which points from the first to the second. `drawn_mm` is its
    size as drawn, 0 for tolerance zones."""

    dimension: Dimension
    of: tuple[CircleFeature | EdgeFeature | OutlineFeature, ...]
    ends: tuple[DistanceEnd, ...]
    direction: Floats
    drawn_mm: float

    @property
    def nominal_mm(self) -> float:
        """Nominal value: that of the dimension, or else the drawn size."""
        stated_mm = self.dimension.nominal_mm
        return self.drawn_mm if stated_mm is None else stated_mm

    @property
    def features(self) -> tuple[Feature, ...]:
        """All circles and edges on which the dimension depends."""
        feature_groups = [
            each.features if isinstance(each, OutlineFeature) else (each,) for each in self.of
        ]
        return (
            *(one for several in feature_groups for one in several),
            *(e.feature for e in self.ends),
        )

    def in_work_frame(self, placement: AffineMap) -> BoundDimension:
        """Return the dimension with its features in the work frame, which does not change
        lengths."""
        direction = placement.matrix @ self.direction / placement.scale
        places = tuple(placement.point(place) for place in self.dimension.places_mm)
        return BoundDimension(
            replace(self.dimension, places_mm=places),
            tuple(each.in_work_frame(placement) for each in self.of),
            tuple(end.in_work_frame(placement) for end in self.ends),
            direction,
            self.drawn_mm,
        )


class Features:
    """Circles and edges of a drawing in order, with an index of their boxes."""

    def __init__(self, each: Iterable[Feature]) -> None:
        self._each = tuple(each)
        self._index = BoxIndex(np.array([_box(one) for one in self._each]).reshape(-1, 4))

    def __iter__(self) -> Iterator[Feature]:
        return iter(self._each)

    def at(self, place: Place) -> list[Feature]:
        """Return the features whose box, widened by BIND_MM, contains a place; the box of a circle
        contains its centre."""
        x, y = place
        box = np.array([[x - BIND_MM, y - BIND_MM, x + BIND_MM, y + BIND_MM]])
        return [self._each[row] for row in self._index.touching(box)[1].tolist()]


def _box(feature: Feature) -> tuple[float, float, float, float]:
    """Return left, low, right and high of a feature, mm; of an arc those of its whole circle."""
    if isinstance(feature, CircleFeature):
        (x, y), radius = feature.centre_mm, feature.radius_mm
        return x - radius, y - radius, x + radius, y + radius
    (x, y), (to_x, to_y) = feature.start_mm, feature.end_mm
    return min(x, to_x), min(y, to_y), max(x, to_x), max(y, to_y)


def features_of(paths: Polylines) -> Features:
    """Return the circles and edges of all paths, in order; collinear segments form one edge, and
    arcs of one path about one centre form one circle."""
    return Features(each for index, path in enumerate(paths) for each in _of_path(index, path))


def _of_path(index: int, path: Polyline) -> Iterator[Feature]:
    segments = Segments.of(path)
    yield from _circles(index, segments)
    yield from _edges(index, segments, closed=path.closed)


def _circles(index: int, segments: Segments) -> Iterator[CircleFeature]:
    arc_rows = np.flatnonzero(segments.is_arc)
    all_arcs = segments[arc_rows]
    todo = np.arange(len(arc_rows))
    while len(todo):
        gap = np.hypot(*(all_arcs.centre[todo] - all_arcs.centre[todo[0]]).T)
        gap = np.maximum(gap, np.abs(all_arcs.radius[todo] - all_arcs.radius[todo[0]]))
        same_circle = todo[gap <= SAME_CIRCLE_MM]
        todo = todo[gap > SAME_CIRCLE_MM]
        x, y = all_arcs.centre[same_circle].mean(axis=0).tolist()
        arcs = np.column_stack([all_arcs.start_angle[same_circle], all_arcs.sweep[same_circle]])
        yield CircleFeature(index, (x, y), float(all_arcs.radius[same_circle].mean()), arcs)


def _edges(index: int, segments: Segments, *, closed: bool) -> Iterator[EdgeFeature]:
    straight = ~segments.is_arc
    vector = segments.end - segments.start
    unit = vector / np.maximum(np.hypot(vector[:, 0], vector[:, 1]), 1e-300)[:, None]
    before = np.roll(unit, 1, axis=0)
    turns = np.abs(before[:, 0] * unit[:, 1] - before[:, 1] * unit[:, 0]) > SAME_DIRECTION_RAD
    goes_on = straight & np.roll(straight, 1) & ~turns & ((before * unit).sum(axis=1) > 0.0)
    if not closed and len(goes_on):
        goes_on[0] = False
    begins = np.flatnonzero(straight & ~goes_on)
    for begin in begins.tolist():
        last = begin
        while goes_on[(last + 1) % len(goes_on)] and (last + 1) % len(goes_on) != begin:
            last = (last + 1) % len(goes_on)
        (x, y), (to_x, to_y) = segments.start[begin].tolist(), segments.end[last].tolist()
        yield EdgeFeature(index, (x, y), (to_x, to_y))


def bind(dimension: Dimension, features: Features, file: str) -> BoundDimension | Finding:
    """Return a dimension with the features that it measures, or the finding that says why none, or
    several, fit.

    Depths and thicknesses have no features in the drawing and are always bound."""
    if dimension.kind == "distance":
        return _distance(dimension, features, file)
    if dimension.kind in DEPTHS:
        return BoundDimension(dimension, (), (), np.zeros(2), dimension.nominal_mm or 0.0)
    features_there = features.at(dimension.places_mm[0])
    if dimension.kind == "straightness":
        candidates: list[Feature] = [
            each
            for each in features_there
            if isinstance(each, EdgeFeature) and _is_near(each, dimension)
        ]
        return _single(dimension, candidates, 0.0, file)
    if dimension.kind == "profile":
        paths = sorted({each.path for each in features_there if _is_near(each, dimension)})
        if len(paths) != 1:
            return _unbound(dimension, len(paths), file)
        outline = OutlineFeature(
            paths[0], tuple(each for each in features if each.path == paths[0])
        )
        return BoundDimension(dimension, (outline,), (), np.zeros(2), 0.0)
    circles = [
        each
        for each in features_there
        if isinstance(each, CircleFeature) and _is_of(each, dimension)
    ]
    if len(circles) > 1 and dimension.nominal_mm is not None:
        radius_wanted = dimension.nominal_mm * (0.5 if dimension.kind == "diameter" else 1.0)
        circles = [
            each for each in circles if abs(each.radius_mm - radius_wanted) <= BIND_MM
        ] or circles
    circles = _closed_circle_first(circles)
    drawn = 0.0
    if circles and dimension.kind in ("diameter", "radius"):
        drawn = circles[0].radius_mm * (2.0 if dimension.kind == "diameter" else 1.0)
    return _single(dimension, circles, drawn, file)


def _closed_circle_first(circles: list[CircleFeature]) -> list[CircleFeature]:
    """Return the closed circle alone if exactly one of these concentric circles is closed, else
    all of them.

    A dimension there is that of the hole, not of a fillet around it."""
    closed = [each for each in circles if each.is_closed]
    return closed if len(closed) == 1 else circles


def _is_near(feature: Feature, dimension: Dimension) -> bool:
    return all(feature.distance_mm(place) <= BIND_MM for place in dimension.places_mm)


def _is_of(circle: CircleFeature, dimension: Dimension) -> bool:
    """Return True if each place is the centre of the circle or lies on it."""
    return all(
        math.dist(place, circle.centre_mm) <= BIND_MM or circle.distance_mm(place) <= BIND_MM
        for place in dimension.places_mm
    )


def _single(
    dimension: Dimension, candidates: Sequence[Feature], drawn_mm: float, file: str
) -> BoundDimension | Finding:
    if len(candidates) != 1:
        return _unbound(dimension, len(candidates), file)
    return BoundDimension(dimension, (candidates[0],), (), np.zeros(2), drawn_mm)


def _distance(dimension: Dimension, features: Features, file: str) -> BoundDimension | Finding:
    first, second = dimension.places_mm
    direction = np.subtract(second, first)
    if dimension.direction_rad is not None:
        angle = dimension.direction_rad
        along = np.array([math.cos(angle), math.sin(angle)])
        direction = along if float(along @ direction) >= 0.0 else -along
    elif not direction.any():
        return _unbound(dimension, 0, file)
    direction = direction / np.hypot(*direction)
    ends = []
    for place in (first, second):
        candidates = _ends_at(place, direction, features.at(place))
        if len(candidates) != 1:
            return _unbound(dimension, len(candidates), file, place)
        ends.append(candidates[0])
    places = [_place_of(end, direction) for end in ends]
    drawn = float((places[1] - places[0]) @ direction)
    return BoundDimension(dimension, (), tuple(ends), direction, drawn)


def _place_of(end: DistanceEnd, direction: Floats) -> Floats:
    """Return the drawn point (2,) mm at which this end of a distance lies.

    The start of an edge, the centre of a circle, or its outermost point along `direction`."""
    if isinstance(end.feature, EdgeFeature):
        return np.asarray(end.feature.start_mm)
    offset = end.side * end.feature.radius_mm if end.how == "outermost" else 0.0
    return np.asarray(end.feature.centre_mm + offset * direction)


def _ends_at(place: Place, direction: Floats, features: Sequence[Feature]) -> list[DistanceEnd]:
    """Return the possible ends at a place near these features for a measurement along `direction`,
    edges before circles that are tangent to them."""
    circles = [each for each in features if isinstance(each, CircleFeature)]
    concentric = [each for each in circles if math.dist(place, each.centre_mm) <= BIND_MM]
    centres = [DistanceEnd(each, "centre") for each in _closed_circle_first(concentric)]
    edges = [
        DistanceEnd(each, "edge")
        for each in features
        if isinstance(each, EdgeFeature)
        and each.distance_mm(place) <= BIND_MM
        and each.is_square_to(direction)
    ]
    if centres or edges:
        return [*centres, *edges]
    outermost = []
    for each in circles:
        spoke = np.subtract(place, each.centre_mm)
        if each.distance_mm(place) > BIND_MM:
            continue
        cosine = float(spoke @ direction) / each.radius_mm
        # A place that is off by BIND_MM changes the angle by up to BIND_MM / radius.
        if abs(cosine) >= math.cos(min(SQUARE_RAD + BIND_MM / each.radius_mm, 0.5)):
            outermost.append(DistanceEnd(each, "outermost", 1 if cosine > 0.0 else -1))
    return outermost


def _unbound(dimension: Dimension, count: int, file: str, place: Place | None = None) -> Finding:
    x, y = dimension.places_mm[0] if place is None else place
    return DIMENSION_UNBOUND(
        where=f"{file}, {dimension.source}, at ({x:.3f}, {y:.3f}) mm",
        measured=count,
        name=dimension.name,
    )
