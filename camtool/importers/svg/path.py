"""The path data of SVG as subpaths.

The words of path data are checked here to the letter: what stands before the first wrong sign is
drawn, as the standard wants it, and the fault is told. Lines and arcs are done with that; the
Bézier curves, with their smooth and relative forms, are svgpathtools' to make.

Source: Scalable Vector Graphics 1.1, chapter 8 (paths; 8.3.9 for their grammar) and appendix F.2
(drawing up to an error).
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from itertools import accumulate

import numpy as np

from camtool.errors import DrawingError
from camtool.geometry.polylines import Floats
from camtool.importers.svg.affine import MAX_NUMBER, NUMBER
from camtool.importers.svg.segments import Arc, Bezier, Lines, Segment, Subpath, arc_between

MAX_SIGNS = 50_000_000
"""Path data of one element may be so long; their numbers would take some 3 GB."""

_COMMAND = re.compile(r"([MmZzLlHhVvCcSsQqTtAa])")
_GAP = r"[ \t\r\n\f,]*+"
_NUM = NUMBER.pattern
_NUMBERS = re.compile(rf"{_GAP}(?>(?:{_NUM}{_GAP})*)", re.ASCII)
_ARC = re.compile(
    rf"({_NUM}){_GAP}({_NUM}){_GAP}({_NUM}){_GAP}([01]){_GAP}([01]){_GAP}({_NUM}){_GAP}({_NUM}){_GAP}",
    re.ASCII,
)
_START = re.compile(_GAP)
_COUNTS = {"M": 2, "L": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "T": 2, "A": 7, "Z": 0}


def parse_path(data: str) -> tuple[list[Subpath], str]:
    """The subpaths of path data that draw something, up to the first fault, and that fault ("").

    DrawingError for data that cannot be drawn at all: too many or too large, or arcs without a
    shape.
    """
    if len(data) > MAX_SIGNS:
        raise DrawingError(f"path data have more than {MAX_SIGNS} signs")
    pen = _Pen()
    fault = _drawn(data, pen)
    pen.lift(closed=False)
    return pen.subpaths(), fault


def _drawn(data: str, pen: _Pen) -> str:
    """Draws command by command; the first fault, or ""."""
    lead, *words = _COMMAND.split(data)
    if lead.strip() or (words and words[0] not in "Mm"):
        begin = lead.strip() or words[0]
        return f"path data begin with {begin[:12]!r}, wanted M or m"
    at = len(lead)
    for letter, text in zip(words[::2], words[1::2], strict=True):
        kind = letter.upper()
        name = f"path data at sign {at + 1}: {letter!r}"
        if kind == "A":
            fault = _arcs(pen, letter.islower(), text)
        else:
            match = _NUMBERS.match(text)
            end = match.end() if match else 0
            numbers = NUMBER.findall(text, 0, end)
            count = _COUNTS[kind]
            whole = len(numbers) // count * count if count else 0
            fault = "" if end == len(text) else _odd(text[end:])
            if not fault and (whole != len(numbers) or (count and not numbers)):
                fault = f"has {len(numbers)} numbers, wanted {count or 'none'}"
            pen.command(letter, numbers[:whole])
        if fault:
            return f"{name} {fault}"
        at += 1 + len(text)
    return ""


def _arcs(pen: _Pen, relative: bool, text: str) -> str:
    """A commands: their flags may stick to what follows ("a1 1 0 011 2"); the fault or ""."""
    start = _START.match(text)
    at = start.end() if start else 0
    drawn = 0
    while match := _ARC.match(text, at):
        rx, ry, turn, large, positive, x, y = (float(number) for number in match.groups())
        pen.arc(complex(rx, ry), turn, int(positive + 2.0 * large), complex(x, y), relative)
        at = match.end()
        drawn += 1
    if at < len(text):
        return _odd(text[at:])
    return "" if drawn else "has no numbers, wanted 7"


def _odd(text: str) -> str:
    return f"holds {text.strip()[:12]!r}, which does not belong there"


@dataclass
class _Pen:
    """Draws: the point where it stands, the open subpath, and what is done.

    A subpath is listed as corners to go straight to, as arcs, and as counts of the next Béziers
    of `_curves`, which svgpathtools makes all at once: one text in which each run of curve
    commands has a moveto of its own, so that a smooth curve is reflected only in its own run.
    """

    here: complex = 0j
    start: complex = 0j
    corners: list[complex] = field(default_factory=list)
    items: list[list[complex] | Arc | int] = field(default_factory=list)
    done: list[tuple[complex, list[list[complex] | Arc | int], bool]] = field(default_factory=list)
    text: list[str] = field(default_factory=list)

    def command(self, letter: str, words: list[str]) -> None:
        """Any command but A, with whole sets of numbers; "M" without numbers draws nothing."""
        kind, relative = letter.upper(), letter.islower()
        if kind == "Z":
            self.lift(closed=True)
        elif words and kind in "CSQT":
            self._curve(letter, words)
        elif words:
            numbers = _floats(words)
            if kind == "M":
                self.lift(closed=False)
                self.start = self.here = _bounded(
                    complex(numbers[0], numbers[1]) + (self.here if relative else 0j)
                )
                numbers = numbers[2:]
            if numbers:
                self._straight(kind, relative, numbers)

    def arc(self, radii: complex, turn: float, flags: int, to: complex, relative: bool) -> None:
        """One arc; without a radius it is a line, and nothing when it ends where it starts."""
        end = _bounded(to + self.here if relative else to)
        if not max(abs(radii.real), abs(radii.imag), abs(turn)) <= MAX_NUMBER:
            raise DrawingError("path data have an arc out of all bounds")
        if radii.real == 0.0 or radii.imag == 0.0 or end == self.here:
            self._to([end])
            return
        angle = math.radians(math.fmod(turn, 360.0))
        self._add(arc_between(self.here, end, radii, angle, flags))
        self.here = end

    def lift(self, *, closed: bool) -> None:
        """Ends the subpath, if one is begun; the pen stands at its start when it is closed."""
        self._flush()
        if self.items:
            self.done.append((self.start, self.items, closed))
            self.items = []
        if closed:
            self.here = self.start
        else:
            self.start = self.here

    def subpaths(self) -> list[Subpath]:
        """All that was drawn."""
        curves = _beziers(" ".join(self.text)) if self.text else []
        found: list[Subpath] = []
        used = 0
        for start, items, closed in self.done:
            segments: list[Segment] = []
            for item in items:
                if isinstance(item, int):
                    segments += curves[used : used + item]
                    used += item
                else:
                    segments.append(item if isinstance(item, Arc) else Lines(_pairs(item)))
            found.append(Subpath(_pair(start), tuple(segments), closed))
        return found

    def _straight(self, kind: str, relative: bool, n: list[float]) -> None:
        """L, H, V, and the pairs after the first one of M."""
        if kind == "H":
            rest = self.here.imag if not relative else 0.0
            ends = [complex(x, rest) for x in n]
        elif kind == "V":
            rest = self.here.real if not relative else 0.0
            ends = [complex(rest, y) for y in n]
        else:
            ends = list(map(complex, n[::2], n[1::2]))
        if relative:
            ends = list(accumulate(ends, initial=self.here))[1:]
        self._to(ends)

    def _to(self, ends: list[complex]) -> None:
        self.corners += ends
        self.here = _bounded(ends[-1])

    def _curve(self, letter: str, words: list[str]) -> None:
        """C, S, Q, T: counted here, made by svgpathtools."""
        count = _COUNTS[letter.upper()]
        numbers = _floats(words)
        xs, ys = numbers[count - 2 :: count], numbers[count - 1 :: count]
        ends = list(map(complex, xs, ys))
        if letter.islower():
            ends = list(accumulate(ends, initial=self.here))[1:]
        self._flush()
        if self.items and isinstance(self.items[-1], int):
            self.items[-1] += len(ends)
        else:
            self.items.append(len(ends))
            self.text.append(f"M {self.here.real!r} {self.here.imag!r}")
        self.text.append(letter)
        self.text += words
        self.here = _bounded(ends[-1])

    def _add(self, item: Arc) -> None:
        self._flush()
        self.items.append(item)

    def _flush(self) -> None:
        if self.corners:
            self.items.append(self.corners)
            self.corners = []


def _beziers(text: str) -> list[Bezier]:
    """The curves of checked data, in order."""
    import svgpathtools

    return [Bezier(_pairs(curve.bpoints()[1:])) for curve in svgpathtools.parse_path(text)]


def _floats(words: list[str]) -> list[float]:
    numbers = list(map(float, words))
    if not (max(numbers) <= MAX_NUMBER and min(numbers) >= -MAX_NUMBER):
        raise DrawingError(f"path data have {max(numbers, key=abs):g}, out of all bounds")
    return numbers


def _bounded(place: complex) -> complex:
    """The place itself; relative steps may have added up to one beyond all bounds."""
    if not (abs(place.real) <= MAX_NUMBER and abs(place.imag) <= MAX_NUMBER):
        raise DrawingError("path data run out of all bounds")
    return place


def _pair(z: complex) -> Floats:
    return np.array([z.real, z.imag])


def _pairs(points: list[complex] | tuple[complex, ...]) -> Floats:
    return np.array(points, dtype=np.complex128).view(np.float64).reshape(-1, 2)
