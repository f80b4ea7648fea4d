"""The part under the probe of a virtual machine."""

from __future__ import annotations

import math

import msgspec
import numpy as np

from camtool.arrays import Bools, Floats

NEVER_CLOSED = -1e6
"""No slide comes down to this height, mm."""


class ProbedPart(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A part that closes the probe of a virtual machine. All places are those of the machine when
    the power comes on, mm. `probe_mm`: its top; `probe_slope_x`, `probe_slope_y`: how much higher
    that is for each mm of X and Y (a tilted blank). `probe_block`: its sides "X0,Y0,X1,Y1" ("":
    none), turned by `probe_turn_deg` about X0 Y0; `probe_round`: a boss "X,Y,DIAMETER" instead;
    `probe_bore`: a bore in it, likewise. `probe_radius`: the radius of the tip."""

    probe_mm: float = NEVER_CLOSED
    probe_slope_x: float = 0.0
    probe_slope_y: float = 0.0
    probe_block: str = ""
    probe_turn_deg: float = 0.0
    probe_round: str = ""
    probe_bore: str = ""
    probe_radius: float = 0.0

    def __post_init__(self) -> None:
        for text, count in ((self.probe_block, 4), (self.probe_round, 3), (self.probe_bore, 3)):
            if text and len(_numbers(text)) != count:
                raise ValueError(f"{text!r} is not {count} numbers with commas between them")

    def closes(self, mm: Floats, rounding_mm: float) -> Bools:
        """Return the mask (…) of the places (…, 3), mm, at which the probe touches the part or is
        inside it."""
        x, y = mm[..., 0], mm[..., 1]
        top = self.probe_mm + x * self.probe_slope_x + y * self.probe_slope_y
        is_on = mm[..., 2] <= top + rounding_mm
        if self.probe_block:
            x0, y0, x1, y1 = _numbers(self.probe_block)
            turn = math.radians(self.probe_turn_deg)
            u = (x - x0) * math.cos(turn) + (y - y0) * math.sin(turn)
            v = (y - y0) * math.cos(turn) - (x - x0) * math.sin(turn)
            beside_u = np.maximum(np.maximum(-u, u - (x1 - x0)), 0.0)
            beside_v = np.maximum(np.maximum(-v, v - (y1 - y0)), 0.0)
            is_on &= np.hypot(beside_u, beside_v) <= self.probe_radius + rounding_mm
        if self.probe_round:
            centre_x, centre_y, width = _numbers(self.probe_round)
            radius = 0.5 * width + self.probe_radius
            is_on &= np.hypot(x - centre_x, y - centre_y) <= radius + rounding_mm
        if self.probe_bore:
            centre_x, centre_y, width = _numbers(self.probe_bore)
            radius = 0.5 * width - self.probe_radius
            is_on &= np.hypot(x - centre_x, y - centre_y) >= radius - rounding_mm
        return np.asarray(is_on)


def _numbers(text: str) -> list[float]:
    """Parse numbers with commas between them; ValueError for other text."""
    return [float(each) for each in text.split(",")]
