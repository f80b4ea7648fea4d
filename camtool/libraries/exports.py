"""Drawings, toolpaths and predicted paths as objects of shapely, ezdxf and svgpathtools; mm.

Objects of a drawing come as {layer: object}, which `read` takes back. What a library does not know
is left out: svgpathtools has no points, shapely no arcs, ezdxf gets no line types but by name."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from camtool.arrays import Bools, Floats
from camtool.errors import OptionError
from camtool.geometry.drawing import Drawing
from camtool.geometry.measure import chords_of
from camtool.geometry.nesting import Nesting, regions
from camtool.geometry.polylines import POSITION_EPS_MM, Polyline, Polylines, Segments
from camtool.toolpath.moves import Kind, PolarArcs, Toolpath

CHORD_MM = 0.001

MIN_CHORDS = 2
"""An arc becomes this many chords or more, so that two arcs still enclose an area."""

ROUND_SHARE = 1e-9
"""A closed path is one circle if its centres and radii differ by at most this share."""

_NO_LAYER = re.compile(r'[<>/\\":;?*|=`,\x00-\x1f]')
"""Characters that must not occur in the name of a layer of a DXF."""


def layers_in(drawing: Drawing) -> list[str]:
    """Return the layers of the paths and marks, in order of first appearance."""
    return list(dict.fromkeys((*drawing.layers, *(mark.layer for mark in drawing.marks))))


def shapely_of(drawing: Drawing, tolerance_mm: float = CHORD_MM) -> dict[str, Any]:
    """Return a geometry of shapely for each layer: closed paths as polygons with their holes, open
    ones as lines, marks as points; arcs as chords within the tolerance. OptionError for a
    tolerance that is not above 0."""
    import shapely

    check_tolerance(tolerance_mm)
    layers = np.array(drawing.layers, dtype=object)
    geometries: dict[str, Any] = {}
    for layer in layers_in(drawing):
        rows = np.flatnonzero(layers == layer)
        paths = drawing.paths.select(rows)
        parts = polygons_of(paths, tolerance_mm)
        parts += [
            shapely.LineString(chord_points(path, tolerance_mm))
            for path in paths
            if not path.closed
        ]
        parts += [shapely.Point(mark.at_mm) for mark in drawing.marks if mark.layer == layer]
        geometries[layer] = gathered(parts)
    return geometries


def check_tolerance(tolerance_mm: float) -> None:
    """Raise OptionError for a tolerance of chords that is not above the smallest distance."""
    if not tolerance_mm >= POSITION_EPS_MM:
        raise OptionError(
            f"tolerance_mm is {tolerance_mm}, it must be {POSITION_EPS_MM:g} or more"
        )


def polygons_of(paths: Polylines, tolerance_mm: float) -> list[Any]:
    """Return the closed paths as polygons of shapely, each outer path with its holes."""
    import shapely

    closed = paths.select(np.flatnonzero(paths.closed))
    rings = [
        [chord_points(ring, tolerance_mm) for ring in region]
        for _, region in regions(Nesting(closed))
    ]
    return [shapely.Polygon(outer, holes) for outer, *holes in rings]


def gathered(parts: list[Any]) -> Any:
    """Return the geometries as one: a MultiPolygon, MultiLineString or MultiPoint if all are of
    one kind, else a GeometryCollection."""
    import shapely

    kinds = {part.geom_type for part in parts}
    kind = kinds.pop() if len(kinds) == 1 else ""
    makers = {
        "Polygon": shapely.MultiPolygon,
        "LineString": shapely.MultiLineString,
        "Point": shapely.MultiPoint,
    }
    return makers.get(kind, shapely.GeometryCollection)(parts)


def chord_points(path: Polyline, tolerance_mm: float) -> Floats:
    """Return the points (n, 2) of the path with arcs replaced by chords; a closed path repeats its
    start at its end."""
    points = chords_of(Segments.of(path), tolerance_mm, min_count=MIN_CHORDS).once
    return np.concatenate([points, path.end[None, :]])


def svgpathtools_of(drawing: Drawing) -> dict[str, list[Any]]:
    """Return the paths of each layer as Paths of svgpathtools, Y down: lines and circular arcs.

    Arcs that leave their chord by less than POSITION_EPS_MM are lines, since svgpathtools loses
    the place of the centre when it is far away."""
    from svgpathtools import Arc, Line, Path

    paths: dict[str, list[Any]] = {layer: [] for layer in layers_in(drawing)}
    for path, layer in zip(drawing.paths, drawing.layers, strict=True):
        segments = Segments.of(path)
        starts, ends = (
            (points[:, 0] - 1j * points[:, 1]).tolist()
            for points in (segments.start, segments.end)
        )
        bulges = np.where(rises_of(segments) < POSITION_EPS_MM, 0.0, segments.bulge).tolist()
        rows = zip(starts, ends, bulges, segments.radius.tolist(), strict=True)
        # Y points down there, so that an arc that turns counter-clockwise has the sweep flag 0.
        paths[layer].append(
            Path(
                *(
                    Arc(start, complex(radius, radius), 0.0, False, bulge < 0.0, end)
                    if bulge
                    else Line(start, end)
                    for start, end, bulge, radius in rows
                )
            )
        )
    return {layer: items for layer, items in paths.items() if items}


def rises_of(segments: Segments) -> Floats:
    """Return the height of the middle of each segment above its chord, (K,) mm: 0 for lines."""
    chord = segments.end - segments.start
    return np.asarray(0.5 * np.abs(segments.bulge) * np.hypot(chord[:, 0], chord[:, 1]))


def ezdxf_of(drawing: Drawing) -> Any:
    """Return a document of ezdxf in mm: CIRCLE, LWPOLYLINE with bulges and POINT, on the layers of
    the drawing, in its colours. Signs that no name of a layer may hold become `_`."""
    from ezdxf import units
    from ezdxf.colors import rgb2int
    from ezdxf.filemanagement import new

    document = new(units=units.MM)
    space = document.modelspace()

    def look(layer: str, colour: str, line_type: str) -> dict[str, Any]:
        attributes: dict[str, Any] = {"layer": _NO_LAYER.sub("_", layer) or "0"}
        if attributes["layer"] not in document.layers:
            document.layers.add(attributes["layer"])
        if colour:
            red, green, blue = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
            attributes["true_color"] = rgb2int((red, green, blue))
        name = _NO_LAYER.sub("_", line_type)
        if name:
            if name not in document.linetypes:
                document.linetypes.add(name, [0.0])
            attributes["linetype"] = name
        return attributes

    looks = zip(drawing.layers, drawing.colours, drawing.line_types, strict=True)
    for path, of_path in zip(drawing.paths, looks, strict=True):
        circle = circle_of(path)
        if circle is None:
            space.add_lwpolyline(
                path.vertices, format="xyb", close=path.closed, dxfattribs=look(*of_path)
            )
        else:
            space.add_circle(circle[:2], circle[2], dxfattribs=look(*of_path))
    for mark in drawing.marks:
        space.add_point(mark.at_mm, dxfattribs=look(mark.layer, mark.colour, mark.line_type))
    return document


def circle_of(path: Polyline) -> tuple[float, float, float] | None:
    """Return centre and radius (x, y, r) mm of a path that is a full circle, counter-clockwise and
    begun at its right as that of a CIRCLE; None for every other one."""
    segments = Segments.of(path)
    if not path.closed or not (segments.bulge > 0.0).all():
        return None
    radius = float(segments.radius.mean())
    centre = segments.centre.mean(axis=0)
    near = ROUND_SHARE * radius
    is_round = np.ptp(segments.radius) <= near and np.ptp(segments.centre, axis=0).max() <= near
    begins = np.abs(path.start - centre - (radius, 0.0)).max() <= near
    if not (is_round and begins and abs(segments.sweep.sum() - 2.0 * np.pi) <= ROUND_SHARE):
        return None
    return float(centre[0]), float(centre[1]), radius


# Moves.


def shapely_of_moves(toolpath: Toolpath, tolerance_mm: float = CHORD_MM) -> dict[str, Any]:
    """Return the moves as 3-D lines of shapely: "cuts" at a feed and "rapids".

    Each unbroken sequence of moves is one line, with arcs as chords within the tolerance."""
    check_tolerance(tolerance_mm)
    return {
        "cuts": _lines_of(toolpath, toolpath.is_feed, tolerance_mm),
        "rapids": _lines_of(toolpath, toolpath.kind == Kind.RAPID, tolerance_mm),
    }


def _lines_of(toolpath: Toolpath, is_chosen: Bools, tolerance_mm: float) -> Any:
    """Return the chosen moves as a MultiLineString, one line for each unbroken sequence; moves
    without a length are left out."""
    import shapely

    is_chosen = is_chosen & ((toolpath.end != toolpath.starts).any(axis=1) | toolpath.is_arc)
    rows = np.flatnonzero(is_chosen)
    points, row = move_points(toolpath, rows, tolerance_mm)
    # Events and moves without a length do not break a line; other moves do.
    order = np.cumsum(toolpath.is_motion & ~is_chosen & (toolpath.end != toolpath.starts).any(1))
    stretches = np.split(points, np.flatnonzero(np.diff(order[row])) + 1)
    return shapely.MultiLineString([_without_repeats(line) for line in stretches if len(line)])


def _without_repeats(points: Floats) -> Floats:
    """Return points (n, 3) without those that equal the one before in X, Y and Z: shapely compares
    X and Y alone and would drop vertical moves."""
    keep = np.append(True, (points[1:] != points[:-1]).any(axis=1))
    return np.asarray(points[keep])


def move_points(toolpath: Toolpath, rows: Any, tolerance_mm: float) -> tuple[Floats, Any]:
    """Return points (P, 3) along these moves, with arcs as chords, and for each point the index
    (P,) of its move."""
    arcs = PolarArcs(toolpath, np.isin(np.arange(len(toolpath)), rows) & toolpath.is_arc)
    radius = np.maximum(arcs.radius, arcs.end_radius)
    within = 1.0 - tolerance_mm / np.maximum(radius, tolerance_mm)
    widest = 2.0 * np.arccos(np.clip(within, -1.0, 1.0))
    parts = np.maximum(np.ceil(np.abs(arcs.sweep) / widest), MIN_CHORDS).astype(np.int64)
    counts = np.full(len(toolpath), 2)
    counts[arcs.row] = parts + 1
    row = np.repeat(rows, counts[rows])
    first = np.cumsum(counts[rows]) - counts[rows]
    step = np.arange(len(row)) - np.repeat(first, counts[rows])
    points = np.where((step == 0)[:, None], toolpath.starts[row], toolpath.end[row])
    inner = np.flatnonzero(toolpath.is_arc[row] & (step > 0) & (step < counts[row] - 1))
    share = step[inner] / (counts[row[inner]] - 1)
    points[inner] = arcs.points(np.searchsorted(arcs.row, row[inner]), share)
    return points, row


def shapely_of_trace(points: Floats, is_cutting: Bools) -> Any:
    """Return positions (T, 2) mm, in order, as a MultiLineString of the stretches that cut."""
    import shapely

    cuts = np.flatnonzero(is_cutting)
    stretches = np.split(cuts, np.flatnonzero(np.diff(cuts) > 1) + 1)
    return shapely.MultiLineString([points[rows] for rows in stretches if len(rows) > 1])
