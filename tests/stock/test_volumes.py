"""Volumes that are cut, against manifold3d: booleans of the bodies that tools sweep.

A tool is convex, so along a straight move it sweeps the convex hull of itself at both ends. With
corners on the circles of the tool it is too small, with sides on them too large: the true volume
lies between.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from manifold3d import Manifold

from camtool.arrays import Floats
from camtool.stock.cut import CutStock
from camtool.stock.cutters import CutterProfile
from camtool.stock.heights import stock_tree
from camtool.stock.moves import StockMoves
from tests.stock.cuts import CUTTERS
from tests.stock.test_heights import random_moves
from tests.strategies import examples

pytestmark = pytest.mark.referee

BOX = (0.0, 0.0, 10.0, 10.0)
THICK_MM = 6.0
TALL_MM = 20.0
SIDES = 48
RINGS = 24


def body(cutter: CutterProfile, stretch: float) -> Floats:
    """Corners (P, 3) of a tool with its tip at 0: rings of its profile up to a height above the
    stock, with circles `stretch` times as wide."""
    out = np.linspace(0.0, cutter.radius_mm - cutter.flat_mm, RINGS + 1)
    if cutter.corner_mm:
        out = cutter.corner_mm * np.sin(np.linspace(0.0, 0.5 * math.pi, RINGS + 1))
    wide = np.concatenate([cutter.flat_mm + out, [cutter.radius_mm]])
    high = np.append(cutter.heights(np.minimum(wide[:-1], cutter.radius_mm)), TALL_MM)
    angle = np.arange(SIDES) * math.tau / SIDES
    rings = [
        np.column_stack(
            [stretch * w * np.cos(angle), stretch * w * np.sin(angle), np.full(SIDES, z)]
        )
        for w, z in zip(wide.tolist(), high.tolist(), strict=True)
    ]
    return np.concatenate(rings)


def cut_volume(moves: StockMoves, stretch: float) -> float:
    """Volume of the stock within all hulls, mm³."""
    hulls = []
    for row in range(len(moves)):
        tool = body(moves.cutters[int(moves.tool[row])], stretch)
        hulls.append(
            Manifold.hull_points(np.concatenate([tool + moves.start[row], tool + moves.end[row]]))
        )
    stock = Manifold.cube([BOX[2], BOX[3], THICK_MM]).translate([0.0, 0.0, -THICK_MM])
    swept = hulls[0]
    for each in hulls[1:]:
        swept += each
    return float((stock ^ swept).volume())


@examples(8)
@given(seed=st.integers(0, 10_000), count=st.integers(1, 12))
def test_volumes_are_those_of_booleans(seed: int, count: int) -> None:
    moves = random_moves(seed, count)
    small = cut_volume(moves, 1.0)
    # Facets of the round corner lie within it, too: by 1 − cos of half their angle of the corner.
    large = cut_volume(moves, 1.0 / math.cos(math.pi / SIDES))
    slack = 0.01 * large + 1e-3
    found = CutStock(moves, stock_tree(moves), BOX, -THICK_MM).removed_mm3(0.002)
    assert found.high - found.low <= 0.003 * found.high + 1e-3
    assert found.high >= small - 1e-6
    assert found.low <= large + slack


@pytest.mark.parametrize("tool", range(len(CUTTERS)))
def test_each_tool_straight_down_and_along(tool: int) -> None:
    start = np.array([[3.0, 5.0, 1.0], [3.0, 5.0, -1.2]])
    end = np.array([[3.0, 5.0, -1.2], [7.0, 6.0, -2.0]])
    one = StockMoves(
        start,
        end,
        np.arange(2),
        np.zeros(2, dtype=np.bool_),
        np.full(2, tool, dtype=np.int64),
        CUTTERS,
    )
    found = CutStock(one, stock_tree(one), BOX, -THICK_MM).removed_mm3(0.001)
    small, large = cut_volume(one, 1.0), cut_volume(one, 1.0 / math.cos(math.pi / SIDES))
    assert found.high >= small
    assert found.low <= large * 1.002
    assert (large - small) < 0.01 * large
