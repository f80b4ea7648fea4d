"""What the tests of the Matlab router share."""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from camtool.importers.read import read_drawing
from camtool.planning.job import job_of
from camtool.planning.plan import plan
from camtool.target.registry import LoadedTarget, load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath

ROOT = Path(__file__).parents[3]

Point = tuple[float, float]

STAR = [
    (151, 86),
    (400, 265),
    (630, 86),
    (575, 431),
    (815, 639),
    (501, 642),
    (400, 999),
    (294, 645),
    (6, 665),
    (220, 428),
    (153, 86),
]
"""The thesis's example, 0.1 mm (L3196-3228)."""

STAR_LXY = [
    [249, 230, 55, 240, 314, 101, 106, 288, 214, 67],
    [179, 179, 345, 208, 3, 357, 354, 20, 237, 342],
]
STAR_VELXY = [
    [480, 480, -77, 480, -480, -136, -144, -480, 433, -94],
    [345, -374, 480, 416, 5, 480, -480, 33, -480, -480],
]


def router(*settings: str) -> LoadedTarget:
    """The target with settings of `[dialect]` ("grid_mm=0.1") or with a full key."""
    full = [text if "." in text.split("=")[0] else f"dialect.{text}" for text in settings]
    return load_target("matlab-router", settings=full)


def strokes(*paths: Sequence[Point], feed: float = 225.0) -> Toolpath:
    """A toolpath that cuts these strokes (mm) as planning would."""
    path = ToolpathBuilder().rapid(z=9.0)
    for first, *rest in paths:
        path.rapid(*first).line(z=-1.0, feed=feed)
        for point in rest:
            path.line(*point, feed=feed)
        path.rapid(z=9.0)
    return path.rapid(0.0, 0.0).event(Kind.END).finish()


def posted(sample: str, target: LoadedTarget) -> bytes:
    """The program of a sample file."""
    drawing = read_drawing(ROOT / "samples" / sample)
    return bytes(target.target.write(plan(drawing, job_of(), target.machine), target.machine).data)


def arrays(program: bytes) -> list[dict[str, list[list[int]]]]:
    """Every job's arrays by name, as plainly as can be (a third reader, of our own files)."""
    jobs = []
    for section in program.decode("ascii").split("%% job ")[1:]:
        found = re.findall(r"^(\w+) = (?:\[([^]]*)\]|(\d+));", section, re.MULTILINE)
        jobs.append(
            {
                name: [[int(word) for word in row.split()] for row in body.strip().split("\n")]
                if body
                else [[int(number)]]
                for name, body, number in found
            }
        )
    return jobs


def cut_points(toolpath: Toolpath) -> list[list[Point]]:
    """The strokes of a toolpath, mm: the start of each cut and the ends behind it."""
    found: list[list[Point]] = []
    before = -2
    rows = np.flatnonzero(
        toolpath.is_feed
        & (toolpath.end[:, 2] < 0.0)
        & (toolpath.end[:, :2] != toolpath.starts[:, :2]).any(axis=1)
    )
    for row in rows.tolist():
        if row != before + 1:
            x, y = toolpath.starts[row, :2].tolist()
            found.append([(x, y)])
        x, y = toolpath.end[row, :2].tolist()
        found[-1].append((x, y))
        before = row
    return found
