"""A reader of programs for mills of the Fanuc kind, written from the manuals alone: it shares no
code with the dialect iso and follows none of its files.

run(data, control)    the steps of a program: moves, and what is switched between them

Facts are those of Fanuc's operator's manual for Series 0i and 30i (preparatory functions, decimal
point programming, feed functions, canned cycles, reference position return), of Haas's Mill
Operator's Manual (settings 77 and 162), and of the chapter on codes of Using Mach3Mill. What they
leave to the machine's builder is a field of `Control`.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from camtool.records import replace

Place = tuple[float, float, float]
INCH_MM = 25.4


@dataclass(frozen=True)
class Control:
    """What differs between controllers, and between machines with the same one.

    A number without a decimal point counts `least_mm` or `least_inch`, or its own units where
    these are 1; F without one counts `feed_mm` or `feed_inch`; a dwell P without one `dwell_s`
    seconds. `has_arc_modes`: G90.1 and G91.1 say what I, J and K are. `reference` is the machine's
    zero in the coordinates of the part; `whole` the addresses that may have
    no decimal point; `back_mm` the retreat of G73 and the distance above its
    last depth at which G83 begins to feed.
    """

    least_mm: float = 1.0
    least_inch: float = 1.0
    feed_mm: float = 1.0
    feed_inch: float = 1.0
    dwell_s: float = 1.0
    has_arc_modes: bool = False
    whole: str = ""
    reference: Place = (0.0, 0.0, 300.0)
    back_mm: float = 0.5


FANUC = Control(
    least_mm=0.001,
    least_inch=0.0001,
    feed_inch=0.01,  # 1 mm/min and 0.01 inch/min: the table of feeds per minute
    dwell_s=0.001,
    whole="GMNOPSTH",  # no others than lengths and F are in the list of decimal point programming
)
HAAS = Control(
    least_mm=0.001,
    least_inch=0.0001,
    feed_mm=0.001,  # settings 77 and 162 at their defaults
    feed_inch=0.0001,
    dwell_s=0.001,
    whole="MNOSTH",
    back_mm=1.27,
)
MACH3 = Control(has_arc_modes=True)

_MODES: Mapping[str, tuple[float, ...]] = {
    "motion": (0, 1, 2, 3, 73, 80, 81, 82, 83, 84, 85, 86, 89),
    "plane": (17, 18, 19),
    "distance": (90, 91),
    "centres": (90.1, 91.1),
    "feeds": (93, 94, 95),
    "units": (20, 21),
    "radius": (40,),
    "length": (43, 49),
    "back": (98, 99),
    "frame": (54, 55, 56, 57, 58, 59),
}
"""Groups of modal G codes: a code holds until another one of its group."""

_AT_ONCE = (4.0, 28.0, 53.0)
"""Codes that hold in their block alone."""

_GROUPS = {float(code): group for group, codes in _MODES.items() for code in codes}
_CYCLES = (73.0, 81.0, 82.0, 83.0, 84.0, 85.0, 86.0, 89.0)
_LENGTHS = "XYZIJKRQ"
_SWITCHES = {
    3.0: "spindle cw",
    4.0: "spindle ccw",
    5.0: "spindle off",
    7.0: "mist",
    8.0: "flood",
    9.0: "dry",
}
_PLANES = {17.0: (0, 1, 2), 18.0: (2, 0, 1), 19.0: (1, 2, 0)}
_WORD = re.compile(r"([A-Z])([+-]?(?:\d+\.?\d*|\.\d+))")


@dataclass(frozen=True)
class Step:
    """A move ("rapid", "line", "cw", "ccw") or an event: where it ends, mm; the points of its path
    without the start; its feed, mm/min; the centre of an arc; the value of an event."""

    kind: str
    end: Place
    points: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))
    feed: float = math.nan
    centre: Place | None = None
    value: float = math.nan

    @property
    def is_move(self) -> bool:
        return self.kind in ("rapid", "line", "cw", "ccw")


def run(data: bytes, control: Control) -> list[Step]:
    """The steps of a program; ValueError names the line that the manual does not know."""
    reader, steps = _Reader(control), list[Step]()
    for number, line in enumerate(_blocks(data.decode("ascii")), start=1):
        try:
            steps += reader.block(_words(line))
        except ValueError as error:
            raise ValueError(f"line {number}: {line}: {error}") from error
        if reader.has_ended:
            break
    if not reader.has_ended:
        raise ValueError("no M2 or M30")
    return steps


def _blocks(text: str) -> Iterator[str]:
    """Lines between the two marks %, without comments; what is before the first mark is leader."""
    lines = text.replace("\r\n", "\n").split("\n")
    marks = [k for k, line in enumerate(lines) if line.strip() == "%"]
    if marks:
        yield from [""] * (marks[0] + 1)
        lines = lines[marks[0] + 1 : marks[1] if len(marks) > 1 else None]
    for line in lines:
        bare = re.sub(r"\([^()]*\)", "", line)
        if re.search(r"[()%]", bare):
            raise ValueError(f"{line}: control in or out alone")
        yield bare


def _words(line: str) -> list[tuple[str, str]]:
    text = line.replace(" ", "").replace("\t", "")
    words = [(word[1], word[2]) for word in _WORD.finditer(text)]
    if "".join(letter + number for letter, number in words) != text:
        raise ValueError("not a row of words")
    return words


class _Reader:
    """A controller that has been switched on: its modes, and where its tool is."""

    def __init__(self, control: Control) -> None:
        self.control, self.has_ended = control, False
        self.modes = {"motion": 1.0, "plane": 17.0, "distance": 90.0, "feeds": 94.0, "back": 98.0}
        self.modes |= {"units": 21.0, "centres": 91.1}
        self.place = np.zeros(3)
        self.feed, self.tool, self.speed = math.nan, math.nan, math.nan
        self.level = 0.0  # the height at which a row of cycles began
        self.cycle: dict[str, float] = {}

    # Words.

    def block(self, words: list[tuple[str, str]]) -> Iterator[Step]:
        """Yield what a block does, in the manual's order: F, S and T, switches on, dwell, modes,
        moves, switches off, end."""
        words = [word for word in words if word[0] not in "NO"]
        codes = [float(text) for letter, text in words if letter == "G"]
        switches = [float(text) for letter, text in words if letter == "M"]
        texts = {letter: text for letter, text in words if letter not in "GM"}
        if len(texts) != sum(letter not in "GM" for letter, _ in words):
            raise ValueError("an address twice")
        at_once = self._set_modes(codes)
        values = {letter: self._value(letter, text, at_once) for letter, text in texts.items()}
        self.feed = values.pop("F", self.feed)
        self.tool, self.speed = values.pop("T", self.tool), values.pop("S", self.speed)
        for code in switches:
            if code == 6.0:
                yield self._event("tool", self.tool)
            elif code in (3.0, 4.0):
                yield self._event(_SWITCHES[code], self.speed)
            elif code in _SWITCHES:
                yield self._event(_SWITCHES[code])
            elif code in (2.0, 30.0):
                self.has_ended = True
            else:
                raise ValueError(f"M{code:g}")
        if "length" in {_GROUPS.get(code) for code in codes}:
            values.pop("H", None)  # lengths of 0: G43 moves nothing
        if at_once == 4.0:
            yield self._event("dwell", values.pop("P", 0.0))
        elif at_once == 28.0:
            yield from self._to_reference(values)
        elif values:
            yield from self._move(values, at_once == 53.0)
        if values:
            raise ValueError(f"nothing takes {' '.join(values)}")

    def _set_modes(self, codes: list[float]) -> float | None:
        groups = [_GROUPS.get(code) for code in codes]
        named = [group for group in groups if group is not None]
        if len(set(named)) != len(named):
            raise ValueError("two codes of one group")
        single = [code for code in codes if code not in _GROUPS]
        if len(single) > 1 or not set(single) <= set(_AT_ONCE):
            raise ValueError(f"codes {single}")
        for code, group in zip(codes, groups, strict=True):
            if group == "centres" and not self.control.has_arc_modes:
                raise ValueError(f"G{code:g}")
            if group == "motion":
                begins = code in _CYCLES and self.modes["motion"] not in _CYCLES
                self.level = float(self.place[2]) if begins else self.level
                self.cycle = {} if code not in _CYCLES else self.cycle
            if group is not None:
                self.modes[group] = code
        return single[0] if single else None

    def _value(self, letter: str, text: str, at_once: float | None) -> float:
        """A number by the rule for its address: with a decimal point it is in mm, inches or
        seconds; without one it counts least increments."""
        value, control, has_point = float(text), self.control, "." in text
        inches = self.modes["units"] == 20.0
        if has_point and letter in control.whole:
            raise ValueError(f"a decimal point behind {letter}")
        if letter in _LENGTHS and at_once != 4.0:
            least = control.least_inch if inches else control.least_mm
            return value * (1.0 if has_point else least) * (INCH_MM if inches else 1.0)
        if letter == "F":
            least = control.feed_inch if inches else control.feed_mm
            return value * (1.0 if has_point else least) * (INCH_MM if inches else 1.0)
        if letter == "P":
            return value * (1.0 if has_point else control.dwell_s)
        if letter in "STH":
            return value
        raise ValueError(f"address {letter}")

    def _event(self, kind: str, value: float = math.nan) -> Step:
        return Step(kind, _place(self.place), value=value)

    # Moves.

    def _target(self, values: dict[str, float]) -> np.ndarray:
        target = self.place.copy()
        for axis, letter in enumerate("XYZ"):
            if letter in values:
                given = values.pop(letter)
                target[axis] = given + (target[axis] if self.modes["distance"] == 91.0 else 0.0)
        return target

    def _to(self, kind: str, target: np.ndarray) -> Step:
        self.place = target.copy()
        feed = math.nan if kind == "rapid" else self.feed
        return Step(kind, _place(target), target[None, :].copy(), feed)

    def _to_reference(self, values: dict[str, float]) -> Iterator[Step]:
        """By way of the point that is given, those axes alone, to the reference position."""
        axes = [axis for axis, letter in enumerate("XYZ") if letter in values]
        yield self._to("rapid", self._target(values))
        home = self.place.copy()
        home[axes] = np.array(self.control.reference)[axes]
        yield self._to("rapid", home)

    def _move(self, values: dict[str, float], of_machine: bool) -> Iterator[Step]:
        motion = self.modes["motion"]
        if of_machine:
            if motion not in (0.0, 1.0) or self.modes["distance"] != 90.0:
                raise ValueError("G53 is for G0, G1 and G90")
            target = self.place.copy()
            for axis, letter in enumerate("XYZ"):
                if letter in values:
                    target[axis] = values.pop(letter) + self.control.reference[axis]
            yield self._to("rapid" if motion == 0.0 else "line", target)
        elif motion == 0.0:
            yield self._to("rapid", self._target(values))
        elif motion == 1.0:
            yield self._to("line", self._target(values))
        elif motion in (2.0, 3.0):
            yield self._arc(values, "cw" if motion == 2.0 else "ccw")
        elif motion in _CYCLES:
            yield from self._hole(values, motion)
        else:
            raise ValueError("no motion is in force")

    def _arc(self, values: dict[str, float], kind: str) -> Step:
        start, end = self.place.copy(), self._target(values)
        first, second, third = _PLANES[self.modes["plane"]]
        sign = 1.0 if kind == "ccw" else -1.0
        if "R" in values:
            centre = _centre_of(start, end, values.pop("R"), sign, (first, second))
        else:
            offset = np.array([values.pop(letter, 0.0) for letter in "IJK"])
            is_place = self.modes["centres"] == 90.1
            centre = offset if is_place else start + offset
        out, to = start - centre, end - centre
        radii = [math.hypot(each[first], each[second]) for each in (out, to)]
        if radii[0] == 0.0:
            raise ValueError("an arc without a radius")
        a, b = (math.atan2(each[second], each[first]) for each in (out, to))
        sweep = (sign * (b - a)) % (2.0 * math.pi)
        if start[first] == end[first] and start[second] == end[second]:
            sweep = 2.0 * math.pi
        share = np.linspace(0.0, 1.0, max(4, math.ceil(sweep / 0.2)) + 1)[1:]
        points = np.empty((len(share), 3))
        radius = radii[0] + (radii[1] - radii[0]) * share
        points[:, first] = centre[first] + radius * np.cos(a + sign * sweep * share)
        points[:, second] = centre[second] + radius * np.sin(a + sign * sweep * share)
        points[:, third] = start[third] + (end[third] - start[third]) * share
        return replace(self._to(kind, end), points=points, centre=_place(centre))

    def _hole(self, values: dict[str, float], motion: float) -> Iterator[Step]:
        """A canned cycle: over the hole at the height where the tool is, down to R, in, and out to
        the height where the cycles began (G98) or to R (G99)."""
        is_relative = self.modes["distance"] == 91.0
        over = self._target({k: v for k, v in values.items() if k in "XY"})
        self.cycle |= values
        values.clear()
        level = self.cycle["R"] + (self.level if is_relative else 0.0)
        bottom = self.cycle["Z"] + (level if is_relative else 0.0)
        at = lambda z: np.array([over[0], over[1], z])  # noqa: E731
        yield self._to("rapid", at(self.place[2]))
        yield self._to("rapid", at(level))
        if motion in (73.0, 83.0):
            depth, bite, back = level, self.cycle["Q"], self.control.back_mm
            if not bite > 0.0:
                raise ValueError("no Q")
            while depth > bottom:
                if depth < level:
                    yield self._to("rapid", at(min(depth + back, level)))
                depth = max(depth - bite, bottom)
                yield self._to("line", at(depth))
                if motion == 83.0 and depth > bottom:
                    yield self._to("rapid", at(level))
        else:
            yield self._to("line", at(bottom))
        if motion in (82.0, 89.0) and "P" in self.cycle:
            yield self._event("dwell", self.cycle["P"])
        if motion in (84.0, 85.0, 89.0):
            yield self._to("line", at(level))
        top = level if self.modes["back"] == 99.0 else max(level, self.level)
        yield self._to("rapid", at(top))


def _place(values: np.ndarray) -> Place:
    return (float(values[0]), float(values[1]), float(values[2]))


def _centre_of(
    start: np.ndarray, end: np.ndarray, radius: float, sign: float, axes: tuple[int, int]
) -> np.ndarray:
    """The centre of an arc by R: the shorter arc where R is positive, the longer where it is
    negative. A whole circle has none."""
    first, second = axes
    chord = (end - start)[[first, second]]
    length = math.hypot(*chord)
    if length == 0.0:
        raise ValueError("a circle cannot be said by R")
    if length > 2.0 * abs(radius) + 0.01:
        raise ValueError("R is less than half the way")
    height = math.sqrt(max(radius * radius - length * length / 4.0, 0.0))
    aside = sign * math.copysign(height, radius) / length
    centre = start.copy()
    centre[first] += chord[0] / 2.0 - chord[1] * aside
    centre[second] += chord[1] / 2.0 + chord[0] * aside
    return centre
