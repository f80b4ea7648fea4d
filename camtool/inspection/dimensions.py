"""Dimensions with limits, from drawings and tolerance files."""

from __future__ import annotations

from typing import Final, Literal

from msgspec import Struct

Kind = Literal[
    "diameter",
    "radius",
    "distance",
    "position",
    "straightness",
    "roundness",
    "profile",
    "depth",
    "thickness",
]
"""Kinds of dimensions. "distance" is between two edges, two centres, or an edge and a centre:
widths are distances. "depth" is that of a floor below the top of the stock, "thickness" that of
the stock which is left under it."""

DEPTHS: Final = ("depth", "thickness")
"""Kinds of dimensions along Z, of the floor at a place.

The drawing gives no size for them: the nominal size is what the job asks for, unless the file
states one."""

ZONES: Final = ("position", "straightness", "roundness", "profile")
"""Kinds that are widths of zones of ISO 1101: they have no nominal size and no lower limit."""

Place = tuple[float, float]


class Limits(Struct, frozen=True):
    """Permitted deviations of a dimension from its nominal value, mm, `lower_mm` ≤ `upper_mm`, and
    their source text ("H7", "±0.05", "ISO 2768-m")."""

    lower_mm: float
    upper_mm: float
    said: str


class Dimension(Struct, frozen=True):
    """One dimension of a drawing, mm, in the drawing's frame.

    `places_mm` say of what it is: of a diameter, radius, roundness or position one point, the
    centre or a point on the circle; of a distance two points, each on an edge, at a corner, at the
    centre of a circle or on it; of a straightness or profile one point on the edge or outline; of
    a depth or thickness one point on the floor.
    `direction_rad`: along which a distance is measured (None: from place to place).
    `nominal_mm` None: as drawn; `limits` None: none are known, and it is only predicted, unless
    they depend on the nominal value and this is not known yet: `words` of limits ("H7"), and the
    `general` tolerance ("ISO 2768-m") where there are none, "" each (`limits.limited`).
    `source`: where it comes from ("DIMENSION 4F", "tolerances.toml, dimension 3")."""

    name: str
    kind: Kind
    places_mm: tuple[Place, ...]
    source: str
    direction_rad: float | None = None
    nominal_mm: float | None = None
    limits: Limits | None = None
    words: str = ""
    general: str = ""

    @property
    def asks(self) -> bool:
        """True if it is to have limits, including limits that are not known yet."""
        return self.limits is not None or bool(self.words or self.general)
