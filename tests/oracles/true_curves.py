"""What a drawing draws, by libraries that are not ours, and how far slides are from it.

DXF: ezdxf explodes inserts and polylines and constructs splines, ellipses and arcs; SVG:
svgpathtools. Both are sampled so densely that the chords between samples stray by less than a
nanometre of the part (`DENSITY`); camtool's readers, arcs and plans have no part in it. The
distance of a slide is that to the nearest chord.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from camtool.arrays import Floats
from camtool.machine.model import Machine
from camtool.toolpath.moves import Toolpath
from tests.targets import simulate

POINTS = 4000
"""A curve is sampled at so many places: chords of a half circle stray by a ten millionth of it."""

UNITS_MM = {0: 1.0, 1: 25.4, 4: 1.0, 5: 10.0, 6: 1000.0}
"""What $INSUNITS says."""


def drawn(file: Path) -> list[Floats]:
    """Dense points (n, 2) of everything that is drawn in a DXF or SVG, mm, Y up."""
    return list(_svg(file) if file.suffix == ".svg" else _dxf(file))


def _dxf(file: Path) -> Iterator[Floats]:
    import ezdxf
    from ezdxf.disassemble import recursive_decompose

    document = ezdxf.readfile(file)
    scale = UNITS_MM[int(document.header.get("$INSUNITS", 0))]
    for entity in recursive_decompose(document.modelspace()):
        parts = [entity]
        if entity.dxftype() in ("LWPOLYLINE", "POLYLINE"):
            parts = list(entity.virtual_entities())
        for part in parts:
            points = _points(part)
            if points is not None:
                yield scale * points


def _points(entity: Any) -> Floats | None:
    """Points of a line or a curve; None for what is neither."""
    kind, share = entity.dxftype(), np.linspace(0.0, 1.0, POINTS)
    if kind == "LINE":
        return np.array([tuple(entity.dxf.start)[:2], tuple(entity.dxf.end)[:2]])
    if kind in ("CIRCLE", "ARC"):
        low, high = 0.0, 2.0 * math.pi
        if kind == "ARC":
            low, high = math.radians(entity.dxf.start_angle), math.radians(entity.dxf.end_angle)
            high += 2.0 * math.pi if high <= low else 0.0
        x, y, _ = entity.ocs().to_wcs(entity.dxf.center)
        flip = -1.0 if entity.dxf.extrusion.z < 0.0 else 1.0
        angle = low + share * (high - low)
        radius = entity.dxf.radius
        return np.column_stack([x + flip * radius * np.cos(angle), y + radius * np.sin(angle)])
    if kind == "ELLIPSE":
        tool = entity.construction_tool()
        low, high = tool.start_param, tool.end_param
        high += 2.0 * math.pi if high <= low else 0.0
        return np.array([tuple(p)[:2] for p in tool.vertices(low + share * (high - low))])
    if kind == "SPLINE":
        tool = entity.construction_tool()
        knots = np.unique(np.array(tool.knots()))
        inner = knots[(knots >= tool.knots()[tool.order - 1]) & (knots <= tool.max_t)]
        each = max(POINTS // max(len(inner) - 1, 1), 200)
        steps = [np.linspace(a, b, each) for a, b in pairwise(inner)]
        return np.array([tuple(p)[:2] for p in tool.points(np.concatenate(steps))])
    return None


def _svg(file: Path) -> Iterator[Floats]:
    """Paths without transforms of a page in mm; y counts down from its height."""
    import svgpathtools

    paths, _, page = svgpathtools.svg2paths2(str(file))
    x0, y0, width, height = map(float, page["viewBox"].split())
    size = float(page["width"].removesuffix("mm"))
    scale = size / width
    for path in paths:
        for part in path:
            count = 2 if isinstance(part, svgpathtools.Line) else POINTS
            at = np.array([part.point(t) for t in np.linspace(0.0, 1.0, count)])
            yield scale * np.column_stack([at.real - x0, y0 + height - at.imag])


def slides_cutting(decoded: Toolpath, machine: Machine) -> Floats:
    """(S, 2) mm where the slides are at every sample of a move at a feed in the stock, rapids,
    plunges and retracts left out; work frame."""
    starts = decoded.starts
    deep = (decoded.end[:, 2] < 0.0) & (starts[:, 2] < 0.0)
    moves = (decoded.end[:, :2] != starts[:, :2]).any(axis=1) | decoded.is_arc
    cuts = deep & moves & decoded.is_feed
    parts = [
        chunk.slide[cuts[chunk.row], :2].copy()
        for chunk in simulate(decoded, machine)
        if len(chunk.row)
    ]
    return np.concatenate(parts)


def distances(points: Floats, curves: list[Floats]) -> Floats:
    """(S,) mm from each point to the nearest chord of the curves."""
    chords = np.concatenate([np.stack([c[:-1], c[1:]], axis=1) for c in curves])
    chords = chords[(chords[:, 0] != chords[:, 1]).any(axis=1)]
    tree = shapely.STRtree(shapely.linestrings(chords))
    of = tree.nearest(shapely.points(points))
    begin, way = chords[of, 0], chords[of, 1] - chords[of, 0]
    share = ((points - begin) * way).sum(axis=1) / (way**2).sum(axis=1)
    off = points - begin - np.clip(share, 0.0, 1.0)[:, None] * way
    return np.asarray(np.hypot(off[:, 0], off[:, 1]))
