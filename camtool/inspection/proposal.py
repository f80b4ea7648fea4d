"""The `tolerances.toml` that a drawing begins: its callouts, circles, slots and overall sizes.

A slot is a closed path of two equal half circles and two edges. Every other closed path that is no
circle has an overall size along x and along y, where it ends at an edge or at the outermost point
of an arc: a corner is no feature that could be measured."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain, groupby

import numpy as np

from camtool.arrays import Floats
from camtool.errors import DrawingError, InputError
from camtool.findings import Finding
from camtool.geometry.drawing import Drawing
from camtool.geometry.polylines import POSITION_EPS_MM
from camtool.inspection.dimensions import DEPTHS, Dimension, Place
from camtool.inspection.features import (
    BoundDimension,
    CircleFeature,
    EdgeFeature,
    Feature,
    bind,
    features_of,
)
from camtool.inspection.limits import limited
from camtool.inspection.tolerances import dimensions_of, measured_by
from camtool.plain import one_line
from camtool.tables import toml_string

MAX_DIMENSIONS = 200

DIGITS = 4
"""Decimals of a millimetre in places and sizes."""

_HEADER = """\
# The dimensions of a drawing and their limits (docs/tolerances.md). Lengths take units ("6mm",
# "1/4in"); bare numbers are mm, places are in the frame of the drawing.

# Limits of all sizes that have none of their own: ISO 2768-f, -m, -c or -v.
# general = "ISO 2768-m"
"""


def propose_file(
    drawing: Drawing, floors: Iterable[Dimension] = ()
) -> tuple[str, tuple[Finding, ...], tuple[DrawingError, ...]]:
    """Return the text of a tolerance file with the dimensions of this drawing and the `floors`
    that a job cuts into it.

    Further values are the findings about its callouts, and the errors of callouts whose limits are
    wrong: these are written without limits. A dimension that fits no drawn feature becomes a
    comment. InputError for a drawing without anything to measure."""
    faults: list[DrawingError] = []
    said_dimensions, findings = dimensions_of(drawing, faults=faults)
    features = features_of(drawing.paths)
    seen_measures = set()
    rows: list[Dimension] = []
    not_bound: list[tuple[Dimension, Finding]] = []
    for each in said_dimensions:
        bound = bind(each, features, drawing.file)
        if isinstance(bound, BoundDimension):
            seen_measures.add(measured_by(bound))
            rows.append(each)
        else:
            not_bound.append((each, bound))
    left_out_count = 0
    for each in chain(_sizes(features, drawing.paths.closed.tolist()), floors):
        if len(rows) >= MAX_DIMENSIONS:
            left_out_count += 1
            continue
        bound = bind(each, features, drawing.file)
        if each.kind in DEPTHS:
            rows.append(each)
        elif isinstance(bound, BoundDimension) and measured_by(bound) not in seen_measures:
            seen_measures.add(measured_by(bound))
            rows.append(limited(each, bound.drawn_mm)[0])
    if not rows and not not_bound:
        raise InputError(
            "has no circles and slots to measure, nor outlines that end in edges along X or Y",
            file=drawing.file,
            mend="write tolerances.toml by hand (docs/tolerances.md)",
        )
    text = _HEADER + "".join(map(_row, rows))
    for each, finding in not_bound:
        remark = f"{each.source}: {finding.message}; give it places on edges or circles"
        text += f"\n# {one_line(remark)}"
        text += _row(each).replace("\n# limits", "\nlimits").rstrip().replace("\n", "\n# ") + "\n"
    for fault in faults:
        text += f"\n# {one_line(f'{fault.where}: {fault.message}')}\n"
    if left_out_count:
        text += (
            f"\n# {left_out_count} more circles, slots and sizes of the drawing are not listed.\n"
        )
    return text, (*findings, *(finding for _, finding in not_bound)), tuple(faults)


def _row(each: Dimension) -> str:
    """Return a [[dimension]] of the file as text."""
    lines = ["", "[[dimension]]", f"name = {toml_string(each.name)}", f'kind = "{each.kind}"']
    if each.kind == "distance":
        first, second = each.places_mm
        lines += [f"from = {_pair(first)}", f"to = {_pair(second)}"]
        if each.direction_rad is not None:
            lines.append(f"direction = {_direction_text(each.direction_rad)}")
    else:
        lines.append(f"at = {_pair(each.places_mm[0])}")
    if each.nominal_mm is not None:
        lines.append(f'nominal = "{_number(each.nominal_mm)}mm"')
    if each.limits is None:
        lines.append(f'# limits = "{"H7" if each.kind == "diameter" else "±0.05"}"')
    else:
        lines.append(f"limits = {toml_string(each.limits.said)}")
    return "\n".join(lines) + "\n"


def _number(value: float) -> str:
    return f"{round(value, DIGITS) + 0.0:.{DIGITS}f}".rstrip("0").rstrip(".")


def _pair(place: Place) -> str:
    return f"[{_number(place[0])}, {_number(place[1])}]"


def _direction_text(direction: float) -> str:
    """Return a direction as text: x, y or degrees."""
    degrees = math.degrees(direction) % 180.0
    for name, angle in (("x", 0.0), ("y", 90.0), ("x", 180.0)):
        if abs(degrees - angle) <= 10.0**-DIGITS:
            return f'"{name}"'
    return f"{degrees:.9g}"


def _sizes(features: Iterable[Feature], closed: Sequence[bool]) -> Iterator[Dimension]:
    """Yield the sizes of all paths, path by path: circles, slots, outlines."""
    paths = [list(group) for _, group in groupby(features, lambda each: each.path)]
    circles = [
        group[0] for group in paths if len(group) == 1 and isinstance(group[0], CircleFeature)
    ]
    closed_circles = [each for each in circles if each.is_closed]
    shapes = [group for group in paths if closed[group[0].path] and group[0] not in closed_circles]
    for number, circle in enumerate(closed_circles, 1):
        name, size = f"circle {number}", 2.0 * circle.radius_mm
        yield Dimension(name, "diameter", (circle.centre_mm,), "", nominal_mm=size)
    slots = [(group, slot) for group in shapes if (slot := _slot(group)) is not None]
    for number, (_, slot) in enumerate(slots, 1):
        for word, (first, second, direction) in zip(("width", "length"), slot, strict=True):
            yield Dimension(
                f"slot {number} {word}", "distance", (first, second), "", direction_rad=direction
            )
    is_slot = {id(group) for group, _ in slots}
    outlines = [group for group in shapes if id(group) not in is_slot]
    yield from chain.from_iterable(
        _overall(f"outline {number}", group) for number, group in enumerate(outlines, 1)
    )


def _slot(features: Sequence[Feature]) -> tuple[tuple[Place, Place, float], ...] | None:
    """Return start, end and direction of the width and of the length of a slot; None for a path
    that is none."""
    ends = [each for each in features if isinstance(each, CircleFeature)]
    edges = [each for each in features if isinstance(each, EdgeFeature)]
    if len(ends) != 2 or len(edges) != 2:
        return None
    half = all(abs(abs(float(each.arcs[:, 1].sum())) - math.pi) <= 1e-3 for each in ends)
    if not half or abs(ends[0].radius_mm - ends[1].radius_mm) > 10.0**-DIGITS:
        return None
    (x, y), (to_x, to_y) = ends[0].centre_mm, ends[1].centre_mm
    axis = math.atan2(to_y - y, to_x - x)
    along = np.array([math.cos(axis), math.sin(axis)])
    first = _point(np.subtract(ends[0].centre_mm, ends[0].radius_mm * along))
    last = _point(np.add(ends[1].centre_mm, ends[1].radius_mm * along))
    across = (axis + 0.5 * math.pi) % math.pi
    width = _middle(edges[0]), _middle(edges[1]), across
    return width, (first, last, axis % math.pi)


def _overall(name: str, features: Sequence[Feature]) -> Iterator[Dimension]:
    """Yield the overall sizes of a path along x and y."""
    for axis, letter in enumerate("xy"):
        direction = np.eye(2)[axis]
        ends = [_outermost(features, direction, side) for side in (-1.0, 1.0)]
        if ends[0] is not None and ends[1] is not None:
            yield Dimension(
                f"{name} {letter}",
                "distance",
                (ends[0], ends[1]),
                "",
                direction_rad=axis * 0.5 * math.pi,
            )


def _outermost(features: Sequence[Feature], direction: Floats, side: float) -> Place | None:
    """Return the place of the outermost edge or arc in a direction; None if a corner is farther
    out."""
    farthest, place = -math.inf, None
    for each in features:
        if isinstance(each, EdgeFeature):
            position = max(side * float(direction @ end) for end in (each.start_mm, each.end_mm))
            candidate = _middle(each) if each.is_square_to(direction) else None
        else:
            angle = math.atan2(*(side * direction)[::-1])
            candidate = _point(each.centre_mm + side * each.radius_mm * direction)
            position = side * float(direction @ np.array(candidate))
            if not each.has(np.array([angle]))[0]:
                ends = np.cumsum(each.arcs, axis=1).ravel()
                tips = np.column_stack([np.cos(ends), np.sin(ends)]) * each.radius_mm
                position = float((side * (each.centre_mm + tips) @ direction).max())
                candidate = None
        if position > farthest + POSITION_EPS_MM or (
            position > farthest - POSITION_EPS_MM and place is None
        ):
            farthest, place = max(position, farthest), candidate
    return place


def _middle(edge: EdgeFeature) -> Place:
    return _point(np.add(edge.start_mm, edge.end_mm) / 2.0)


def _point(point: Floats) -> Place:
    return float(point[0]), float(point[1])
