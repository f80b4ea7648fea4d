"""Slow twins of LinuxCNC's own ways, and what LinuxCNC itself did with some programs.

`MEASURED` was taken from LinuxCNC 2.9.0~pre1 (Debian package linuxcnc-uspace), its trivial
kinematics and simulated axes of 30.48 mm/s and 508 mm/s² with a servo period of 1 ms, by sampling
the commanded position of the three joints in every period: in how many periods it changed, and by
how much the path stays away from each programmed corner, µm. `MODES` in the same way, from
programs that say G61 and G64 themselves.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

Point = tuple[float, ...]


def merge(points: list[Point], apart: list[bool], tolerance: float) -> list[int]:
    """The chain of each move from points[k] to points[k + 1], as a list of waiting points."""
    numbers: list[int] = []
    base, waiting, number = points[0], list[Point](), -1
    for k, new in enumerate(points[1:]):
        if apart[k] or not waiting or not _linkable(base, waiting, new, tolerance):
            if waiting:
                base = waiting[-1]
            waiting, number = [], number + 1
        waiting.append(new)
        numbers.append(number)
    return numbers


def _linkable(base: Point, waiting: list[Point], new: Point, tolerance: float) -> bool:
    if len(waiting) > 100 or new == base:
        return False
    return all(off_line(base, new, point) <= tolerance for point in waiting)


def off_line(base: Point, end: Point, point: Point) -> float:
    """Distance of a point from the line between two others."""
    way = [e - b for b, e in zip(base, end, strict=True)]
    along = sum(w * (p - b) for w, p, b in zip(way, point, base, strict=True))
    share = min(max(along / sum(w * w for w in way), 0.0), 1.0)
    return math.dist(point, [b + share * w for b, w in zip(base, way, strict=True)])


@dataclass(frozen=True)
class Measured:
    """A program behind `G0 X0 Y0 Z0`, the mode of its corners with the tolerance in mm, and what
    was measured: periods of 1 ms in motion, and µm at the corners of lines."""

    name: str
    program: str
    mode: str
    tolerance_mm: float
    periods: int
    corners_um: tuple[float, ...] = ()


def _rectangle(x: float, y: float, feed: float) -> str:
    return f"F{feed:g}\nG1 X{x:g}\nY{y:g}\nX0\nY0\n"


_SLOT = "F900\nG1 X5\nG3 X5 Y2 I0 J1\nG1 X0\nG3 X0 Y0 I0 J-1\n"
_ZIGZAG = "F900\n" + "".join(f"G1 X{0.5 * k:g} Y{0.5 * (k % 2):g}\n" for k in range(1, 21))
_POLYGON = "F1500\n" + "".join(
    f"G1 X{5.0 * math.sin(k / 60.0):.3f} Y{5.0 - 5.0 * math.cos(k / 60.0):.3f}\n"
    for k in range(1, 300)
)
_ARCS = "F900\nG1 X5\nG3 X7 Y2 I2 J0\nG1 X10 Y6\nG2 X14 Y6 I2 J0\nG3 X18 Y6 I2 J0\nG1 X20\n"
_ANGLES = "F1200\nG1 X5\nX9 Y1\nX9.5 Y6\nX3 Y5.5\nX8 Y4 Z1\nX8 Y4 Z4\n"

MEASURED = (
    Measured("trapezoid", "F600\nG1 X10\n", "exact-path", 0.0, 1022),
    Measured("triangle", "G0 X0.5\n", "exact-path", 0.0, 65),
    Measured("diagonal", "G0 X10 Y10 Z3\n", "exact-path", 0.0, 390),
    Measured("stops", _rectangle(10, 6, 600), "exact-path", 0.0, 3290),
    Measured("exact stops", _rectangle(10, 6, 600), "exact-stop", 0.0, 3282),
    Measured("rounded", _rectangle(10, 6, 600), "blend", 0.01, 3284, (10.0,) * 3),
    Measured("wider", _rectangle(10, 6, 600), "blend", 0.1, 3201, (100.0,) * 3),
    Measured("slow", _rectangle(2, 2, 60), "blend", 0.1, 8003, (1.0,) * 3),
    Measured("circle", "F1500\nG3 X0 Y0 I-10 J0\n", "exact-path", 0.0, 2614),
    Measured("small circle", "F1500\nG3 X0 Y0 I-0.5 J0\n", "exact-path", 0.0, 273),
    Measured("slot", _SLOT, "exact-path", 0.0, 1132),
    Measured("slot, blended", _SLOT, "blend", 0.01, 1162),
    Measured("arcs", _ARCS, "blend", 0.05, 2391),
    Measured("zigzag", _ZIGZAG, "blend", 0.02, 1363, (20.0,) * 19),
    Measured("polygon", _POLYGON, "blend", 0.01, 1082),
    Measured("polygon, stops", _POLYGON, "exact-path", 0.0, 7484),
    Measured("angles", _ANGLES, "blend", 0.02, 1659, (20.0,) * 5),
)


@dataclass(frozen=True)
class Modes:
    """A program with path modes of its own, and how far the path stays from some places (x, y) mm,
    µm."""

    program: str
    corners_um: dict[tuple[float, float], float]


_NEARLY = "X4 Y0.1\nX6 Y0\nX8 Y0.1\nX10 Y5\n"

MODES = (
    # The move before a corner says how it is met, the tighter of both tolerances holds.
    Modes("F900\nG64 P0.5\nG1 X10\nG61\nY10\n", {(10, 0): 233.7}),
    Modes("F900\nG61\nG1 X10\nG64 P0.5\nY10\n", {(10, 0): 0.0}),
    Modes("F900\nG64 P0.5\nG1 X10\nG64 P0.1\nY10\nX0\n", {(10, 0): 100.1, (10, 10): 100.1}),
    # Without P as far as the speed needs, at most a quarter of the shorter move.
    Modes("F900\nG64\nG1 X2\nY2\nX4\nY4.5\n", {(2, 0): 233.7, (2, 2): 233.7, (4, 2): 233.7}),
    # Q merges lines, P rounds what corners are left.
    Modes(
        f"F900\nG64 P0.05 Q0.2\nG1 X2 Y0\n{_NEARLY}",
        {(2, 0): 25.0, (4, 0.1): 50.0, (6, 0): 75.0, (8, 0.1): 50.1},
    ),
)
