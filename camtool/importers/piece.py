"""The piece that readers make of an entity."""

from __future__ import annotations

from dataclasses import dataclass

from camtool.geometry.polylines import Floats

MAX_COORDINATE_MM = 1e9
"""Beyond this doubles cannot tell positions apart that differ by POSITION_EPS_MM."""


@dataclass(frozen=True, eq=False)
class Piece:
    """One entity: `vertices` (n, 3) of x, y, bulge in mm, and where it came from.

    A closed piece may repeat its first point at its end. `source` begins with the kind of the
    entity ("CIRCLE 2F", "path outline"). `line_type` as a DXF names it, "" elsewhere. `off_mm`
    (n, 2): the largest and the rms distance of what is drawn from the segment that leaves each
    vertex; None where the segments are what is drawn.
    """

    vertices: Floats
    closed: bool
    layer: str
    colour: str
    source: str
    line_type: str = ""
    off_mm: Floats | None = None

    @property
    def where(self) -> str:
        """For messages: layer and source."""
        return f"layer {self.layer}, {self.source}"

    @property
    def kind(self) -> str:
        """The first word of the source."""
        return self.source.partition(" ")[0]
