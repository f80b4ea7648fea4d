"""Arrays of numpy: (N, 2) points, or (N, 3) with the bulge of the segment that leaves each.

An array is read as an .npy file is: closed where its last point is its first."""

from __future__ import annotations

from typing import Any

import numpy as np

from camtool.errors import DrawingError, OptionError
from camtool.importers.assemble import Found, unit_or_mm
from camtool.importers.options import ReadOptions
from camtool.importers.points.reader import piece_of
from camtool.importers.points.tables import Stroke, check_numbers, check_type
from camtool.libraries.read import NO_UNIT


def read(value: Any, name: str, options: ReadOptions) -> Found:
    """Return the polyline of an array of numpy; DrawingError if its rows are no points."""
    if not isinstance(value, np.ndarray):
        raise OptionError(
            f"{name} is a number of numpy ({type(value).__name__})", mend="give an array of points"
        )
    if isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value):
        raise DrawingError("has masked numbers", file=name, mend="fill them or leave them out")
    units = unit_or_mm(options, NO_UNIT)
    check_type(value.shape, value.dtype, name, None)
    points = np.array(value, dtype=np.float64, copy=True, subok=False)
    check_numbers(points, name, "")
    if not len(points):
        return Found([], units)
    piece = piece_of(Stroke(points, f"of {name}"), units.mm_per_unit)
    return Found([piece], units, {"array": 1})
