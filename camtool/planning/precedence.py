"""What must be cut before what: a part comes loose after everything within it has been cut."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from camtool.geometry.nesting import nesting
from camtool.geometry.polylines import POSITION_EPS_MM, Floats, Ints, Polyline, Polylines
from camtool.planning.items import Contour, Item, Run

SPECK_MM = 1e-4
"""A run that stays at one place (a drilled hole) lies in what holds a line of this length there:
long enough to be a line, far shorter than any tool is wide."""


def must_precede(items: Sequence[Item]) -> Ints:
    """Pairs (P, 2) of items, the first to be cut before the second, ascending.

    An item goes before the smallest closed Contour that holds it, or any of its runs; nothing
    else does. Contours that cross hold each other not.
    """
    # The runs that a contour was divided into share its outline: they hold and lie as it does.
    owners: dict[int, list[int]] = {}
    paths: dict[int, Polyline] = {}
    for index, item in enumerate(items):
        for path in _shapes(item):
            owners.setdefault(id(path), []).append(index)
            paths[id(path)] = path
    if not paths:
        return np.empty((0, 2), dtype=np.int64)
    parent = nesting(Polylines.of(paths.values())).parent.tolist()
    of_shape = list(owners.values())
    pairs = [
        (one, other)
        for held, holder in enumerate(parent)
        if holder >= 0
        for one in of_shape[held]
        for other in of_shape[holder]
        if one != other
    ]
    return np.unique(np.array(pairs, dtype=np.int64).reshape(-1, 2), axis=0)


def _shapes(item: Item) -> Iterator[Polyline]:
    """Paths that say where an item lies; of them only a Contour's is closed and holds any."""
    if isinstance(item, Contour):
        yield item.path if item.outline is None else item.outline
    elif item.outline is not None:
        yield Polyline(item.outline.vertices, closed=False)
    else:
        yield from map(_trace, item.runs)


def _trace(run: Run) -> Polyline:
    """The run seen from above, without the moves that lead nowhere there."""
    flat = run.vertices[:, [0, 1, 3]]
    kept: list[Floats] = [flat[0]]
    for vertex in flat[1:]:
        if np.hypot(*(vertex[:2] - kept[-1][:2])) > POSITION_EPS_MM:
            kept.append(vertex)
        else:
            kept[-1] = vertex  # it knows the bulge of the move that leads away
    if len(kept) == 1:
        x, y, _ = flat[0]
        return Polyline(np.array([[x - SPECK_MM / 2, y, 0.0], [x + SPECK_MM / 2, y, 0.0]]))
    return Polyline(np.array(kept))
