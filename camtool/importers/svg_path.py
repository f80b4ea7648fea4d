"""Subpaths, and the path data of SVG.

A subpath is a start and segments in user units, Y down as in the file:

    Lines        corners after the start, (n, 2)
    Bezier       control points after the start: (2, 2) or (3, 2)
    Arc          centre + u·cos t + v·sin t, t from `begin` over the signed `sweep`, to `end`

The words of path data are checked here to the letter, since a program must not be cut from half
a drawing; subpaths of straight lines alone are then done. The curves of the others are parsed by
svgpathtools; of its arcs only the data are taken, as its centres are rounded (a half circle is
recognised within 1e-8) and ours are not.

Source: Scalable Vector Graphics 1.1, chapter 8 (paths) and appendix F.6 (elliptical arcs).
"""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from camtool.errors import DrawingError
from camtool.geometry.polylines import Floats
from camtool.importers.svg_affine import BETWEEN, MAX_NUMBER, NUMBER, parse_numbers

_COMMAND = re.compile(r"[MmZzLlHhVvCcSsQqTtAa]")
_FLAG = re.compile(r"[01]")
_FLAG_FIELDS = (3, 4)
_COUNTS = {"M": 2, "L": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "T": 2, "A": 7, "Z": 0}


@dataclass(frozen=True, eq=False)
class Lines:
    """Straight segments through `points` (n, 2)."""

    points: Floats


@dataclass(frozen=True, eq=False)
class Bezier:
    """A quadratic (2, 2) or cubic (3, 2) Bézier: `control` without its first point."""

    control: Floats


@dataclass(frozen=True, eq=False)
class Arc:
    """An arc of an ellipse, its half axes `u`, `v` (2,), angles in rad, `end` (2,) exact."""

    centre: Floats
    u: Floats
    v: Floats
    begin: float
    sweep: float
    end: Floats


Segment = Lines | Bezier | Arc


@dataclass(frozen=True, eq=False)
class Subpath:
    """A start (2,) and what follows it; `closed` paths have a straight line back, if any."""

    start: Floats
    segments: tuple[Segment, ...]
    closed: bool


@dataclass
class _Words:
    """One subpath on the way: its corners, and its commands for svgpathtools."""

    points: list[complex]
    commands: list[str] = field(default_factory=list)
    curved: bool = False


def arc_between(start: complex, end: complex, radii: complex, turn: float, flags: int) -> Arc:
    """The arc of path data: `radii` = rx + i·ry, `turn` rad of the x axis; flags: 1 the sweep
    flag, 2 the large-arc flag. Radii that are too short are grown. Start and end differ.

    In the frame where the ellipse is the unit circle, with the chord's half h = (p1 − p0)/2,
    |h| = sin(half the small sweep), the centre lies at the chord's middle ± i·h/|h|·√(1 − |h|²).
    """
    rx, ry = abs(radii.real), abs(radii.imag)
    axis = complex(math.cos(turn), math.sin(turn))

    def to_unit(z: complex) -> complex:
        w = z * axis.conjugate()
        return complex(w.real / rx, w.imag / ry)

    middle, half = to_unit((start + end) / 2.0), to_unit((end - start) / 2.0)
    size = abs(half)
    grow = max(size, 1.0)
    rise = math.sqrt((1.0 - size) * (1.0 + size)) if size < 1.0 else 0.0
    positive, large = bool(flags & 1), bool(flags & 2)
    side = 1.0 if positive != large else -1.0
    offset = side * rise * half * 1j / size
    small = 2.0 * math.atan2(min(size, 1.0), rise)
    sweep = (2.0 * math.pi - small) if large else small
    from_centre = -half / grow - offset
    centre = (middle + offset) if size < 1.0 else middle
    at = complex(centre.real * rx, centre.imag * ry) * axis
    u, v = rx * grow * axis, 1j * ry * grow * axis
    return Arc(
        centre=_pair(at),
        u=_pair(u),
        v=_pair(v),
        begin=math.atan2(from_centre.imag, from_centre.real),
        sweep=sweep if positive else -sweep,
        end=_pair(end),
    )


def parse_path(data: str) -> list[Subpath]:
    """The subpaths of path data that draw something; DrawingError naming the sign at fault."""
    subpaths: list[Subpath] = []
    words: _Words | None = None
    start = here = 0j
    for letter, numbers, at in _commands(data):
        kind, relative = letter.upper(), letter.islower()
        if kind == "Z":
            if words is not None and len(words.points) > 1:
                subpaths.append(_subpath(words, closed=True))
            words, here = None, start
            continue
        count = _COUNTS[kind]
        for row in range(0, len(numbers), count):
            field_values = numbers[row : row + count]
            if kind == "M" and row == 0:
                if words is not None and len(words.points) > 1:
                    subpaths.append(_subpath(words, closed=False))
                start = here = complex(*field_values) + (here if relative else 0j)
                words = _Words([here])
                continue
            if words is None:
                words = _Words([here])
            here = _step(words, "L" if kind == "M" else kind, relative, field_values)
            if not (abs(here.real) <= MAX_NUMBER and abs(here.imag) <= MAX_NUMBER):
                raise DrawingError(f"path data run out of all bounds at sign {at + 1}")
    if words is not None and len(words.points) > 1:
        subpaths.append(_subpath(words, closed=False))
    return subpaths


def _commands(data: str) -> Iterator[tuple[str, list[float], int]]:
    """Letter, numbers and place of each command, all checked."""
    places = [match.start() for match in _COMMAND.finditer(data)]
    lead = data[: places[0]] if places else data
    if lead.strip():
        raise DrawingError(f"path data begin with {lead.strip()[:12]!r}, wanted M or m")
    if places and data[places[0]] not in "Mm":
        raise DrawingError(f"path data begin with {data[places[0]]!r}, wanted M or m")
    for at, following in zip(places, [*places[1:], len(data)], strict=True):
        letter, text = data[at], data[at + 1 : following]
        name = f"path data at sign {at + 1}: {letter!r}"
        kind = letter.upper()
        numbers = _arc_numbers(text, name) if kind == "A" else parse_numbers(text, name)
        count = _COUNTS[kind]
        if (len(numbers) % count if count else len(numbers)) or (count and not numbers):
            raise DrawingError(f"{name} has {len(numbers)} numbers, wanted {count or 'none'}")
        yield letter, numbers, at


def _arc_numbers(text: str, name: str) -> list[float]:
    """Numbers of A commands, whose flags may stick to what follows ("a1 1 0 011 2")."""
    words: list[str] = []
    at = _after_blanks(text, 0)
    while at < len(text):
        pattern = _FLAG if len(words) % _COUNTS["A"] in _FLAG_FIELDS else NUMBER
        match = pattern.match(text, at)
        if match is None:
            raise DrawingError(f"{name} holds {text[at : at + 12]!r}, which does not belong there")
        words.append(match[0])
        at = _after_blanks(text, match.end())
    return parse_numbers(" ".join(words), name)


def _after_blanks(text: str, at: int) -> int:
    while at < len(text) and text[at] in BETWEEN:
        at += 1
    return at


def _step(words: _Words, kind: str, relative: bool, n: list[float]) -> complex:
    """Takes one command into the subpath; where it ends."""
    here = words.points[-1]
    base = here if relative else 0j
    if kind == "H":
        end = complex(n[0] + base.real, here.imag)
    elif kind == "V":
        end = complex(here.real, n[0] + base.imag)
    else:
        end = complex(n[-2], n[-1]) + base
    # The standard: an arc without a radius is a line, one that ends where it starts is left out.
    if kind in "LHV" or (kind == "A" and (n[0] == 0.0 or n[1] == 0.0 or end == here)):
        words.commands.append(f"L {end.real!r} {end.imag!r}")
    elif kind == "A":
        words.commands.append(
            f"A {n[0]!r} {n[1]!r} {n[2]!r} {n[3]:.0f} {n[4]:.0f} {end.real!r} {end.imag!r}"
        )
        words.curved = True
    else:
        letter = kind.lower() if relative else kind
        words.commands.append(f"{letter} {' '.join(map(repr, n))}")
        words.curved = True
    words.points.append(end)
    return end


def _subpath(words: _Words, *, closed: bool) -> Subpath:
    points = np.array(words.points).view(np.float64).reshape(-1, 2)
    if not words.curved:
        return Subpath(points[0], (Lines(points[1:]),), closed)
    return Subpath(points[0], tuple(_curves(words)), closed)


def _curves(words: _Words) -> Iterator[Segment]:
    """The segments of a subpath with curves, as svgpathtools reads them."""
    import svgpathtools

    begin = words.points[0]
    text = f"M {begin.real!r} {begin.imag!r} " + " ".join(words.commands)
    try:
        # Its warnings are about numbers that we check, or do not use.
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            path = svgpathtools.parse_path(text)
    except (ValueError, ArithmeticError, AssertionError, IndexError) as error:
        raise DrawingError("path data hold a curve without a shape") from error
    corners: list[complex] = []
    for segment in path:
        if isinstance(segment, svgpathtools.Line):
            corners.append(segment.end)
            continue
        if corners:
            yield Lines(_pairs(corners))
            corners = []
        if isinstance(segment, svgpathtools.Arc):
            flags = int(segment.sweep) + 2 * int(segment.large_arc)
            turn = math.radians(segment.rotation)
            radii = complex(segment.radius)
            yield arc_between(segment.start, segment.end, radii, turn, flags)
        else:
            yield Bezier(_pairs(segment.bpoints()[1:]))
    if corners:
        yield Lines(_pairs(corners))


def _pair(z: complex) -> Floats:
    return np.array([z.real, z.imag])


def _pairs(points: list[complex] | tuple[complex, ...]) -> Floats:
    return np.array(points, dtype=np.complex128).view(np.float64).reshape(-1, 2)
