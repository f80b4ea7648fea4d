"""Sums, largest and smallest numbers, of parts of arrays.

They are taken in no certain order, so that the processor takes several numbers at once: only this
module is compiled so, and its numbers must be finite.
"""

from __future__ import annotations

from camtool.arrays import Floats


def total(values: Floats, low: int, high: int) -> float:
    """The sum of values[low:high]."""
    found = 0.0
    for k in range(low, high):
        found += values[k]
    return found


def square_total(values: Floats, low: int, high: int) -> float:
    """The sum of the squares of values[low:high]."""
    found = 0.0
    for k in range(low, high):
        found += values[k] * values[k]
    return found


def largest(values: Floats, low: int, high: int) -> float:
    """The largest of values[low:high], of which there is one at least."""
    found = values[low]
    for k in range(low, high):
        found = values[k] if values[k] > found else found
    return float(found)


def smallest(values: Floats, low: int, high: int) -> float:
    """The smallest of values[low:high], of which there is one at least."""
    found = values[low]
    for k in range(low, high):
        found = values[k] if values[k] < found else found
    return float(found)
