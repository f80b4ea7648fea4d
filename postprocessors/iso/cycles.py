"""Reading cycles of holes: which code each template of the machine file has, what its letters say,
and the moves that a controller makes of a hole."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

from msgspec import Struct

from camtool import bounds
from camtool.toolpath.moves import Kind

from ..gcode.faults import LineFault
from ..gcode.part_moves import PartMoves, too_many
from .dialect import CYCLE_FIELDS, CycleFormat, IsoDialect
from .lines import pattern_of

KINDS: Final = tuple(name for name in CYCLE_FIELDS if name not in ("again", "end"))

ENOUGH_MM: Final = 1e-9
"""A bite that ends so near to the bottom ends there."""


class CycleWords(Struct):
    """A cycle: the kind of hole that it makes, the meaning of its letters, and their numbers in
    force."""

    kind: str
    letters: dict[str, str]
    values: dict[str, float]


def cycles_of(dialect: IsoDialect) -> dict[int, CycleWords]:
    """Return the cycles of a dialect, keyed by ten times their G code."""
    cycles = {}
    for kind in KINDS:
        template: str = getattr(dialect.cycles, kind)
        code = cycle_code(template)
        if code is not None:
            letters = {letter: name for name, letter in pattern_of(template)[1] if letter}
            cycles[code] = CycleWords(kind, letters, {})
    return cycles


def cycle_code(template: str) -> int | None:
    """Return ten times the G code by which a template is recognised, one of 73 to 89; None without
    such a code."""
    codes = [round(float(code) * 10.0) for code in re.findall(r"G(\d+(?:\.\d)?)", template)]
    return next((code for code in codes if 730 <= code < 900 and code != 800), None)


class HoleMoves(Struct, frozen=True):
    """Adds the moves of holes to a path, as the controller makes them."""

    moves: PartMoves
    shift: Sequence[float]
    format: CycleFormat
    returns_high: bool

    def rapid(self, x: float, y: float, z: float) -> None:
        """Add a rapid to this place, unless the tool is there already."""
        place = self._part(x, y, z)
        if place != self.moves.path.position:
            self.moves.rapid(*place)

    def line(self, x: float, y: float, z: float) -> None:
        """Add a cut at the feed to this place."""
        self.moves.line(*self._part(x, y, z))

    def _part(self, x: float, y: float, z: float) -> tuple[float, float, float]:
        return x + self.shift[0], y + self.shift[1], z + self.shift[2]


def run_hole(hole: HoleMoves, cycle: CycleWords, at: tuple[float, float], height: float) -> None:
    """Add the moves of one hole at `at`; the tool comes to it at Z `height`."""
    x, y = at
    bottom, level = cycle.values["z"], cycle.values["r"]
    out = max(height, level) if hole.returns_high else level
    if height < level:
        hole.rapid(*_xy(hole), level)
    hole.rapid(x, y, max(height, level))
    hole.rapid(x, y, level)
    if cycle.kind in ("peck", "chip"):
        _peck(hole, cycle, at)
    else:
        hole.line(x, y, bottom)
    if cycle.kind == "dwell" and cycle.values.get("s", 0.0) > 0.0:
        hole.moves.path.event(Kind.DWELL, cycle.values["s"])
    if cycle.kind in ("bore", "tap"):
        hole.line(x, y, level)
    hole.rapid(x, y, out)


def _peck(hole: HoleMoves, cycle: CycleWords, at: tuple[float, float]) -> None:
    """Add the moves down to the bottom by pecks, with a retract to R between them (G83) or a short
    one that breaks the chip (G73)."""
    x, y = at
    bottom, level, bite = cycle.values["z"], cycle.values["r"], cycle.values["q"]
    if (level - bottom) / bite > bounds.MAX_MOVES:
        raise LineFault(too_many("the bites of this cycle"), None, bounds.SPLIT_PROGRAM)
    depth = level
    while depth - bottom > ENOUGH_MM:
        last, depth = depth, max(bottom, depth - bite)
        if depth - bottom <= ENOUGH_MM:
            depth = bottom
        if last < level:
            if cycle.kind == "peck":
                hole.rapid(x, y, level)
                hole.rapid(x, y, min(level, last + hole.format.clearance_mm))
            else:
                hole.rapid(x, y, min(level, last + hole.format.chip_mm))
        hole.line(x, y, depth)


def _xy(hole: HoleMoves) -> tuple[float, float]:
    x, y, _ = hole.moves.path.position
    return x - hole.shift[0], y - hole.shift[1]
