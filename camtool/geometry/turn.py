"""Turning a part over: the map from the frame of the first face into that of a set-up."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec import Struct

if TYPE_CHECKING:
    from camtool.arrays import Floats

Box = tuple[float, float, float, float]
"""Low x, low y, high x and high y, mm."""

Pair = tuple[float, float]


class Turn(Struct, frozen=True):
    """A map of the plane, p ↦ `signs` · p + `shift_mm`: a part that is turned over about a line
    along an axis (`Turn.about`), half a turn (both signs are −1), or a shift alone."""

    signs: Pair = (1.0, 1.0)
    shift_mm: Pair = (0.0, 0.0)

    @classmethod
    def about(cls, axis: str, line_mm: float) -> Turn:
        """Return the map that turns a part over about a line along the axis "x" or "y"; `line_mm`
        is the place of the line on the other axis."""
        if axis == "y":
            return cls((-1.0, 1.0), (2.0 * line_mm, 0.0))
        return cls((1.0, -1.0), (0.0, 2.0 * line_mm))

    @property
    def is_over(self) -> bool:
        """True if the map turns the part over, so that its other face is up."""
        return self.signs[0] * self.signs[1] < 0.0

    @property
    def back(self) -> Turn:
        """The inverse map."""
        x, y = (-sign * by for sign, by in zip(self.signs, self.shift_mm, strict=True))
        return Turn(self.signs, (x, y))

    def then(self, other: Turn) -> Turn:
        """Return the map that applies this one first, then the other."""
        x, y = (one * two for one, two in zip(self.signs, other.signs, strict=True))
        return Turn((x, y), other.point(self.shift_mm))

    def point(self, at_mm: Pair) -> Pair:
        """Return the image of a point under this map."""
        x, y = (
            sign * place + by
            for sign, place, by in zip(self.signs, at_mm, self.shift_mm, strict=True)
        )
        return x, y

    def points(self, points: Floats) -> Floats:
        """Return the images of points, columns x and y first (J, 2 or more); further columns are
        unchanged."""
        turned_points = points.copy()
        turned_points[:, :2] = points[:, :2] * self.signs + self.shift_mm
        return turned_points

    def box(self, box: Box) -> Box:
        """Return the image of a box under this map."""
        (a, b), (c, d) = self.point(box[:2]), self.point(box[2:])
        return min(a, c), min(b, d), max(a, c), max(b, d)


UNTURNED = Turn()
"""The map of a part that lies as drawn."""
