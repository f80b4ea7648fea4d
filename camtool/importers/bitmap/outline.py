"""The lines along which a picture is as dark as a threshold: marching squares.

Between two neighbouring pixels of which one is dark and one is light, the line crosses where the
darkness, which changes evenly between their centres, is that of the threshold: an edge that was
drawn with smooth edges, or photographed, is found to a small part of a pixel, one of black and
white alone in the middle between two pixels. Where four pixels meet crosswise their mean decides.

Lines are closed, do not cross, and have what is dark on their left. Beyond the picture it is
light. Units are pixels, x to the right from its left edge, y upwards from its lower edge."""

from __future__ import annotations

import numpy as np

from camtool.arrays import Bools, Floats, Ints
from camtool.importers.bitmap.pixels import Ink

INWARD = 1e-3
"""A line stays this far from the centres of pixels: at a centre up to four lines would meet."""

TOP, RIGHT, BOTTOM, LEFT = range(4)

_LINES: dict[int, tuple[tuple[int, int], ...]] = {
    1: ((LEFT, TOP),),
    2: ((TOP, RIGHT),),
    3: ((LEFT, RIGHT),),
    4: ((RIGHT, BOTTOM),),
    6: ((TOP, BOTTOM),),
    7: ((LEFT, BOTTOM),),
    8: ((BOTTOM, LEFT),),
    9: ((BOTTOM, TOP),),
    11: ((BOTTOM, RIGHT),),
    12: ((RIGHT, LEFT),),
    13: ((RIGHT, TOP),),
    14: ((TOP, LEFT),),
}
"""Sides at which a line enters and leaves a square of four pixels, by the sum over its dark ones:
1 upper left, 2 upper right, 4 lower right, 8 lower left."""

_SADDLES = {
    (5, True): ((RIGHT, TOP), (LEFT, BOTTOM)),
    (5, False): ((LEFT, TOP), (RIGHT, BOTTOM)),
    (10, True): ((TOP, LEFT), (BOTTOM, RIGHT)),
    (10, False): ((TOP, RIGHT), (BOTTOM, LEFT)),
}
"""Lines in a square of two dark pixels that meet at a corner, by the case as above and whether its
middle is dark."""


def crossings(ink: Ink, level: float) -> int:
    """Count the points of all contours: each lies between a dark and a light pixel."""
    dark = ink >= level
    across = int((dark[:, 1:] != dark[:, :-1]).sum()) + int((dark[1:] != dark[:-1]).sum())
    return across + sum(int(edge.sum()) for edge in (dark[0], dark[-1], dark[:, 0], dark[:, -1]))


def outlines(ink: Ink, level: float) -> list[Floats]:
    """Return the closed lines at the darkness `level`, points (n, 2) in pixels each, n ≥ 4."""
    height, width = ink.shape
    field = np.zeros((height + 2, width + 2), dtype=np.float32)
    field[1:-1, 1:-1] = ink
    begin, end = _directed(field, field >= level, level)
    order = np.argsort(begin)
    begin, end = begin[order], end[order]
    followers = np.searchsorted(begin, end).tolist()
    points = _places(field, begin, level)
    points -= 0.5
    points[:, 1] = height - points[:, 1]
    np.clip(points, 0.0, [width, height], out=points)
    lines: list[Floats] = []
    visited = np.zeros(len(begin), dtype=np.bool_).tolist()
    for first in range(len(visited)):
        if visited[first]:
            continue
        row, run = first, []
        while not visited[row]:
            visited[row] = True
            run.append(row)
            row = followers[row]
        lines.append(points[run])
    return lines


def _directed(field: Ink, dark: Bools, level: float) -> tuple[Ints, Ints]:
    """Return the sides (K,), (K,) at which a line enters and leaves each square between four
    pixels.

    Sides are numbered: first those between neighbours in a row, then those between neighbours in a
    column."""
    width = field.shape[1]
    corners = [dark[:-1, :-1], dark[:-1, 1:], dark[1:, 1:], dark[1:, :-1]]
    code = np.zeros(corners[0].shape, dtype=np.uint8)
    for position, corner in enumerate(corners):
        code += corner.astype(np.uint8) << np.uint8(position)
    row, column = np.nonzero((code > 0) & (code < 15))
    code = code[row, column]
    squares = row * width + column
    sides = np.column_stack(
        [squares, field.size + squares + 1, squares + width, field.size + squares]
    )
    middle = 0.25 * (
        field[row, column].astype(np.float64)
        + field[row, column + 1]
        + field[row + 1, column]
        + field[row + 1, column + 1]
    )
    pairs = [(code == case, lines) for case, lines in _LINES.items()]
    pairs += [
        ((code == case) & ((middle >= level) == joined), lines)
        for (case, joined), lines in _SADDLES.items()
    ]
    begin, end = [], []
    for is_case, lines in pairs:
        for enters, leaves in lines:
            begin.append(sides[is_case, enters])
            end.append(sides[is_case, leaves])
    return np.concatenate(begin), np.concatenate(end)


def _places(field: Ink, side: Ints, level: float) -> Floats:
    """Return the points (K, 2), column and row, where lines cross these sides, interpolated
    between the centres of pixels."""
    is_vertical = side >= field.size
    start_pixels = np.where(is_vertical, side - field.size, side)
    row, column = np.divmod(start_pixels, field.shape[1])
    start_values = field[row, column].astype(np.float64)
    end_values = field[row + is_vertical, column + ~is_vertical].astype(np.float64)
    share = np.clip((level - start_values) / (end_values - start_values), INWARD, 1.0 - INWARD)
    return np.column_stack([column + ~is_vertical * share, row + is_vertical * share])


def enclosed_area(points: Floats) -> float:
    """Return the area inside a closed line, square pixels; positive if the inside is dark."""
    x, y = (points - points[0]).T
    return float(0.5 * (x * np.roll(y, -1) - np.roll(x, -1) * y).sum())
