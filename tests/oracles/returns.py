"""Where paths come back to, against all pairs of their points."""

import math

from camtool.arrays import Floats, Ints


def latest_near(places: Floats, begins: Ints, reach: float) -> list[int]:
    """As `camtool.kernels.chaining.latest_near`."""
    latest = []
    for low, high in zip(begins[:-1].tolist(), begins[1:].tolist(), strict=True):
        for later in range(low, high):
            near = [
                earlier
                for earlier in range(low, later)
                if math.hypot(*(places[earlier] - places[later])) <= reach
            ]
            latest.append(near[-1] if near else -1)
    return latest
