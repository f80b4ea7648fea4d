"""Geometries of shapely: rings of polygons are closed, points are marks, heights are left out."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from camtool.arrays import Floats
from camtool.errors import OptionError
from camtool.geometry.drawing import Mark, Skipped
from camtool.importers.assemble import Found, unit_or_mm
from camtool.importers.options import ReadOptions
from camtool.importers.pieces import Piece
from camtool.libraries.read import NO_UNIT


def read(value: Any, name: str, options: ReadOptions) -> Found:
    """Return the rings, lines and points of a shapely geometry as pieces and marks; OptionError
    for other objects."""
    import shapely

    if not isinstance(value, shapely.Geometry):
        raise OptionError(
            f"{name} is of type {type(value).__name__} of shapely", mend="give geometries"
        )
    units = unit_or_mm(options, NO_UNIT)
    pieces: list[Piece] = []
    marks: list[Mark] = []
    empty = 0
    for part in _parts(value):
        source = f"{part.geom_type} {len(pieces) + len(marks) + 1} of {name}"
        if part.is_empty:
            empty += 1
        elif part.geom_type == "Point":
            x, y = (shapely.get_coordinates(part)[0] * units.mm_per_unit).tolist()
            marks.append(Mark((x, y), "0", "", source))
        else:
            for line in shapely.get_rings(part) if part.geom_type == "Polygon" else [part]:
                points = shapely.get_coordinates(line) * units.mm_per_unit
                pieces.append(Piece(_straight(points), bool(line.is_closed), "0", "", source))
    skipped = [Skipped("geometry", empty, "is empty")] if empty and (pieces or marks) else []
    used = {"geometry": len(pieces) + len(marks)} if pieces or marks else {}
    return Found(pieces, units, used, skipped, marks=marks)


def _parts(geometry: Any) -> Iterator[Any]:
    """Yield the single geometries of a collection, also of those within it."""
    import shapely

    if not hasattr(geometry, "geoms"):
        yield geometry
        return
    for part in shapely.get_parts(geometry):
        yield from _parts(part)


def _straight(points: Floats) -> Floats:
    """Return points (n, 2) as vertices (n, 3) of a polyline of lines: x, y and bulge 0."""
    return np.column_stack([points, np.zeros(len(points))])
