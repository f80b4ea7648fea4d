"""A feed, or a column of them, against a limit."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from camtool.machine.model import FEED_TOLERANCE, exceeds

LIMITS = st.floats(1e-3, 1e6)
PARTS = st.sampled_from([0.5, 1.0, 1.0 + 0.5 * FEED_TOLERANCE, 1.0 + 2.0 * FEED_TOLERANCE, 2.0])


@given(LIMITS, st.lists(st.one_of(PARTS, st.just(np.nan), st.floats(0.9, 1.1)), max_size=8))
def test_a_column_is_its_feeds_one_by_one(limit: float, parts: list[float]) -> None:
    feeds = np.array(parts, dtype=np.float64) * limit
    assert exceeds(feeds, limit).tolist() == [exceeds(feed, limit) for feed in feeds.tolist()]


def test_rounding_is_not_above() -> None:
    feeds = np.array([1.0, 1.0 + 0.5 * FEED_TOLERANCE, 1.0 + 2.0 * FEED_TOLERANCE, np.nan])
    assert exceeds(feeds, 1.0).tolist() == [False, False, True, False]
