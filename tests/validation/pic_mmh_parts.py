"""The pieces that the thesis on the PIC machine measured: its readings, and ours.

Lnnn are lines of the thesis.
"""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from camtool.calibration.calibrate import Calibration, calibrate
from camtool.calibration.measurements import Measurements, read_measurements
from camtool.target.registry import load_target
from tests.validation.pieces import ROOT, UM, Piece, piece

UNCOMPENSATED = ("axes.x.compensation_mm=0", "axes.y.compensation_mm=0")
FIRST = ("axes.x.compensation_mm=0.1925", "axes.y.compensation_mm=0.1685")
"""What the squares were cut with: the first estimate of the play, L2370-2373."""
MAP = ("play_map.use=true",)
CENTRE = (2.0, 0.5)
"""Where zero of the circles' drawing lies when they are cut in the middle of the table. The
largest leaves 0.5 mm of the travel in Y: it cannot have been far from there."""

REGIONS = {
    "H1": ("x", 2.5, 2.509, 190.0, (0.4, 1.0)),  # L2353-2423, figures A to F
    "H2": ("x", 2.5, 2.503, 201.0, (3.733, 1.0)),
    "H3": ("x", 2.5, 2.502, 187.0, (7.066, 1.0)),
    "V1": ("y", 1.2, 1.205, 152.0, (1.0, 0.5)),
    "V2": ("y", 1.2, 1.203, 180.0, (1.0, 2.833)),
    "V3": ("y", 1.2, 1.199, 173.0, (1.0, 5.166)),
}
"""Axis, length, measured first line mm, measured play µm; where it is cut here, mm."""

SQUARES = {"Dx": (2.489, 2.484, 2.497), "Dy": (2.519, 2.497, 2.494)}
"""Tabla 14, L2457-2479: squares X, Y and Z."""
CORNERS = ((2.9, 2.9), (6.2, 4.9), (9.6, 6.9))
"""Upper right corners: the left edges lie in H1, H2, H3, the lower ones in V1, V2, V2, for there
is no room for them in V3."""

DIAMETERS = {
    3.0: (5.950, 5.980, 6.001, 6.003, 5.961, 5.926, 5.904, 5.940),  # Tabla 15, L2528-2594
    2.0: (3.987, 3.991, 3.998, 4.018, 3.990, 3.961, 3.947, 3.969),
    1.0: (1.991, 2.001, 2.017, 2.017, 2.001, 1.971, 1.970, 1.967),
}
EXTREMES = {3.0: (21, 51, 8, 30), 2.0: (21, 25, 9, 13), 1.0: (18, 12, 9, 3)}
"""µm at the left, the right, the upper, the lower end (Ei, Ed, Ps, Pi), the same table."""
MINUTES = {3.0: 23, 2.0: 14, 1.0: 8}
"""Its column without a head."""
READ_DEG = 1.0
"""A diameter is read from edge to edge, each over a stretch of so much to both sides."""

LOGOS = {
    "puma-5": ((4.86, 4.830), (4.96, 4.947)),  # Tabla 16, L2674-2950
    "puma-1.2": ((1.17, 1.165), (1.19, 1.200)),  # Tabla 17, the same lines
    "puma-1": ((0.970, 0.968), (0.990, 0.994)),  # Tabla 18
    "gmm-5": ((5.0, 4.980), (4.997, 5.040)),  # Tabla 19, L2953-3101
    "gmm-1.2": ((1.21, 1.199), (1.08, 1.060)),  # Tabla 20
}
"""Nominal and measured, X and Y."""

LEAD = ("axes.x.real_step_mm=0.000139508929", "axes.y.real_step_mm=0.000139508929")
"""0.5 mm / (28 · 128): a lead that the thesis does not state, with its motor and gear."""
NONE = (*UNCOMPENSATED, "axes.x.backlash_mm=0", "axes.y.backlash_mm=0")
"""Slides that are where they are sent."""
EVEN = ("axes.x.backlash_mm=0.204", "axes.y.backlash_mm=0.178")
"""Play as large as what the controller adds: what the thesis took for it in the end."""


@cache
def calibrated(*circles: int) -> Calibration:
    """The machine as these circles of Tabla 15 say it."""
    said = read_measurements(ROOT / "samples" / "measured" / "pic-mmh-circles.toml")
    some = tuple(said.coupons[k] for k in circles)
    whole = (said.file, said.target, said.uncertainty_mm, said.compensation_mm, said.regions)
    return calibrate(Measurements(*whole, some), load_target("pic-mmh").machine)


def settings_of(found: Calibration) -> tuple[str, ...]:
    keys = {"step": "real_step_mm", "play": "backlash_mm"}
    return tuple(
        f"axes.{each.axis}.{keys[each.what]}={each.value!r}"
        if each.axis
        else f"mechanics.squareness_rad={each.value!r}"
        for each in found.estimates
    )


def lines(name: str, *settings: str) -> tuple[float, float]:
    """(length of the first line mm, by how much the second is shorter µm)."""
    axis, _, _, _, at = REGIONS[name]
    cut = piece(f"pic-mmh-lines-{axis}", *UNCOMPENSATED, *settings, at=at).cuts
    along = "xy".index(axis)
    first, second = (float(np.ptp(cut[k][:, along])) for k in (0, -1))
    return first, (first - second) * UM


def square(*settings: str, at: tuple[float, float] = CORNERS[1]) -> tuple[float, float]:
    """(Dx, Dy) mm from edge to edge."""
    return square_of(piece("pic-mmh-square", *FIRST, *settings, at=at))


def square_of(made: Piece) -> tuple[float, float]:
    """(Dx, Dy) mm from edge to edge."""
    top, left, bottom, right = made.cuts
    across = np.median(right[:, 0]) - np.median(left[:, 0])
    return float(across), float(np.median(top[:, 1]) - np.median(bottom[:, 1]))


def square_begun_below(*settings: str) -> tuple[float, float]:
    """(Dx, Dy) mm where the lower edge is come to in +, as it lies: Y shows no play."""
    bottom, right, top, left = piece("pic-mmh-square-up", *FIRST, *settings).cuts
    across = np.median(right[:, 0]) - np.median(left[:, 0])
    return float(across), float(np.median(top[:, 1]) - np.median(bottom[:, 1]))


def circles(*settings: str) -> Piece:
    return piece("pic-mmh-circles", *settings, at=CENTRE)


def diameters(*settings: str) -> dict[float, np.ndarray]:
    """(8,) mm of each circle, through the middle of its extremes."""
    return diameters_of(circles(*settings))


def diameters_of(made: Piece) -> dict[float, np.ndarray]:
    """(8,) mm of each circle, through the middle of its extremes."""
    found = {}
    for radius, slide in zip((1.0, 2.0, 3.0), made.cuts, strict=True):
        arm = slide - 0.5 * (slide.min(axis=0) + slide.max(axis=0))
        angle = np.degrees(np.arctan2(arm[:, 1], arm[:, 0]))
        far = np.hypot(arm[:, 0], arm[:, 1])
        ends = [
            far[np.abs((angle - at + 180.0) % 360.0 - 180.0) < READ_DEG].mean()
            for at in np.arange(16) * 22.5
        ]
        found[radius] = np.array(ends[:8]) + np.array(ends[8:])
    return found


def logos(*settings: str) -> dict[str, tuple[float, float]]:
    return {name: piece(f"pic-mmh-{name}", *settings).size for name in LOGOS}


def rms(values: np.ndarray) -> float:
    """µm, of mm."""
    return math.sqrt(float(np.mean(np.square(values)))) * UM
