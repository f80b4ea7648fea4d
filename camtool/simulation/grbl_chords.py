"""The targets that grbl 1.1 hands to its planner, in its own 32-bit floats.

Lines have one, their end; an arc has the ends of its chords (`mc_arc` in motion_control.c): all
but the last lie on the circle about its centre with the radius of its start, the last is its end.
Every operation rounds to 32 bits as the C code does on a processor whose double has 32 bits
(AVR); sine, cosine and arc tangent may differ from its library's in the last bit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from camtool.machine.controllers import GrblController
from camtool.machine.model import Machine
from camtool.simulation.motion import Floats, Ints
from camtool.toolpath.moves import Kind, Toolpath

Singles = npt.NDArray[np.float32]

MAX_DIGITS = 8
"""grbl drops the digits of a number behind so many (MAX_INT_DIGITS, nuts_bolts.c)."""

DECIMAL_EPS = 1e-6
"""Units of the last decimal: a number farther than this from all such units was not written with
so many decimals, and is taken as its nearest float."""

FULL_TURN_RAD = np.float32(5e-7)
"""An arc that turns by less is a full circle (ARC_ANGULAR_TRAVEL_EPSILON, config.h)."""

MOST_SEGMENTS = 1 << 16
"""The chords of an arc are counted in 16 bits."""


@dataclass(frozen=True, eq=False)
class Targets:
    """T targets in order: mm (T, 3), 32-bit, and the row (T,) of each."""

    row: Ints
    mm: Singles


def targets_of(path: Toolpath, machine: Machine, controller: GrblController) -> Targets:
    """What the rows of a program ask of the planner; rows that do not move ask nothing."""
    ends = as_read(path.end, machine)
    homing = np.isin(path.kind, (Kind.HOME_XY, Kind.HOME_Z))
    arcs = np.flatnonzero(path.is_arc)
    counts = np.where(path.is_motion | homing, 1, 0)
    start = as_read(path.start, machine)
    begins = np.concatenate([start[None, :], ends[:-1]]) if len(path) else ends
    chords = _Chords(path, machine, begins[arcs], ends[arcs], arcs)
    counts[arcs] = chords.segments(controller)
    row = np.repeat(np.arange(len(path)), counts)
    mm = ends[row]
    first = np.cumsum(counts) - counts
    inside, points = chords.points(counts[arcs], first[arcs], controller.arc_correction)
    mm[inside] = points
    return Targets(row, mm)


def as_read(values: Floats, machine: Machine) -> Singles:
    """Numbers as `read_float` (nuts_bolts.c) makes them from their digits.

    The digits are one whole number, which is multiplied by 0.01 and 0.1 until the point is where
    it belongs, each time rounded. How many decimals were written only `dialect.decimals` says;
    where it does not, or the number has others, it is taken as the nearest float.
    """
    nearest = values.astype(np.float32)
    decimals = machine.dialect.get("decimals")
    if not isinstance(decimals, int):
        return nearest
    scaled = np.abs(values) * 10.0**decimals
    digits = np.rint(scaled)
    whole = np.maximum(np.floor(np.log10(np.maximum(np.trunc(np.abs(values)), 1.0))), 0.0) + 1.0
    dropped = np.clip(whole + decimals - MAX_DIGITS, 0, decimals).astype(np.int64)
    made = np.floor(digits / 10.0**dropped).astype(np.float32)
    left = decimals - dropped
    for _ in range(decimals // 2):
        made = np.where(left >= 2, made * np.float32(0.01), made)
        left = np.where(left >= 2, left - 2, left)
    made = np.where(left == 1, made * np.float32(0.1), made)
    written = np.abs(scaled - digits) <= DECIMAL_EPS
    return np.asarray(np.where(written, np.copysign(made, nearest), nearest))


class _Chords:
    """The arcs of a program, J of them, from `begin` to `end` (J, 3) mm."""

    def __init__(
        self, path: Toolpath, machine: Machine, begin: Singles, end: Singles, arcs: Ints
    ) -> None:
        self._begin, self._end = begin, end
        offset = as_read(path.centre[arcs] - path.starts[arcs, :2], machine)
        self._offset = offset
        self._centre = begin[:, :2] + offset
        self._radius = np.sqrt(offset[:, 0] * offset[:, 0] + offset[:, 1] * offset[:, 1])
        rx, ry = -offset[:, 0], -offset[:, 1]
        tx, ty = end[:, 0] - self._centre[:, 0], end[:, 1] - self._centre[:, 1]
        turn = np.arctan2(rx * ty - ry * tx, rx * tx + ry * ty)
        full = np.float32(2.0 * np.pi)
        clockwise = path.kind[arcs] == Kind.ARC_CW
        down = np.where(turn >= -FULL_TURN_RAD, turn - full, turn)
        up = np.where(turn <= FULL_TURN_RAD, turn + full, turn)
        self._turn = np.where(clockwise, down, up)

    def segments(self, controller: GrblController) -> Ints:
        """(J,) chords of each: ⌊|½ φ r| / √(δ (2r − δ))⌋, δ the arc tolerance; at least the one
        to the end."""
        tolerance = np.float32(controller.arc_tolerance_mm)
        half = tolerance * (np.float32(2.0) * self._radius - tolerance)
        way = np.abs(np.float32(0.5) * self._turn * self._radius)
        with np.errstate(invalid="ignore", divide="ignore"):
            count = np.floor(way / np.sqrt(half))
        counted = np.where(np.isfinite(count), count, 0.0).astype(np.int64) % MOST_SEGMENTS
        return np.maximum(counted, 1)

    def points(self, segments: Ints, first: Ints, correction: int) -> tuple[Ints, Singles]:
        """Which targets (P,) are ends of chords within an arc, and where these lie (P, 3) mm.

        A radius vector is turned by the angle of a chord, θ, with cos θ ≈ 1 − θ²/2 and
        sin θ ≈ θ − θ³/6; after `correction` turns the next one is computed anew.
        """
        inner = segments - 1
        arc = np.repeat(np.arange(len(segments)), inner)
        number = np.arange(len(arc)) - np.repeat(np.cumsum(inner) - inner, inner) + 1
        theta = (self._turn / segments.astype(np.float32))[arc]
        x0, y0 = -self._offset[arc, 0], -self._offset[arc, 1]
        turned = number % (correction + 1)
        angle = (number - turned).astype(np.float32) * theta
        cos_i, sin_i = np.cos(angle), np.sin(angle)
        anew = number >= turned + 1
        x = np.where(anew, x0 * cos_i - y0 * sin_i, x0)
        y = np.where(anew, x0 * sin_i + y0 * cos_i, y0)
        cos_t = np.float32(2.0) - theta * theta
        sin_t = theta * np.float32(0.16666667) * (cos_t + np.float32(4.0))
        cos_t = cos_t * np.float32(0.5)
        for step in range(1, correction + 1):
            on = np.flatnonzero(turned >= step)
            c, s, u, v = cos_t[on], sin_t[on], x[on], y[on]
            x[on], y[on] = u * c - v * s, u * s + v * c
        points = np.empty((len(arc), 3), dtype=np.float32)
        points[:, 0] = self._centre[arc, 0] + x
        points[:, 1] = self._centre[arc, 1] + y
        points[:, 2] = self._heights(segments, arc)
        return np.repeat(first, inner) + number - 1, points

    def _heights(self, segments: Ints, arc: Ints) -> Singles:
        """Z of the chords' ends within the arcs: an equal rise added each time."""
        z: Singles = self._begin[arc, 2].copy()
        rise = (self._end[:, 2] - self._begin[:, 2]) / segments.astype(np.float32)
        behind = np.cumsum(segments - 1)
        for which in np.flatnonzero((rise != 0.0) & (segments > 1)).tolist():
            low, high = int(behind[which] - segments[which] + 1), int(behind[which])
            z[low] += rise[which]
            z[low + 1 : high] = rise[which]
            z[low:high] = np.add.accumulate(z[low:high])
        return z
