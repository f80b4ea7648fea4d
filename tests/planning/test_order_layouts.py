"""Layouts as they come: how much longer the rapids are than a strong solver's, or than any can be.

Where each item is cut from one place, the bound of Held and Karp says what no tour can be under.
Where items have many ways, OR-tools' routing (guided local search) is the referee, when it is
there; each item is a group of places of which one is visited.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from camtool.planning.order import Choices, best_order, travel_mm
from tests.oracles import tours

Floats = np.ndarray
NONE = np.empty((0, 2), dtype=np.int64)
MOST_EXCESS = 1.03


def _random(seed: int) -> np.random.Generator:
    return np.random.default_rng(seed)


def grid(columns: int, rows: int, pitch: float = 10.0) -> Floats:
    return pitch * np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), -1).reshape(-1, 2)


def clusters(seed: int) -> Floats:
    rng = _random(seed)
    return (rng.uniform(0, 400, (8, 1, 2)) + rng.normal(0, 8, (8, 25, 2))).reshape(-1, 2)


def ring(count: int, radius: float) -> Floats:
    angle = np.linspace(0, 2 * np.pi, count, endpoint=False)
    return 100 + radius * np.column_stack([np.cos(angle), np.sin(angle)])


PLACES: dict[str, Callable[[], Floats]] = {
    "random 50": lambda: _random(1).uniform(0, 200, (50, 2)),
    "random 200": lambda: _random(2).uniform(0, 200, (200, 2)),
    "random 400": lambda: _random(3).uniform(0, 200, (400, 2)),
    "random 600": lambda: _random(4).uniform(0, 200, (600, 2)),
    "grid 12 by 12": lambda: grid(12, 12),
    "grid 20 by 10": lambda: grid(20, 10),
    "grid with gaps": lambda: grid(18, 18)[_random(6).permutation(324)[:220]],
    "rings": lambda: np.concatenate([ring(24, 20), ring(48, 50), ring(72, 80)]),
    "letters": lambda: np.concatenate(
        [
            _random(k).normal(0, 3, (12, 2)) + np.array([14 * (k % 15), 25 * (k // 15)])
            for k in range(30)
        ]
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", PLACES)
def test_places_against_what_no_tour_can_be_under(name: str) -> None:
    places = PLACES[name]()
    choices = alone(places)
    found = travel_mm(choices, best_order(choices, NONE), (0.0, 0.0), (0.0, 0.0))
    bound = tours.least_length(np.concatenate([np.zeros((1, 2)), places]), found, 1500)
    assert bound - 1e-6 <= found <= MOST_EXCESS * bound


def boxes(seed: int, count: int, size: float) -> Choices:
    """Rectangles of all sizes, each to be begun at any corner."""
    rng = _random(seed)
    corner = rng.uniform(0, 200, (count, 1, 2))
    sides = rng.uniform(0.2 * size, size, (count, 1, 2))
    places = (corner + sides * np.array([[0, 0], [1, 0], [1, 1], [0, 1]])).reshape(-1, 2)
    return Choices(np.repeat(np.arange(count), 4), places, places)


def strokes(seed: int, count: int, size: float) -> Choices:
    """Lines to be cut from either end."""
    rng = _random(seed)
    start = rng.uniform(0, 200, (count, 2))
    end = start + rng.normal(0, size, (count, 2))
    both = np.stack([start, end], axis=1)
    owner = np.repeat(np.arange(count), 2)
    return Choices(owner, both.reshape(-1, 2), both[:, ::-1].reshape(-1, 2))


def gears(seed: int, count: int, teeth: int) -> Choices:
    """Round parts of many vertices."""
    rng = _random(seed)
    centre, radius = rng.uniform(0, 300, (count, 1, 2)), rng.uniform(3, 15, (count, 1, 1))
    angle = np.linspace(0, 2 * np.pi, teeth, endpoint=False)
    places = (centre + radius * np.stack([np.cos(angle), np.sin(angle)], -1)).reshape(-1, 2)
    return Choices(np.repeat(np.arange(count), teeth), places, places)


def alone(places: Floats) -> Choices:
    """Each item cut from its one place."""
    return Choices(np.arange(len(places)), places, places)


# The bound is slow to come close where places crowd together, so that these are for the referee.
WAYS: dict[str, Callable[[], Choices]] = {
    "long and narrow": lambda: alone(_random(5).uniform(0, 1, (300, 2)) * (1000, 20)),
    "clusters": lambda: alone(clusters(7)),
    "more clusters": lambda: alone(clusters(8)),
    "small boxes": lambda: boxes(1, 60, 8.0),
    "many boxes": lambda: boxes(2, 120, 10.0),
    "large boxes": lambda: boxes(3, 40, 60.0),
    "strokes": lambda: strokes(4, 60, 10.0),
    "long strokes": lambda: strokes(5, 80, 50.0),
    "many strokes": lambda: strokes(6, 150, 15.0),
    "gears": lambda: gears(7, 30, 12),
    "more gears": lambda: gears(8, 50, 8),
}


@pytest.mark.slow
@pytest.mark.referee
@pytest.mark.parametrize("name", WAYS)
def test_ways_against_a_strong_solver(name: str) -> None:
    pytest.importorskip("ortools")
    choices = WAYS[name]()
    found = travel_mm(choices, best_order(choices, NONE), (0.0, 0.0), (0.0, 0.0))
    assert found <= MOST_EXCESS * solved(choices, seconds=20)


def solved(choices: Choices, seconds: int) -> float:
    """The length of the solver's tour from (0, 0) and back, mm."""
    from ortools.constraint_solver import pywrapcp, routing_enums_pb2

    entry = np.concatenate([np.zeros((1, 2)), choices.entry])
    leave = np.concatenate([np.zeros((1, 2)), choices.exit])
    apart = np.hypot(*(leave[:, None] - entry[None]).transpose(2, 0, 1))
    whole_um = np.rint(1000.0 * apart).astype(int).tolist()
    manager = pywrapcp.RoutingIndexManager(len(entry), 1, 0)
    routing = pywrapcp.RoutingModel(manager)
    way = routing.RegisterTransitMatrix(whole_um)
    routing.SetArcCostEvaluatorOfAllVehicles(way)
    for item in range(len(choices)):
        rows = np.flatnonzero(choices.owner == item).tolist()
        routing.AddDisjunction([manager.NodeToIndex(row + 1) for row in rows], 10**9, 1)
    wanted = pywrapcp.DefaultRoutingSearchParameters()
    wanted.first_solution_strategy = routing_enums_pb2.FirstSolutionStrategy.PATH_CHEAPEST_ARC
    wanted.local_search_metaheuristic = (
        routing_enums_pb2.LocalSearchMetaheuristic.GUIDED_LOCAL_SEARCH
    )
    wanted.time_limit.seconds = seconds
    answer = routing.SolveWithParameters(wanted)
    assert answer is not None
    return float(answer.ObjectiveValue()) / 1000.0
