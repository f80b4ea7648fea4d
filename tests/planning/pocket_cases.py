"""Shapes and settings that the tests of pockets share."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations
from typing import Any

import numpy as np
from hypothesis import strategies as st

from camtool.geometry.distance import approach
from camtool.geometry.nesting import Nesting, oriented
from camtool.geometry.polylines import Polyline, Polylines, rotate
from camtool.operations.pocket.work import pocket
from camtool.planning.items import Chosen, CutRun, Feeds, Setting, Work
from camtool.planning.job import Operation, Tool
from camtool.planning.settings import levels
from tests.oracles.contours import (
    CIRCLE,
    DUMBBELL,
    ELL,
    FILLETED,
    KEYHOLE,
    LENS,
    NOTCH,
    OBLONG,
    SLOT,
    SQUARE,
    closed,
    comb,
    gear,
    star,
)
from tests.paths import moved, scaled
from tests.strategies import contours

STARS = [moved(scaled(star(5, 4.0, 10.0), 0.25), x, y) for x in (5.0, 14.0) for y in (5.0, 14.0)]
LETTER_B = [
    closed((0, 0), (6, 0, 1), (6, 7, 0), (5, 7, 0), (5, 7.5, 1), (5, 14, 0), (0, 14)),
    closed((2, 2), (2, 5.5), (5, 5.5, -1), (5, 2)),
    closed((2, 9), (2, 12), (4, 12, -1), (4, 9)),
]
SHAPES: dict[str, list[Polyline]] = {
    "square": [SQUARE],
    "circle": [CIRCLE],
    "annulus": [CIRCLE, scaled(CIRCLE, 0.7)],
    "core in an annulus": [CIRCLE, scaled(CIRCLE, 0.7), scaled(CIRCLE, 0.4)],
    "dumbbell": [DUMBBELL],
    "island off the middle": [SLOT, moved(scaled(CIRCLE, 0.3), 6.0, 5.0)],
    "island almost at the wall": [OBLONG, moved(scaled(SQUARE, 0.4), 5.0, 1.05)],
    "star": [star(5, 4.0, 12.0)],
    "blunt star": [star(9, 8.0, 12.0)],
    "comb": [comb(3)],
    "ell": [ELL],
    "filleted": [FILLETED],
    "gear with a bore": [gear(9, 6.0, 10.0), scaled(CIRCLE, 0.2)],
    "keyhole": [KEYHOLE],
    "notch": [NOTCH],
    "lens": [LENS],
    "four stars": [scaled(SQUARE, 2.0), *STARS],
    "letter": LETTER_B,
}


def chosen_of(paths: Sequence[Polyline]) -> Chosen:
    """The paths as an operation takes them."""
    count = len(paths)
    names = tuple(f"0/PATH {index}" for index in range(count))
    nesting, rim = Nesting(Polylines.of(paths)), np.zeros(count, bool)
    return Chosen(nesting, np.arange(count), names, np.empty((0, 2)), (), rim)


def setting_of(diameter_mm: float, **settings: Any) -> Setting:
    """A pocket's setting: 1 mm deep in one pass, unless something else is said."""
    settings = {"kind": "pocket", "depth_mm": 1.0, **settings}
    operation = Operation(tool=Tool(diameter_mm=diameter_mm), **settings)
    assert operation.depth_mm is not None
    passes = levels(operation.depth_mm, operation.step_down_mm, operation.last_pass_mm)
    return Setting(operation, Feeds(600.0, 100.0), passes, 5.0)


def work_of(paths: Sequence[Polyline], diameter_mm: float, **settings: Any) -> Work:
    """Plan a pocket of the paths."""
    return pocket(chosen_of(paths), setting_of(diameter_mm, **settings))


def runs_of(work: Work) -> list[CutRun]:
    """All runs of all items."""
    return [run for item in work.items for run in item.runs]


def region_of(paths: Sequence[Polyline]) -> Polylines:
    """Return the region that the paths enclose, outer ones CCW and islands CW."""
    return oriented(Nesting(Polylines.of(paths)))


@st.composite
def shapes(draw: st.DrawFn) -> list[Polyline]:
    """A contour of lines and arcs with up to three islands: the contour holds the disc of half a
    millimetre in which they lie, and they keep apart from each other."""
    outer = scaled(draw(contours()), 2.0)
    islands = []
    for place in range(draw(st.integers(0, 3))):
        small = scaled(draw(contours(max_points=6)), draw(st.floats(0.01, 0.04)))
        angle = 2.0 * math.pi * place / 3.0
        islands.append(moved(small, 0.6 * math.cos(angle), 0.6 * math.sin(angle)))
    turn = draw(st.floats(0.0, 6.0))
    return [rotate(path, turn) for path in (outer, *islands)]


def cross(paths: Sequence[Polyline]) -> bool:
    """True if any of the paths meets another one: such pockets are refused."""
    return any(approach(one, other).distance == 0.0 for one, other in combinations(paths, 2))
