"""Stepped lines event by event, in whole numbers and fractions."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction


def steps_of_line(count: int, size: int, phase: int, events: int) -> list[int]:
    """Steps of the minor axis after j = 0 … count − 1 events, by the controllers' counter."""
    steps, counter, taken = [], phase, 0
    for _ in range(count):
        steps.append(taken)
        counter += 2 * size
        while counter >= 2 * events:
            counter -= 2 * events
            taken += 1
    return steps


def sums_of_line(count: int, size: int, phase: int, events: int) -> tuple[int, ...]:
    """Σ 1, Σ j, Σ j², Σ u, Σ u² and Σ j u with u = N t − a j."""
    steps = steps_of_line(count, size, phase, events)
    teeth = [events * taken - size * j for j, taken in enumerate(steps)]
    places = range(count)
    return (
        count,
        sum(places),
        sum(j * j for j in places),
        sum(teeth),
        sum(u * u for u in teeth),
        sum(j * u for j, u in zip(places, teeth, strict=True)),
    )


def values_of_line(
    steps: Sequence[int], along: float, across: float, level: float
) -> list[Fraction]:
    """Return along·j + across·t_j + level, exactly."""
    return [
        Fraction(along) * j + Fraction(across) * taken + Fraction(level)
        for j, taken in enumerate(steps)
    ]
