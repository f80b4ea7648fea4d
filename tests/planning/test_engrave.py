"""Engraving: every path as it is drawn, open ones from either end."""

from __future__ import annotations

import math
import re
from itertools import combinations

import numpy as np
import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st

from camtool.errors import OptionError
from camtool.findings import Finding, Severity
from camtool.geometry.measure import sample
from camtool.geometry.nesting import Nesting
from camtool.geometry.polylines import Polyline, Polylines
from camtool.operations.engrave import work as engraving
from camtool.operations.engrave.work import engrave
from camtool.planning.items import Chosen, Contour, Feeds, Setting
from camtool.planning.job import Operation, Tool
from tests.oracles import contours as shapes
from tests.strategies import examples

PATHS = [shapes.SLOT, shapes.opened((0, 0), (5, 0, 1), (9, 0)), shapes.NOTCH]


def setting_of(direction: str = "drawn") -> Setting:
    operation = Operation(kind="engrave", name="marks", direction=direction)
    return Setting(operation, Feeds(100.0, 40.0), (-0.1,), 5.0)


def chosen_of(paths: list[Polyline]) -> Chosen:
    names = tuple(f"PATH {index}" for index in range(len(paths)))
    return Chosen(
        Nesting(Polylines.of(paths)),
        3 + np.arange(len(paths)),
        names,
        np.empty((0, 2)),
        (),
        np.zeros(len(paths), bool),
    )


def test_paths_are_kept_as_they_are_drawn() -> None:
    setting = setting_of()
    work = engrave(chosen_of(PATHS), setting)
    assert not work.findings
    for index, (item, path) in enumerate(zip(work.items, PATHS, strict=True)):
        assert isinstance(item, Contour)
        assert item.path.vertices.tolist() == path.vertices.tolist()
        assert item.path.closed == path.closed
        assert (item.name, item.source) == (f"PATH {index}", 3 + index)
        assert item.setting is setting


def test_open_paths_may_begin_at_either_end_and_closed_ones_anywhere_but_not_backwards() -> None:
    work = engrave(chosen_of(PATHS), setting_of())
    assert [item.reversible for item in work.items] == [False, True, False]
    assert all(len(item.starts) == 0 for item in work.items)
    assert all(item.material_left is None for item in work.items)


@pytest.mark.parametrize("direction", ["climb", "conventional"])
def test_a_groove_has_no_side_to_climb_on(direction: str) -> None:
    with pytest.raises(OptionError, match=direction) as caught:
        engrave(chosen_of(PATHS), setting_of(direction))
    assert caught.value.where == "operation 'marks', key direction"
    assert "drawn" in caught.value.mend


def test_nothing_chosen_is_no_work() -> None:
    assert not len(engrave(chosen_of([]), setting_of()).items)


def lines_at(*starts: tuple[float, float], along: tuple[float, float]) -> list[Polyline]:
    """Lines from these places, all of one direction and length."""
    return [shapes.opened(start, tuple(np.add(start, along))) for start in starts]


def narrow(paths: list[Polyline], tool: Tool, depth: float = 0.5) -> list[Finding]:
    operation = Operation(kind="engrave", tool=tool)
    setting = Setting(operation, Feeds(100.0, 40.0), (-depth,), 5.0)
    return list(engrave(chosen_of(paths), setting).findings)


RING = Polyline(np.array([[-2.0, 0, 1], [2.0, 0, 1.0]]), closed=True)
TRIANGLE = [shapes.opened((0, 0), (6, 0)), shapes.opened((6, 0), (3, 3 * math.sqrt(3.0))),
            shapes.opened((3, 3 * math.sqrt(3.0)), (0, 0))]  # fmt: skip


@pytest.mark.parametrize(
    ("paths", "fits"),
    [
        (lines_at((0, 0), (0, 1.7), along=(10, 0)), 1.7),
        # Beside each other in part, and slanted.
        (lines_at((0, 0), (6, 1.3), along=(10, 2)), None),
        ([RING], 4.0),
        # The circle within a triangle that three lines make has the radius a / (2·√3).
        (TRIANGLE, 6.0 / math.sqrt(3.0)),
        ([shapes.SLOT], None),
    ],
)
@given(share=st.floats(0.3, 3.0))
@examples(30)
def test_lines_nearer_than_the_tool_is_wide_run_together(
    paths: list[Polyline], fits: float | None, share: float
) -> None:
    """Shapely tells what a groove of the tool's width leaves: the ground between the lines is in
    pieces, or none, when they run together."""
    if fits is None:
        fits = free_width(paths)
    found = narrow(paths, Tool(share * fits))
    if share <= 1.0:
        assert found == []
    elif share > 1.05:
        (finding,) = found
        assert finding.severity is Severity.WARNING
        assert finding.measured == pytest.approx(share * fits)
        assert finding.limit == pytest.approx(fits, rel=0.02)
        assert narrow(paths, Tool(0.97 * (finding.limit or 0.0))) == []


def free_width(paths: list[Polyline]) -> float:
    """The least distance of two lines, or the widest disc in one that is closed, by dense
    points."""
    if len(paths) == 2:
        one, other = (sample(path, 0.01) for path in paths)
        return float(np.hypot(*(one[:, None] - other[None]).transpose(2, 0, 1)).min())
    outline = shapely.Polygon(sample(paths[0], 0.01))
    return 2.0 * float(shapely.length(shapely.maximum_inscribed_circle(outline)))


def test_of_many_lines_that_cross_the_first_are_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    rows = [shapes.opened((0, 0.3 * k), (60, 0.3 * k)) for k in range(100)]
    columns = [shapes.opened((0.3 * k, 0), (0.3 * k, 60)) for k in range(100)]
    paths = [path for pair in zip(rows, columns, strict=True) for path in pair]
    (every,) = narrow(paths, Tool(0.5))
    monkeypatch.setattr(engraving, "MAX_PAIRS", 1_000)
    monkeypatch.setattr(engraving, "FIRST_LINES", 8)
    (some,) = narrow(paths, Tool(0.5))
    assert some.limit == pytest.approx(every.limit, rel=1e-3)
    counts = [int(re.findall(r"at (\d+) more", each.message)[0]) for each in (some, every)]
    assert 100 < counts[0] < counts[1] / 2


def test_what_crosses_or_ends_beside_another_line_does_not_run_together() -> None:
    cross = [shapes.opened((-5, 0), (5, 0)), shapes.opened((0, -5), (0, 5))]
    assert narrow(cross, Tool(3.0)) == []
    # The crossbar of a letter that is drawn a little beside its leg.
    bar = [shapes.opened((0, -5), (0, 5)), shapes.opened((0.1, 0), (4, 0))]
    assert narrow(bar, Tool(0.3)) == []
    far = [shapes.opened((0, -5), (0, 5)), shapes.opened((1.0, 0), (4, 0))]
    assert len(narrow(far, Tool(1.2))) == 1
    assert narrow(far, Tool(0.0)) == []


def test_a_v_bit_cuts_as_wide_as_it_is_deep() -> None:
    paths = lines_at((0, 0), (0, 1.0), along=(10, 0))
    bit = Tool(6.0, "v", math.radians(90.0), 0.1)
    assert narrow(paths, bit, 0.4) == []  # 0.9 mm wide
    (finding,) = narrow(paths, bit, 0.6)
    assert finding.measured == pytest.approx(1.3)
    assert "PATH 0 at" in str(finding.where)


PLACES = st.tuples(st.floats(0.0, 40.0), st.floats(0.0, 40.0))


def ring(place: tuple[float, float], radius: float) -> Polyline:
    (x, y), r = place, radius
    return Polyline(np.array([[x - r, y, 1.0], [x + r, y, 1.0]]), closed=True)


def bar(place: tuple[float, float], long: float, wide: float, turn: float) -> Polyline:
    along = np.array([math.cos(turn), math.sin(turn)]) * long
    across = np.array([-math.sin(turn), math.cos(turn)]) * wide
    corners = np.array(place) + np.array([0 * along, along, along + across, across])
    return Polyline(np.column_stack([corners, np.zeros(4)]), closed=True)


def stroke(place: tuple[float, float], long: float, turn: float) -> Polyline:
    x, y = place
    return shapes.opened(place, (x + long * math.cos(turn), y + long * math.sin(turn)))


SHAPES = st.one_of(
    st.builds(ring, PLACES, st.floats(0.8, 6.0)),
    st.builds(bar, PLACES, st.floats(2.0, 12.0), st.floats(1.0, 8.0), st.floats(0.0, 6.0)),
    st.builds(stroke, PLACES, st.floats(1.0, 20.0), st.floats(0.0, 6.0)),
)


def line_of(path: Polyline) -> shapely.Geometry:
    points = sample(path, 0.02)
    return shapely.linearrings(points) if path.closed else shapely.linestrings(points)


def keeps_all(lines: list[shapely.Geometry], width: float) -> bool:
    """True if grooves of this width stay apart, and leave ground within each closed line."""
    cut = [shapely.buffer(line, 0.5 * width, quad_segs=32) for line in lines]
    closed = sum(line.geom_type == "LinearRing" for line in lines)
    grounds = sum(shapely.get_num_interior_rings(each) for each in cut)
    apart = len(shapely.get_parts(shapely.union_all(cut))) == len(lines)
    return apart and grounds == closed


@examples(20, 1000)
@given(st.lists(SHAPES, min_size=1, max_size=6), st.floats(0.6, 1.9))
def test_random_lines_run_together_where_buffers_meet(paths: list[Polyline], share: float) -> None:
    """Against shapely alone: which lines overlap when all are as wide as the tool, where, and the
    widest tool with which none do, by halving."""
    lines = [line_of(path) for path in paths]
    assume(all(line.is_simple for line in lines) and keeps_all(lines, 0.4))
    low, high = 0.4, 40.0
    while high - low > 1e-3:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if keeps_all(lines, middle) else (low, middle)
    assume(high < 39.0)
    fits, width = low, share * low
    assume(abs(share - 1.0) > 0.03)
    found = narrow(paths, Tool(width))
    assert bool(found) == (share > 1.0)
    if not found:
        return
    (finding,) = found
    assert finding.limit == pytest.approx(fits, rel=0.02, abs=5e-3)
    told = re.fullmatch(r"PATH (\d+) at X ([-\d.]+) Y ([-\d.]+)", str(finding.where))
    assert told
    row, place = int(told[1]), shapely.points(float(told[2]), float(told[3]))
    away = sorted(shapely.distance(place, line) for line in lines)
    # In the middle between two lines, or in that of what one encloses.
    assert away[0] == pytest.approx(0.5 * fits, rel=0.05, abs=0.01)
    assert shapely.distance(place, lines[row]) == pytest.approx(0.5 * fits, rel=0.05, abs=0.01)
    rooms = [
        2.0 * shapely.length(shapely.maximum_inscribed_circle(shapely.Polygon(line)))
        for line in lines
        if line.geom_type == "LinearRing"
    ]
    rooms += [shapely.distance(one, other) for one, other in combinations(lines, 2)]
    more = re.search(r"and at (\d+) more", finding.message)
    places = 1 + (int(more[1]) if more else 0)
    sure = sum(room < 0.97 * width for room in rooms)
    assert sure <= places <= sure + sum(0.97 * width <= room < width for room in rooms)
