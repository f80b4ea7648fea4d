"""Scatter: the numbers drawn, what they do to the slides; blocks and order do not matter."""

import math

import numpy as np
import pytest

from camtool.arrays import Floats
from camtool.simulation.mechanics import Mechanics
from camtool.simulation.motion import ALL
from tests.oracles.mechanics import deviates, split_mix_64
from tests.oracles.path_machine import path_machine

COUNT = 20_000
SIGMA = 0.004
SCATTER = tuple(f"axes.{axis}.repeatability_mm={SIGMA}" for axis in "xyz")


def drawn(*settings: str, count: int = COUNT) -> Floats:
    """Errors (count, 3) of the slides after each of so many reversals of all axes."""
    points = np.tile(np.where(np.arange(count) % 2 == 0, -1.0, 1.0)[:, None], (1, 3))
    mechanics = Mechanics(path_machine(*SCATTER, *settings), np.zeros(3), ALL)
    slide, reversals = mechanics.follow(points, np.array([0, count]))
    assert reversals.tolist() == [[count] * 3]
    return slide - points


def test_the_twin_is_the_published_generator() -> None:
    """Outputs for the key 1234567, as published with the generator's reference code."""
    assert split_mix_64(1234567, 5) == [
        6457827717110365317,
        3203168211198807973,
        9817491932198370423,
        4593380528125082431,
        16408922859458223821,
    ]


@pytest.mark.parametrize("seed", [0, 1, 2**32 - 1])
def test_the_numbers_are_those_of_the_twin(seed: int) -> None:
    found = drawn(f"mechanics.seed={seed}", count=300)
    for axis in range(3):
        turns = np.where(np.arange(300) % 2 == 0, -1.0, 1.0)
        want = [
            at + SIGMA * number - at
            for at, number in zip(turns, deviates(seed, axis, 300), strict=True)
        ]
        assert np.array_equal(found[:, axis], want)


def test_moments_bounds_and_independence() -> None:
    """Within four standard errors: mean 0, deviation 1, skewness 0, fourth moment 3 − 6/(5·12)
    (sums of twelve uniform numbers); neighbours, axes and seeds have nothing to do with one
    another."""
    values = drawn() / SIGMA
    other = drawn("mechanics.seed=1") / SIGMA
    error = 4.0 / math.sqrt(COUNT)
    for axis in range(3):
        z = values[:, axis]
        assert abs(z.mean()) < error
        assert abs(z.var() - 1.0) < error * math.sqrt(1.9)
        assert abs((z**3).mean()) < error * math.sqrt(15.0)
        assert abs((z**4).mean() - 2.9) < error * math.sqrt(96.0)
        assert np.abs(z).max() < 6.0
        for twin in (np.roll(z, 1), np.roll(z, 2), values[:, axis - 1], other[:, axis]):
            assert abs((z * twin).mean()) < error


def test_the_distribution_is_nearly_normal() -> None:
    """Largest distance from the normal one: below the 0.1 % limit of Kolmogorov's test."""
    z = np.sort(drawn()[:, 0]) / SIGMA
    normal = np.array([0.5 * (1.0 + math.erf(value / math.sqrt(2.0))) for value in z.tolist()])
    steps = np.arange(1, COUNT + 1) / COUNT
    assert np.abs(normal - steps).max() < 1.95 / math.sqrt(COUNT)


def test_a_seed_is_one_machine() -> None:
    assert np.array_equal(drawn(count=50), drawn(count=50))
    assert not np.isclose(drawn(count=50), drawn("mechanics.seed=1", count=50)).any()


def test_a_stretch_keeps_its_number_and_the_first_has_none() -> None:
    """Repeatability is what ISO 230-2 calls it: from one side, at one place, again and again."""
    ways = [np.linspace(a, b, 101)[1:] for a, b in ((0, 1), (1, 0), (0, 1), (1, 0))]
    points = np.zeros((400, 3))
    points[:, 0] = np.concatenate(ways)
    mechanics = Mechanics(path_machine(*SCATTER, "axes.x.backlash_mm=0.05"), np.zeros(3), ALL)
    error = mechanics.follow(points, np.array([0, 400]))[0][:, 0] - points[:, 0]
    first, second, third = (SIGMA * number for number in deviates(0, 0, 3))
    assert not error[:100].any()
    for part, number in ((error[120:200], first + 0.05), (error[220:300], second)):
        assert part == pytest.approx(number, abs=1e-12)
    assert error[320:] == pytest.approx(third + 0.05, abs=1e-12)
