"""What makes a run of chords an arc, said plainly, for runs that were found."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from camtool.arrays import Floats


def least_squares_circle(points: Floats) -> tuple[Floats, float]:
    """Centre and radius that minimise Σ (x² + y² − 2ax − 2by − c)², by numpy's solver."""
    middle = points.mean(axis=0)
    about = points - middle
    rows = np.column_stack([2.0 * about, np.ones(len(about))])
    a, b, c = np.linalg.lstsq(rows, (about**2).sum(axis=1), rcond=None)[0]
    return middle + np.array([a, b]), math.sqrt(c + a * a + b * b)


def turns_about(points: Floats, centre: Floats) -> Floats:
    """Signed angles rad that each chord turns about the centre."""
    spoke = points - centre
    a, b = spoke[:-1], spoke[1:]
    return np.arctan2(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], (a * b).sum(axis=1))


def explode(vertices: Floats, most_turn: float, decimals: int | None = None) -> Floats:
    """An open chain (n, 3) with every arc cut into equal chords that turn by at most `most_turn`,
    four at least; points (m, 2), rounded to so many decimals if told."""
    rows = [vertices[:1, :2]]
    for (ax, ay, bulge), (bx, by, _) in pairwise(vertices):
        a, b = complex(ax, ay), complex(bx, by)
        if bulge == 0.0:
            rows.append(np.array([[bx, by]]))
            continue
        sweep = 4.0 * math.atan(bulge)
        count = max(4, math.ceil(abs(sweep) / most_turn))
        centre = 0.5 * (a + b) + 1j * (b - a) * (1.0 - bulge**2) / (4.0 * bulge)
        spokes = (a - centre) * np.exp(1j * sweep * np.arange(1, count + 1) / count)
        points = centre + spokes
        points[-1] = b
        rows.append(np.column_stack([points.real, points.imag]))
    points = np.concatenate(rows)
    return points if decimals is None else np.round(points, decimals)
