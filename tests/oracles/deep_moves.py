"""Toolpaths as planning makes them with depth: ramps, helices, passes, tabs, pockets, pecks."""

from __future__ import annotations

import math

from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath


class Shop:
    """Cuts scaled to a machine: `size` mm is about the size of a part, `deep` mm its depth."""

    def __init__(self, size: float, deep: float, feed: float) -> None:
        self.size, self.deep, self.feed = size, deep, feed
        self.path = ToolpathBuilder().rapid(z=deep)

    def to(self, x: float, y: float, z: float = 0.0) -> None:
        """Above the place, then down at a feed."""
        self.path.rapid(z=self.deep).rapid(x, y).line(z=z, feed=self.feed)

    def around(self, x: float, y: float, side: float) -> list[tuple[float, float]]:
        return [(x + side, y), (x + side, y + side), (x, y + side), (x, y)]

    def profile(self, x: float, y: float) -> None:
        """A square in three passes: lead-in, a ramp along the first side, tabs in the last pass,
        overlap, lead-out."""
        s, d, f = self.size, self.deep, self.feed
        self.path.source = "CUT/PROFILE"
        self.to(x, y - 0.2 * s)
        self.path.line(x, y, feed=f)
        for number in (1, 2, 3):
            level = -d * number / 3.0
            self.path.line(x + s, y, level, feed=f)  # the ramp
            for corner in self.around(x, y, s)[1:]:
                self.path.line(*corner, feed=f)
        self.path.line(x + 0.4 * s, y, feed=f)
        self.path.line(z=-0.5 * d, feed=f).line(x + 0.6 * s, y, feed=f).line(z=-d, feed=f)
        self.path.line(x + s, y, feed=f).line(x + s, y + 0.3 * s, feed=f)
        self.path.line(x + s, y + 0.4 * s, -0.5 * d, feed=f).line(x + s, y + 0.6 * s, feed=f)
        self.path.line(x + s, y + 0.7 * s, -d, feed=f)
        for corner in self.around(x, y, s)[1:]:
            self.path.line(*corner, feed=f)
        self.path.line(x + 0.1 * s, y, feed=f).line(x + 0.1 * s, y - 0.2 * s, feed=f)

    def bore(self, x: float, y: float) -> None:
        """A circle by a helix of three turns, then one level turn."""
        r = 0.4 * self.size
        self.path.source = "CUT/BORE"
        self.to(x + r, y)
        for number in (1, 2, 3):
            z = -self.deep * number / 3.0
            self.path.arc(x + r, y, z, centre=(x, y), ccw=True, feed=self.feed)
        self.path.arc(x + r, y, centre=(x, y), ccw=True, feed=self.feed)
        self.path.line(x, y, feed=self.feed)

    def pocket(self, x: float, y: float, rings: int = 4) -> None:
        """Rings from the middle out at two depths, the way between them at depth."""
        for z in (-0.5 * self.deep, -self.deep):
            self.path.source = "CUT/POCKET"
            step = 0.5 * self.size / rings
            self.to(x, y, z)
            for ring in range(1, rings + 1):
                half = ring * step
                self.path.line(x - half, y - half, feed=self.feed)
                for corner in self.around(x - half, y - half, 2.0 * half):
                    self.path.line(*corner, feed=self.feed)

    def holes(self, x: float, y: float) -> None:
        """Two holes in three pecks each, rapids between these, and a dwell."""
        for number in range(2):
            self.path.source = "CUT/HOLE"
            self.to(x + number * 0.3 * self.size, y, -self.deep / 3.0)
            for peck in (2, 3):
                self.path.rapid(z=self.deep).rapid(z=-self.deep * (peck - 1.2) / 3.0)
                self.path.line(z=-self.deep * peck / 3.0, feed=self.feed)
            self.path.event(Kind.DWELL, 1.0).rapid(z=self.deep)

    def carve(self, x: float, y: float, points: int = 24) -> None:
        """A line in space that sinks to the depth and climbs out, as a V bit does."""
        self.path.source = "CUT/CARVE"
        self.to(x, y)
        for number in range(1, points + 1):
            share = number / points
            z = -self.deep * math.sin(math.pi * share)
            self.path.line(
                x + self.size * share,
                y + 0.3 * self.size * math.sin(7.0 * share),
                -0.0 if number == points else z,
                feed=self.feed,
            )

    def finish(self) -> Toolpath:
        self.path.source = ""
        return self.path.rapid(z=self.deep).rapid(0.0, 0.0).event(Kind.END).finish()


def everything(size: float, deep: float, feed: float) -> Toolpath:
    """Make one shape of each kind, beside each other."""
    shop = Shop(size, deep, feed)
    shop.profile(size, size)
    shop.bore(3.2 * size, 1.5 * size)
    shop.pocket(5.0 * size, 1.5 * size)
    shop.holes(1.3 * size, 1.5 * size)
    shop.carve(size, 2.6 * size)
    return shop.finish()
