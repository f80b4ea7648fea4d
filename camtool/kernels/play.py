"""The play of an axis (backlash), and what the controller issues against it.

The slide sits between two flanks of the nut: with the motor at m (mm) it can only be in
[m + low, m + high], high − low = play, and it moves only when a flank takes it along:

    s_k = min(max(s_{k−1}, m_k + low), m_k + high)          (the play operator)

Before the first motion s = m. "preloaded" in + : the flank that pushes towards + touches, low = 0,
high = play; in − : low = −play, high = 0. "centred": low = −play/2, high = +play/2. The two
differ by half the play, and by nothing else.

Compensation is the controller's own policy: whenever the commanded direction of an axis changes,
it issues so much more in the new direction before the step itself; that moves the motor, not the
controller's position. A first motion against the direction that the axis is believed to be
engaged in counts as a change. (Thesis of the PIC18F8720, L1707-1709, L1774-1778.)

An axis has reversed when it came back by half a coded step from the furthest that it went in its
direction: rounding of positions in mm must not make a reversal, and any step does.

Positions, compensation and the half step are in one unit, mm or steps; `scale` makes it mm.

Exact, because the slide is either left alone or set to (position + added) · scale + flank, where
`added` is 0 or one compensation, in the direction that is not the first one: nothing is summed
up, and cutting the samples into blocks changes no bit. The operator does not depend on the rate,
so a monotone burst of compensation steps acts as its last one. Compiled, because every position
depends on the one before.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from camtool.kernels.compiled import bare, kernel
from camtool.kernels.deviates import deviate

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]


def play_limits(play_mm: float, convention: str, direction: int) -> tuple[float, float]:
    """(low, high) in mm for "preloaded" in `direction` ±1 or "centred"."""
    if convention == "centred":
        return -0.5 * play_mm, 0.5 * play_mm
    return (0.0, play_mm) if direction > 0 else (-play_mm, 0.0)


def play_start(position: float, scale: float, direction: int) -> Floats:
    """The state (6,) of an axis at rest at `position`, engaged in `direction` ±1.

    Furthest position in the present direction, that direction, compensation added so far, slide
    in mm; reversals so far and shift in mm, where the axis scatters.
    """
    return np.array([position, direction, 0.0, position * scale, 0.0, 0.0], dtype=np.float64)


@bare
def turned(
    position: float, furthest: float, direction: float, least: float
) -> tuple[float, float, bool]:
    """The new furthest position and direction, and whether the axis has reversed."""
    ahead = (position - furthest) * direction
    if ahead >= 0.0:
        return position, direction, False
    if ahead <= -least:
        return position, -direction, True
    return furthest, direction, False


@bare
def taken_along(slide: float, motor: float, low: float, high: float) -> float:
    """The play operator: the slide after the motor went to `motor` mm without turning round."""
    return min(max(slide, motor + low), motor + high)


@kernel
def play_fill(
    positions: Floats, offsets: Ints, axes: Floats, states: Floats, out: Floats, turns: Ints
) -> None:
    """Slides in mm, `out` (n, 3), for commanded `positions` (n, 3); reversals of each run.

    `axes` (3, 5): scale, low and high in mm, compensation, and how far back is a reversal.
    `states` (3, 6), each of `play_start`, are changed in place, so that the next call goes on.
    Run r is offsets[r]:offsets[r+1]; `turns` (R, 3) are its reversals.
    """
    for axis in range(3):
        scale, low, high = axes[axis, 0], axes[axis, 1], axes[axis, 2]
        compensation, least = axes[axis, 3], axes[axis, 4]
        furthest, direction = states[axis, 0], states[axis, 1]
        added, slide = states[axis, 2], states[axis, 3]
        for run in range(len(turns)):
            count = 0
            for k in range(offsets[run], offsets[run + 1]):
                position = positions[k, axis]
                furthest, direction, reversed_ = turned(position, furthest, direction, least)
                if reversed_:
                    added += direction * compensation
                    count += 1
                slide = taken_along(slide, (position + added) * scale, low, high)
                out[k, axis] = slide
            turns[run, axis] = count
        states[axis, 0], states[axis, 1] = furthest, direction
        states[axis, 2], states[axis, 3] = added, slide


@kernel
def play_varied_fill(
    positions: Floats,
    offsets: Ints,
    axes: Floats,
    states: Floats,
    plays: Floats,
    shares: Floats,
    scatter: Floats,
    seed: int,
    out: Floats,
    turns: Ints,
) -> None:
    """As `play_fill`, with a play for each sample and axes that scatter.

    `plays` (n, 3) mm take the place of low and high in `axes`, which are shares (2,) of them. At
    each reversal both flanks of an axis go to a new random place, `scatter` (3,) mm is its
    standard deviation; the first ones are at 0.
    """
    for axis in range(3):
        scale, compensation, least = axes[axis, 0], axes[axis, 3], axes[axis, 4]
        furthest, direction = states[axis, 0], states[axis, 1]
        added, slide = states[axis, 2], states[axis, 3]
        number, shift = int(states[axis, 4]), states[axis, 5]
        for run in range(len(turns)):
            before = number
            for k in range(offsets[run], offsets[run + 1]):
                position = positions[k, axis]
                furthest, direction, reversed_ = turned(position, furthest, direction, least)
                if reversed_:
                    added += direction * compensation
                    shift = scatter[axis] * deviate(seed, axis, number)
                    number += 1
                play = plays[k, axis]
                motor = (position + added) * scale + shift
                slide = taken_along(slide, motor, shares[0] * play, shares[1] * play)
                out[k, axis] = slide
            turns[run, axis] = number - before
        states[axis, 0], states[axis, 1] = furthest, direction
        states[axis, 2], states[axis, 3] = added, slide
        states[axis, 4], states[axis, 5] = number, shift
