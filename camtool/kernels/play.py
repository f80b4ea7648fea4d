"""The play of an axis (backlash), and what the controller issues against it.

The slide sits between two flanks of the nut: with the motor at m (mm) it can only be in
[m + low, m + high], high − low = play, and it moves only when a flank takes it along:

    s_k = min(max(s_{k−1}, m_k + low), m_k + high)          (the play operator)

Before the first motion s = m. "preloaded" in + : the flank that pushes towards + touches, low = 0,
high = play; in − : low = −play, high = 0. "centred": low = −play/2, high = +play/2. The two
differ by half the play, and by nothing else.

Compensation is the controller's own policy: whenever the commanded direction of an axis changes,
it issues `compensation` more steps in the new direction before the step itself; they move the
motor, not the controller's position. A first motion against the direction that the axis is
believed to be engaged in counts as a change. (Thesis L1707-1709, L1774-1778.)

Exact, because the motor is an integer number of steps and the slide is either left alone or set
to motor × step + flank: nothing is summed up. The operator does not depend on the rate, so a
monotone burst of compensation steps acts as its last one. Compiled, because every position
depends on the one before.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]


def play_limits(play_mm: float, convention: str, direction: int) -> tuple[float, float]:
    """(low, high) in mm for "preloaded" in `direction` ±1 or "centred"."""
    if convention == "centred":
        return -0.5 * play_mm, 0.5 * play_mm
    return (0.0, play_mm) if direction > 0 else (-play_mm, 0.0)


def play_start(position_steps: int, step_mm: float, direction: int) -> Floats:
    """The state (6,) of an axis at rest, engaged in `direction` ±1.

    position (steps), direction, motor − position (steps), slide (mm), reversals so far, steps
    of the program so far. The whole numbers among them are far below 2⁵³.
    """
    slide_mm = position_steps * step_mm
    return np.array([position_steps, direction, 0.0, slide_mm, 0.0, 0.0], dtype=np.float64)


@njit(cache=True)
def play_fill(steps: Ints, axis: Floats, state: Floats, out: Floats) -> None:
    """Positions of the slide in mm, `out` (n,), for commanded positions `steps` (n,).

    `axis` (4,): real step in mm, low and high in mm, compensation in steps. `state` (6,) of
    `play_start` is changed in place, so that the next call goes on.
    """
    step_mm, low, high, compensation = axis[0], axis[1], axis[2], axis[3]
    position, direction, offset, slide = state[0], state[1], state[2], state[3]
    for k in range(len(steps)):
        change = steps[k] - position
        if change != 0.0:
            sense = 1.0 if change > 0.0 else -1.0
            if sense != direction:
                direction = sense
                offset += sense * compensation
                state[4] += 1.0
            position = float(steps[k])
            state[5] += abs(change)
            motor = (position + offset) * step_mm
            slide = min(max(slide, motor + low), motor + high)
        out[k] = slide
    state[0], state[1], state[2], state[3] = position, direction, offset, slide


@njit(cache=True)
def play_path_fill(
    positions: Floats, offsets: Ints, axis: Floats, state: Floats, out: Floats, turns: Ints
) -> None:
    """Positions of the slide in mm, `out` (n,), for a motor that follows `positions` (n,) mm.

    `axis` (5,): real over coded step, low and high in mm, compensation in mm, and how far back
    a position must go to be a reversal, mm (rounding must not make one). `state` (5,): furthest
    position in the present direction, direction, compensation so far, slide, reversals so far;
    changed in place, so that the next call goes on. Run r is offsets[r]:offsets[r+1];
    `turns` (R,) are its reversals.
    """
    scale, low, high, compensation, least = axis[0], axis[1], axis[2], axis[3], axis[4]
    furthest, direction, offset, slide = state[0], state[1], state[2], state[3]
    for run in range(len(turns)):
        turns[run] = 0
        for k in range(offsets[run], offsets[run + 1]):
            ahead = (positions[k] - furthest) * direction
            if ahead >= 0.0:
                furthest = positions[k]
            elif -ahead >= least:
                direction = -direction
                offset += direction * compensation
                turns[run] += 1
                furthest = positions[k]
            motor = (positions[k] + offset) * scale
            slide = min(max(slide, motor + low), motor + high)
            out[k] = slide
        state[4] += turns[run]
    state[0], state[1], state[2], state[3] = furthest, direction, offset, slide
