"""The accumulators against numpy on the whole of the data."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.verification.figures import Figure
from camtool.verification.nearest import ranges, run_offsets, run_peaks

P95_ACCURACY = 0.004


def filled(parts: list[np.ndarray]) -> Figure:
    figure, begun = Figure(), 0
    for part in parts:
        numbers = np.arange(begun, begun + len(part))
        figure.add(part, np.column_stack([numbers, -numbers]).astype(float), numbers)
        begun += len(part)
    return figure


@pytest.mark.parametrize(
    "draw",
    [
        lambda rng, n: rng.random(n) * 0.02,
        lambda rng, n: np.abs(rng.normal(size=n)) * 1e-4,
        lambda rng, n: np.exp(rng.normal(size=n) * 5.0 - 8.0),
        lambda rng, n: np.full(n, 0.0123),
        lambda rng, n: np.where(rng.random(n) < 0.97, 0.0, 0.5),
    ],
    ids=["uniform", "normal", "many decades", "constant", "mostly zero"],
)
@pytest.mark.parametrize("count", [1, 7, 20, 5000])
def test_a_figure_is_that_of_all_the_data(draw, count: int) -> None:
    data = draw(np.random.default_rng(count), count)
    figure = filled(np.array_split(data, 5))
    assert figure.count == count
    assert figure.max == data.max()
    assert figure.row == np.argmax(data)
    assert figure.at_mm == (float(np.argmax(data)), -float(np.argmax(data)))
    assert figure.rms == pytest.approx(math.sqrt((data**2).mean()), rel=1e-12)
    exact = np.percentile(data, 95, method="inverted_cdf")
    assert figure.p95 == pytest.approx(exact, rel=P95_ACCURACY)


@given(st.lists(st.floats(1e-8, 1e3), min_size=1, max_size=40))
def test_the_percentile_is_within_its_accuracy(values: list[float]) -> None:
    exact = np.percentile(values, 95, method="inverted_cdf")
    assert filled([np.array(values)]).p95 == pytest.approx(exact, rel=P95_ACCURACY)


def test_zero_tiny_and_huge_errors_have_bins() -> None:
    assert filled([np.zeros(3)]).p95 == 0.0
    assert filled([np.full(3, 1e-12)]).p95 == 0.0
    assert filled([np.full(3, 1e9)]).p95 <= 1e9


def test_nothing_added_is_not_a_number() -> None:
    figure = filled([np.empty(0)])
    assert math.isnan(figure.max)
    assert math.isnan(figure.rms)
    assert math.isnan(figure.p95)
    assert figure.row == -1


def test_memory_does_not_grow_with_the_stream() -> None:
    figure = Figure()
    before = sum(np.asarray(value).nbytes for value in vars(figure).values())
    for _ in range(50):
        figure.add(np.random.default_rng(0).random(1000), np.zeros((1000, 2)), np.zeros(1000, int))
    assert sum(np.asarray(value).nbytes for value in vars(figure).values()) <= before + 64


@given(st.lists(st.integers(0, 2), max_size=30), st.integers(1, 7))
def test_runs_are_those_of_a_loop(labels: list[int], longest: int) -> None:
    expected = [0]
    for index in range(1, len(labels) + 1):
        begun = expected[-1]
        if index == len(labels) or labels[index] != labels[begun] or index - begun == longest:
            expected.append(index)
    assert run_offsets(np.array(labels, dtype=np.int64), longest).tolist() == expected


def test_peaks_boxes_and_ranges() -> None:
    values = np.array([1.0, 3.0, 3.0, 2.0, 2.0, 0.0])
    offsets = np.array([0, 3, 5, 6])
    assert run_peaks(values, offsets).tolist() == [1, 3, 5]
    assert ranges(np.array([5, 1]), np.array([3, 2])).tolist() == [5, 6, 7, 1, 2]
