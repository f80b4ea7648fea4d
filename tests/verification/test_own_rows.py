"""What a program was written from is compared first: the same is found as by a search over all.

The search without `row_from` is the oracle. Programs are those that were wanted, rounded to a
grid, and damaged in many ways.
"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath
from camtool.verification import coverage, matching
from camtool.verification.circles import full_circles
from camtool.verification.coverage import Coverage, Side, cover, direction_findings
from camtool.verification.cuts import cut_moves
from camtool.verification.matching import Goal
from camtool.verification.nearest import MoveIndex

pytestmark = pytest.mark.checked

LIMIT_MM, DEPTH_MM, SAMPLE_MM, GRID_MM = 0.005, 0.01, 0.2, 0.001


def scribbles(rng: np.random.Generator, count: int) -> Toolpath:
    """Lines, some on a slope, and arcs that cross, at two depths, some contours in two passes."""
    path = ToolpathBuilder()
    for _ in range(count):
        path.rapid(z=1.0).rapid(*rng.uniform(0.0, 20.0, 2))
        for depth in (-1.0, -2.0)[: int(rng.integers(1, 3))]:
            path.line(z=depth, feed=100.0)
            for x, y in rng.uniform(0.0, 20.0, (int(rng.integers(1, 7)), 2)):
                if rng.random() < 0.7:
                    rise = float(rng.uniform(-0.3, 0.3)) if rng.random() < 0.2 else 0.0
                    path.line(float(x), float(y), path.position[2] + rise, feed=200.0)
                    continue
                middle = 0.5 * (np.array(path.position[:2]) + np.array([x, y]))
                path.arc(float(x), float(y), centre=tuple(middle), ccw=True, feed=200.0)
    path.rapid(z=1.0)
    return path.finish()


def on_grid(wanted: Toolpath) -> Toolpath:
    """As a dialect of so many decimals says it."""
    everything = np.arange(len(wanted))
    return wanted.picked(
        everything,
        end=np.round(wanted.end / GRID_MM) * GRID_MM,
        centre=np.round(wanted.centre / GRID_MM) * GRID_MM,
    )


DAMAGES = ("none", "dropped", "doubled", "swapped", "moved", "deeper", "turned", "alone")


def damaged(rng: np.random.Generator, decoded: Toolpath, kind: str) -> tuple[Toolpath, np.ndarray]:
    """The rows of a damaged program, and from which row of the whole one each of them came."""
    count = len(decoded)
    row = np.arange(count)
    at = int(rng.choice(np.flatnonzero(decoded.is_feed & (decoded.end[:, 2] < 0.0))))
    end = decoded.end.copy()
    if kind == "dropped":
        row = np.delete(row, at)
    elif kind == "doubled":
        row = np.insert(row, at, row[at])
    elif kind == "swapped":
        row[[at - 1, at]] = row[[at, at - 1]]
    elif kind == "moved":
        end[at, :2] += rng.choice([-1.0, 1.0], 2) * rng.choice([0.004, 0.02, 1.0])
    elif kind == "deeper":
        end[at:, 2] -= np.where(end[at:, 2] < 0.0, float(rng.choice([0.005, 0.1])), 0.0)
    elif kind == "turned":
        low = max(k for k in range(at + 1) if decoded.end[k, 2] > 0.0)
        high = min(k for k in range(at, count) if decoded.end[k, 2] > 0.0)
        end[low + 1 : high] = end[low + 1 : high][::-1]
    whole = decoded.picked(np.arange(count), end=end)
    if kind == "alone":
        whole = whole.picked(np.arange(count), kind=np.where(row == at, Kind.RAPID, whole.kind))
    return whole.picked(row), row


def compared(
    decoded: Toolpath, wanted: Toolpath, row_from: np.ndarray | None
) -> tuple[Coverage, list[object]]:
    """Compare both toolpaths: their coverage, and the contours that are cut in reverse."""
    mine, other = Side.of(decoded, flat_cuts=False), Side.of(wanted, flat_cuts=False)
    goal = Goal(other.moves, full_circles(other.cuts, LIMIT_MM), LIMIT_MM, DEPTH_MM)
    limits = LIMIT_MM, DEPTH_MM
    turned = direction_findings(mine.moves, other.moves, limits, SAMPLE_MM, row_from)
    return cover(mine, other, goal, SAMPLE_MM, row_from), list(turned)


@given(st.integers(0, 10_000), st.integers(1, 8), st.sampled_from(DAMAGES))
def test_own_rows_first_finds_what_a_search_over_all_finds(
    seed: int, count: int, kind: str
) -> None:
    rng = np.random.default_rng(seed)
    wanted = scribbles(rng, count)
    decoded, row_from = damaged(rng, on_grid(wanted), kind)
    own, turned = compared(decoded, wanted, row_from)
    every, turned_of_all = compared(decoded, wanted, None)
    assert own.findings == every.findings
    assert turned == turned_of_all
    for name in ("contour", "only", "row", "circle"):
        assert np.array_equal(getattr(own.match, name), getattr(every.match, name))
    assert np.array_equal(own.match.off_mm, every.match.off_mm)
    assert own.rounding.max == pytest.approx(every.rounding.max, rel=1e-9, nan_ok=True)
    assert own.rounding.rms == pytest.approx(every.rounding.rms, rel=1e-9, nan_ok=True)


@given(
    st.integers(0, 10_000),
    st.integers(1, 8),
    st.sampled_from(DAMAGES),
    st.integers(1, 300),
    st.booleans(),
)
def test_the_size_of_lots_changes_nothing(
    seed: int, count: int, kind: str, size: int, known: bool
) -> None:
    rng = np.random.default_rng(seed)
    wanted = scribbles(rng, count)
    decoded, row_from = damaged(rng, on_grid(wanted), kind)
    came = row_from if known else None
    whole, turned = compared(decoded, wanted, came)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(coverage, "SAMPLES_AT_ONCE", size)
        patch.setattr(coverage, "ROWS_AT_ONCE", size)
        patch.setattr(matching, "ROWS_AT_ONCE", size)
        parts, turned_too = compared(decoded, wanted, came)
    assert (parts.findings, turned_too) == (whole.findings, turned)
    for name in ("contour", "only", "row", "circle", "off_mm"):
        assert np.array_equal(getattr(parts.match, name), getattr(whole.match, name))
    assert parts.rounding.max == pytest.approx(whole.rounding.max, rel=1e-12, nan_ok=True)
    assert parts.rounding.rms == pytest.approx(whole.rounding.rms, rel=1e-12, nan_ok=True)


@given(st.integers(0, 10_000), st.integers(1, 6))
def test_wrong_claims_of_where_rows_came_from_harm_nothing(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    wanted = scribbles(rng, count)
    decoded = on_grid(wanted)
    claimed = rng.integers(-1, len(wanted), len(decoded))
    own, every = (compared(decoded, wanted, rows)[0] for rows in (claimed, None))
    assert own.findings == every.findings
    assert np.array_equal(own.match.only, every.match.only)
    assert own.rounding.max == pytest.approx(every.rounding.max, rel=1e-9, nan_ok=True)


def test_a_whole_program_has_no_findings_and_a_moved_line_has() -> None:
    wanted = scribbles(np.random.default_rng(1), 30)
    everything = np.arange(len(wanted))
    assert compared(on_grid(wanted), wanted, everything)[0].findings == ()
    cuts = cut_moves(wanted, flat_cuts=False)
    row = np.flatnonzero(cuts.is_cut & (wanted.kind == Kind.LINE))[5]
    end = wanted.end.copy()
    end[row, :2] += 0.3
    moved = wanted.picked(everything, end=end)
    assert compared(moved, wanted, everything)[0].findings != ()


def test_contours_in_one_place_are_found_too() -> None:
    path = ToolpathBuilder()
    for _ in range(2):
        path.rapid(x=0.0, y=0.0, z=1.0).line(z=-1.0, feed=100.0)
        path.line(5.0, 0.0, feed=100.0).line(5.0, 5.0, feed=100.0).rapid(z=1.0)
    wanted = path.finish()
    # A search cannot tell them apart: both are matched with the last of them.
    for row_from, matched in ((np.arange(len(wanted)), [-1, 0, 1]), (None, [-1, 1])):
        found = compared(wanted, wanted, row_from)[0]
        assert found.findings == ()
        assert sorted(set(found.match.contour.tolist())) == matched


@pytest.mark.parametrize("short", [False, True])
def test_an_arc_that_ends_beside_its_start_is_no_full_circle(short: bool) -> None:
    """The ends and the centres of both are alike; what is missing is all of the circle."""
    end, paths = (10.0, 0.001) if short else (10.0, 0.0), []
    for x, y in ((10.0, 0.0), end):
        path = ToolpathBuilder().rapid(z=1.0).rapid(10.0, 0.0).line(z=-1.0, feed=100.0)
        paths.append(path.arc(x, y, centre=(0.0, 0.0), ccw=True, feed=200.0).rapid(z=1.0).finish())
    wanted, decoded = paths
    own, _ = compared(decoded, wanted, np.arange(len(decoded)))
    assert own.findings == compared(decoded, wanted, None)[0].findings
    assert bool(own.findings) == short


@pytest.mark.parametrize("beside", [0.0, 0.4])
@pytest.mark.parametrize("apart", [0.1, 0.5, 0.9, 1.3])
def test_ends_beside_their_circles_leave_less_room_for_rows_to_be_alike(
    beside: float, apart: float
) -> None:
    """Two quarters of a circle whose ends lie beside it by a part of the limit, `apart` by another
    part of it."""
    paths = []
    for y in (0.0, apart * LIMIT_MM):
        path = ToolpathBuilder().rapid(z=1.0).rapid(10.0, y).line(z=-1.0, feed=100.0)
        end = 10.0 + beside * LIMIT_MM + y
        path.arc(0.0, end, centre=(0.0, y), ccw=True, feed=200.0)
        paths.append(cut_moves(path.finish(), flat_cuts=False))
    one, other = paths
    rows = coverage._rows_alike(other, one, (LIMIT_MM, DEPTH_MM), np.arange(4))
    # Both arcs lie beside their circles, and their centres are as far apart as their ends.
    assert (len(rows) == 1) == (apart <= 1.0 - 2.0 * apart - 2.0 * beside)


@given(
    st.floats(0.01, 30.0),
    st.floats(-3.1, 3.1),
    st.floats(0.01, 6.2),
    st.lists(st.floats(-0.002, 0.002), min_size=6, max_size=6),
)
def test_arcs_whose_rows_are_alike_lie_within_the_limits(
    radius: float, begin: float, sweep: float, off: list[float]
) -> None:
    """Arcs whose ends and centres are moved a little, against points on both."""
    paths = []
    for moved in (np.zeros(6), np.array(off)):
        start = radius * np.array([np.cos(begin), np.sin(begin)]) + moved[:2]
        end = radius * np.array([np.cos(begin + sweep), np.sin(begin + sweep)]) + moved[2:4]
        path = ToolpathBuilder().rapid(z=1.0).rapid(*start).line(z=-1.0, feed=100.0)
        centre = (float(moved[4]), float(moved[5]))
        path.arc(*end, centre=centre, ccw=True, feed=200.0)
        paths.append(cut_moves(path.finish(), flat_cuts=False))
    one, other = paths
    rows = coverage._rows_alike(other, one, (LIMIT_MM, DEPTH_MM), np.arange(4))
    if len(rows):
        samples = coverage.sample_cuts(other, 0.01)
        near = MoveIndex(one).nearest_of_all(samples.points, samples.z, LIMIT_MM)
        assert near.distance.max() <= LIMIT_MM + 1e-9
