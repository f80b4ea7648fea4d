"""How long offsets take: `pytest -m benchmark tests/benchmarks/test_offset_speed.py`.

The ratio within a group is the answer. The result here is exact to 1e-6 mm at every distance. For
shapely the shape is flattened to chords that stray from its arcs by no more than `FLAT_MM`, the
fitting tolerance of micro machines, and so are the arcs about its corners: that is what "the same
accuracy" means here, though it is 500 times coarser. At small distances shapely takes off vertices
nearer together than 1 % of the distance before it begins, and is quicker than it would be.
"""

import math
from typing import Any

import numpy as np
import pytest
import shapely

from camtool.geometry.measure import point_at, signed_areas
from camtool.geometry.offset import offset_shape
from camtool.geometry.polylines import Polyline, Polylines, Segments

pytestmark = pytest.mark.benchmark
FLAT_MM = 0.0005


def wavy(count: int) -> Polyline:
    """A wavy ring about 100 mm wide, every other segment an arc."""
    rng = np.random.default_rng(1)
    angle = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    radius = 50.0 * (1.0 + 0.1 * np.sin(7.0 * angle) + 0.02 * np.sin(count / 33.0 * angle))
    bulge = rng.uniform(-0.5, 0.5, count) * (rng.random(count) < 0.5)
    return Polyline(np.column_stack([radius * np.cos(angle), radius * np.sin(angle), bulge]), True)


def flattened(p: Polyline) -> np.ndarray:
    """The points of the path with arcs as chords within FLAT_MM."""
    segments = Segments.of(p)
    radius = np.where(segments.is_arc, segments.radius, 1.0)
    most = 2.0 * np.arccos(np.clip(1.0 - FLAT_MM / radius, -1.0, 1.0))
    counts = np.where(segments.is_arc, np.ceil(np.abs(segments.sweep) / most), 1).astype(np.int64)
    rows = np.repeat(np.arange(len(segments)), counts)
    place = np.arange(len(rows)) - np.repeat(np.cumsum(counts) - counts, counts)
    return point_at(segments, rows, place / counts[rows])


@pytest.mark.parametrize("what", ["shapely", "camtool"])
@pytest.mark.parametrize("d", [0.005, 0.02, 0.1, 0.5, 5.0, -0.02, -0.5, -5.0])
@pytest.mark.benchmark(group="10,000 segments")
def test_ten_thousand(benchmark: Any, d: float, what: str) -> None:
    benchmark.group = f"10,000 segments with arcs by {d} mm, against shapely at 0.5 µm"
    p = wavy(10_000)
    lines, polygon = Polylines.of([p]), shapely.Polygon(flattened(p))
    assert polygon.is_valid
    step = 2.0 * math.acos(max(1.0 - FLAT_MM / abs(d), -1.0))
    quarter = max(1, math.ceil(0.5 * math.pi / step))
    benchmark.extra_info["chords"] = len(polygon.exterior.coords)
    if what == "shapely":
        benchmark.pedantic(
            lambda: polygon.buffer(-d, quad_segs=quarter), rounds=5, warmup_rounds=1
        )
        return
    found = benchmark.pedantic(lambda: offset_shape(lines, d), rounds=5, warmup_rounds=1)
    area = polygon.buffer(-d, quad_segs=quarter).area
    benchmark.extra_info["segments"] = len(found.vertices)
    assert signed_areas(found).sum() == pytest.approx(area, rel=1e-4)


@pytest.mark.benchmark(group="50 rings of 300 segments, against shapely at 0.5 µm")
@pytest.mark.parametrize("what", ["shapely", "camtool"])
def test_rings(benchmark: Any, what: str) -> None:
    p = wavy(300)
    if what == "camtool":
        lines = Polylines.of([p])
        found = benchmark.pedantic(
            lambda: [offset_shape(lines, 0.8 * k) for k in range(1, 51)], rounds=3, warmup_rounds=1
        )
        assert sum(len(each) for each in found) > 45
        return
    polygon = shapely.Polygon(flattened(p))
    buffers = benchmark.pedantic(
        lambda: [
            polygon.buffer(-0.8 * k, quad_segs=math.ceil(0.8 * math.sqrt(k / FLAT_MM)))
            for k in range(1, 51)
        ],
        rounds=3,
        warmup_rounds=1,
    )
    assert len(buffers) == 50
