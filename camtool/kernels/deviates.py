"""Random numbers with a number each: the same on every machine, in whatever order they are asked.

The n-th number of a stream is the sum of twelve uniform ones, less its mean: of mean 0, of
standard deviation 1 (1 − 2⁻³³ of it), never beyond ±6, and near enough to a normal one (fourth
moment 2.9 for 3). Sums of integers are exact; logarithms and cosines, of which normal numbers are
made else, differ between platforms in their last bits.

The uniform numbers are the 16-bit parts of three outputs of SplitMix64 (Steele, Lea, Flood,
"Fast splittable pseudorandom number generators", 2014), whose k-th output from a key is a mixture
of the bits of key + k·γ: nothing is carried along.
"""

from __future__ import annotations

import numpy as np

from camtool.kernels.compiled import inner

GAMMA = np.uint64(0x9E3779B97F4A7C15)
"""2⁶⁴ divided by the golden ratio, odd: what the counter of SplitMix64 goes on by."""


@inner
def _mixed(word: np.uint64) -> np.uint64:
    """The output function of SplitMix64."""
    word = (word ^ (word >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    word = (word ^ (word >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return word ^ (word >> np.uint64(31))


@inner
def deviate(seed: int, stream: int, number: int) -> float:
    """The `number`-th of a stream ≥ 0, from 0 on."""
    key = _mixed(np.uint64(seed) + np.uint64(stream + 1) * GAMMA)
    total = np.uint64(0)
    for k in range(1, 4):
        word = _mixed(key + np.uint64(3 * number + k) * GAMMA)
        for part in range(4):
            total += (word >> np.uint64(16 * part)) & np.uint64(0xFFFF)
    return (float(total) - 6.0 * 65535.0) / 65536.0
