"""The play of an axis over blocks of positions that mostly run one way.

While the motor runs one way, the play operator of `camtool.kernels.play` has no memory but where
the slide stood at first: with rising motor positions m_k

    s_k = min(max(s_{k−1}, m_k + low), m_k + high) = max(s_0, m_k + low),

since m_k + low rises too, and s_{k−1} ≤ m_{k−1} + high ≤ m_k + high; falling the same with the
other flank. Exact to the last bit, since max and min only choose. A reversal comes with the first
sample that moves, in a block that turns nowhere else; blocks that do are taken step by step.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from camtool.kernels.compiled import bare
from camtool.kernels.play import taken_along, turned
from camtool.kernels.wide import larger, smaller

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]

RISING, FALLING, STILL, TURNING = 1, -1, 0, 2
"""Which way a block of positions runs."""


@bare
def way_of(before: int, positions: Ints) -> int:
    """Which way positions (n,) run that follow `before`."""
    least = most = positions[0] - before
    behind, ahead = positions[:-1], positions[1:]
    for k in range(len(ahead)):
        change = ahead[k] - behind[k]
        least = min(least, change)
        most = max(most, change)
    if least >= 0:
        return RISING if most > 0 else STILL
    return FALLING if most <= 0 else TURNING


@bare
def play_block(way: int, positions: Floats, axis: Floats, state: Floats, out: Floats) -> int:
    """Slides, `out` (n,) mm, for positions (n,) that run `way`; returns the reversals.

    `axis` (5,) and `state` (4,) as in `camtool.kernels.play`; steps are wider than axis[4].
    """
    if way == TURNING or len(positions) == 0:
        return _step_by_step(positions, axis, state, out)
    scale, low, high = axis[0], axis[1], axis[2]
    begin, reversals = 0, 0
    if way != STILL and way != state[1]:
        while positions[begin] == state[0]:
            begin += 1
        if begin > 0:
            state[3] = taken_along(state[3], (state[0] + state[2]) * scale, low, high)
        for k in range(begin):
            out[k] = state[3]
        state[1] = way
        state[2] += way * axis[3]
        reversals = 1
    added = state[2]
    slide = taken_along(state[3], (positions[begin] + added) * scale, low, high)
    here, there = positions[begin:], out[begin:]
    if way == STILL:
        for k in range(len(there)):
            there[k] = slide
    elif way == RISING:
        for k in range(len(here)):
            there[k] = larger(slide, (here[k] + added) * scale + low)
    else:
        for k in range(len(here)):
            there[k] = smaller(slide, (here[k] + added) * scale + high)
    state[0], state[3] = positions[-1], out[-1]
    return reversals


@bare
def _step_by_step(positions: Floats, axis: Floats, state: Floats, out: Floats) -> int:
    reversals = 0
    for k in range(len(positions)):
        state[0], state[1], reversed_ = turned(positions[k], state[0], state[1], axis[4])
        if reversed_:
            state[2] += state[1] * axis[3]
            reversals += 1
        state[3] = taken_along(state[3], (positions[k] + state[2]) * axis[0], axis[1], axis[2])
        out[k] = state[3]
    return reversals
