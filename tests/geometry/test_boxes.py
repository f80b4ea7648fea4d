"""The index of boxes finds what comparing all of them finds, however many there are."""

import numpy as np
import pytest

from camtool.geometry.boxes import (
    BLOCKS_AT_A_TIME,
    FAN,
    IN_ORDER,
    BoxIndex,
    box_pairs,
    near_points,
)


def scattered(rng: np.random.Generator, count: int, most_mm: float) -> np.ndarray:
    """Boxes on a plate of 100 mm; some are points, some lie upon each other."""
    low = np.round(rng.uniform(0.0, 100.0, (count, 2)), 1)
    return np.concatenate([low, low + np.round(rng.uniform(0.0, most_mm, (count, 2)), 1)], axis=1)


def by_all(one: np.ndarray, other: np.ndarray) -> list[tuple[int, int]]:
    low = np.maximum(one[:, None, :2], other[None, :, :2])
    high = np.minimum(one[:, None, 2:], other[None, :, 2:])
    rows = np.nonzero((low <= high).all(axis=2))
    return list(zip(*(row.tolist() for row in rows), strict=True))


@pytest.mark.parametrize("count", [0, 1, FAN, FAN + 1, FAN * FAN + 1, IN_ORDER, IN_ORDER + 1])
@pytest.mark.parametrize("asked", [0, 1, 40])
def test_the_index_finds_all_that_touch(count: int, asked: int) -> None:
    rng = np.random.default_rng(count + asked)
    boxes, others = scattered(rng, asked, 5.0), scattered(rng, count, 3.0)
    found = BoxIndex(others).touching(boxes)
    assert list(zip(*(row.tolist() for row in found), strict=True)) == by_all(boxes, others)


def test_what_touches_everything_comes_in_batches() -> None:
    """A thousand boxes upon each other, ten times over: the rows never descend."""
    boxes = np.tile([0.0, 0.0, 1.0, 1.0], (1000, 1))
    batches = list(BoxIndex(np.tile(boxes, (4, 1))).pairs(boxes))
    assert len(batches) > 10
    assert max(len(row) for row, _ in batches) <= BLOCKS_AT_A_TIME * FAN
    rows = np.concatenate([row for row, _ in batches])
    assert len(rows) == 4_000_000
    assert (np.diff(rows) >= 0).all()


def test_pairs_come_by_rows_and_from_left_to_right() -> None:
    rng = np.random.default_rng(3)
    boxes, others = scattered(rng, 50, 5.0), scattered(rng, 200, 5.0)
    batches = list(box_pairs(boxes, others, reach_mm=0.5))
    one, other = (np.concatenate(rows) for rows in zip(*batches, strict=True))
    wide = boxes + 0.5 * np.array([-1.0, -1.0, 1.0, 1.0])
    assert sorted(zip(one.tolist(), other.tolist(), strict=True)) == by_all(wide, others)
    assert (np.lexsort((others[other, 0], one)) == np.arange(len(one))).all()


@pytest.mark.parametrize("differing", [False, True])
def test_points_no_farther_apart_than_the_reach(differing: bool) -> None:
    rng = np.random.default_rng(4)
    points, places = rng.integers(0, 30, (80, 2)) * 1.0, rng.integers(0, 30, (3000, 2)) * 1.0
    reach = rng.integers(0, 6, 80) * 1.0 if differing else 5.0
    apart = np.sqrt(((points[:, None] - places[None]) ** 2).sum(axis=2))
    wanted = np.nonzero(apart <= np.reshape(reach, (-1, 1)))
    for found, expected in zip(near_points(points, places, reach), wanted, strict=True):
        assert (found == expected).all()
