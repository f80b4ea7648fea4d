"""The mechanics against a literal loop, and each effect against mathematics."""

import dataclasses
import itertools
import math

import numpy as np
import pytest

from camtool.arrays import Floats, Ints
from camtool.machine.model import Machine
from camtool.records import replace
from camtool.simulation.mechanics import Mechanics
from camtool.simulation.motion import ALL, IDEAL, Effects
from tests.oracles.mechanics import LiteralMechanics
from tests.oracles.path_machine import STEP, path_machine

START = np.zeros(3)
MAP = (
    "play_map.use=true",
    "play_map.x.x_mm=[-1.0, -0.2, 0.1, 0.4]",
    "play_map.x.y_mm=[-1.0, 0.0, 1.0]",
    "play_map.x.play_mm=[[0.02, 0.05, 0.0], [0.03, 0.01, 0.1]]",
    "play_map.y.x_mm=[0.0, 1.0]",
    "play_map.y.y_mm=[-0.3, 0.0, 0.3]",
    "play_map.y.play_mm=[[0.04], [0.06]]",
    "controller.machine_zero_mm=[0.05, -0.1, 0.0]",
)
PLAIN = (
    "axes.x.backlash_mm=0.05",
    "axes.y.backlash_mm=0.07",
    "axes.z.backlash_mm=0.03",
    "axes.x.compensation_mm=0.04",
    "axes.y.compensation_mm=0.09",
    "axes.z.compensation_mm=0.02",
    "axes.x.real_step_mm=0.005017",
    "axes.y.real_step_mm=0.00499",
    "axes.z.real_step_mm=0.00501",
)
EVERYTHING = (
    *MAP,
    *PLAIN,
    "axes.x.repeatability_mm=0.004",
    "axes.y.repeatability_mm=0.002",
    "axes.z.repeatability_mm=0.001",
    "mechanics.squareness_rad=0.003",
    "mechanics.seed=7",
)


def slides(machine: Machine, points: Floats, effects: Effects = ALL) -> Floats:
    """Slides (K, 3) for all points in one go, from rest at part zero."""
    return Mechanics(machine, START, effects).follow(points, whole(points))[0]


def whole(points: Floats) -> Ints:
    return np.array([0, len(points)])


def wander(seed: int, count: int = 600) -> Floats:
    """Positions (count, 3) that run, turn, stand and jitter below half a step."""
    rng = np.random.default_rng(seed)
    way = np.sin(np.cumsum(rng.uniform(0.0, 0.3, (count, 3)), axis=0)) * [0.6, 0.4, 0.2]
    still = rng.random((count, 3)) < 0.2
    for axis in range(3):
        keep = np.maximum.accumulate(np.where(still[:, axis], 0, np.arange(count)))
        way[:, axis] = way[keep, axis]
    return np.asarray(way + rng.uniform(-0.4, 0.4, (count, 3)) * STEP)


def along(axis: int, *turns: float, parts: int = 500) -> Floats:
    """Move one axis over these turning points, the others at 0."""
    values = np.concatenate(
        [np.linspace(a, b, parts + 1)[1:] for a, b in itertools.pairwise(turns)]
    )
    points = np.zeros((len(values), 3))
    points[:, axis] = values
    return points


STARTS = [
    (f"controller.start_play={play}", f"controller.start_direction={direction}")
    for play in ("preloaded", "centred")
    for direction in "+-"
]


@pytest.mark.parametrize("start", STARTS)
@pytest.mark.parametrize("settings", [PLAIN, EVERYTHING, EVERYTHING[1:]])
def test_everything_equals_the_literal_loop(
    settings: tuple[str, ...], start: tuple[str, ...]
) -> None:
    machine = path_machine(*settings, *start)
    for seed in range(5):
        points = wander(seed)
        cuts = np.sort(np.random.default_rng(seed).integers(0, len(points) + 1, 20))
        offsets = np.concatenate([[0], cuts, [len(points)]])
        got, reversals = Mechanics(machine, points[0], ALL).follow(points, offsets)
        literal = LiteralMechanics(machine, points[0].tolist(), ALL)
        want = [literal.go(point) for point in points.tolist()]
        assert np.array_equal(got, np.array([slide for slide, _ in want]))
        turns = np.array([turned for _, turned in want], dtype=np.int64)
        sums = [turns[a:b].sum(axis=0) for a, b in itertools.pairwise(offsets)]
        assert np.array_equal(reversals, np.array(sums))
        assert reversals.sum() > 100


@pytest.mark.slow
@pytest.mark.parametrize("settings", [PLAIN, EVERYTHING])
def test_a_long_wander_equals_the_literal_loop(settings: tuple[str, ...]) -> None:
    machine, points = path_machine(*settings), wander(99, 200_000)
    got, reversals = Mechanics(machine, points[0], ALL).follow(points, whole(points))
    literal = LiteralMechanics(machine, points[0].tolist(), ALL, draws=100_000)
    want = [literal.go(point)[0] for point in points.tolist()]
    assert np.array_equal(got, np.array(want))
    assert reversals[0].tolist() == [axis.reversals for axis in literal.axes]


@pytest.mark.parametrize("settings", [EVERYTHING, PLAIN])
@pytest.mark.parametrize("size", [1, 7, 64, 599])
def test_blocks_change_no_bit(settings: tuple[str, ...], size: int) -> None:
    machine, points = path_machine(*settings), wander(11)
    parts = Mechanics(machine, START, ALL)
    found = [
        parts.follow(points[at : at + size], whole(points[at : at + size]))
        for at in range(0, len(points), size)
    ]
    one = Mechanics(machine, START, ALL)
    want, reversals = one.follow(points, whole(points))
    assert np.array_equal(np.concatenate([slide for slide, _ in found]), want)
    assert np.array_equal(sum(turns for _, turns in found), reversals)
    assert np.array_equal(parts.states, one.states)


@pytest.mark.parametrize("start", STARTS)
def test_cells_of_one_play_are_that_play_to_the_bit(start: tuple[str, ...]) -> None:
    plain = path_machine(*PLAIN, *start)
    cells = ("x_mm=[0.0, 0.1, 0.2]", "y_mm=[-0.1, 0.0]")
    same = path_machine(
        *PLAIN,
        *start,
        "play_map.use=true",
        *(f"play_map.{axis}.{key}" for axis in "xy" for key in cells),
        "play_map.x.play_mm=[[0.05, 0.05]]",
        "play_map.y.play_mm=[[0.07, 0.07]]",
    )
    assert Mechanics(plain, START, ALL).plain
    assert not Mechanics(same, START, ALL).plain
    points = wander(12, 5000)
    assert np.array_equal(slides(plain, points), slides(same, points))


def test_ideal_mechanics_are_the_identity_to_the_bit() -> None:
    points = wander(13)
    assert np.array_equal(slides(path_machine(*EVERYTHING), points, IDEAL), points)
    assert np.array_equal(slides(path_machine(), points), points)
    assert Mechanics(path_machine(*EVERYTHING), START, IDEAL).plain


WITHOUT = {
    "play": ["play_map.use=false", *(f"axes.{axis}.backlash_mm=0" for axis in "xyz")],
    "compensation": [f"axes.{axis}.compensation_mm=0" for axis in "xyz"],
    "scale": [f"axes.{axis}.real_step_mm={STEP}" for axis in "xyz"],
    "squareness": ["mechanics.squareness_rad=0"],
    "repeatability": [f"axes.{axis}.repeatability_mm=0" for axis in "xyz"],
}


@pytest.mark.parametrize("effect", WITHOUT)
def test_each_effect_can_be_left_out(effect: str) -> None:
    """Left out is what a machine does that does not have it; and it makes a difference."""
    assert {field.name for field in dataclasses.fields(Effects)} == set(WITHOUT)
    points, machine = wander(14), path_machine(*EVERYTHING)
    left_out = slides(machine, points, replace(ALL, **{effect: False}))
    assert np.array_equal(left_out, slides(path_machine(*EVERYTHING, *WITHOUT[effect]), points))
    assert np.abs(left_out - slides(machine, points)).max() > 1e-4


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_play_of_each_axis_there_and_back(axis: int) -> None:
    """Z like X and Y: going back it waits for the play, and lags by it ever after."""
    play, points = 0.03, along(axis, 0.0, 1.0, 0.0)
    found = slides(path_machine(f"axes.{'xyz'[axis]}.backlash_mm={play}"), points)
    back = np.minimum(1.0, points[500:, axis] + play)
    assert found[:500, axis] == pytest.approx(points[:500, axis], abs=1e-15)
    assert found[500:, axis] == pytest.approx(back, abs=1e-15)
    assert not np.delete(found, axis, axis=1).any()


@pytest.mark.parametrize("compensation", [0.0, 0.03, 0.05, 0.06])
@pytest.mark.parametrize("start", STARTS)
def test_what_compensation_leaves_at_rest(compensation: float, start: tuple[str, ...]) -> None:
    """Driven far enough in + and in −, the slides differ by play − compensation: exact leaves
    nothing of the play, and preloaded the slide is then where it is commanded."""
    machine = path_machine(
        "axes.x.backlash_mm=0.05", f"axes.x.compensation_mm={compensation}", *start
    )
    first = 1.0 if start[1].endswith("+") else -1.0
    found = slides(machine, along(0, 0.0, first, 0.0, first, 0.5 * first, first))
    error = found[:, 0] - along(0, 0.0, first, 0.0, first, 0.5 * first, first)[:, 0]
    ahead, back = error[[499, 1499, 2499]], error[[999, 1999]]
    flank = -0.025 * first if "centred" in start[0] else 0.0
    assert ahead == pytest.approx(flank, abs=1e-12)
    assert back - ahead[:2] == pytest.approx(first * (0.05 - compensation), abs=1e-12)


def test_conventions_differ_by_half_the_play_of_the_place() -> None:
    """The conventions differ where the slide is engaged: a turn before has taken up the play."""
    points = along(0, 0.0, 0.8, -0.8, 0.8)
    settings = [setting for setting in EVERYTHING if "repeatab" not in setting]
    plus = slides(path_machine(*settings), points)
    middle = slides(path_machine(*settings, "controller.start_play=centred"), points)
    literal = LiteralMechanics(path_machine(*settings), START.tolist(), ALL)
    axis = literal.axes[0]
    play = [axis.flanks(x - 0.05, 0.1)[1] for x in points[:, 0]]
    moving = np.flatnonzero(np.abs(np.diff(plus[:, 0])) > 0)[1:]
    engaged = moving[(np.diff(moving, append=0) == 1)]
    half = 0.5 * np.array(play)
    deep = [k for k in engaged if half[k] == half[k - 60]]
    assert len(deep) > 700
    assert plus[deep, 0] - middle[deep, 0] == pytest.approx(half[deep], abs=1e-12)
    assert len(set(half[deep])) == 3


def test_mirrored_paths_have_mirrored_slides() -> None:
    points = wander(15)
    plus = slides(path_machine(*PLAIN), points)
    minus = slides(path_machine(*PLAIN, "controller.start_direction=-"), -points)
    assert np.array_equal(plus, -minus)


def test_a_cycle_backwards_has_the_opposite_lag() -> None:
    """Centred play, engaged: −b/2 along the way, so run backwards it is +b/2 at each place."""
    angle = np.linspace(0.0, 2.0 * math.pi, 4001)[1:]
    ring = np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle])
    machine = path_machine(
        "axes.x.backlash_mm=0.05", "axes.y.backlash_mm=0.08", "controller.start_play=centred"
    )
    forth = slides(machine, np.tile(ring, (2, 1)))[4000:] - ring
    back = (slides(machine, np.tile(ring[::-1], (2, 1)))[4000:] - ring[::-1])[::-1]
    for axis, half in ((0, 0.025), (1, 0.04)):
        engaged = np.isclose(np.abs(forth[:, axis]), half) & np.isclose(
            np.abs(back[:, axis]), half
        )
        engaged &= np.abs(ring[:, axis]) < 1.0 - 1e-9  # where it turns, both ways arrive alike
        assert engaged.mean() > 0.6
        assert forth[engaged, axis] == pytest.approx(-back[engaged, axis], abs=1e-12)


@pytest.mark.parametrize("play", [0.002, 0.05, 0.2])
def test_a_circle_with_play_has_flats_and_radii_of_the_formulas(play: float) -> None:
    """R cos t, R sin t from (R, 0), preloaded in +, both axes with play b and w = √(2Rb − b²).

    X turns at once: its slide stays at R until R(1 − cos t) = b, while Y goes by w: a flat of
    length w on the right; so at each pole. On the right flat the radius grows to √(R² + w²);
    on the lower and the left one it falls to R − b.
    """
    radius, b = 1.0, play
    angle = np.linspace(0.0, 2.0 * math.pi, 400_001)
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    ring = np.column_stack([x, y, 0.0 * x])
    machine = path_machine(f"axes.x.backlash_mm={b}", f"axes.y.backlash_mm={b}")
    found = Mechanics(machine, ring[0], ALL).follow(ring, whole(ring))[0]
    quarter = len(angle) // 4
    right = np.minimum(radius, x + b)
    left = np.maximum(-radius + b, x)
    want_x = np.where(np.arange(len(angle)) <= 2 * quarter, right, left)
    top, low = np.minimum(radius, y + b), np.maximum(-radius + b, y)
    turns = np.arange(len(angle)) // quarter
    want_y = np.where(turns < 1, y, np.where(turns < 3, top, low))
    assert np.abs(found[:, 0] - want_x).max() < 1e-10
    assert np.abs(found[:, 1] - want_y).max() < 1e-10
    w = math.sqrt(2.0 * radius * b - b * b)
    for axis, pole in ((0, radius), (1, radius), (0, b - radius), (1, b - radius)):
        flat = found[np.abs(found[:, axis] - pole) < 1e-10, 1 - axis]
        assert np.ptp(flat) == pytest.approx(w, abs=2e-5)
    radii = np.hypot(found[:, 0], found[:, 1])
    assert radii.max() == pytest.approx(math.hypot(radius, w), abs=1e-5)
    assert radii.min() == pytest.approx(radius - b, abs=1e-5)


def test_scale_is_real_over_coded_step() -> None:
    points = wander(16)
    found = slides(
        path_machine("axes.x.real_step_mm=0.0051", "axes.z.real_step_mm=0.0049"), points
    )
    assert found[:, 0] == pytest.approx(1.02 * points[:, 0], rel=1e-12)
    assert np.array_equal(found[:, 1], points[:, 1])
    assert found[:, 2] == pytest.approx(0.98 * points[:, 2], rel=1e-12)


@pytest.mark.parametrize("lean", [0.002, -0.01])
def test_squareness_leans_y_and_pulls_the_diagonals_apart(lean: float) -> None:
    side = 2.0
    square = side * np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    machine = path_machine(f"mechanics.squareness_rad={lean}")
    a, b, c, d = slides(machine, square)
    assert (a[0], a[1], b[0], b[1]) == (0.0, 0.0, side, 0.0)
    assert d - a == pytest.approx([side * math.tan(lean), side, 0.0])
    angle = math.atan2(*(d - a)[1::-1]) - math.atan2(*(b - a)[1::-1])
    assert angle == pytest.approx(0.5 * math.pi - lean)
    long, short = np.sum((c - a) ** 2), np.sum((d - b) ** 2)
    assert long - short == pytest.approx(4.0 * side**2 * math.tan(lean))


def test_squareness_acts_on_what_scale_and_play_left() -> None:
    settings = ("axes.y.real_step_mm=0.0051", "axes.y.backlash_mm=0.1")
    points = along(1, 0.0, 1.0, 0.5)
    square = slides(path_machine(*settings), points)
    found = slides(path_machine(*settings, "mechanics.squareness_rad=0.01"), points)
    assert found[:, 0] == pytest.approx(square[:, 1] * math.tan(0.01), rel=1e-12)
    assert np.array_equal(found[:, 1:], square[:, 1:])


def test_the_nearest_cell_holds_outside_and_the_upper_one_on_an_edge() -> None:
    """Play of X at places on the Y axis of the table: rows −∞…0, 0…∞, from machine zero."""
    machine = path_machine(
        "play_map.use=true",
        "play_map.x.x_mm=[5.0, 6.0]",
        "play_map.x.y_mm=[-1.0, 0.0, 1.0]",
        "play_map.x.play_mm=[[0.01], [0.02]]",
        "controller.machine_zero_mm=[100.0, 3.0, 0.0]",
    )
    for y, play in ((-50.0, 0.01), (2.999, 0.01), (3.0, 0.02), (3.5, 0.02), (99.0, 0.02)):
        points = along(0, 0.0, 1.0, 0.0) + np.array([0.0, y, 0.0])
        assert slides(machine, points)[-1, 0] == pytest.approx(play, abs=1e-12)


def test_columns_are_those_of_x_from_machine_zero() -> None:
    """Play of Y at places along X: on an edge the cell beyond it, outside the nearest."""
    machine = path_machine(
        "play_map.use=true",
        "play_map.y.x_mm=[-1.0, 0.0, 1.0, 2.0]",
        "play_map.y.y_mm=[5.0, 6.0]",
        "play_map.y.play_mm=[[0.01, 0.02, 0.03]]",
        "controller.machine_zero_mm=[3.0, 100.0, 0.0]",
    )
    for x, play in ((-50.0, 0.01), (2.999, 0.01), (3.0, 0.02), (4.0, 0.03), (99.0, 0.03)):
        points = along(1, 0.0, 1.0, 0.0) + np.array([x, 0.0, 0.0])
        assert slides(machine, points)[-1, 1] == pytest.approx(play, abs=1e-12)


def test_place_moves_without_a_reversal() -> None:
    machine = path_machine("axes.x.backlash_mm=0.05", "axes.x.compensation_mm=0.05")
    mechanics = Mechanics(machine, START, ALL)
    points = along(0, 0.0, 1.0)
    mechanics.follow(points, whole(points))
    mechanics.place(np.array([0.5, 0.0, 0.0]))
    onwards = along(0, 0.5, 2.0)
    slide, reversals = mechanics.follow(onwards, whole(onwards))
    assert not reversals.any()
    assert slide[-1, 0] == pytest.approx(2.0)


def test_compensation_is_whole_steps() -> None:
    machine = path_machine("axes.x.compensation_mm=0.0177", "axes.z.compensation_mm=0.0175")
    assert Mechanics(machine, START, ALL).compensation_steps.tolist() == [4, 0, 4]
    left_out = Effects(compensation=False)
    assert Mechanics(machine, START, left_out).compensation_steps.tolist() == [0, 0, 0]
