"""Runs of contours against many points along them: how deep, how steep, how much at a time."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.geometry.measure import length, sample
from camtool.geometry.polylines import Polyline, Polylines, begin_at, reverse, rotate
from camtool.planning import contours as module
from camtool.planning.findings import PlanningCode
from camtool.planning.items import Contour, CutRun, Feeds, Runs, Setting
from camtool.planning.job import Entry, Lead, Operation, Tabs, Tool
from camtool.planning.leads import KeepOut
from camtool.planning.settings import levels
from camtool.records import replace
from tests.oracles.runs import cut_over, most_at_a_time, move_length, run_points, runs_of, steepest
from tests.paths import mirrored, scaled
from tests.strategies import contours, open_contours

STEP = 0.05
SQUARE = Polyline(np.array([[0, 0, 0], [8, 0, 0], [8, 8, 0], [0, 8, 0.0]]), True)
ROUND = Polyline(np.array([[0, 0, 1.0], [10, 0, 1.0]]), True)
OPEN = Polyline(np.array([[0, 0, 0.5], [6, 0, -0.3], [6, 7, 0], [0, 7, 0.0]]))
PLUNGE = Entry()


def ramp(degrees: float) -> Entry:
    return Entry("ramp", math.radians(degrees))


def contour(path: Polyline, depth: tuple[float, ...] = (-0.4, -0.8, -1.0), **kind: Any) -> Contour:
    """A contour with these levels; `reversible` and `material_left` are its own."""
    own = {key: kind.pop(key) for key in ("reversible", "material_left") if key in kind}
    setting = Setting(Operation(name="cut", **kind), Feeds(100.0, 30.0), depth, 2.0)
    return Contour(path, setting, "part/LINE 1", 0, **own)


def cut(
    path: Polyline, depth: tuple[float, ...] = (-0.4, -0.8, -1.0), **kind: Any
) -> list[CutRun]:
    runs, findings = runs_of(contour(path, depth, **kind), path)
    assert findings == []
    return runs


def places(path: Polyline) -> np.ndarray:
    points = sample(path, STEP)
    return points if path.closed else points[1:-1]


@pytest.mark.parametrize("reversible", [True, False])
@pytest.mark.parametrize("entry", [PLUNGE, ramp(3.0), ramp(20.0)])
@pytest.mark.parametrize("path", [SQUARE, ROUND, OPEN])
def test_all_of_the_contour_is_cut_to_the_depth(
    path: Polyline, entry: Entry, reversible: bool
) -> None:
    runs = cut(path, entry=entry, reversible=reversible)
    low, most = cut_over(runs, places(path), STEP)
    slack = STEP * math.tan(entry.angle_rad) if entry.kind != "plunge" else 1e-9
    assert low.min() >= -1.0
    assert low.max() <= -1.0 + 1e-9
    # Nowhere more than one step down at a time.
    assert most <= 0.4 + 2.0 * slack


@given(
    st.one_of(contours(max_points=6), open_contours(max_points=6)),
    st.floats(0.5, 45.0),
    st.floats(0.2, 3.0),
    st.booleans(),
)
def test_ramps_on_any_contour(
    path: Polyline, degrees: float, depth: float, reversible: bool
) -> None:
    wanted = levels(depth, 0.7, 0.1)
    runs, findings = runs_of(
        contour(path, wanted, entry=ramp(degrees), reversible=reversible), path
    )
    assert findings == []
    assert len(runs) == (1 if path.closed or reversible else len(wanted))
    for run in runs:
        assert steepest(run.vertices) <= math.tan(math.radians(degrees)) * (1.0 + 1e-6)
        # No move straight down: the tool comes down on its own slopes.
        assert all((here[:2] != there[:2]).any() for here, there in pairwise(run.vertices))
    lengths = sum(move_length(a, b) for run in runs for a, b in pairwise(run.vertices))
    if lengths > 2000.0:
        return  # a flat ramp, very often round: too many points
    step = 0.1
    points = sample(path, step)
    low, _ = cut_over(runs, points if path.closed else points[1:-1], step)
    assert low.max() <= -depth + 1e-9
    if path.closed:
        most = most_at_a_time(runs[0].vertices, length(path), 300)
        assert most <= 0.7 * (1.0 + 1e-6)


def test_a_closed_ramp_ends_with_a_flat_lap_from_start_to_start() -> None:
    (run,) = cut(SQUARE, entry=ramp(5.0), overlap_mm=3.0)
    flat = [(here, there) for here, there in pairwise(run.vertices) if here[2] == there[2] == -1.0]
    assert flat[0][0][:2] == pytest.approx([0.0, 0.0], abs=1e-9)
    assert flat[-1][1][:2] == pytest.approx([3.0, 0.0])
    assert sum(move_length(here, there) for here, there in flat) == pytest.approx(32.0 + 3.0)
    # It begins on the stock, before the start.
    assert run.vertices[0, 2] == 0.0
    # Down 0.4, 0.4 and 0.2: each level takes a lap, and the last ramp comes on top of them.
    whole = sum(move_length(here, there) for here, there in pairwise(run.vertices))
    assert whole == pytest.approx(3 * 32.0 + 0.2 / math.tan(math.radians(5.0)) + 3.0)


def test_a_ramp_longer_than_the_contour_goes_on_round() -> None:
    (run,) = cut(ROUND, (-2.0,), entry=ramp(1.0))
    slopes = [
        (here[2] - there[2]) / move_length(here, there) for here, there in pairwise(run.vertices)
    ]
    laps = 2.0 / math.tan(math.radians(1.0)) / (10.0 * math.pi)
    assert laps > 3.0
    steep = math.tan(math.radians(1.0))
    assert all(abs(slope) < 1e-12 or slope == pytest.approx(steep) for slope in slopes)
    # Arcs stay arcs: two halves each lap, and a part at the beginning.
    assert len(run.vertices) <= 2 * math.ceil(laps) + 5
    assert np.abs(run.vertices[:-1, 3]).min() > 0.0


def test_plunges_are_at_the_start_and_the_run_stays_down() -> None:
    (run,) = cut(SQUARE, overlap_mm=2.0)
    down = [
        tuple(here[:2]) for here, there in pairwise(run.vertices) if (here[:2] == there[:2]).all()
    ]
    assert down == [(0.0, 0.0), (0.0, 0.0)]
    assert run.vertices[0].tolist() == [0.0, 0.0, -0.4, 0.0]
    assert run.vertices[-1].tolist() == [2.0, 0.0, -1.0, 0.0]
    assert run.name == "part/LINE 1"
    assert run.plunge_mm_min == 30.0


def test_an_overlap_may_go_round_more_than_once() -> None:
    (run,) = cut(SQUARE, (-1.0,), overlap_mm=36.0)
    assert run.vertices[-1, :2] == pytest.approx([4.0, 0.0])
    whole = sum(move_length(here, there) for here, there in pairwise(run.vertices))
    assert whole == pytest.approx(68.0)


def test_open_contours_go_to_and_fro_or_begin_again() -> None:
    (run,) = cut(OPEN, reversible=True)
    assert [tuple(row[:3]) for row in run.vertices[::4]] == [
        (0, 0, -0.4),
        (0, 7, -0.8),
        (0, 0, -1),
    ]
    again = cut(OPEN)
    assert [tuple(each.vertices[0, :3]) for each in again] == [(0, 0, z) for z in (-0.4, -0.8, -1)]
    assert all((each.vertices[-1, :2] == [0.0, 7.0]).all() for each in again)
    # A ramp of a later pass begins on what the pass before has left.
    sloping = cut(OPEN, entry=ramp(5.0))
    assert [float(each.vertices[0, 2]) for each in sloping] == [0.0, -0.4, -0.8]


@given(st.lists(st.one_of(contours(), open_contours()), min_size=1, max_size=5), st.integers(1, 3))
def test_many_contours_are_cut_as_each_by_itself(paths: list[Polyline], at_once: int) -> None:
    items = [contour(path, entry=ramp(5.0), lead_out=Lead("line", 0.5)) for path in paths]
    items = [replace(item, name=f"PATH {k}") for k, item in enumerate(items)]
    order = np.arange(len(items))[::-1]
    keep_out = KeepOut(Polylines.of([]), np.empty(0, dtype=np.bool_))
    lines = Polylines.of(paths).select(order.tolist())
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(module, "CONTOURS_AT_ONCE", at_once)
        made = module.runs_of(items, order, lines, keep_out)
    each = [runs_of(items[k], paths[k]) for k in order.tolist()]
    assert list(made.counts) == [len(runs) for runs, _ in each]
    assert list(made.findings) == [finding for _, findings in each for finding in findings]
    wanted = [run for runs, _ in each for run in runs]
    for one, other in zip(made.runs, wanted, strict=True):
        assert one.vertices.tolist() == other.vertices.tolist()
        assert one.feed_mm_min.tolist() == other.feed_mm_min.tolist()
        assert (one.plunge_mm_min, one.name) == (other.plunge_mm_min, other.name)
    again = Runs.of(made.runs)
    for name in ("vertices", "first", "plunge_mm_min", "dwell_s"):
        assert getattr(again, name).tolist() == getattr(made.runs, name).tolist()


def test_slopes_are_slow_enough_for_the_plunge_feed() -> None:
    for entry in (PLUNGE, ramp(10.0), ramp(40.0)):
        (run,) = cut(SQUARE, entry=entry, tabs=Tabs(count=2, width_mm=1.0, ramped=True))
        feeds = set()
        for (here, there), feed in zip(pairwise(run.vertices), run.feed_mm_min, strict=True):
            across = move_length(here, there) if (here[:2] != there[:2]).any() else 0.0
            rise = abs(there[2] - here[2])
            vertical = feed * rise / math.hypot(across, rise)
            assert vertical <= 30.0 * (1.0 + 1e-9)
            assert feed <= 100.0
            # As quick as both allow.
            assert feed == pytest.approx(100.0) or vertical == pytest.approx(30.0)
            feeds.add(round(float(feed)))
        assert 100 in feeds
        assert min(feeds) < 100 or entry == ramp(10.0)


def _vertices(runs: list[CutRun]) -> np.ndarray:
    return np.concatenate([run.vertices for run in runs])


FULL: dict[str, Any] = {
    "tool": Tool(1.0),
    "entry": ramp(4.0),
    "lead_in": Lead("arc", 0.8),
    "lead_out": Lead("line", 0.8),
    "overlap_mm": 1.0,
    "tabs": Tabs(count=2, width_mm=0.5, height_mm=0.3),
}


@given(contours(max_points=6), st.sampled_from([0.3, 2.0, -1.1]), st.booleans())
def test_turned_scaled_and_mirrored_contours_give_runs_that_are_so(
    path: Polyline, angle: float, left: bool
) -> None:
    first, findings = runs_of(contour(path, **FULL, material_left=left), path)
    turned, noticed = runs_of(
        contour(rotate(path, angle), **FULL, material_left=left), rotate(path, angle)
    )
    assert [each.code for each in noticed] == [each.code for each in findings]
    wanted = _vertices(first)
    cosine, sine = math.cos(angle), math.sin(angle)
    spun = wanted[:, :2] @ np.array([[cosine, sine], [-sine, cosine]])
    assert _vertices(turned)[:, :2] == pytest.approx(spun, abs=1e-6)
    assert _vertices(turned)[:, 2:] == pytest.approx(wanted[:, 2:], abs=1e-6)
    other, _ = runs_of(contour(mirrored(path), **FULL, material_left=not left), mirrored(path))
    assert _vertices(other) == pytest.approx(wanted * [-1.0, 1.0, 1.0, -1.0], abs=1e-6)
    if findings:
        return  # what hardly fits may do so at one scale alone: tolerances are lengths
    large, _ = runs_of(
        contour(
            scaled(path, 3.0),
            (-1.2, -2.4, -3.0),
            **{
                **FULL,
                "tool": Tool(3.0),
                "lead_in": Lead("arc", 2.4),
                "lead_out": Lead("line", 2.4),
                "overlap_mm": 3.0,
                "tabs": Tabs(count=2, width_mm=1.5, height_mm=0.9),
            },
            material_left=left,
        ),
        scaled(path, 3.0),
    )
    # Tolerances are lengths: what is searched to 1e-6 mm at one scale is so at the other.
    assert _vertices(large) == pytest.approx(wanted * [3.0, 3.0, 3.0, 1.0], abs=3e-5)


@given(contours(max_points=6), st.integers(0, 5))
def test_the_way_it_is_cut_decides_the_side_of_the_leads(path: Polyline, start: int) -> None:
    """A reversible contour that is cut the other way has its material on the other side."""
    drawn = replace(contour(path, lead_in=Lead("arc", 0.5), reversible=True), material_left=True)
    way = begin_at(reverse(path), start % len(path))
    runs, findings = runs_of(drawn, way)
    turned = contour(way, lead_in=Lead("arc", 0.5), reversible=True, material_left=False)
    wanted, noticed = runs_of(turned, way)
    assert findings == noticed
    assert (_vertices(runs) == _vertices(wanted)).all()


def test_a_ramp_too_flat_for_a_small_contour_is_a_plunge() -> None:
    small = scaled(ROUND, 1e-3)
    runs, findings = runs_of(contour(small, entry=ramp(1.0)), small)
    assert [each.code for each in findings] == [PlanningCode.ENTRY_CHANGED]
    assert "part/LINE 1" in findings[0].where
    assert findings[0].measured is not None
    assert findings[0].measured > (findings[0].limit or math.inf)
    assert (_vertices(runs) == _vertices(cut(small))).all()


def test_leads_of_open_contours_are_cut_at_every_depth() -> None:
    (run,) = cut(
        OPEN,
        reversible=True,
        material_left=True,
        lead_in=Lead("line", 1.0),
        lead_out=Lead("arc", 1.0),
        entry=ramp(5.0),
    )
    points = run_points(run.vertices, STEP)
    for end in (run.vertices[0], run.vertices[np.abs(run.vertices[:, 1] - 8.0).argmin()]):
        over = np.hypot(*(points[:, :2] - end[:2]).T) < 1e-9
        assert {round(z, 6) for z in points[over, 2]} >= {-0.4, -0.8}
