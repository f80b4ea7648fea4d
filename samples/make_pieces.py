"""Writes drawings of the parts that the theses measured, as far as their text gives the sizes.

    python samples/make_pieces.py [FOLDER]

Each has a few lines; its name begins with the target of its machine. docs/validation.md gives the
sources of the numbers. The positions on the table are our choice. All lengths are mm.
"""

from __future__ import annotations

import sys
from pathlib import Path

from dxf_writer import dxf
from emblems import emblem, puma
from make_samples import straight
from shapes import Layer, Line, Polyline, Shape, Sheet

APART = 0.2
"""Distance of two parallel lines, which the theses do not give."""

PUMAS = {
    "pic-mmh-puma-5": (4.86, 4.96, 0.35),
    "pic-mmh-puma-1.2": (1.17, 1.19, 0.08),
    "pic-mmh-puma-1": (0.97, 0.99, 0.07),
    "flashcut-puma": (4.0, 4.082, 0.288),
}
EMBLEMS = {
    "pic-mmh-gmm-5": (5.0, 4.997),
    "pic-mmh-gmm-1.2": (1.21, 1.08),
    "flashcut-lmm": (12.0, 11.993),
}
"""Overall sizes, and of the pumas the width of the ears. Their shapes are in lost figures, and
`emblems` redraws them. The sizes on the parallel-port machine, 4 and 12 mm, are those that the
other thesis gives for the parts of its predecessor."""


def two_lines(length: float, axis: int) -> Shape:
    """Two parallel lines along an axis, joined at their far ends, the first one in +."""
    corners = [(0.0, 0.0), (length, 0.0), (length, APART), (0.0, APART)]
    return straight([(a, b) if axis == 0 else (b, a) for a, b in corners], closed=False)


def clockwise(centre: tuple[float, float], radius: float) -> Shape:
    """A clockwise circle that begins at its left end."""
    (x, y), half = centre, -1.0
    return Polyline([(x - radius, y, half), (x + radius, y, half)])


def rectangle(width: float, height: float) -> Shape:
    """A rectangle from (0, 0) counter-clockwise. With negative sizes it first goes along -X
    and -Y, so that all four edges are approached across the backlash."""
    return straight([(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)])


COLOURS = (5, 1, 3, 6)
"""Colours of the layers, by index."""

DIAGONALS: list[Shape] = [Line((0.0, 0.0), (10.0, 5.0)), Line((10.0, 0.0), (0.0, 5.0))]
"""Diagonals of the rectangle, on a layer of their own, because they are cut more slowly."""


def pieces() -> dict[str, dict[str, list[Shape]]]:
    """The shapes of each drawing by layer, by the drawing's name."""
    middle = (3.0, 3.0)
    plain: dict[str, list[Shape]] = {
        "pic-mmh-lines-x": [two_lines(2.5, 0)],
        "pic-mmh-lines-y": [two_lines(1.2, 1)],
        "pic-mmh-square": [rectangle(-2.5, -2.5)],
        "pic-mmh-square-up": [rectangle(2.5, 2.5)],
        "pic-mmh-circles": [clockwise(middle, radius) for radius in (3.0, 2.0, 1.0)],
        "flashcut-lines-x": [two_lines(10.0, 0)],
        "flashcut-lines-y": [two_lines(10.0, 1)],
        "flashcut-10x10": [rectangle(10.0, 10.0)],
        "flashcut-10x5": [rectangle(10.0, 5.0)],
        "flashcut-3x10": [rectangle(3.0, 10.0)],
        "flashcut-diagonals": [rectangle(10.0, 5.0)],
        "flashcut-circle": [clockwise((5.0, 5.0), 5.0)],
    }
    found = {name: {"CUT": shapes} for name, shapes in plain.items()}
    found["flashcut-diagonals"]["SLOW"] = DIAGONALS
    found |= {name: puma(*size) for name, size in PUMAS.items()}
    found["pic-mmh-puma-1.2-halves"] = puma(*PUMAS["pic-mmh-puma-1.2"], halves=True)
    found |= {name: emblem(*size) for name, size in EMBLEMS.items()}
    return found


def main(folder: Path) -> None:
    """Write all pieces into the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, shapes in pieces().items():
        layers = [
            Layer(layer, COLOURS[k], "#000000", held)
            for k, (layer, held) in enumerate(shapes.items())
        ]
        text = dxf(Sheet(name, (10.0, 10.0), layers, {}))
        (folder / f"{name}.dxf").write_text(text, encoding="ascii", newline="\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "pieces")
