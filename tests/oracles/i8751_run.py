"""The i8751 controller, pulse by pulse, in plain Python.

From the thesis's listing of its delay (L3126-3144), the rules of its ramp (L3197-3245) and of its
routines RUT1, RUT2 and GIRA1 (L4683-4742, L4768-4873). Nothing here is shared with `camtool`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache

CRYSTAL_HZ = 12e6


@cache
def listing_periods(x: int) -> int:
    """Periods of the crystal that the delay routine takes, instruction by instruction."""
    periods = 12  # MOV R0,#0AAH
    r0 = 0xAA
    while True:
        periods += 12 + 12  # NOP; MOV R1,X
        r1 = x
        while True:
            periods += 12 + 24  # NOP; DJNZ R1
            r1 -= 1
            if r1 == 0:
                break
        periods += 24  # DJNZ R0
        r0 -= 1
        if r0 == 0:
            break
    return periods + 24  # RET


@dataclass
class Reading:
    """A reading of the thesis."""

    bursts: bool = False
    repeats: bool = False
    declared: bool = False
    counted: bool = False
    start: int = 242
    flows: bool = False

    def delay_s(self, x: int) -> float:
        """Seconds of a delay X."""
        x = max(x, 1)
        return (listing_periods(x) if self.counted else 6156 * x + 10272) / CRYSTAL_HZ

    def ramp_s(self, k: int) -> float:
        """Seconds of the k-th pulse of a ramp, from 0; the 45th is the cruise."""
        if not self.declared:
            return self.delay_s(self.start - 5 * k)
        first, last = self.delay_s(self.start), 1.0 / 70.0
        return first + (last - first) * k / 45

    def delays_s(self, pulses: int) -> list[float]:
        """The delay after each pulse of one run of a routine."""
        if self.bursts and pulses > 255:
            return self.delays_s(255) + self.delays_s(pulses - 255)
        if pulses < 90:
            return [self.ramp_s(0)] * pulses
        up = [self.ramp_s(k) for k in range(45)]
        return up + [self.ramp_s(45)] * (pulses - 90) + up[::-1]


@dataclass
class Done:
    """The motion of one record: the places (steps) after each pulse that moved something, and its
    seconds."""

    places: list[tuple[int, int, int]] = field(default_factory=list)
    seconds: float = 0.0


def record(at: tuple[int, int, int], steps: tuple[int, int, int], how: Reading) -> Done:
    """Run a record of steps from `at`: X and Y, then Z."""
    done, here = Done(), list(at)
    sense = [1 if count > 0 else -1 for count in steps]
    left = [abs(count) for count in steps]
    lost = [1 if how.repeats and count else 0 for count in left]

    def pulse(*axes: int) -> None:
        moved = False
        for axis in axes:
            if lost[axis]:
                lost[axis] -= 1
            else:
                here[axis] += sense[axis]
                left[axis] -= 1
                moved = True
        if moved:
            done.places.append((here[0], here[1], here[2]))

    together = 0
    while left[0] + lost[0] and left[1] + lost[1]:
        pulse(0, 1)
        together += 1
    alone = 0
    for axis in (0, 1):
        while left[axis] + lost[axis]:
            pulse(axis)
            alone += 1
    rises = 0
    while left[2] + lost[2]:
        pulse(2)
        rises += 1
    runs = [together + alone, rises] if how.flows else [together, alone, rises]
    done.seconds = sum(sum(how.delays_s(run)) for run in runs)
    return done
