"""The paths that a page shows, read back from its data and from its pixels, and those of a program
of plain G-code, read from its text: nothing here is shared with what writes either."""

from __future__ import annotations

import base64
import json
import math
import re
from dataclasses import dataclass, field

import numpy as np
import shapely

from camtool.arrays import Bools, Floats
from tests.oracles import svg_page

PARTS = 64
"""A line becomes so many chords, an arc eight times as many: of a whole turn these are 2e-5 of its
radius off."""

POINT_MM = 0.1
"""Lines of pictures have a point each so far, and `PARTS` of them at most."""

_WORD = re.compile(r"([A-Z])\s*([-+]?(?:\d+\.?\d*|\.\d+))")


@dataclass
class Paths:
    """Moves from above as dense points (K, 2) mm each; those along Z alone as one point."""

    cuts: list[Floats] = field(default_factory=list)
    rapids: list[Floats] = field(default_factory=list)
    z: list[tuple[float, float]] = field(default_factory=list)
    """Of each of the cuts, where it begins and ends."""
    tools: list[int] = field(default_factory=list)
    """Of each of the cuts, the number of the last T with an M6."""

    def box(self) -> tuple[float, float, float, float]:
        """left, low, right, top of all moves."""
        points = np.concatenate([*self.cuts, *self.rapids])
        return (*points.min(axis=0).tolist(), *points.max(axis=0).tolist())


def program_paths(text: str) -> Paths:
    """The moves of a program in plain G-code: G0 to G3 with I and J from the start, G90 or G91,
    millimetres or inches, from (0, 0)."""
    found, at, word = Paths(), [0.0, 0.0, 0.0], 0
    unit, absolute, tool = 1.0, True, 0
    for line in text.splitlines():
        words = _WORD.findall(re.sub(r"\([^)]*\)|;.*", "", line.upper()))
        codes = [float(number) for letter, number in words if letter == "G"]
        unit = 25.4 if 20.0 in codes else 1.0 if 21.0 in codes else unit
        absolute = (absolute or 90.0 in codes) and 91.0 not in codes
        word = next((int(code) for code in codes if code in (0.0, 1.0, 2.0, 3.0)), word)
        if ("M", "6") in words:
            tool = next(int(number) for letter, number in words if letter == "T")
        said = {letter: float(number) * unit for letter, number in words if letter in "XYZIJ"}
        assert not any(letter == "R" for letter, _ in words), "an arc by its radius"
        if not said or not {4.0, 10.0, 28.0, 43.0, 53.0, 92.0}.isdisjoint(codes):
            continue
        to = [
            at[k] if axis not in said else said[axis] + (0.0 if absolute else at[k])
            for k, axis in enumerate("XYZ")
        ]
        points = np.array([at[:2]])
        if word >= 2:
            centre = at[0] + said.get("I", 0.0), at[1] + said.get("J", 0.0)
            points = _turned(at[:2], to[:2], centre, ccw=word == 3)
        elif at[:2] != to[:2]:
            points = straight(at[:2], to[:2])
        if word == 0:
            found.rapids.append(points)
        else:
            found.cuts.append(points)
            found.z.append((at[2], to[2]))
            found.tools.append(tool)
        at = to
    return found


def straight(begin: list[float], end: list[float], parts: int = PARTS) -> Floats:
    """(K, 2) points from end to end."""
    return np.linspace(begin, end, parts + 1)


def _turned(
    begin: list[float], end: list[float], centre: tuple[float, float], ccw: bool
) -> Floats:
    first = math.atan2(begin[1] - centre[1], begin[0] - centre[0])
    last = math.atan2(end[1] - centre[1], end[0] - centre[0])
    turn = (last - first) % math.tau if ccw else (first - last) % math.tau
    turn = math.tau if math.dist(begin, end) < 1e-9 else turn
    radii = math.dist(begin, centre), math.dist(end, centre)
    return bent(centre, radii, first, turn if ccw else -turn)


def bent(
    centre: tuple[float, float], radii: tuple[float, float], first: float, turn: float
) -> Floats:
    """(K, 2) points of an arc from an angle on, whose radius may change evenly."""
    share = np.linspace(0.0, 1.0, 8 * PARTS + 1)
    angle, radius = first + share * turn, radii[0] + share * (radii[1] - radii[0])
    return np.column_stack(
        [centre[0] + radius * np.cos(angle), centre[1] + radius * np.sin(angle)]
    )


# Pages.


def svg_paths(element: svg_page.Element, flipped: bool = False) -> list[Floats]:
    """The lines and arcs of all paths below an element; `flipped`: its Y grows downwards."""
    found = []
    for path in svg_page.paths(element):
        for piece in path:
            if isinstance(piece, svg_page.Arc):
                x, y = piece.begin[0] - piece.centre[0], piece.begin[1] - piece.centre[1]
                radii = piece.radius, piece.radius
                found.append(bent(piece.centre, radii, math.atan2(y, x), piece.sweep))
            else:
                parts = min(PARTS, math.ceil(math.dist(piece.begin, piece.end) / POINT_MM) or 1)
                found.append(straight(list(piece.begin), list(piece.end), parts))
    return [points * (1.0, -1.0) for points in found] if flipped else found


def live_rows(page: str) -> int:
    """Number of rows that the page of `send --live` shows as done."""
    return int(json.loads(_of(page, "sent"))["row"]) + 1


def viewer_column(page: str, name: str) -> Floats:
    """A column of numbers of the viewer's page."""
    kind, offset, count, *unit = json.loads(_of(page, "head"))["columns"][name]
    data = base64.b64decode(_of(page, "columns"))
    if not kind.startswith("v"):
        return np.frombuffer(data, {"u1": "u1", "f4": "<f4"}[kind], count, offset).astype(float)
    found, stride = [0] * int(kind[1:]), int(kind[1:])
    for _ in range(count):
        digits = [data[offset] & 127]
        while data[offset] & 128:
            offset += 1
            digits.append(data[offset] & 127)
        offset += 1
        number = sum(digit << 7 * place for place, digit in enumerate(digits))
        found.append(found[-stride] + (-(number + 1) // 2 if number % 2 else number // 2))
    return np.array(found[stride:], dtype=float) * (unit[0] if unit else 1.0)


def viewer_paths(page: str, rows: int | None = None) -> Paths:
    """The moves of the viewer's page, or of its first rows."""

    def column(name: str) -> Floats:
        return viewer_column(page, name)

    found = Paths()
    at = column("move_start").tolist()
    bends = dict(
        zip(column("move_arc").tolist(), column("move_bend").reshape(-1, 3).tolist(), strict=True)
    )
    for row, (kind, end) in enumerate(
        zip(column("move_kind").tolist(), column("move_end").reshape(-1, 3).tolist(), strict=True)
    ):
        if rows is not None and row >= rows:
            break
        if kind <= 3:
            points = straight(at[:2], end[:2]) if at[:2] != end[:2] else np.array([at[:2]])
            if kind >= 2:
                x, y, sweep = bends[row]
                first = math.atan2(at[1] - y, at[0] - x)
                radii = math.dist(at[:2], (x, y)), math.dist(end[:2], (x, y))
                points = bent((x, y), radii, first, sweep)
            (found.cuts if kind else found.rapids).append(points)
        at = end
    return found


def _of(page: str, name: str) -> str:
    found = re.search(rf'<script type="[a-z/]*" id="{name}">(.*?)</script>', page, re.S)
    assert found is not None
    return found[1].strip()


def embedded_pictures(page: str) -> list[str]:
    """The SVG pictures that a page holds as data addresses, in its order."""
    held = re.findall(r'src="data:image/svg\+xml;base64,([^"]+)"', page)
    return [base64.b64decode(each).decode() for each in held]


# Comparing.


def farthest(points: list[Floats], others: list[Floats]) -> float:
    """Largest distance of the points from the lines through the others, mm."""
    chords = [np.stack([path[:-1], path[1:]], axis=1) for path in _once(others) if len(path) > 1]
    dots = [shapely.points(path) for path in _once(others) if len(path) == 1]
    tree = shapely.STRtree(np.concatenate([*map(shapely.linestrings, chords), *dots]))
    flat = shapely.points(np.concatenate(_once(points)))
    _, apart = tree.query_nearest(flat, all_matches=False, return_distance=True)
    return float(apart.max())


def _once(paths: list[Floats]) -> list[Floats]:
    """Each of the paths once: lower passes go along the same."""
    return list({path.tobytes(): path for path in paths if len(path)}.values())


def beside(one: list[Floats], other: list[Floats]) -> float:
    """Largest distance between two drawings, mm, in both directions."""
    return max(farthest(one, other), farthest(other, one))


def ink_beside(ink: Bools, paths: list[Floats], box: tuple[float, ...]) -> tuple[float, float]:
    """Largest distances, in pixels, of ink (rows, columns) from paths and of paths from ink.

    The `box` (left, low, right, top) of the paths is laid on the extents of the ink, with
    one scale along X and Y."""
    rows, columns = np.nonzero(ink)
    left, low, right, top = box
    across = (columns.max() - columns.min()) / (right - left)
    down = (rows.max() - rows.min()) / (top - low)
    assert abs(across - down) * max(right - left, top - low) < 6.0, (across, down)
    scale = max(across, down)
    middle = 0.5 * (columns.max() + columns.min()), 0.5 * (rows.max() + rows.min())
    centre = 0.5 * (left + right), 0.5 * (low + top)
    laid = [
        np.column_stack(
            [
                middle[0] + scale * (path[:, 0] - centre[0]),
                middle[1] - scale * (path[:, 1] - centre[1]),
            ]
        )
        for path in paths
    ]
    pixels = np.column_stack([columns, rows]).astype(float)
    tree = shapely.STRtree(shapely.points(pixels))
    flat = shapely.points(np.concatenate(laid)[::5])
    _, apart = tree.query_nearest(flat, all_matches=False, return_distance=True)
    return farthest([pixels], laid), float(apart.max())
