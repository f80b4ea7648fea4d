"""How long a pocket takes, against its rings alone and against shapely's buffers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import shapely

from camtool.geometry.measure import sample
from camtool.geometry.offset import offset_shape
from camtool.geometry.polylines import Polyline, Polylines
from camtool.planning.reach import unreached
from tests.planning.pocket_cases import region_of, runs_of, work_of

pytestmark = pytest.mark.benchmark
SEGMENTS = 300
DIAMETER_MM, STEP_OVER = 1.0, 0.48


def blossom() -> Polyline:
    """300 lines and arcs around five lobes, 60 mm wide: 50 rings and some."""
    angle = np.arange(SEGMENTS) * 2.0 * np.pi / SEGMENTS
    radius = 30.0 + 4.0 * np.sin(5.0 * angle)
    bulge = np.where(np.arange(SEGMENTS) % 3 == 0, 0.2, 0.0)
    points = radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    return Polyline(np.column_stack([points, bulge]), closed=True)


def rings(region: Polylines) -> int:
    """Each ring from the one before it, as the pocket has them, and nothing else."""
    count, ring = 0, offset_shape(region, 0.5 * DIAMETER_MM)
    while len(ring):
        count, ring = count + 1, offset_shape(ring, STEP_OVER * DIAMETER_MM)
    return count


def buffers(region: Polylines) -> int:
    """The same by shapely, arcs as chords."""
    area = shapely.Polygon(sample(region[0], 0.05)).buffer(-0.5 * DIAMETER_MM)
    count = 0
    while not area.is_empty:
        count, area = count + 1, area.buffer(-STEP_OVER * DIAMETER_MM)
    return count


def pocketed(region: Polylines) -> int:
    """The whole pocket: rings, ways between them, slots looked for, what stays uncut."""
    return len(runs_of(work_of(list(region), DIAMETER_MM, step_over=STEP_OVER)))


def zigzagged(region: Polylines) -> int:
    """The same in straight strokes."""
    made = work_of(list(region), DIAMETER_MM, step_over=STEP_OVER, pattern="zigzag")
    return len(runs_of(made))


@pytest.mark.benchmark(group="pocket of 300 segments in 50 rings and more, under 1 s")
@pytest.mark.parametrize(
    ("work", "least"),
    [(pocketed, 1), (zigzagged, 1), (rings, 50), (buffers, 50)],
    ids=["pocket", "zigzag", "rings alone", "shapely buffers"],
)
def test_pocket(benchmark: Any, work: Callable[[Polylines], int], least: int) -> None:
    region = region_of([blossom()])
    assert benchmark.pedantic(work, (region,), rounds=5, warmup_rounds=1) >= least


@pytest.mark.benchmark(group="what stays uncut of 300 segments, against the opening alone")
@pytest.mark.parametrize("part", ["unreached", "opening"])
def test_unreached(benchmark: Any, part: str) -> None:
    region = region_of([blossom()])

    def opening(lines: Polylines, radius: float) -> Polylines:
        return offset_shape(offset_shape(lines, radius), -radius)

    work = unreached if part == "unreached" else opening
    assert benchmark.pedantic(work, (region, 2.0), rounds=9, warmup_rounds=1) is not None
