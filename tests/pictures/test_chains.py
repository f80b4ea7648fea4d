"""Toolpaths and drawings as chains, and chains as path data."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.geometry.measure import sample
from camtool.geometry.polylines import Polyline, Polylines, reverse, rotate
from camtool.pictures.chains import Chain, chains_box, chains_of, moves_of, path_data
from camtool.toolpath.builder import ToolpathBuilder
from tests.oracles.svg_page import Arc, Line, pieces
from tests.paths import mirrored

FULL = 2.0 * math.pi
EQUAL_MM = 1e-6
"""Positions are equal within this: so far an arc may bend beside its box."""

BULGES = st.just(0.0) | st.floats(1e-9, 1.0) | st.floats(-1.0, -1e-9)


def toolpath_arc(sweep: float, radius: float = 2.0, first: float = 0.3) -> Chain:
    """The chain of one arc about (1, −1), as a toolpath gives it."""
    begin, end = (
        (1.0 + radius * math.cos(angle), -1.0 + radius * math.sin(angle))
        for angle in (first, first + sweep)
    )
    end = begin if abs(sweep) == FULL else end
    builder = ToolpathBuilder((*begin, 0.0))
    path = builder.arc(*end, centre=(1.0, -1.0), ccw=sweep > 0.0, feed=1.0).finish()
    (chain,) = moves_of(path).feeds
    return chain


@given(
    st.floats(0.05, FULL) | st.sampled_from([math.pi, 0.75 * FULL, FULL]),
    st.booleans(),
    st.floats(0.01, 500.0),
    st.floats(-FULL, FULL),
)
def test_arcs_come_back_as_the_same_arcs(
    turn: float, ccw: bool, radius: float, first: float
) -> None:
    sweep = turn if ccw else -turn
    chain = toolpath_arc(sweep, radius, first)
    found = pieces(path_data([chain]))
    assert all(isinstance(arc, Arc) for arc in found)
    arcs = [arc for arc in found if isinstance(arc, Arc)]
    assert len(arcs) == math.ceil(abs(chain.sweep[0]) / (0.75 * math.pi))
    # No half circle is one arc: its centre would lie off by √(2 · radius · 1e-9 mm).
    near = 1e-8 + 1e-6 / turn
    for arc in arcs:
        assert arc.centre == pytest.approx((1.0, -1.0), abs=near)
        assert arc.radius == pytest.approx(radius, abs=near)
        assert math.copysign(1.0, arc.sweep) == math.copysign(1.0, sweep)
    assert sum(arc.sweep for arc in arcs) == pytest.approx(sweep, abs=4.0 * near / radius)


def test_a_full_circle_is_three_arcs() -> None:
    for sweep in (FULL, -FULL):
        arcs = [arc for arc in pieces(path_data([toolpath_arc(sweep)])) if isinstance(arc, Arc)]
        assert len(arcs) == 3
        assert arcs[0].begin == arcs[2].end
        assert [arc.sweep for arc in arcs] == pytest.approx([sweep / 3.0] * 3, abs=1e-6)


def test_a_half_circle_of_rounded_numbers_stays_where_it_is() -> None:
    radius = 40.0005
    points = np.array([[0.0, 40.001], [0.0, -40.0]])
    chain = Chain(points, np.array([[0.0, 0.0]]), np.array([-math.pi]))
    arcs = [arc for arc in pieces(path_data([chain])) if isinstance(arc, Arc)]
    assert [math.dist(arc.centre, (0.0, 0.0)) < 2e-3 for arc in arcs] == [True, True]
    assert [arc.radius for arc in arcs] == pytest.approx([radius] * 2, abs=2e-3)


def test_mirroring_a_path_flips_the_flag_of_its_arcs() -> None:
    path = Polyline(np.array([[0, 0, 0.4], [2, 0, -0.3], [2, 2, 0]], dtype=float), True)
    flags = [arc.sweep for arc in pieces(path_data(chains_of(Polylines.of([path]))))[:2]]  # type: ignore[union-attr]
    turned = [
        arc.sweep  # type: ignore[union-attr]
        for arc in pieces(path_data(chains_of(Polylines.of([mirrored(path)]))))[:2]
    ]
    assert turned == pytest.approx([-flag for flag in flags])
    assert flags[0] > 0.0 > flags[1]


def test_an_arc_that_is_flat_is_a_line() -> None:
    path = Polyline(np.array([[0, 0, 1e-6], [1, 0, 3e-6], [1, 1, 0]], dtype=float))
    flat, bent = pieces(path_data(chains_of(Polylines.of([path]))))
    assert isinstance(flat, Line)
    assert isinstance(bent, Arc)


@pytest.mark.parametrize("closed", [True, False])
@pytest.mark.parametrize("last", [0.0, 0.5])
def test_a_path_is_closed_only_when_it_is(closed: bool, last: float) -> None:
    path = Polyline(np.array([[0, 0, 0], [3, 0, 0], [3, 1, last]], dtype=float), closed)
    data = path_data(chains_of(Polylines.of([path])))
    assert data.endswith("Z") == closed
    assert len(pieces(data)) == len(path)
    assert isinstance(pieces(data)[0], Line)


@given(
    st.lists(
        st.tuples(st.floats(-9, 9), st.floats(-9, 9), BULGES),
        min_size=2,
        max_size=6,
        unique_by=lambda v: (round(v[0], 2), round(v[1], 2)),
    ),
    st.booleans(),
)
def test_the_box_holds_all_points_and_is_touched(
    vertices: list[tuple[float, float, float]], closed: bool
) -> None:
    path = Polyline(np.array(vertices), closed)
    for shape in (path, mirrored(path), reverse(path), rotate(path, 1.0)):
        box = chains_box(chains_of(Polylines.of([shape])))
        assert box is not None
        points = sample(shape, 0.05)
        assert (points >= box[:, 0] - EQUAL_MM).all()
        assert (points <= box[:, 1] + EQUAL_MM).all()
        assert points.min(axis=0) == pytest.approx(box[:, 0], abs=0.05)
        assert points.max(axis=0) == pytest.approx(box[:, 1], abs=0.05)


@pytest.mark.parametrize("sweep", [1.0, -4.0, 5.5, FULL, -FULL])
def test_the_box_of_a_toolpath_arc_is_exact(sweep: float) -> None:
    chain = toolpath_arc(sweep)
    points = np.array([chain.at(0, share)[0] for share in np.linspace(0.0, 1.0, 20_001)])
    box = chains_box([chain])
    assert box is not None
    assert points.min(axis=0) == pytest.approx(box[:, 0], abs=1e-6)
    assert points.max(axis=0) == pytest.approx(box[:, 1], abs=1e-6)
    assert chain.lengths()[0] == pytest.approx(2.0 * abs(sweep))


def test_nothing_has_no_box() -> None:
    assert chains_box([]) is None


def test_moves_are_sorted_by_how_they_are_drawn() -> None:
    path = (
        ToolpathBuilder()
        .rapid(z=1.0)  # straight up: nothing to see from above
        .rapid(1.0, 0.0)
        .line(z=-0.1, feed=5.0)  # plunge
        .line(2.0, 0.0, feed=10.0)
        .arc(2.0, 2.0, centre=(2.0, 1.0), ccw=True, feed=10.0)
        .line(z=-0.2, feed=5.0)  # down to the next pass
        .line(3.0, 2.0, -0.3, feed=5.0)  # ramp
        .line(z=1.0, feed=5.0)  # rises: neither
        .rapid(1.0, 0.0)
        .line(z=-0.1, feed=5.0)  # a second plunge at the first place
        .rapid(3.0, 2.0)
        .finish()
    )
    moves = moves_of(path)
    assert [len(chain.sweep) for chain in moves.feeds] == [2]
    assert [chain.points.tolist() for chain in moves.ramps] == [[[2.0, 2.0], [3.0, 2.0]]]
    assert moves.plunges.tolist() == [[1.0, 0.0]]
    assert moves.starts.tolist() == [[1.0, 0.0]]
    # There and back is drawn once.
    assert [chain.points.tolist() for chain in moves.rapids] == [
        [[0.0, 0.0], [1.0, 0.0]],
        [[3.0, 2.0], [1.0, 0.0]],
    ]


def test_passes_at_several_depths_are_drawn_once() -> None:
    builder = ToolpathBuilder()
    for depth in (-0.1, -0.2, -0.3):
        builder.rapid(0.0, 0.0).line(z=depth, feed=5.0).line(1.0, 0.0, feed=5.0).rapid(z=1.0)
    moves = moves_of(builder.finish())
    assert len(moves.feeds) == len(moves.plunges) == 1


def test_headings_are_those_of_travel() -> None:
    assert toolpath_arc(math.pi, first=0.0).at(0, 0.5) == (
        pytest.approx((1.0, 1.0)),
        pytest.approx(math.pi),
    )
    assert toolpath_arc(-math.pi, first=math.pi).at(0, 0.5)[1] == pytest.approx(0.0)


def test_passes_of_one_stay_are_drawn_once() -> None:
    builder = ToolpathBuilder().rapid(z=1.0).rapid(1.0, 0.0)
    for level in (-1.0, -2.0, -3.0):
        builder.line(z=level, feed=5.0).line(2.0, 0.0, feed=5.0)
        builder.arc(2.0, 2.0, centre=(2.0, 1.0), ccw=True, feed=5.0).line(1.0, 0.0, feed=5.0)
    moves = moves_of(builder.rapid(z=1.0).finish())
    assert [len(chain.sweep) for chain in moves.feeds] == [3]
    assert moves.plunges.tolist() == [[1.0, 0.0]]


def test_there_and_back_is_drawn_once() -> None:
    builder = ToolpathBuilder().rapid(z=1.0).rapid(2.0, 0.0)
    for level in (-1.0, -2.0):
        builder.line(z=level, feed=5.0).line(3.0, 0.0, feed=5.0)
        builder.arc(5.0, 0.0, centre=(4.0, 0.0), ccw=True, feed=5.0).line(z=level - 0.5, feed=5.0)
        builder.arc(3.0, 0.0, centre=(4.0, 0.0), ccw=False, feed=5.0).line(2.0, 0.0, feed=5.0)
    moves = moves_of(builder.finish())
    assert [chain.sweep.tolist() for chain in moves.feeds] == [[0.0, pytest.approx(math.pi)]]
    other = ToolpathBuilder().arc(2.0, 0.0, centre=(1.0, 0.0), ccw=True, feed=5.0)
    other.arc(0.0, 0.0, centre=(1.0, 0.0), ccw=True, feed=5.0)  # the other half
    assert [len(chain.sweep) for chain in moves_of(other.finish()).feeds] == [2]


def test_slopes_and_helices_are_no_level_cuts() -> None:
    builder = ToolpathBuilder().rapid(z=1.0).rapid(1.0, 0.0).line(z=0.0, feed=5.0)
    builder.arc(1.0, 0.0, -1.0, centre=(0.0, 0.0), ccw=True, feed=5.0)
    builder.arc(1.0, 0.0, centre=(0.0, 0.0), ccw=True, feed=5.0).line(2.0, 0.0, -0.5, feed=5.0)
    moves = moves_of(builder.finish())
    assert [chain.sweep.tolist() for chain in moves.feeds] == [[pytest.approx(FULL)]]
    assert [len(chain.sweep) for chain in moves.ramps] == [1, 1]
    assert moves.starts.tolist() == [[1.0, 0.0]]


def test_small_steps_of_a_slope_are_neither_plunges_nor_starts() -> None:
    builder = ToolpathBuilder().rapid(z=1.0).rapid(1.0, 0.0).line(z=0.0, feed=5.0)
    for number in range(1, 50):
        builder.line(1.0 + 0.1 * number, 0.0, feed=5.0).line(z=-0.01 * number, feed=5.0)
    moves = moves_of(builder.finish())
    assert moves.plunges.tolist() == moves.starts.tolist() == [[1.0, 0.0]]
    assert [len(chain.sweep) for chain in moves.feeds] == [49]


def test_drilled_holes_are_plunges() -> None:
    builder = ToolpathBuilder().rapid(z=1.0)
    for x in (1.0, 2.0):
        builder.rapid(x, 0.0).line(z=-1.0, feed=5.0).rapid(z=1.0).rapid(z=-0.9)
        builder.line(z=-2.0, feed=5.0).rapid(z=1.0)
    moves = moves_of(builder.finish())
    assert moves.plunges.tolist() == [[1.0, 0.0], [2.0, 0.0]]
    assert (moves.feeds, moves.ramps, len(moves.starts)) == ((), (), 0)
