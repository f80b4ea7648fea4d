"""Regions: closed paths by which of them holds which, outer ones CCW and their holes CW."""

from __future__ import annotations

import numpy as np

from camtool.errors import GeometryError
from camtool.geometry.measure import signed_areas
from camtool.geometry.nest import Nesting, nesting
from camtool.geometry.polylines import Polylines
from camtool.geometry.transform import reverse


def oriented(lines: Polylines) -> Polylines:
    """The closed paths, in their order, so turned that what an odd number of them hold is left.

    Paths held by none, by two, and so on run CCW, the others CW. Open paths: GeometryError.
    """
    return _oriented(lines, _nesting(lines))


def regions(lines: Polylines) -> list[Polylines]:
    """Each outer path (CCW) with the holes (CW) that are directly in it; in the order of paths.

    An island in a hole is the outer path of a region of its own. Open paths: GeometryError.
    """
    nest = _nesting(lines)
    turned = _oriented(lines, nest)
    outer = np.flatnonzero(nest.depth % 2 == 0)
    return [
        turned.select([row, *np.flatnonzero((nest.parent == row) & (nest.depth % 2 == 1))])
        for row in outer.tolist()
    ]


def _nesting(lines: Polylines) -> Nesting:
    if not lines.closed.all():
        where = f"path {np.argmin(lines.closed)}"
        raise GeometryError("an open path has no inside", where=where, mend="close it")
    return nesting(lines)


def _oriented(lines: Polylines, nest: Nesting) -> Polylines:
    ccw = signed_areas(lines) > 0.0
    wanted = nest.depth % 2 == 0
    paths = zip(lines, (ccw == wanted).tolist(), strict=True)
    return Polylines.of([p if right else reverse(p) for p, right in paths])
