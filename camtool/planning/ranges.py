"""What the numbers and words of a job may be: OptionError with the mend for all others."""

from __future__ import annotations

import math
from collections.abc import Sequence

from camtool.errors import OptionError

MOST = {"mm": 1e5, "mm/min": 1e7, "rev/min": 1e7, "s": 1e6, "rad": 1e6, "": 1e6}
"""The most that a number of this unit may be, as in `camtool.machine.ranges`: 100 m, 167 m/s,
eleven days; and a million of what has no unit."""

LEAST = 1e-6
"""The least that a number above 0 may be, of any unit: a nanometre."""

MOST_WIDE_MM = 1000.0
"""No tool is wider than a metre, and nothing more is left on a wall."""

FARTHEST_MM = 1e9
"""Places in a drawing lie no farther from its zero (a thousand kilometres: maps do)."""

MOST_MOVES = 1_000_000
"""Passes, pecks and laps that make more moves than this of a drawing are taken as a mistake: a
program of some 25 MB."""


def above_zero(name: str, value: float | None, unit: str, most: float | None = None) -> None:
    """Refuse a number that is given (not None) and not above 0, or not plausible."""
    if value is None:
        return
    if not (math.isfinite(value) and value > 0.0):
        raise OptionError(
            f"{_said(name, value, unit)} is not above 0",
            mend=f"give a {name} above 0, or leave it out",
        )
    if value < LEAST:
        raise OptionError(
            f"{_said(name, value, unit)} is less than {LEAST:g}", mend=f"give a larger {name}"
        )
    _at_most(name, value, unit, most)


def all_above_zero(name: str, values: Sequence[float], unit: str = "") -> None:
    """Refuse numbers of which one is not above 0, or not plausible."""
    for value in values:
        above_zero(name, value, unit)


def at_least_zero(name: str, value: float, unit: str, most: float | None = None) -> None:
    """Refuse a number below 0, or not plausible."""
    if not (math.isfinite(value) and value >= 0.0):
        raise OptionError(
            f"{_said(name, value, unit)} is not 0 or more",
            mend=f"give a {name} of 0 or more",
        )
    _at_most(name, value, unit, most)


def finite(name: str, value: float, unit: str, most: float | None = None) -> None:
    """Refuse what is no number, or not plausible."""
    if not math.isfinite(value):
        raise OptionError(f"{_said(name, value, unit)} is no number", mend=f"give a {name}")
    _at_most(name, abs(value), unit, most)


def refuse_endless(moves: float, where: str, asked: str, mend: str) -> None:
    """OptionError when so many moves are estimated to come of what was `asked`, such as
    "10000 passes"."""
    if moves > MOST_MOVES:
        raise OptionError(
            f"{asked} would make {moves:.3g} moves, more than {MOST_MOVES:,}",
            where=where,
            mend=mend,
        )


def _at_most(name: str, value: float, unit: str, most: float | None) -> None:
    limit = MOST[unit] if most is None else most
    if value > limit:
        raise OptionError(
            f"{_said(name, value, unit)} is more than {limit:g}", mend=f"give a smaller {name}"
        )


def _said(name: str, value: float, unit: str) -> str:
    return f"{name} {value:g} {unit}".rstrip()


def one_of(name: str, value: str, known: Sequence[str]) -> None:
    """Refuse a word that is not known."""
    if value not in known:
        raise OptionError(f"unknown {name} {value!r}", mend=f"use one of {', '.join(known)}")
