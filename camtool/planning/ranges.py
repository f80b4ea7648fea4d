"""What the numbers and words of a job may be: OptionError with the mend for all others."""

from __future__ import annotations

import math
from collections.abc import Sequence

from camtool.errors import OptionError


def above_zero(name: str, value: float | None, unit: str) -> None:
    """Refuse a number that is given (not None) and not above 0."""
    if value is not None and not (math.isfinite(value) and value > 0.0):
        raise OptionError(
            f"{name} {value:g} {unit}".rstrip() + " is not above 0",
            mend=f"give a {name} above 0, or leave it out",
        )


def all_above_zero(name: str, values: Sequence[float], unit: str = "") -> None:
    """Refuse numbers of which one is not above 0."""
    for value in values:
        above_zero(name, value, unit)


def at_least_zero(name: str, value: float, unit: str) -> None:
    """Refuse a number below 0."""
    if not (math.isfinite(value) and value >= 0.0):
        raise OptionError(
            f"{name} {value:g} {unit}".rstrip() + " is not 0 or more",
            mend=f"give a {name} of 0 or more",
        )


def finite(name: str, value: float, unit: str) -> None:
    """Refuse what is no number."""
    if not math.isfinite(value):
        raise OptionError(f"{name} {value:g} {unit} is no number", mend=f"give a {name}")


def one_of(name: str, value: str, known: Sequence[str]) -> None:
    """Refuse a word that is not known."""
    if value not in known:
        raise OptionError(f"unknown {name} {value!r}", mend=f"use one of {', '.join(known)}")
