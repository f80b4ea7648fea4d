"""The bands that machine files predict for the parts that theses measured, and how often the
measured sizes lie in them.

The bands were written (`--bless`) and committed before they were compared. What no thesis gives a
number for is unknown, has no part in a band, and is named.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, cast

import numpy as np

from camtool.arrays import Floats
from camtool.inspection.uncertainty import (
    Budget,
    Variant,
    edges_of,
    inputs_of,
    opposite_edges,
    propagate,
)
from tests.validation import pic_mmh_parts as pic
from tests.validation import test_validation_flashcut as flashcut
from tests.validation import test_validation_others as others
from tests.validation.page import check, mm
from tests.validation.pieces import UM, Piece, piece

X, Y = 0.0, 0.5 * math.pi


@dataclass(frozen=True)
class Size:
    """A size of a part: its name, the direction in which it is measured, and what was measured,
    mm, on one part or several. It has two edges, or one, where it is a place."""

    name: str
    direction_rad: float
    measured_mm: tuple[float, ...]
    edges: int = 2


@dataclass(frozen=True)
class Part:
    """A part that was measured, and how its sizes follow from the paths of its slides."""

    group: str
    name: str
    made: Callable[[], Piece]
    sizes_of: Callable[[Piece], Sequence[float]]
    sizes: tuple[Size, ...]


def extents(made: Piece) -> Floats:
    """(2,) mm: width and height of all that is cut."""
    return np.asarray(np.ptp(np.concatenate(made.cuts), axis=0))


def all_diameters(made: Piece) -> list[float]:
    found = pic.diameters_of(made)
    return [float(each) for radius in pic.DIAMETERS for each in found[radius]]


def crossing(made: Piece) -> list[float]:
    at, apart = flashcut.crossing(made)
    return [float(at[0]), float(at[1]), apart]


def logo(name: str) -> Callable[[], Piece]:
    return lambda: piece(f"pic-mmh-{name}")


def rectangle(name: str) -> Callable[[], Piece]:
    return lambda: flashcut.rectangle(name)


def circle(half_period: int) -> Callable[[], Piece]:
    setting = f"controller.half_period_ms={half_period}"
    return lambda: piece("flashcut-circle", setting, job=flashcut.ALONE)


def turns(axis: str) -> Part:
    """The places after six to ten turns of a screw, from what the first five say: the step and how
    well it is known, and how much the readings scatter."""

    def made() -> Piece:
        found = others.by_five(axis)
        settings = (
            f"axes.{axis}.real_step_mm={others.step_by_five(axis)!r}",
            f"uncertainty.{axis}.scale={found.known.standard(f'{axis}.scale')!r}",
            f"uncertainty.process_mm={found.spread_mm!r}",
        )
        return Piece(cast(Any, None), *others.turned(axis, *settings))

    def places(moved: Piece) -> list[float]:
        found: list[float] = others.places_of(moved.decoded, moved.machine, axis)[5:].tolist()
        return found

    read = others.readings()[axis].tolist()
    sizes = tuple(
        Size(f"{axis.upper()} after {k} turns", X if axis == "x" else Y, (read[k - 1],), 1)
        for k in range(6, 11)
    )
    return Part("ValCNC", "by five turns", made, places, sizes)


def both(x: Sequence[float], y: Sequence[float]) -> tuple[Size, ...]:
    return Size("X", X, tuple(x)), Size("Y", Y, tuple(y))


PARTS = (
    Part(
        "PIC machine",
        "squares of 2.5",
        lambda: piece("pic-mmh-square", *pic.FIRST, at=pic.CORNERS[1]),
        pic.square_of,
        both(pic.SQUARES["Dx"], pic.SQUARES["Dy"]),
    ),
    Part(
        "PIC machine",
        "circles",
        pic.circles,
        all_diameters,
        tuple(
            Size(f"Ø {2.0 * radius:g} at {22.5 * k:g}°", math.radians(22.5 * k), (read,))
            for radius, every in pic.DIAMETERS.items()
            for k, read in enumerate(every)
        ),
    ),
    *(
        Part("PIC machine", name, logo(name), extents, both([x[1]], [y[1]]))
        for name, (x, y) in pic.LOGOS.items()
    ),
    *(
        Part("parallel port", name, rectangle(name), extents, both([x[1]], [y[1]]))
        for name, (x, y, _) in flashcut.RECTANGLES.items()
    ),
    *(
        Part("parallel port, circles", f"{ms} ms", circle(ms), extents, both([x], [y]))
        for ms, ((x, y), _) in flashcut.CIRCLES.items()
    ),
    Part(
        "parallel port",
        "diagonals",
        flashcut.crossed,
        crossing,
        (
            Size("crossing X", X, (flashcut.CROSSING[0],)),
            Size("crossing Y", Y, (flashcut.CROSSING[1],)),
            Size("A to B", Y, (flashcut.APART_MM,)),
        ),
    ),
    turns("x"),
    turns("y"),
)


@cache
def budget_of(part: Part) -> Budget:
    """The bands of its sizes, all of which are scribed with a point."""
    made = part.made()

    def values(variant: Variant) -> Floats:
        return np.array(part.sizes_of(replace(made, machine=variant.machine)))

    edges = edges_of(
        [(1, opposite_edges(size.direction_rad)[: size.edges]) for size in part.sizes]
    )
    return propagate(values, inputs_of(made.machine, 0.0), edges)


COVERS = 1.959964
"""Standard uncertainties to either side that hold 95 %."""


def test_bands(bless: bool) -> None:
    rows = []
    for part in PARTS:
        budget = budget_of(part)
        for k, size in enumerate(part.sizes):
            largest = budget.contributions(k)[:2]
            rows.append(
                [
                    part.group,
                    part.name,
                    size.name,
                    mm(float(budget.expected[k])),
                    mm(COVERS * float(budget.standards[k])),
                    ", ".join(
                        f"{each.input.name} {each.standard_mm * UM:.1f}" for each in largest
                    ),
                    ", ".join(each.name.partition("_")[0] for each in budget.unknown(k)),
                ]
            )
    heads = ["thesis", "part", "size", "predicted, mm", "± for 95 %, mm"]
    check("bands", [*heads, "most from, µm (standard)", "not known"], rows, bless)


def test_the_simulation_of_variants_is_that_of_the_report() -> None:
    for part in PARTS:
        if part.sizes_of is extents:
            made = part.made()
            assert np.allclose(extents(made), made.size, atol=1e-6)
