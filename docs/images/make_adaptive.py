"""Draws adaptive pockets of FreeCAD and camtool beside each other, coloured by engagement:

    PYTHONPATH=. python docs/images/make_adaptive.py [FOLDER]

writes docs/images/adaptive-beside.png with four pockets, and into a folder each of all ten alone.
FreeCAD's planner is Debian's freecad-python3 (tests/oracles/adaptive_peers.py). Both clear the
same pocket with the same tool at the same step-over. What exceeds the engagement of that step is
red; links at depth, and what cuts nothing, are grey. Another version of FreeCAD draws another
picture; nothing compares it.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
from make_images import shrink
from PIL import Image, ImageDraw

from camtool.arrays import Floats
from camtool.kernels.engagement import Cleared
from camtool.pictures.colours import ENGAGED_STYLES
from camtool.pictures.engaged import steps_of
from tests.benchmarks.test_adaptive_speed import ISLANDS, LINK_FEED_MM_MIN, own_runs
from tests.oracles.adaptive_peers import CUTTING, LINK, freecad_plan
from tests.oracles.contours import C_SHAPE, CIRCLE, gear, star
from tests.oracles.engagement import chords_of
from tests.oracles.swept import area_of
from tests.paths import scaled
from tests.planning.pocket_cases import region_of
from tests.validation.test_validation_adaptive import SHAPES, Shape, limit_of

FOUR = ("inner corner", "letter B", "star", "gear with a bore")
POCKETS = {name: shape for name, shape in SHAPES.items() if shape.share == 0.2} | {
    "four islands": Shape(ISLANDS, 5.0, 0.2),
    "star": Shape([scaled(star(5, 4.0, 12.0), 2.0)], 1.5, 0.2),
    "gear with a bore": Shape([scaled(gear(9, 6.0, 10.0), 2.0), scaled(CIRCLE, 0.4)], 1.5, 0.2),
    "C": Shape([scaled(C_SHAPE, 2.0)], 1.5, 0.2),
    "circle": Shape([CIRCLE], 1.5, 0.2),
}
SIZE, MARGIN, FINER = 420, 16, 2
LINKS, ABOVE = "#d5d5d5", "#e4002b"
MAX_SHARE = 1.05
"""Engagements up to this part of the limit are not red: they are known to 2 degrees."""
Way = tuple[bool, Floats]
"""True for a cut, False for a link; and its points (n, 2)."""


def peer_ways(shape: Shape) -> list[Way]:
    """The ways of FreeCAD; a helix clears a ring of half the tool's diameter."""
    area = area_of(region_of(shape.paths)).simplify(1e-4 * shape.radius_mm)
    angle = np.linspace(0.0, math.tau, 100)
    ring = 0.5 * shape.radius_mm * np.column_stack([np.cos(angle), np.sin(angle)])
    ways: list[Way] = []
    for centre, own in freecad_plan(area, shape.radius_mm, shape.share, finish=False).regions:
        ways.append((True, np.array(centre) + ring))
        ways += [(kind == CUTTING, np.array(way)) for kind, way in own if kind in (CUTTING, LINK)]
    return [(is_cut, points) for is_cut, points in ways if len(points) > 1]


def own_ways(shape: Shape) -> list[Way]:
    """The ways of camtool, links and cuts told apart by their feeds."""
    ways: list[Way] = []
    for run in own_runs(shape, limit_of(shape)):
        is_link = run.feed_mm_min == LINK_FEED_MM_MIN
        for rows in np.split(np.arange(len(is_link)), np.flatnonzero(np.diff(is_link)) + 1):
            part = run.vertices[rows[0] : rows[-1] + 2]
            ways.append((not is_link[rows[0]], chords_of(part, 1e-3 * shape.radius_mm)[:, :2]))
    return ways


def colours(ways: list[Way], radius_mm: float, limit: float) -> list[list[str]]:
    """Return the colours of the moves of each way."""
    every = np.concatenate([points for _, points in ways])
    extents = np.stack([every.min(axis=0), every.max(axis=0)])
    cleared = Cleared(extents, radius_mm, np.array([-np.inf, -np.inf, np.inf, np.inf]))
    found = list[list[str]]()
    for is_cut, points in ways:
        flat = np.column_stack(
            [np.full(len(points) - 1, radius_mm), np.zeros((len(points) - 1, 4))]
        )
        rows = np.column_stack([points[:-1], points[1:], flat])
        moved = np.hypot(*(points[1:] - points[:-1]).T) > 1e-9
        thick_mm, coarse = 4e-3 * radius_mm, math.radians(2.0)
        angles = cleared.judge(
            rows, moved & is_cut, thick_mm, math.pi, coarse, coarse_rad=coarse, known_rad=-1.0
        )
        table = [ENGAGED_STYLES[step][0] for step in steps_of(angles).tolist()]
        is_above = angles > MAX_SHARE * limit
        found.append([ABOVE if above else own for above, own in zip(is_above, table, strict=True)])
    return found


def picture(shape: Shape, ways: list[Way]) -> Image.Image:
    """Draw the pocket and the ways of the tool's centre."""
    every = np.concatenate([path.vertices[:, :2] for path in shape.paths])
    low, high = every.min(axis=0), every.max(axis=0)
    scale = FINER * (SIZE - 2 * MARGIN) / float((high - low).max())
    middle = 0.5 * (low + high)

    def pixels(points: Floats) -> list[tuple[float, float]]:
        flat = (points - middle) * [scale, -scale] + 0.5 * FINER * SIZE
        return [(x, y) for x, y in flat.tolist()]

    image = Image.new("RGB", (FINER * SIZE, FINER * SIZE), "white")
    draw = ImageDraw.Draw(image)
    own = colours(ways, shape.radius_mm, limit_of(shape))
    coloured = list(zip(ways, own, strict=True))
    for is_cuts in (False, True):
        for (is_cut, points), table in coloured:
            if is_cut != is_cuts:
                continue
            place = pixels(points)
            for number, colour in enumerate(table):
                draw.line(
                    place[number : number + 2], fill=colour if is_cut else LINKS, width=FINER
                )
    for path in shape.paths:
        rows = np.column_stack(
            [path.vertices[:, :2], np.zeros(len(path.vertices)), path.vertices[:, 2]]
        )
        draw.line(pixels(chords_of(np.concatenate([rows, rows[:1]]), 0.01)[:, :2]), fill="black",
                  width=FINER)  # fmt: skip
    return image.resize((SIZE, SIZE), Image.Resampling.LANCZOS)


def beside(name: str) -> Image.Image:
    """FreeCAD's on the left, camtool's on the right, with their names above."""
    shape = POCKETS[name]
    both = Image.new("RGB", (2 * SIZE, SIZE + MARGIN), "white")
    draw = ImageDraw.Draw(both)
    for number, (program, ways) in enumerate(
        (("FreeCAD", peer_ways(shape)), ("camtool", own_ways(shape)))
    ):
        both.paste(picture(shape, ways), (number * SIZE, MARGIN))
        draw.text((number * SIZE + MARGIN, 2), f"{program}: {name}", fill="black")
    return both


def main() -> None:
    """Make the picture of four pockets, and those of all of them."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else None
    rows = []
    for name in POCKETS if folder else FOUR:
        made = beside(name)
        if folder:
            made.save(folder / f"{name.replace(' ', '-')}.png")
        if name in FOUR:
            rows.append(made)
    file = Path(__file__).parent / "adaptive-beside.png"
    whole = Image.new("RGB", (2 * SIZE, sum(row.height for row in rows)), "white")
    for number, row in enumerate(rows):
        whole.paste(row, (0, number * row.height))
    whole.save(file)
    shrink(file)


if __name__ == "__main__":
    main()
