"""Adaptive clearing beside FreeCAD's and hsm_nibble's, by the slow oracle of engagement.

    HSM_NIBBLE=FOLDER pytest -m slow --bless tests/validation/test_validation_adaptive.py

writes the table of docs/validation.md; the shapes are drawn from what reports about FreeCAD say
(docs/validation.md has which), not copied from their files.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pytest
import shapely

from camtool.geometry.polylines import Polyline
from tests.operations.test_adaptive import adaptive
from tests.oracles.adaptive_peers import FREECAD, HSM_NIBBLE, Clearing, freecad, hsm_nibble
from tests.oracles.contours import QUARTER, closed
from tests.oracles.engagement import CHORD_SHARE, Stock, chords_of, engagements, stays_of
from tests.oracles.swept import area_of
from tests.planning.pocket_cases import LETTER_B, region_of
from tests.validation.page import check, mm

pytestmark = [
    pytest.mark.slow,
    pytest.mark.referee,
    pytest.mark.skipif(
        not (FREECAD / "area.so").exists(),
        reason="FreeCAD's area.so is missing: apt-get install freecad-python3 brings it",
    ),
]

THICK_SHARE, EVERY_SHARE, DEEP_SHARE = 4e-3, 0.1, 0.01
TOLERATED = 1.02


class Shape(NamedTuple):
    """A pocket, the radius of its tool, mm, and the part of its diameter that may be cut."""

    paths: list[Polyline]
    radius_mm: float
    share: float


CORNER = [
    closed((0, 0), (44, 0), (44, 44), (0, 44)),
    closed((10, 10), (34, 10), (34, 20), (20, 20), (20, 34), (10, 34)),
]
HOLE = [
    CORNER[0],
    closed((10, 10), (34, 10), (34, 20), (23, 20, -QUARTER), (20, 17, -QUARTER),
           (17, 20, -QUARTER), (20, 23), (20, 34), (10, 34)),
]  # fmt: skip
LETTER_E = [
    closed((0, 0), (10, 0), (10, 3), (3, 3), (3, 6), (8, 6), (8, 9), (3, 9), (3, 12), (10, 12),
           (10, 15), (0, 15)),
]  # fmt: skip
SHAPES = {
    "inner corner": Shape(CORNER, 2.5, 0.2),
    "inner corner with a hole": Shape(HOLE, 2.5, 0.2),
    "letter B": Shape(LETTER_B, 0.75, 0.2),
    "letter E": Shape(LETTER_E, 1.2, 0.2),
    "slot of 10.16 mm": Shape([closed((0, 0), (30, 0), (30, 10.16), (0, 10.16))], 3.175, 0.2),
    "step-over of 1 %": Shape([closed((0, 0), (20, 0), (20, 20), (0, 20))], 6.0, 0.01),
}


class Figures(NamedTuple):
    """The greatest engagement outside of the entry, rad; the part of the way that is above the
    limit; and the area that stays though the tool reaches it, mm²."""

    greatest: float
    above: float
    uncut_mm2: float

    def words(self) -> list[str]:
        return [
            mm(math.degrees(self.greatest), 1),
            mm(100.0 * self.above, 1),
            mm(self.uncut_mm2, 2),
        ]


def ours(shape: Shape) -> Clearing:
    runs = adaptive(shape.paths, 2.0 * shape.radius_mm, limit_of(shape))
    stays = stays_of(
        [chords_of(run.vertices, CHORD_SHARE * shape.radius_mm) for run in runs], -1.0
    )
    is_entry = [len(stay.down) > 0 and stay.down[0, 2] == 0.0 for stay in stays]
    return Clearing(stays, is_entry)


def limit_of(shape: Shape) -> float:
    return math.acos(1.0 - 2.0 * shape.share)


def figures(shape: Shape, clearing: Clearing, finished: Clearing | None = None) -> Figures:
    """Measure a clearing; what stays is measured behind `finished`, the same with a pass along the
    walls, where a program needs one for that."""
    radius, limit = shape.radius_mm, limit_of(shape)
    stock = Stock(radius, THICK_SHARE * radius)
    angles = [
        place.angle
        for place in engagements(stock, clearing.stays, EVERY_SHARE * radius, 0.5)
        if not math.isnan(place.heading)
        and not (clearing.is_entry[place.stay] and place.travelled_mm <= math.tau * radius)
    ]
    for stay in finished.stays if finished else ():
        stock.cut(stay.points)
    fine = 0.02 * radius
    area = area_of(region_of(shape.paths))
    centres = shapely.buffer(area, -radius - fine, quad_segs=200)
    reached = shapely.buffer(centres, fine + radius, quad_segs=200)
    deep = shapely.buffer(stock.remaining(reached), -DEEP_SHARE * radius)
    grown = shapely.buffer(deep, DEEP_SHARE * radius)
    above = np.array(angles) > TOLERATED * limit
    return Figures(max(angles, default=0.0), float(above.mean()) if angles else 0.0, grown.area)


def row_of(name: str, program: str, measured: Sequence[str]) -> list[str]:
    shape = SHAPES[name]
    limit = mm(math.degrees(limit_of(shape)), 1)
    return [name, mm(2.0 * shape.radius_mm, 2), limit, program, *measured]


def test_beside_other_programs(bless: bool) -> None:
    """Ours keeps to its limit and leaves nothing; what others do is measured, not judged."""
    rows = []
    for name, shape in SHAPES.items():
        area = area_of(region_of(shape.paths)).simplify(1e-4 * shape.radius_mm)
        own = figures(shape, ours(shape))
        assert own.greatest <= TOLERATED * limit_of(shape), name
        assert own.uncut_mm2 == 0.0, name
        rows.append(row_of(name, "camtool", own.words()))
        rough, whole = (
            freecad(area, shape.radius_mm, shape.share, finish=finish) for finish in (False, True)
        )
        rows.append(row_of(name, "FreeCAD", figures(shape, rough, whole).words()))
        if HSM_NIBBLE:
            peer = hsm_nibble(area, shape.radius_mm, shape.share)
            rows.append(row_of(name, "hsm_nibble", figures(shape, peer).words()))
    if bless:
        heads = ["pocket", "tool, mm", "limit, °", "program", "greatest, °"]
        check("adaptive", [*heads, "above, % of the way", "uncut, mm²"], rows, bless)
