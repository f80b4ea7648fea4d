"""The tolerances of an offset."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from camtool.errors import OptionError
from camtool.geometry.polylines import POSITION_EPS_MM

NODE_EPS_MM = 1e-8
"""Ends and meetings of raw elements nearer than this are one node."""

VALIDITY_EPS_MM = 2e-7
"""How much nearer to the source than the distance a slice may be and is still kept."""

CUSP_EPS_RAD = 1e-3
"""A corner this near to a full turn back is capped on both its sides: rounding, or arcs that cross
again beside the corner, decide which side is the inner one."""

SHARP_LIMIT = 100.0
"""A sharp corner may be so many times the distance away from the source, and is cut off there: it
is one sharper than 1.1°."""


@dataclass(frozen=True)
class OffsetOptions:
    """Tolerances, mm; see the top of the package for what each decides.

    `sliver_eps_mm` must be POSITION_EPS_MM or more, because no polyline has shorter segments.
    """

    node_eps_mm: float = NODE_EPS_MM
    validity_eps_mm: float = VALIDITY_EPS_MM
    sliver_eps_mm: float = POSITION_EPS_MM

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not (math.isfinite(value) and value > 0.0):
                raise OptionError(f"{field.name} of {value} is not above 0")
        if self.sliver_eps_mm < POSITION_EPS_MM:
            raise OptionError(
                f"sliver_eps_mm of {self.sliver_eps_mm} is below {POSITION_EPS_MM}",
                mend="no polyline has shorter segments",
            )


DEFAULT_OPTIONS = OffsetOptions()
