"""How long fitting and recognising take: `pytest -m benchmark tests/benchmarks/test_fit_speed.py`.

As in test_main_job.py, the ratio within a group is the answer; counts are in `extra_info`, which
`--benchmark-json` writes.
"""

from typing import Any

import numpy as np
import pytest

from camtool.geometry.curves import BezierCurve, EllipseCurve, FunctionCurve
from camtool.geometry.fit import fit_curve
from camtool.geometry.polylines import Polyline
from camtool.geometry.simplify import recognise_arcs
from tests.oracles.curves import fewest_chords
from tests.oracles.recognise import explode

pytestmark = pytest.mark.benchmark
TOLERANCE_MM = 0.0005
VERTICES = 100_000


def quadratics(count: int) -> list[BezierCurve]:
    """Random quadratic Béziers in squares of 5 to 50 mm."""
    rng = np.random.default_rng(1)
    return [
        BezierCurve(rng.uniform(0.0, 1.0, (3, 2)) * rng.uniform(5.0, 50.0)) for _ in range(count)
    ]


@pytest.mark.benchmark(group="900 quadratic Béziers at 0.5 µm, against 4,000 points of each")
@pytest.mark.parametrize("what", ["points", "fit"])
def test_quadratics(benchmark: Any, what: str) -> None:
    curves = quadratics(900)
    t = np.linspace(0.0, 1.0, 4_000)
    if what == "points":
        assert len(benchmark.pedantic(lambda: [c.point(t) for c in curves], rounds=5)) == 900
        return
    fits = benchmark.pedantic(
        lambda: [fit_curve(curve, TOLERANCE_MM) for curve in curves], rounds=5, warmup_rounds=1
    )
    assert max(fit.max_mm for fit in fits) <= TOLERANCE_MM
    moves = sum(len(fit.vertices) - 1 for fit in fits[:30])
    fine = np.linspace(0.0, 1.0, 20_000)
    chords = sum(fewest_chords(curve.point(fine), TOLERANCE_MM) for curve in curves[:30])
    benchmark.extra_info["moves"] = moves
    benchmark.extra_info["chords"] = chords
    assert chords > 3 * moves


@pytest.mark.benchmark(group="ellipses: compiled, and as any curve given by functions")
@pytest.mark.parametrize("way", ["pieces", "functions"])
def test_ellipses(benchmark: Any, way: str) -> None:
    curves: list[Any] = [
        EllipseCurve(np.zeros(2), np.array([20.0, 0.0]), np.array([0.0, minor]))
        for minor in np.linspace(1.0, 19.0, 50)
    ]
    if way == "functions":
        curves = [FunctionCurve(c.point, c.tangent, c.breaks) for c in curves]
    fits = benchmark.pedantic(
        lambda: [fit_curve(curve, TOLERANCE_MM) for curve in curves], rounds=5, warmup_rounds=1
    )
    assert max(fit.max_mm for fit in fits) <= TOLERANCE_MM


def waves(decimals: int | None) -> Polyline:
    """Half circles up and down, a hundred thousand chords in all."""
    each = 25
    rows = [(4.0 * i, 0.0, 1.0 if i % 2 else -1.0) for i in range(VERTICES // each)]
    points = explode(np.array([*rows, (4.0 * len(rows), 0.0, 0.0)]), np.pi / each, decimals)
    return Polyline(np.column_stack([points, np.zeros(len(points))]))


@pytest.mark.benchmark(
    group="arcs recognised among 100,000 chords, against checking the path once"
)
@pytest.mark.parametrize("what", ["check", "exact", "rounded", "none"])
def test_recognition(benchmark: Any, what: str) -> None:
    path = waves(4 if what == "rounded" else None)
    if what == "check":
        made = benchmark.pedantic(lambda: Polyline(path.vertices), rounds=5)
        assert len(made) == len(path)
        return
    if what == "none":
        points = np.cumsum(np.random.default_rng(2).normal(size=(VERTICES, 2)), axis=0)
        path = Polyline(np.column_stack([points, np.zeros(VERTICES)]))
    _, count = benchmark.pedantic(
        lambda: recognise_arcs(path, TOLERANCE_MM), rounds=5, warmup_rounds=1
    )
    assert count == (0 if what == "none" else VERTICES // 25)
