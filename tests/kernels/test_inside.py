"""Which points a ring holds, against its oracle; paths held, against all their points asked."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.geometry.nesting import inside
from camtool.geometry.polylines import Polylines, Segments
from tests.oracles import inside as oracle
from tests.oracles.contours import CIRCLE, CRESCENT, FILLETED, KEYHOLE, RANDOM, SQUARE, comb

pytestmark = pytest.mark.checked


@given(st.integers(0, 2**32 - 1), st.sampled_from(list(RANDOM)))
def test_random_contours(seed: int, kind: str) -> None:
    rng = np.random.default_rng(seed)
    drawn = RANDOM[kind](rng)
    if drawn is None:
        return
    ring = Segments.of(Polylines.of([drawn[0]]))
    points = rng.uniform(-1.2, 1.2, (400, 2)) * drawn[1]
    # Level with vertices, and on them.
    points[:50, 1] = rng.choice(ring.start[:, 1], 50)
    points[50:60] = rng.choice(ring.start, 10)
    assert (inside(points, ring) == oracle.inside(points, ring)).all()


def test_on_a_grid() -> None:
    # Vertices, chords and extremes of arcs lie on the grid.
    x, y = np.meshgrid(np.arange(-12.0, 25.0, 0.5), np.arange(-12.0, 25.0, 0.5))
    points = np.column_stack([x.ravel(), y.ravel()])
    for p in (CIRCLE, CRESCENT, FILLETED, KEYHOLE, SQUARE, comb(6)):
        ring = Segments.of(p)
        assert (inside(points, ring) == oracle.inside(points, ring)).all()
        assert 0 < inside(points, ring).sum() < len(points)
