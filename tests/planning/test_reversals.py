"""Contours cut as runs without reversals: what they are, and what the machine makes of them."""

from __future__ import annotations

import math
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from camtool.findings import Severity
from camtool.geometry.distance import points_to_segments
from camtool.geometry.measure import length, sample
from camtool.geometry.polylines import Polyline, Segments, begin_at, reverse, rotate
from camtool.importers.read import read_drawing
from camtool.machine.model import Machine
from camtool.pipeline import post_drawing
from camtool.planning.findings import PlanningCode
from camtool.planning.items import Contour, Fixed, Item
from camtool.planning.job import Entry, Lead, Tabs, job_of
from camtool.planning.order import must_precede
from camtool.planning.reversing import fewer_reversals
from camtool.toolpath.findings import ProgramCode
from tests.oracles.reversals import fewest_runs
from tests.paths import mirrored, moved, scaled
from tests.planning.reversal_parts import (
    PIC,
    circle,
    contour,
    cutting_reversals,
    gear,
    judged,
    letter_e,
    letter_s,
    letter_v,
    paths_of,
    polygon,
    reversals_of,
    run_of,
    setting,
    square,
    star,
    with_play,
)
from tests.strategies import contours, examples, open_contours

LOGO = Path(__file__).parents[2] / "samples" / "logo.dxf"

STEPS_MM = 3e-4
"""Two steps of the PIC machine: what its interpolation adds to errors, or takes from them."""

SHAPES = {
    "square": square(),
    "circle": circle(),
    "star": star(),
    "gear": gear(),
    "S": letter_s(),
    "E": letter_e(),
    "V": letter_v(),
}


def divided(path: Polyline, machine: Machine, **operation: Any) -> list[Polyline]:
    return paths_of(fewer_reversals([contour(path, **operation)], machine)[0])


@given(st.one_of(contours(), open_contours()))
def test_the_runs_are_the_contour(machine: Machine, path: Polyline) -> None:
    pieces = divided(path, machine)
    assert all(reversals_of(piece, machine) == (0, 0) for piece in pieces)
    assert sum(map(length, pieces)) == pytest.approx(length(path), rel=1e-12)
    for piece in pieces:
        points = sample(piece, length(path) / 200.0)
        assert points_to_segments(points, Segments.of(path)).min(axis=1).max() < 1e-9
    # Every place is an end of two runs, but for the ends of an open path.
    ends = np.array([end for piece in pieces for end in (piece.start, piece.end)])
    same = (ends[:, None] == ends[None]).all(axis=2).sum(axis=1)
    loose = ends[same % 2 == 1]
    assert len(loose) == (0 if path.closed else 2)
    if not path.closed:
        assert {tuple(end) for end in loose} == {tuple(path.start), tuple(path.end)}


coordinate = st.integers(0, 4).map(float)


@given(st.lists(st.tuples(coordinate, coordinate), min_size=3, max_size=8, unique=True))
def test_no_division_has_fewer_runs(machine: Machine, points: list[tuple[float, float]]) -> None:
    # Many lines along the axes, which may go with either neighbour.
    path = polygon(*points)
    least = fewest_runs(path)
    found = len(divided(path, machine))
    assert found >= least
    # Without residual errors nothing but the number of runs counts.
    exact = with_play(machine, backlash_mm=0.2, compensation_mm=0.2)
    assert len(divided(path, exact)) == least


@pytest.mark.parametrize(
    ("path", "runs", "error_um", "why"),
    [
        (square(), 2, 0.0, "both halves from the lower left"),
        (begin_at(square(), 1), 2, 0.0, "wherever it is drawn from"),
        (reverse(square()), 2, 0.0, "however it is drawn"),
        (circle(), 4, 9.5, "two quarters must drive one axis backward: Y errs less"),
        (rotate(square(), 0.3), 4, 9.5, "no line along an axis: two more runs"),
    ],
)
def test_known_divisions(
    machine: Machine, path: Polyline, runs: int, error_um: float, why: str
) -> None:
    pieces = divided(path, machine)
    assert len(pieces) == runs, why
    report = judged(pieces, [path], machine, approach=True)
    assert report.error_um.total.max == pytest.approx(error_um, abs=0.3), why
    assert cutting_reversals(report) == 0, why


def test_halves_begin_at_one_point(machine: Machine) -> None:
    one, other = divided(square(), machine)
    assert (one.start == other.start).all()
    assert (one.end == other.end).all()
    assert one.start.tolist() == [0.0, 0.0]


@pytest.mark.parametrize("name", SHAPES)
def test_runs_go_one_way_where_that_costs_nothing(machine: Machine, name: str) -> None:
    for piece in divided(SHAPES[name], machine):
        assert piece.end[0] >= piece.start[0]


def test_a_smaller_error_is_worth_a_run(machine: Machine) -> None:
    # In one run, one of the lines would be off by the error of an axis that it does not need.
    angle = Polyline(np.array([[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]))
    assert reversals_of(angle, machine) == (0, 0)
    pieces = divided(angle, machine)
    assert [piece.start.tolist() for piece in pieces] == [[1.0, 0.0], [0.0, 1.0]]
    report = judged(pieces, [angle], machine, approach=True)
    assert report.error_um.total.max == pytest.approx(0.0, abs=0.3)
    # Without residual errors it stays one.
    exact = with_play(machine, backlash_mm=0.2, compensation_mm=0.2)
    assert len(divided(angle, exact)) == 1


@pytest.mark.parametrize("name", SHAPES)
def test_reversals_and_errors_of_shapes(machine: Machine, name: str) -> None:
    path = moved(SHAPES[name], 1.0, 1.0)
    before = judged([path], [path], machine, approach=False)
    after = judged(divided(path, machine), [path], machine, approach=True)
    assert cutting_reversals(before) >= 2
    assert cutting_reversals(after) == 0
    assert (before.error_um.total.max or 0.0) >= 11.0
    assert (after.error_um.total.max or 0.0) <= 9.5 + 1000.0 * STEPS_MM
    assert (after.error_um.total.rms or 0.0) < (before.error_um.total.rms or 0.0)


@examples(25)
@given(st.one_of(contours(max_points=7), open_contours(max_points=7)))
def test_the_error_never_rises(machine: Machine, path: Polyline) -> None:
    small = moved(scaled(path, 0.05), 1.0, 1.0)
    # The dialect cannot say centres that are farther away.
    assume((Segments.of(small).radius[Segments.of(small).is_arc] < 50.0).all())
    before = judged([small], [small], machine, approach=False)
    after = judged(divided(small, machine), [small], machine, approach=True)
    assert cutting_reversals(after) == 0
    least, most = (each.error_um.total.max for each in (after, before))
    assert least is not None
    assert most is not None
    assert least <= most + 1000.0 * STEPS_MM


@pytest.mark.parametrize("name", ["circle", "gear", "S", "E"])
@pytest.mark.parametrize("compensation_mm", [0.0, 0.1])
def test_nor_where_compensation_is_too_small(
    machine: Machine, name: str, compensation_mm: float
) -> None:
    loose = with_play(machine, backlash_mm=compensation_mm + 0.01, compensation_mm=compensation_mm)
    path = moved(SHAPES[name], 1.0, 1.0)
    before = judged([path], [path], loose, approach=False)
    after = judged(divided(path, loose), [path], loose, approach=True)
    assert cutting_reversals(after) == 0
    assert (after.error_um.total.max or 0.0) <= (before.error_um.total.max or 0.0) + 0.3
    assert (after.error_um.total.rms or 0.0) < (before.error_um.total.rms or 0.0)


def test_the_sample_logo(machine: Machine) -> None:
    # A fifth of its size: a millimetre, as the small logo of the thesis.
    paths = [moved(scaled(path, 0.2), 0.5, 0.5) for path in read_drawing(LOGO).paths]
    items, findings = fewer_reversals([contour(path) for path in paths], machine)
    before = judged(paths, paths, machine, approach=False)
    after = judged(paths_of(items), paths, machine, approach=True)
    assert cutting_reversals(before) > 200
    assert cutting_reversals(after) <= cutting_reversals(before) / 20
    assert (after.error_um.total.max or 0.0) <= (before.error_um.total.max or 0.0)
    assert [finding.code for finding in findings] == [PlanningCode.REVERSALS_IN_AIR]
    assert findings[0].measured == 0.0
    assert findings[0].limit == sum(sum(reversals_of(path, machine)) for path in paths)


@given(contours())
def test_mirrored_and_turned_they_are_as_many(machine: Machine, path: Polyline) -> None:
    # With the same play on both axes, so that neither is better.
    even = with_play(machine, backlash_mm=0.19, compensation_mm=0.2)
    count = len(divided(path, even))
    quarter = np.array([[0.0, 1.0], [-1.0, 0.0]])
    turned = Polyline(np.column_stack([path.vertices[:, :2] @ quarter, path.vertices[:, 2]]), True)
    for other in (mirrored(path), reverse(path), begin_at(path, 2), turned):
        assert len(divided(other, even)) == count


def test_climb_and_conventional_keep_their_direction(machine: Machine) -> None:
    path = gear()
    for left in (True, False):
        item = contour(path, left=left, direction="climb", tool=setting_tool(0.1))
        items, _ = fewer_reversals([item], machine)
        assert len(items) > 4
        for piece in items:
            assert isinstance(piece, Contour)
            assert piece.material_left is left
            assert not piece.reversible
            assert follows(piece.path, path)
    # A point without width cuts on no side, and an engraved line has none.
    assert not all(follows(each, path) for each in divided(path, machine, direction="climb"))
    engraved = contour(path, direction="climb", tool=setting_tool(0.1))
    assert not all(
        follows(each, path) for each in paths_of(fewer_reversals([engraved], machine)[0])
    )


@pytest.mark.parametrize("name", SHAPES)
def test_nor_does_the_error_rise_when_they_do(machine: Machine, name: str) -> None:
    path = moved(SHAPES[name], 1.0, 1.0)
    item = contour(path, left=True, direction="climb", tool=setting_tool(0.1))
    pieces = paths_of(fewer_reversals([item], machine)[0])
    before = judged([path], [path], machine, approach=False)
    after = judged(pieces, [path], machine, approach=True)
    assert cutting_reversals(after) == 0
    assert (after.error_um.total.max or 0.0) <= (before.error_um.total.max or 0.0) + 0.3


def setting_tool(diameter_mm: float) -> Any:
    from camtool.planning.job import Tool

    return Tool(diameter_mm)


def follows(piece: Polyline, path: Polyline) -> bool:
    """True if a piece runs in the direction of the path."""
    middle = sample(piece, length(piece) / 7.9)[:2]
    along = [
        float(
            np.argmin(
                points_to_segments(
                    sample(path, 0.003),
                    Segments.of(
                        Polyline(np.array([[*point, 0.0], [point[0] + 1e-5, point[1], 0.0]]))
                    ),
                )[:, 0]
            )
        )
        for point in middle
    ]
    return 0 < (along[1] - along[0]) % len(sample(path, 0.003)) < 0.5 * len(sample(path, 0.003))


def test_a_run_cut_backward_has_its_material_on_the_other_side(machine: Machine) -> None:
    item = contour(circle(), left=True)
    for piece in fewer_reversals([item], machine)[0]:
        assert isinstance(piece, Contour)
        assert piece.material_left is follows(piece.path, circle())
        assert piece.outline is item.path
        assert (piece.name, piece.source, piece.setting) == (item.name, item.source, item.setting)
        assert len(piece.starts) == 0


def test_an_axis_without_play_may_turn(machine: Machine) -> None:
    assert (
        len(divided(circle(), with_play(machine, y_backlash_mm=0.0, y_compensation_mm=0.0))) == 2
    )
    assert (
        len(divided(circle(), with_play(machine, x_backlash_mm=0.0, x_compensation_mm=0.0))) == 2
    )
    none = with_play(machine, backlash_mm=0.0, compensation_mm=0.0)
    item = contour(circle())
    items, findings = fewer_reversals([item], none)
    assert items == [item]
    assert [(each.code, each.severity) for each in findings] == [
        (ProgramCode.PLAY_NOT_KNOWN, Severity.WARNING)
    ]


@pytest.mark.parametrize(
    "operation",
    [
        {"tabs": Tabs(count=2)},
        {"lead_in": Lead("arc", 0.1)},
        {"lead_out": Lead("line", 0.1)},
        {"entry": Entry("ramp")},
        {"start": "corner"},
        {"start": (0.0, 0.0)},
    ],
)
def test_what_only_a_whole_contour_can_have_keeps_it_whole(
    machine: Machine, operation: dict[str, Any]
) -> None:
    items, findings = fewer_reversals([contour(square(), **operation)], machine)
    (item,) = items
    assert isinstance(item, Contour)
    assert item.path.closed
    assert [each.code for each in findings] == [PlanningCode.REVERSALS_IN_AIR] * 2
    assert "in one piece" in findings[1].message
    starts = item.starts.tolist()
    assert starts == ([] if "start" in operation else [0, 1, 2, 3])


def test_whole_contours_begin_where_most_turns_are(machine: Machine) -> None:
    tabs = Tabs(count=2)
    item = start_of(contour(circle(start_rad=0.3), tabs=tabs), machine)
    begins = [begin_at(item.path, start) for start in item.starts.tolist()]
    assert len(begins) == 4
    assert {sum(reversals_of(path, machine)) for path in begins} == {3}
    assert sum(reversals_of(circle(start_rad=0.3), machine)) == 4
    # A corner at which both axes turn is better than those where one does.
    wedge = polygon((3.0, 1.0), (1.0, 2.0), (0.0, 0.0))
    item = start_of(contour(wedge, tabs=tabs), machine)
    assert [begin_at(item.path, start).start.tolist() for start in item.starts] == [[0.0, 0.0]]
    # Where the operation says where it may begin, it begins at the best of these.
    house = polygon((0.0, 0.0), (2.0, 0.0), (2.5, 2.0), (1.5, 2.5), (1.0, 3.0), (-0.5, 2.0))
    allowed = Contour(house, setting(tabs=tabs), "test", 0, starts=np.array([2, 3, 4]))
    chosen = start_of(allowed, machine)
    assert chosen.path is house
    assert chosen.starts.tolist() == [2, 4]


def start_of(item: Contour, machine: Machine) -> Contour:
    (made,) = fewer_reversals([item], machine)[0]
    assert isinstance(made, Contour)
    assert len(made.starts)
    return made


def test_fixed_items_and_straight_lines_stay(machine: Machine) -> None:
    fixed = Fixed((run_of(square()),), setting(), "pocket")
    line = Polyline(np.array([[0.0, 0.0, 0.0], [1.0, 2.0, 0.0]]))
    items: list[Item] = [fixed, contour(line), fixed]
    made, findings = fewer_reversals(items, machine)
    assert made[0] is made[2] is fixed
    assert len(made) == 3
    assert paths_of(made[1:2])[0].vertices.tolist() == line.vertices.tolist()
    assert findings == ()


def test_lines_are_drawn_towards_the_better_side(machine: Machine) -> None:
    # Nothing but their direction changes: X towards + leaves no error.
    line = Polyline(np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 0.0]]))
    (item,) = fewer_reversals([contour(line)], machine)[0]
    assert isinstance(item, Contour)
    assert item.path.start.tolist() == [0.0, 0.0]
    assert not item.reversible
    assert item.outline is None


def test_what_is_told_counts_passes(machine: Machine) -> None:
    _, (told,) = fewer_reversals([contour(square(), levels=3)], machine)
    # Three rounds in one go turn 4 times each; at the start nothing has turned yet.
    assert told.limit == 3 * 4 - 2
    assert told.measured == 0.0
    assert "1 run is cut as 6" in told.message
    assert told.severity == Severity.INFO
    assert math.isclose(float(told.message.split(" µm, not ")[1].split()[0]), 14.9, abs_tol=0.05)


def test_what_a_divided_contour_holds_is_cut_before_all_its_runs(machine: Machine) -> None:
    outer, hole = contour(square(3.0)), contour(moved(circle(), 1.5, 1.5))
    items, _ = fewer_reversals([outer, hole], machine)
    runs: dict[int, list[int]] = {id(outer.path): [], id(hole.path): []}
    for index, item in enumerate(items):
        assert isinstance(item, Contour)
        runs[id(item.outline)].append(index)
    pairs = {tuple(pair) for pair in must_precede(items).tolist()}
    assert pairs == set(product(runs[id(hole.path)], runs[id(outer.path)]))
    assert len(pairs) == 8


def test_a_letter_from_drawing_to_report() -> None:
    posted = post_drawing(
        read_drawing(LOGO.with_name("letter.svg")),
        job_of(origin="lower-left", minimise="reversals"),
        PIC,
    )
    assert posted.verification is not None
    report = posted.verification.report
    assert report.contours == 10
    assert cutting_reversals(report) == 0
    assert report.before is not None
    assert report.before.reversals_cutting == 11
    assert report.before.total_max_um == pytest.approx(14.84, abs=0.3)
    assert report.error_um.total.max == pytest.approx(9.5, abs=0.3)
    assert "10 reversals while cutting become 0" in str(
        next(each for each in posted.findings if each.code == PlanningCode.REVERSALS_IN_AIR)
    )
