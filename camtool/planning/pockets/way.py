"""The way of the tool through a pocket, collected stroke by stroke, with the links between."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from camtool.geometry.polylines import Floats, Polyline, reverse
from camtool.planning.contours.along import Along
from camtool.planning.pockets.route import Rails, closest, route, tidy


class Way:
    """Collects strokes (k, 3) of x, y, bulge; each is linked to the one before it, at depth."""

    def __init__(self) -> None:
        self.begin: Floats | None = None
        """Where the tool would best go down (2,), if anywhere."""
        self._parts: list[Floats] = []
        self._done: list[Floats] = []

    @property
    def here(self) -> Floats | None:
        """Where the tool is (2,); None before the first stroke."""
        return self._parts[-1][-1, :2] if self._parts else None

    def cut(self, stroke: Floats, rails: Rails) -> None:
        """A stroke, after a link that stays in a region which holds both places.

        Where rounding hides the link (`route`) the tool comes up: another way begins.
        """
        if self.here is not None:
            link = route(self.here, stroke[0, :2], rails)
            if link is None:
                self._done.append(_chained(self._parts))
                self._parts = []
            else:
                self._parts.append(link)
        self._parts.append(stroke)

    def cut_all(self, paths: Iterable[Polyline], rails: Rails, around: Rails, ahead: bool) -> None:
        """All these paths of a region, each time the nearest: closed ones once round from their
        nearest place, the way they run or (not `ahead`) the other; open ones from either end.

        The first is come to in `around`, which holds the region.
        """
        left = [Along.of(path) for path in paths]
        while left:
            here = self._near(left[0].path)
            ways = [_from_nearest(along, here) for along in left]
            pick = min(range(len(left)), key=lambda row: ways[row][0])
            along, begin = left.pop(pick), ways[pick][1]
            if along.path.closed:
                end = begin + (along.total_mm if ahead else -along.total_mm)
                self.cut(along.piece(begin, end), around)
            else:
                path = along.path if begin == 0.0 else reverse(along.path)
                self.cut(path.vertices, around)
            around = rails

    def _near(self, path: Polyline) -> Floats:
        """Where the tool is, or would go down, or else the start of a path."""
        if self.here is not None:
            return self.here
        return path.start if self.begin is None else self.begin

    def ways(self) -> list[Floats]:
        """(n, 3) open paths; several only where the tool has to come up."""
        return [*self._done, _chained(self._parts)] if self._parts else self._done


def _from_nearest(along: Along, here: Floats) -> tuple[float, float]:
    """Distance of a place from where a path may begin, and the length along it to there."""
    if along.path.closed:
        return closest(along, here)
    to_start, to_end = np.hypot(*(along.path.vertices[[0, -1], :2] - here).T).tolist()
    return (to_start, 0.0) if to_start <= to_end else (to_end, along.total_mm)


def _chained(parts: list[Floats]) -> Floats:
    """Open paths, each of which begins where the one before it ends, as one."""
    return tidy(np.concatenate([*(part[:-1] for part in parts[:-1]), parts[-1]]))
