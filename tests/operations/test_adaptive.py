"""Adaptive pockets: the tool's engagement keeps to its limit, and all is cleared all the same."""

from __future__ import annotations

import math
from functools import cache
from itertools import product
from pathlib import Path

import ezdxf
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import camtool
from camtool.errors import OptionError
from camtool.geometry.measure import sample
from camtool.geometry.offset import offset_shape
from camtool.geometry.polylines import Polyline, Polylines
from camtool.planning.adaptive import FrontStroke, _Clearing, adaptive_legs, spiral
from camtool.planning.items import CutRun
from camtool.planning.job import Entry, Job, Operation, Tool
from camtool.planning.pursuing import TURN_SHARE, Approach, Pursued
from camtool.planning.strategies import engagement
from camtool.planning.strokes import (
    Pose,
    corner_ratio,
    ends_of,
    moves_along,
    step_for,
    tangent_link,
)
from camtool.progress import Progress
from tests.operations.adaptive_programs import posted
from tests.oracles.contours import CIRCLE, SQUARE, closed, comb
from tests.oracles.engaged import chords_of, greatest_engagement
from tests.oracles.swept import complaints
from tests.paths import mirrored, moved, scaled
from tests.planning.pocket_cases import SHAPES, region_of, runs_of, work_of
from tests.strategies import examples

PLATE = [SQUARE, moved(scaled(CIRCLE, 0.1), 3.0, 3.0), moved(scaled(SQUARE, 0.1), 6.0, 5.0)]
QUICK = {"square": [SQUARE], "plate": PLATE, "star": SHAPES["star"]}
HELIX = Entry("helix", angle_rad=math.radians(5.0))
SHARE = 3e-3
"""This part of the area may be left in sharp corners."""


def adaptive(
    paths: list[Polyline], diameter_mm: float, limit: float, **options: object
) -> list[CutRun]:
    own = (("strategy", "adaptive"), ("engagement_rad", limit))
    return runs_of(work_of(paths, diameter_mm, own=own, entry=HELIX, **options))


LIMIT = math.acos(1.0 - 2.0 * 0.12)


@cache
def square_runs() -> list[CutRun]:
    """Return the runs of the square at LIMIT, with one feed and no lift."""
    return adaptive([SQUARE], 1.2, LIMIT)


@pytest.mark.parametrize("shape", ["square", "star"])
def test_all_within_reach_is_cleared_and_nothing_else(shape: str) -> None:
    limit = math.acos(1.0 - 2.0 * 0.2)
    runs = adaptive(QUICK[shape], 1.3, limit)
    assert complaints(runs, region_of(QUICK[shape]), 0.65, -1.0, share=SHARE) == []


def test_the_engagement_keeps_to_its_limit() -> None:
    wide = math.acos(1.0 - 2.0 * 0.3)
    for runs, limit in ((square_runs(), LIMIT), (adaptive(PLATE, 1.2, wide), wide)):
        assert len([run for run in runs if run.vertices[0, 2] == 0.0]) == 1
        engaged = greatest_engagement(runs, 0.6, 4e-3 * 0.6)
        assert 0.7 * limit < engaged <= 1.02 * limit


def test_the_feed_rises_on_the_same_path() -> None:
    """Lines and arcs are split where the feed changes, between `feed` (600) and `max_feed`."""
    own = (("strategy", "adaptive"), ("engagement_rad", LIMIT), ("max_feed_mm_min", 1800.0))
    plain, runs = square_runs(), runs_of(work_of([SQUARE], 1.2, own=own, entry=HELIX))
    assert len(runs) == len(plain)
    for run, same in zip(runs, plain, strict=True):
        assert length_of(run) == pytest.approx(length_of(same), rel=1e-4)
        places = {tuple(place) for place in np.round(run.vertices[:, :2], 6).tolist()}
        assert places >= {tuple(place) for place in np.round(same.vertices[:, :2], 6).tolist()}
    feeds = np.concatenate([run.feed_mm_min[run.feed_mm_min >= 600.0] for run in runs])
    assert len(np.unique(feeds)) > 2
    assert feeds.max() <= 1800.0 + 1e-9


def test_links_are_lifted_and_nothing_else() -> None:
    """Strokes are the same; links rise by 45 degrees at most, up to the lift."""
    own = (("strategy", "adaptive"), ("engagement_rad", LIMIT), ("lift_mm", 0.1))
    plain, runs = square_runs(), runs_of(work_of([SQUARE], 1.2, own=own, entry=HELIX))
    highest = -1.0
    for run, same in zip(runs, plain, strict=True):
        assert np.array_equal(run.vertices[:, [0, 1, 3]], same.vertices[:, [0, 1, 3]])
        lifts = run.vertices[:, 2] - same.vertices[:, 2]
        gaps = np.hypot(*np.diff(run.vertices[:, :2], axis=0).T)
        assert (lifts >= 0.0).all()
        assert (np.abs(np.diff(lifts)) <= 0.5 * math.pi * gaps + 1e-9).all()
        highest = max(highest, float(lifts.max()))
    assert highest == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("own", "words"),
    [(("lift_mm", 1.1), "a lift of"), (("max_feed_mm_min", 500.0), "greatest feed")],
)
def test_a_lift_out_of_the_first_pass_and_a_low_greatest_feed_are_refused(
    own: tuple[str, float], words: str
) -> None:
    with pytest.raises(OptionError, match=words):
        work_of([SQUARE], 1.2, own=(("strategy", "adaptive"), own), entry=HELIX)


@pytest.mark.slow
@pytest.mark.parametrize("diameter_mm", [0.7, 1.7])
@pytest.mark.parametrize("shape", SHAPES)
def test_every_shape(shape: str, diameter_mm: float) -> None:
    limit = math.acos(1.0 - 2.0 * 0.15)
    runs = adaptive(SHAPES[shape], diameter_mm, limit)
    assert complaints(runs, region_of(SHAPES[shape]), 0.5 * diameter_mm, -1.0, share=SHARE) == []


def test_both_sides_of_a_neck_that_no_disc_passes_are_cleared() -> None:
    """The neck leaves the tool's centre 4 µm; each chamber gets a helix of its own."""
    neck = 1.3 + 0.004
    low, high = 2.5 - 0.5 * neck, 2.5 + 0.5 * neck
    corners = [(0, 0), (5, 0), (5, low), (6, low), (6, 0), (11, 0), (11, 5), (6, 5), (6, high)]
    shape = closed(*corners, (5, high), (5, 5), (0, 5))
    runs = adaptive([shape], 1.3, math.acos(1.0 - 2.0 * 0.2))
    assert len([run for run in runs if run.vertices[0, 2] == 0.0]) == 2
    area = complaints(runs, region_of([shape]), 0.65, -1.0, share=0.05)
    assert area == []


@pytest.mark.parametrize("wide_mm", [2.0, 2.0005, 2.02])
def test_slots_in_which_no_limit_holds_are_named(wide_mm: float) -> None:
    slot = closed((0, 0), (20, 0), (20, wide_mm), (0, wide_mm))
    own = (("strategy", "adaptive"), ("engagement_rad", math.radians(50.0)))
    work = work_of([slot], 2.0, own=own, entry=HELIX)
    (finding,) = (each for each in work.findings if each.code.name == "SLOT_AS_WIDE")
    assert finding.measured == pytest.approx(wide_mm, abs=1e-3)
    assert "X" in finding.where
    assert "no limit" in finding.message
    assert work.items


def test_a_slot_that_is_roughed_at_full_width_is_named(tmp_path: Path) -> None:
    """What is left for the finishing pass makes it as wide as the tool."""
    slot = closed((0, 0), (12, 0), (12, 2.42), (0, 2.42))
    run = posted([slot], 2.0, math.radians(50.0), "grbl", tmp_path, finish_mm=0.2)
    (finding,) = (each for each in run.findings if each.code.name == "SLOT_AS_WIDE")
    assert finding.measured == pytest.approx(2.02, abs=1e-3)


def test_the_scallop_of_corners_is_named_and_nothing_else_is_left(tmp_path: Path) -> None:
    """Discs of 2.16 % of the tool's radius leave √2 − 1 of that in a square corner, 27 µm here."""
    run = posted([scaled(SQUARE, 1.4)], 6.0, math.radians(60.0), "grbl", tmp_path)
    assert "MATERIAL_LEFT" not in {each.code.name for each in run.findings}
    (scallop,) = (each for each in run.findings if "scallop" in each.message)
    assert scallop.measured == pytest.approx((math.sqrt(2.0) - 1.0) * 0.0216 * 3.0)
    assert "4 inner corners" in scallop.message
    round_pocket = work_of([CIRCLE], 3.0, own=(("strategy", "adaptive"),), entry=HELIX)
    assert not any("scallop" in each.message for each in round_pocket.findings)


def test_conventional_is_the_mirror_image_of_climb() -> None:
    limit = math.acos(1.0 - 2.0 * 0.2)
    wedge = closed((0, 0), (8, 0), (0, 6))
    climb = adaptive([wedge], 1.6, limit)
    conventional = adaptive([mirrored(wedge)], 1.6, limit, direction="conventional")
    total = [sum(length_of(run) for run in runs) for runs in (climb, conventional)]
    assert total[0] == pytest.approx(total[1], rel=0.02)


def length_of(run: CutRun) -> float:
    rows = chords_of(run)
    return float(np.hypot(*(rows[:, 2:4] - rows[:, :2]).T).sum())


@examples(200, nightly=2_000)
@given(st.floats(0.1, 1.5), st.floats(0.01, 50.0), st.floats(0.05, 10.0), st.floats(0.01, 0.99))
def test_a_step_engages_by_the_limit(
    limit: float, opening: float, radius: float, part: float
) -> None:
    """Behind a cleared disc of centres, the tool's circle at the step is out of what is cleared
    exactly within the limit."""
    step = step_for(limit, opening, radius)
    assert 0.0 < step < 2.0 * radius
    for share, is_air in ((1.0 + 1e-3 * part, True), (1.0 - 1e-3 * part, False)):
        angle = limit * share
        x = opening + step + radius * math.cos(angle)
        y = radius * math.sin(angle)
        assert (math.hypot(x, y) < opening + radius) == is_air


@examples(200, nightly=2_000)
@given(
    st.tuples(st.floats(-5, 5), st.floats(-5, 5), st.floats(-3.1, 3.1)),
    st.tuples(st.floats(-5, 5), st.floats(-5, 5), st.floats(-3.1, 3.1)),
    st.floats(0.05, 3.0),
    st.sampled_from([(1, 1), (1, -1), (-1, 1), (-1, -1)]),
)
def test_links_are_tangent_everywhere(
    one: tuple[float, float, float],
    other: tuple[float, float, float],
    radius: float,
    turns: tuple[int, int],
) -> None:
    start, end = Pose(*one), Pose(*other)
    link = tangent_link(start, end, radius, turns)
    if link is None:
        return
    first, last = ends_of(link)
    assert (first.x, first.y) == (start.x, start.y)
    assert (last.x, last.y) == (end.x, end.y)
    poses = [start]
    for row in range(len(link) - 1):
        piece = np.array([link[row], [*link[row + 1, :2], 0.0]])
        if np.hypot(*(piece[1, :2] - piece[0, :2])) < 1e-3:
            continue
        begin, finish = ends_of(piece)
        assert abs(math.remainder(begin.angle - poses[-1].angle, math.tau)) < 1e-3
        poses.append(finish)
    assert abs(math.remainder(end.angle - poses[-1].angle, math.tau)) < 1e-3


@examples(60, nightly=2_000)
@given(st.floats(0.2, 1.5), st.floats(0.05, 3.0), st.floats(0.4, 2.5))
def test_a_smaller_disc_in_a_corner_engages_by_no_more_than_the_limit(
    limit: float, opening: float, corner: float
) -> None:
    """The tool of radius 1 goes along the arc of the smaller disc behind the larger one: of the
    front half of its circle, what lies out of that is within the limit, counted in points."""
    ratio = corner_ratio(limit, opening, 1.0, corner)
    assert 0.0 <= ratio < 1.0
    gap = (1.0 - ratio) * opening / math.sin(0.5 * corner)
    rim = (np.arange(4000) + 0.5) / 4000 * math.pi
    most = 0.5 * (math.pi - corner)
    for normal in np.linspace(-most, most, 17):
        x = gap + ratio * opening * math.cos(normal) + np.cos(normal + rim)
        y = ratio * opening * math.sin(normal) + np.sin(normal + rim)
        engaged = float((np.hypot(x, y) > opening + 1.0).mean()) * math.pi
        assert engaged <= limit + 2e-3


@pytest.mark.parametrize("value", ["0%", "100%", "51%", "-3%", "4deg", "91deg", "nan", "", "abc"])
def test_limits_that_no_path_can_keep_are_refused(value: str) -> None:
    with pytest.raises(OptionError):
        engagement(value)


def test_limits_are_parts_of_the_diameter_or_angles() -> None:
    assert engagement("50%") == pytest.approx(0.5 * math.pi)
    assert engagement(0.1) == pytest.approx(math.radians(36.8699), abs=1e-5)
    assert engagement("40deg") == pytest.approx(math.radians(40.0))


def test_a_limit_that_takes_for_ever_is_refused() -> None:
    with pytest.raises(OptionError, match="fronts"):
        adaptive([scaled(SQUARE, 50.0)], 0.2, math.radians(10.0))


def test_the_limit_is_proved_on_the_predicted_slides(tmp_path: Path) -> None:
    document = ezdxf.new(units=ezdxf.units.MM)
    document.modelspace().add_lwpolyline([(0, 0), (7, 0), (7, 6), (0, 6)], close=True)
    document.saveas(tmp_path / "part.dxf")
    operation = Operation(
        kind="pocket",
        tool=Tool(3.0, number=1),
        depth_mm=1.0,
        spindle_rpm=9000.0,
        plunge_feed_mm_min=60.0,
        own=(("strategy", "adaptive"), ("engagement_rad", math.radians(50.0))),
        entry=HELIX,
    )
    job = Job(operations=(operation,))
    names = []
    for backlash in (0.0, 0.4):
        settings = {"axes.x.backlash_mm": backlash, "axes.y.backlash_mm": backlash}
        target = camtool.load_target("grbl", settings=settings)
        run = camtool.post(str(tmp_path / "part.dxf"), target, job)
        names.append({finding.code.name for finding in run.findings})
    assert "ENGAGEMENT_KEPT" in names[0]
    assert "ENGAGEMENT_TOO_HIGH" in names[1]


@pytest.mark.parametrize(
    ("path", "tool_mm", "is_pursued"), [(SQUARE, 0.65, True), (comb(2), 0.5, False)]
)
def test_a_pursuit_that_leaves_much_is_given_up(
    path: Polyline, tool_mm: float, is_pursued: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a comb whose gaps are as wide as the tightest turn nothing is reached: fronts clear all
    of it, as they do where nothing is pursued."""
    region, limit = offset_shape(region_of([path]), tool_mm), math.acos(1.0 - 2.0 * 0.2)
    plan = adaptive_legs(region, 0.5 * tool_mm, tool_mm, limit)
    monkeypatch.setattr("camtool.planning.adaptive.PURSUED_ROOM_SHARE", math.inf)
    fronts = adaptive_legs(region, 0.5 * tool_mm, tool_mm, limit)
    legs, legs_of_fronts = (
        [leg.vertices.tolist() for stay in each.stays for leg in stay] for each in (plan, fronts)
    )
    assert (legs != legs_of_fronts) == is_pursued


@examples(20)
@given(st.integers(1, 60), st.integers(1, 12), st.integers(0, 10_000))
def test_strokes_wait_for_all_older_ones_near_them(count: int, fronts: int, seed: int) -> None:
    """Not each by itself, which were as many as the square of the fronts (18 GB of pairs)."""
    rng = np.random.default_rng(seed)
    starts = rng.uniform(0.0, 12.0, (count, 2))
    ends = starts + rng.uniform(-3.0, 3.0, (count, 2))
    strokes = [
        FrontStroke(np.insert(np.array([one, other]), 2, 0.0, axis=1), int(front), 1.0)
        for one, other, front in zip(starts, ends, rng.integers(0, fronts, count), strict=True)
    ]
    clearing = _Clearing(offset_shape(Polylines.of([SQUARE]), 1.0), 1.0, 1.0)
    clearing.take(strokes)
    waits, followers = clearing.older_ones()
    before = [set[int]() for _ in strokes]
    for number in sorted(range(count), key=lambda each: strokes[each].front):
        for follower in followers[number]:
            before[follower] |= before[number] | {number}
            waits[follower] -= 1
    cells = [
        {tuple(place) for place in np.floor(sample(Polyline(each.vertices), 1.0) / 2.0).tolist()}
        for each in strokes
    ]
    for number, other in product(range(count), repeat=2):
        gaps = [max(abs(a - c), abs(b - d)) for a, b in cells[number] for c, d in cells[other]]
        is_older = strokes[other].front < strokes[number].front
        assert (is_older and min(gaps) <= 1.0) <= (other in before[number])
        assert (other in before[number]) <= is_older
    assert waits == [0] * count


def test_chambers_behind_a_neck_are_cleared_one_by_one() -> None:
    """A neck 3 % wider than the tool: by discs that fit through it the second chamber would take
    19 m of cuts, and the first one takes 0.7 m."""
    low, high = (20.0, 8.0), (20.0, 12.12)
    chambers = closed(
        *((0, 0), (20, 0), low, (26, 8), (26, 0), (46, 0)),
        *((46, 20), (26, 20), (26, 12.12), high, (20, 20), (0, 20)),
    )
    limit = math.radians(60.0)
    runs = adaptive([chambers], 4.0, limit)
    assert complaints(runs, region_of([chambers]), 2.0, -1.0, share=SHARE) == []
    assert greatest_engagement(runs, 2.0, 4e-3 * 2.0) <= 1.02 * limit
    assert sum(length_of(run) for run in runs) < 6_000.0
    assert len([run for run in runs if run.vertices[0, 2] == 0.0]) == 2


def pursued(path: Polyline, tool_mm: float, limit: float) -> Pursued:
    """A pursuit behind its way down, about the middle of a region that reaches from 0 to 10."""
    region = offset_shape(region_of([path]), tool_mm)
    ring = np.array([[5.5, 5.0, 1.0], [4.5, 5.0, 1.0], [5.5, 5.0, 0.0]])
    first = spiral(np.array([5.0, 5.0]), 0.5, 2.0, tool_mm, limit)
    return Pursued(region, [ring], first, tool_mm, limit, TURN_SHARE)


def test_a_stroke_counts_only_if_the_way_to_it_stays_in_the_region() -> None:
    """A link once cut 0.6 µm into a wall."""
    pursuit = pursued(SQUARE, 1.0, math.radians(60.0))
    stroke = np.array([[5.0, 5.0, 0.0], [5.5, 5.0, 0.0]])
    for border_mm, keeps in ((0.999, False), (1.0, True)):
        x, y, _ = pursuit.pose
        pursuit.cleared.add(moves_along(np.array([[x, y, 0.0], [1.0, 5.0, 0.0]]), 1.0)[0])
        link = np.array([[1.0, 5.0, 0.0], [border_mm, 5.0, 0.0], [5.0, 5.0, 0.0]][keeps:])
        assert pursuit.keeps(Approach(link, False), stroke) == keeps


def test_a_square_corner_takes_few_arcs() -> None:
    """From half of the tool's radius to 2 % of it. Where each has 0.93 of the radius of the one
    before it takes 47."""
    pursuit = pursued(SQUARE, 1.0, math.radians(70.0))
    pursuit.run()
    legs = [leg.vertices for stay in pursuit.stays for leg in stay if leg.cuts]
    corner = np.array([1.0, 1.0])
    about = [each for each in legs if np.hypot(*(each[:, :2] - corner).T).max() < 1.5]
    assert 2 <= len(about) <= 12
    assert len(pursuit.stock_left()) == 0


@pytest.mark.parametrize(
    ("room_share", "parts"), [(0.1, ["strokes"]), (math.inf, ["fronts", "links"])]
)
def test_planning_tells_which_share_is_cleared_and_linked(
    room_share: float, parts: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each part of the stage grows, and ends at all; then the stage is that of before. Pockets
    without room for a pursuit are cleared by fronts."""
    monkeypatch.setattr("camtool.planning.adaptive.PURSUED_ROOM_SHARE", room_share)
    told: list[tuple[str, float]] = []

    class Told(Progress):
        def __setattr__(self, name: str, value: object) -> None:
            super().__setattr__(name, value)
            if name == "done" and hasattr(self, "count") and self.share:
                told.append((self.stage, self.share))

    progress = Told()
    progress.begin("planning")
    adaptive(QUICK["square"], 1.3, math.acos(1.0 - 2.0 * 0.2))
    stages = [f"planning – {part}" for part in parts]
    assert list(dict.fromkeys(stage for stage, _ in told)) == stages
    for part in parts:
        shares = [share for stage, share in told if stage.endswith(part)]
        assert shares == sorted(shares)
        assert len(set(shares)) > 5
        assert 0.97 <= shares[-1] <= 1.0
    assert (progress.stage, progress.share) == ("planning", None)
