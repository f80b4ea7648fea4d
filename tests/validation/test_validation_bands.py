"""The bands that machine files predict for the parts that theses measured, and how often the
measured sizes lie in them.

The bands were written (`--bless`) and committed before they were compared. What no thesis gives a
number for is unknown, has no part in a band, and is named.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, cast

import numpy as np

from camtool.arrays import Floats
from camtool.inspection.uncertainty import (
    Budget,
    MachineVariant,
    edges_of,
    inputs_of,
    normal_below,
    opposite_edges,
    propagate,
)
from camtool.pictures.text import TextStyle, label
from camtool.records import replace
from tests.validation import pic_mmh_parts as pic
from tests.validation import test_validation_flashcut as flashcut
from tests.validation import test_validation_others as others
from tests.validation.page import PAGE, check, mm
from tests.validation.pieces import ROOT, UM, Piece, piece

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

    def values(variant: MachineVariant) -> Floats:
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
                    ", ".join(_not_known(budget, k)),
                ]
            )
    heads = ["thesis", "part", "size", "predicted, mm", "± for 95 %, mm"]
    check("bands", [*heads, "most from, µm (standard)", "not known"], rows, bless)


def _not_known(budget: Budget, value: int) -> Iterator[str]:
    """The first words of what is not known, with its bound, µm, where it has one."""
    for each in budget.unknown(value):
        most = float(budget.at_most[value, budget.inputs.index(each)]) * UM
        name = each.name.partition("_")[0]
        yield f"{name} (at most {most:.1f})" if math.isfinite(most) else name


def test_the_simulation_of_variants_is_that_of_the_report() -> None:
    for part in PARTS:
        if part.sizes_of is extents:
            made = part.made()
            assert np.allclose(extents(made), made.size, atol=1e-6)


# The comparison.

LEVELS = (0.5, 0.68, 0.8, 0.9, 0.95, 0.99)
"""Of the bands of the reliability diagram."""

KINDS = (
    ("PIC machine: squares", "squares of 2.5", ""),
    ("PIC machine: circles", "circles", ""),
    ("PIC machine: logos, X", "puma|gmm", "X"),
    ("PIC machine: logos, Y", "puma|gmm", "Y"),
    ("parallel port: rectangles", "10x10|10x5|3x10", ""),
    ("parallel port: diagonals", "diagonals", ""),
    ("parallel port: circles", "ms", ""),
    ("ValCNC: turns", "turns", ""),
)
"""What is counted together: its name, parts, and sizes."""

GROUPS = (
    ("PIC machine", "squares|circles|puma|gmm", ""),
    ("parallel port", "10x10|10x5|3x10|diagonals|ms", ""),
    ("ValCNC", "turns", ""),
)

ALL = (("all but circles, parallel port", "squares|circles|puma|gmm|10x|3x|diag|turns", ""),
       ("all", "", ""))  # fmt: skip

DIAGRAM = ROOT / "docs" / "images" / "reliability.svg"
CAP = 9.0


@dataclass(frozen=True, eq=False)
class Compared:
    """Readings against what was predicted: `off` (N,) mm measured less predicted, the `standard`
    uncertainties (N,) mm, and how many `edges` (N,) each size has."""

    off: Floats
    standard: Floats
    edges: Floats

    @property
    def sigmas(self) -> Floats:
        """(N,) the deviations in standard uncertainties."""
        return np.asarray(self.off / self.standard)

    @property
    def needed_um(self) -> float:
        """Additional `process_mm`, µm, with which the deviations were as large as predicted, in
        the mean of squares; 0 if they are no larger."""
        low, high = 0.0, 10.0
        for _ in range(60):
            middle = 0.5 * (low + high)
            spread = self.standard**2 + self.edges * middle**2
            if float(np.mean(self.off**2 / spread)) > 1.0:
                low = middle
            else:
                high = middle
        return low * UM

    def inside(self, level: float) -> float:
        """The share that lies in the bands of this level."""
        below = np.vectorize(normal_below)(np.abs(self.sigmas))
        return float((below <= 0.5 + 0.5 * level).mean())


def compared(parts: str, sizes: str = "") -> Compared:
    """The readings of some sizes of some parts."""
    rows = [
        (
            read - float(budget_of(part).expected[k]),
            float(budget_of(part).standards[k]),
            size.edges,
        )
        for part in PARTS
        if re.search(parts, part.name)
        for k, size in enumerate(part.sizes)
        if sizes in size.name
        for read in size.measured_mm
    ]
    off, standard, edges = np.array(rows).T
    return Compared(off, standard, edges)


def test_every_reading_is_counted_once() -> None:
    counted = sum(len(compared(parts, sizes).off) for _, parts, sizes in KINDS)
    assert counted == sum(len(size.measured_mm) for part in PARTS for size in part.sizes) == 63


def test_coverage(bless: bool) -> None:
    rows = [_row(name, compared(parts, sizes)) for name, parts, sizes in (*KINDS, *ALL)]
    heads = ["", "readings", *(f"in {100 * level:g} %" for level in LEVELS)]
    but = compared(ALL[0][1])
    said = f"95 % bands hold {100.0 * but.inside(0.95):.0f} %"
    page = PAGE.read_text(encoding="utf-8")
    assert f"### Compared: {said}\n" in page
    assert f"{said} of {len(but.off)} readings" in page
    check("coverage", [*heads, "rms, standard uncertainties", "needed, µm"], rows, bless)


def _row(name: str, read: Compared) -> list[str]:
    shares = [f"{100.0 * read.inside(level):.0f} %" for level in LEVELS]
    rms = math.sqrt(float(np.mean(read.sigmas**2)))
    return [name, str(len(read.off)), *shares, f"{rms:.1f}", f"{read.needed_um:.1f}"]


def test_what_can_have_a_verdict() -> None:
    """If the temperature alone is unknown, its effect is bounded by less than the width of the
    band, and such sizes can be said to hold.

    The circles of the parallel port, far outside of their bands, are undecided: nothing bounds
    the process.
    """
    decided, bounded = set(), 0
    for part in PARTS:
        budget = budget_of(part)
        for k, size in enumerate(part.sizes):
            unknown = {each.name for each in budget.unknown(k)}
            assert "temperature_k" in unknown
            assert ("process_mm" in unknown) == part.group.startswith("parallel port")
            most = float(budget.at_most[k].sum())
            assert math.isfinite(most) == (unknown == {"temperature_k"})
            if math.isfinite(most):
                decided.add(part.name)
                bounded += len(size.measured_mm)
                assert part.group == "ValCNC" or most < COVERS * budget.standards[k]
    assert decided == {"squares of 2.5", "circles", "puma-5", "puma-1.2", "puma-1", "gmm-5",
                       "gmm-1.2", "by five turns"}  # fmt: skip
    assert bounded == 27  # of the 59 without the circles of the parallel port
    far = compared("ms")
    assert (far.sigmas < -30.0).all()
    assert far.inside(0.99) == 0.0


def test_reliability(bless: bool) -> None:
    """The diagram: how many readings lie in a band, by how many should."""
    levels = np.arange(0.05, 1.0, 0.05)
    lines = {
        name: [compared(parts).inside(float(level)) for level in levels]
        for name, parts, _ in (*GROUPS, ALL[0])
    }
    text = _diagram(levels.tolist(), lines)
    if bless:
        DIAGRAM.write_text(text, encoding="utf-8")
    assert DIAGRAM.read_text(encoding="utf-8") == text


def _diagram(levels: Sequence[float], lines: dict[str, list[float]]) -> str:
    """SVG: predicted shares to the right, observed ones up, 0 to 100 %."""

    def at(x: float, y: float) -> str:
        return f"{60 + 300 * x:.1f},{330 - 300 * y:.1f}"

    parts = [
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 640 390">',
        '<rect width="640" height="390" fill="#fff"/>',
        f'<polyline points="{at(0, 0)} {at(1, 1)}" stroke="#999" stroke-dasharray="4 4"/>',
    ]
    for tick in range(0, 101, 20):
        part = tick / 100.0
        x, y = 60.0 + 300.0 * part, 330.0 - 300.0 * part
        parts += [
            f'<polyline points="{at(part, 0)} {at(part, 1)}" stroke="#ddd"/>',
            f'<polyline points="{at(0, part)} {at(1, part)}" stroke="#ddd"/>',
            label(str(tick), (x, 347.0), TextStyle(CAP, anchor="middle")),
            label(str(tick), (52.0, y + 4.0), TextStyle(CAP, anchor="end")),
        ]
    colours = ("#0072b2", "#d55e00", "#009e73", "#333333")
    for k, ((name, shares), colour) in enumerate(zip(lines.items(), colours, strict=True)):
        points = " ".join(at(x, y) for x, y in zip(levels, shares, strict=True))
        parts += [
            f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="2"/>',
            f'<rect x="380" y="{50 + 24 * k}" width="18" height="3" fill="{colour}"/>',
            label(name, (404.0, 56.0 + 24.0 * k), TextStyle(CAP)),
        ]
    parts += [
        label(
            "readings predicted in the band, %", (210.0, 372.0), TextStyle(CAP, anchor="middle")
        ),
        '<g transform="rotate(-90 18 180)">',
        label("readings in the band, %", (18.0, 180.0), TextStyle(CAP, anchor="middle")),
        "</g></svg>",
    ]
    return "\n".join(parts) + "\n"
