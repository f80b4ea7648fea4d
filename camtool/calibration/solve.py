"""Least squares with weights, and what the readings cannot tell.

    minimise  Σ ((measured_i − predicted_i(p)) / u_i)²

by Gauss-Newton: each round solves the linear problem about the last values, and one is enough
where the equations are linear, as all are but diagonals and circles. u_i is the standard
uncertainty of a reading; where not all are known, all count alike. With A the weighted
derivatives and s² = Σ residual² / (n − p),

    covariance = s² (AᵀA)⁻¹,

where s is not taken below 1 if the u_i are known: residuals that happen to be small make no
reading better than its instrument.

Parameters that the readings cannot tell are held at what the machine's file says: those that no
reading depends on, and of those that only occur together the least wanted one, until the rest can
be told. The null space of A shows which they are.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from camtool.calibration.model import Floats, Model, Parameter

Bools = npt.NDArray[np.bool_]

ROUNDS = 50
"""Rounds of Gauss-Newton at most; a handful is usual."""

SETTLED = 1e-13
"""It has settled when no parameter moves by more than this (of 1, of a mm, of a tangent)."""

TOLD_APART = 1e-9
"""Singular values below this part of the largest are zero: directions that no reading tells."""

INVOLVED = 1e-6
"""A parameter takes part in such a direction when its share is above this."""

OUTLIER_SIGMAS = 3.0
"""A reading whose residual is above so many of its standard deviations is named an outlier."""

OUTLIER_FREEDOM = 4
"""The other readings say that standard deviation when they are so many more than the parameters;
fewer ones say it too badly, and the instrument's own uncertainty does."""


@dataclass(frozen=True)
class Held:
    """A parameter that was not estimated, and why."""

    parameter: Parameter
    why: str


@dataclass(frozen=True, eq=False)
class Solution:
    """values (P,) of the parameters in the model's order, and their covariance (P, P): nan where
    held, and where it is not known (as many readings as parameters, and no instrument's).
    predicted, sigma (n,) mm: of the readings; sigma is that of a residual, nan where not known.
    freedom: readings more than parameters. spread: s, in mm where the u_i are not known, else in
    their units; nan without freedom."""

    values: Floats
    covariance: Floats
    predicted: Floats
    sigma: Floats
    free: Bools
    held: tuple[Held, ...]
    freedom: int
    spread: float

    def uncertainty(self, columns: Sequence[int]) -> float:
        """Standard uncertainty of the mean of some parameters; nan when not known."""
        part = self.covariance[np.ix_(columns, columns)]
        return float(np.sqrt(part.sum())) / len(columns)


def solve(model: Model, start: Floats) -> Solution:
    """The parameters that fit the model's readings best, from the values `start` (P,)."""
    uncertain_mm = [reading.uncertainty_mm or np.nan for reading in model.readings]
    known = bool(np.isfinite(uncertain_mm).all())
    weights = 1.0 / np.array(uncertain_mm) if known else np.ones(len(uncertain_mm))
    measured = np.array([reading.measured_mm for reading in model.readings])
    values = start.copy()
    free, held = _told_apart(model.parameters, model.slopes(values) * weights[:, None])
    for _ in range(ROUNDS):
        matrix = model.slopes(values)[:, free] * weights[:, None]
        residual = (measured - model.predict(values)) * weights
        change = np.linalg.lstsq(matrix, residual, rcond=None)[0]
        values[free] += change
        if not len(change) or np.abs(change).max() < SETTLED:
            break
    predicted = model.predict(values)
    matrix = model.slopes(values)[:, free] * weights[:, None]
    residual = (measured - predicted) * weights
    freedom = len(measured) - int(free.sum())
    spread = float(np.sqrt(residual @ residual / freedom)) if freedom > 0 else np.nan
    unit = np.fmax(spread, 1.0) if known else spread
    inverse = np.linalg.pinv(matrix)
    covariance = np.full((len(values), len(values)), np.nan)
    covariance[np.ix_(free, free)] = unit**2 * inverse @ inverse.T
    leverage = np.einsum("ij,ji->i", matrix, inverse)
    sigma = _sigma(residual, leverage, freedom, known=known) / weights
    return Solution(values, covariance, predicted, sigma, free, held, freedom, spread)


def _sigma(residual: Floats, leverage: Floats, freedom: int, *, known: bool) -> Floats:
    """(n,) standard deviation of each weighted residual, from what the other readings say.

    Without reading i the sum of squares falls by r_i² / (1 − h_i), h the leverage. A reading
    that alone determines a parameter (h = 1) has no residual to judge.
    """
    rest = np.clip(1.0 - leverage, 0.0, 1.0)
    judged = rest > TOLD_APART
    others = np.full(len(residual), 1.0 if known else np.nan)
    if freedom - 1 >= OUTLIER_FREEDOM:
        share = np.divide(residual**2, rest, out=np.zeros_like(rest), where=judged)
        squares = np.clip(residual @ residual - share, 0.0, None)
        others = np.fmax(np.sqrt(squares / (freedom - 1)), 1.0 if known else 0.0)
    return np.where(judged, others * np.sqrt(rest), np.nan)


def _told_apart(parameters: Sequence[Parameter], matrix: Floats) -> tuple[Bools, tuple[Held, ...]]:
    """(P,) which parameters the readings tell, and the others with the reason."""
    size = np.linalg.norm(matrix, axis=0)
    free = size > 0.0
    touched = free.copy()
    while free.any():
        index = np.flatnonzero(free)
        _, singular, rows = np.linalg.svd(matrix[:, index] / size[index])
        rank = int((singular > TOLD_APART * singular[0]).sum())
        if rank == len(index):
            break
        together = index[np.abs(rows[rank:]).max(axis=0) > INVOLVED]
        free[max(together, key=lambda column: (_wish(parameters[column]), column))] = False
    held: list[Held] = []
    for column in np.flatnonzero(~free).tolist():
        why = "no reading depends on it"
        if touched[column]:
            parts = np.linalg.lstsq(matrix[:, free], matrix[:, column], rcond=None)[0]
            shares = np.abs(parts) * size[free] > INVOLVED * size[column]
            others = [str(parameters[other]) for other in np.flatnonzero(free)[shares].tolist()]
            why = f"the readings cannot tell it from {' and '.join(others)}"
        held.append(Held(parameters[column], why))
    return free, tuple(held)


def _wish(parameter: Parameter) -> int:
    """The higher, the sooner a parameter is held: a step scale is mostly known already."""
    return ("play", "squareness", "scale").index(parameter.what)
