"""Hundreds of drawings, of the samples: `python tests/benchmarks/batch_drawings.py FOLDER 500`.

A tenth are the logo, as many as half are parts of 3 to 12 corners with curves (SVG), the rest the
pieces of the first machine. All differ by content.
"""

from __future__ import annotations

import math
import shutil
import sys
from pathlib import Path

SAMPLES = Path(__file__).parents[2] / "samples"
PIECES = sorted((SAMPLES / "pieces").glob("pic-mmh-*.dxf"))


def make_drawings(folder: Path, count: int) -> int:
    """`count` drawings in folders of fifty; how many there are."""
    for number in range(count):
        place = folder / f"{number // 50:02}"
        place.mkdir(parents=True, exist_ok=True)
        if number % 10 == 0:
            _with_comment(SAMPLES / "logo.dxf", place / f"{number:03}.dxf", number)
        elif number % 2:
            (place / f"{number:03}.svg").write_text(_polygon(number), encoding="utf-8")
        else:
            piece = PIECES[number % len(PIECES)]
            _with_comment(piece, place / f"{number:03}.dxf", number)
    return sum(1 for path in folder.rglob("*") if path.is_file())


def _with_comment(source: Path, place: Path, number: int) -> None:
    """The drawing with a comment of its own before it (group 999)."""
    shutil.copyfile(source, place)
    text = place.read_text(encoding="utf-8")
    place.write_text(f"999\nvariation {number}\n{text}", encoding="utf-8")


def _polygon(number: int) -> str:
    """A part of 3 to 12 corners, with a hole and a rounded slot."""
    corners = 3 + number % 10
    radius = 1.0 + (number % 7) / 7.0
    points = " ".join(
        f"{2.5 + radius * math.cos(2 * math.pi * n / corners + number):.4f},"
        f"{2.5 + radius * math.sin(2 * math.pi * n / corners + number):.4f}"
        for n in range(corners)
    )
    return (
        '<svg xmlns="http://www.w3.org/2000/svg" width="5mm" height="5mm" viewBox="0 0 5 5">'
        f'<polygon points="{points}"/><circle cx="2.5" cy="2.5" r="0.3"/>'
        '<path d="M 2.2 3 C 2.4 3.2 2.6 3.2 2.8 3 S 2.4 2.9 2.2 3 Z"/></svg>\n'
    )


if __name__ == "__main__":
    print(make_drawings(Path(sys.argv[1]), int(sys.argv[2])))
