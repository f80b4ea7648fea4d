"""Pieces that come loose: against polygons that shapely makes, and by hand."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from camtool.findings import Finding
from camtool.geometry.polylines import Polyline
from camtool.kernels import pieces as kernel
from camtool.planning.job import Job, Operation, Stock, Tabs, Tool
from camtool.planning.plan import planned
from camtool.records import replace
from camtool.stock.checks import stock_findings, stock_request
from camtool.stock.cutters import CutterProfile
from camtool.stock.moves import stock_moves_of_toolpath
from camtool.stock.pieces import STANDING, loose_pieces
from camtool.stock.slides import tools_of_rows
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.findings import ProgramCode
from tests.drawings import drawing_of
from tests.oracles import stock_pieces as slow
from tests.oracles.path_machine import path_machine
from tests.strategies import examples


def box(x: float, y: float, width: float, height: float) -> Polyline:
    corners = [(x, y), (x + width, y), (x + width, y + height), (x, y + height)]
    return Polyline(np.array([(*corner, 0.0) for corner in corners]), closed=True)


def loose(job: Job, *paths: Polyline, layers: list[str] | None = None) -> list[Finding]:
    return [each for each in found_in(job, *paths, layers=layers) if each.code == LOOSE]


def found_in(job: Job, *paths: Polyline, layers: list[str] | None = None) -> tuple[Finding, ...]:
    made = planned(drawing_of(paths, layers), job, path_machine())
    tools = tools_of_rows(made.toolpath, job)
    moves = stock_moves_of_toolpath(made.toolpath, tools.index, tools.cutters)
    return stock_findings(made.toolpath, moves, stock_request(made.steps, job, 0.01), 0.01)


def size_of(finding: Finding) -> list[float]:
    return list(map(float, re.findall(r"([\d.]+) by ([\d.]+) mm", finding.message)[0]))


LOOSE = ProgramCode.LOOSE_PIECE
SHEET = Stock(3.0)
THROUGH = Operation(tool=Tool(3.0), depth_mm=3.2)


@given(
    width=st.floats(3.5, 40.0),
    height=st.floats(3.5, 40.0),
    cut=st.floats(-0.3, 20.0),
    side=st.sampled_from(["auto", "inside"]),
)
@examples(60)
def test_a_piece_that_comes_loose_is_as_large_as_the_tool_leaves_it(
    width: float, height: float, cut: float, side: str
) -> None:
    """A window with a cut corner, less twice the tool's radius all round; what is milled away is
    no piece."""
    cut = min(max(cut, 0.0), 0.4 * min(width, height))
    corners = [
        (0.0, 0.0),
        (width, 0.0),
        (width, height - cut),
        (width - cut, height),
        (0.0, height),
    ]
    corners = [(x + 10.0, y + 10.0) for x, y in corners]
    if cut < 0.01:
        corners = [corners[0], corners[1], (width + 10.0, height + 10.0), corners[4]]
    window = Polyline(np.array([(*corner, 0.0) for corner in corners]), closed=True)
    operation = replace(THROUGH, side=side, select=("inner",))
    found = loose(Job((operation,), stock=SHEET), box(0, 0, 60, 60), window)
    path = shapely.Polygon(corners).buffer(-1.5, quad_segs=64)
    piece = path.buffer(-1.5, quad_segs=64)
    least = 0.25 * math.pi * 1.5**2
    if piece.area < least - 0.05:
        assert found == []
    elif piece.area > least + 0.05:
        (finding,) = found
        # Half a cell along the edge, of as many as the piece and the cells beside it have.
        cell = math.sqrt((width + 2.0) * (height + 2.0) / 400_000.0)
        assert finding.measured == pytest.approx(piece.area, abs=0.5 * cell * piece.length + 0.01)
        low, high = np.array(piece.bounds).reshape(2, 2)
        assert size_of(finding) == pytest.approx(list(high - low), rel=6e-3, abs=0.03)
        x, y = map(float, re.findall(r"X ([\d.]+) Y ([\d.]+)", str(finding.where))[0])
        assert [x, y] == pytest.approx(list(0.5 * (low + high)), abs=0.03)


def test_which_pieces_come_loose() -> None:
    plate, window, part = box(0, 0, 100, 60), box(10, 10, 60, 40), box(20, 20, 30, 20)
    slug = box(24, 24, 20, 12)
    job = Job((THROUGH,), stock=SHEET)
    # Of contours in one another those of holes, and not those of parts.
    found = loose(job, plate, window, part, slug)
    assert sorted(map(size_of, found)) == [
        pytest.approx([14.0, 6.0], abs=0.05),
        pytest.approx([54.0, 34.0], abs=0.05),
    ]
    assert loose(Job((THROUGH,)), plate, window) == []  # nobody knows how thick the stock is
    assert loose(Job((THROUGH,), stock=Stock(4.0)), plate, window) == []
    # Tabs hold it, if they are its own: those of parts leave holes out.
    own = replace(THROUGH, tabs=Tabs(2))
    assert loose(Job((replace(own, select=("inner",)),), stock=SHEET), plate, window) == []
    assert len(loose(Job((own,), stock=SHEET), plate, window)) == 1
    # A tool on the line cuts out what is within; a point cuts nothing out.
    assert len(loose(Job((replace(THROUGH, side="on"),), stock=SHEET), window)) == 1
    assert loose(Job((replace(THROUGH, tool=Tool(0.0)),), stock=SHEET), window) == []


def test_what_a_pocket_cleared_before_comes_not_loose() -> None:
    plate, window = box(0, 0, 100, 60), box(10, 10, 60, 40)
    pocket = Operation("pocket", "clear", tool=Tool(3.0), depth_mm=3.2, layers=("IN",))
    wall = replace(THROUGH, name="wall")
    for operations, count in (
        ((pocket, wall), 0),
        ((wall, pocket), 1),
        ((replace(pocket, depth_mm=2.0), wall), 1),
    ):
        job = Job(operations, stock=SHEET)
        assert len(loose(job, plate, window, layers=["OUT", "IN"])) == count
    # An island of a pocket that goes through is a piece too.
    (island,) = loose(Job((pocket,), stock=SHEET), window, box(30, 20, 20, 12), layers=["IN"] * 2)
    # When it is cut off, the rings beside it that are milled away later still belong to it.
    wide, tall = size_of(island)
    assert 20.0 < wide < 20.0 + 3 * 3.0
    assert 12.0 < tall < 12.0 + 3 * 3.0
    # Boring leaves no core.
    bore = Operation("bore", tool=Tool(3.0), depth_mm=3.2)
    circle = Polyline(np.array([[0, 0, 1], [30, 0, 1.0]]), closed=True)
    assert loose(Job((bore,), stock=SHEET), circle) == []


def test_a_part_that_is_cut_after_it_came_loose_is_found_with_its_blocks() -> None:
    plate, window = box(0, 0, 60, 40), box(20, 10, 12, 12)
    outline = replace(THROUGH, name="outline", select=("outer",))
    inside = replace(THROUGH, name="window", select=("inner",))
    before = loose(Job((inside, outline), stock=SHEET), plate, window)
    assert ["part" in each.message for each in before] == [False]
    slug, part = sorted(
        loose(Job((outline, inside), stock=SHEET), plate, window),
        key=lambda each: "the part" in each.message,
    )
    assert size_of(slug) == pytest.approx([6.0, 6.0], abs=0.05)
    assert size_of(part) == pytest.approx([60.0, 40.0], abs=0.15)
    assert part.measured == pytest.approx(60.0 * 40.0, abs=100.0 * 0.1)
    freed, again = (int(each) for each in re.findall(r"move (\d+)", str(part)))
    found = re.match(r"move (\d+) at X (\S+) Y (\S+)", slug.where)
    assert found is not None
    assert [float(found[2]), float(found[3])] == pytest.approx([26.0, 16.0], abs=0.03)
    assert freed < again < int(found[1])


@examples(30)
@given(gap=st.floats(0.02, 3.0), turn=st.floats(0.0, 6.28))
def test_the_thinnest_bridge_holds_a_piece_and_none_does_not(gap: float, turn: float) -> None:
    """A circle that ends a gap before its start, or is lifted there: any bridge is one."""
    radius, cutter = 10.0, CutterProfile(1.0, 1.0)
    path = ToolpathBuilder().rapid(z=5)
    path.rapid(radius * math.cos(turn), radius * math.sin(turn)).line(z=-3.2, feed=1)
    end = turn - (2.0 * 1.0 + gap) / radius  # the bridge of the chord is as wide, less its bend
    to = (radius * math.cos(end), radius * math.sin(end))
    path.arc(*to, centre=(0.0, 0.0), ccw=True, feed=1)
    held = stock_moves_of_toolpath(path.finish(), np.zeros(4, dtype=np.int64), (cutter,))
    bent = 2.0 * radius * math.sin(0.5 * (2.0 + gap) / radius) - 2.0
    if bent > 0.0:
        assert loose_pieces(held, 3.0, None).pieces == []
    back = path.line(z=-2.99, feed=1)
    back.line(radius * math.cos(turn), radius * math.sin(turn), feed=1)
    raised = stock_moves_of_toolpath(back.finish(), np.zeros(6, dtype=np.int64), (cutter,))
    if bent > 0.0:
        assert loose_pieces(raised, 3.0, None).pieces == []
    through = back.line(z=-3.0, feed=1).line(*to, feed=1)
    free = stock_moves_of_toolpath(through.finish(), np.zeros(8, dtype=np.int64), (cutter,))
    (piece,) = loose_pieces(free, 3.0, None).pieces
    assert int(free.row[piece.move]) >= 3
    assert piece.area_mm2 == pytest.approx(math.pi * 9.0**2, abs=2.0)
    x0, y0, x1, y1 = piece.box_mm
    assert [x0, y0, x1, y1] == pytest.approx([-9.0, -9.0, 9.0, 9.0], abs=0.4)  # a chord


@pytest.mark.checked
@examples(80)
@given(seed=st.integers(0, 100_000))
def test_pieces_of_rasters_are_those_of_the_twin(seed: int) -> None:
    rng = np.random.default_rng(seed)
    ny, nx = rng.integers(1, 14, 2)
    time = rng.integers(0, int(rng.integers(1, 30)), (ny, nx))
    time[rng.random((ny, nx)) < rng.random()] = STANDING
    least = float(rng.integers(1, 4))
    rows = kernel.partings(time, STANDING, least)
    wanted = slow.partings(time, STANDING, least)
    sizes = (kernel.TIME, kernel.LOW, kernel.HIGH, kernel.LEFT, kernel.RIGHT, kernel.CUT)
    assert [tuple(row) for row in rows[:, list(sizes)].tolist()] == wanted
    for now, cell, low, high, left, right, _ in rows.tolist():
        row, column = divmod(cell, int(nx))
        stands = time > now
        piece = kernel.piece_at(stands, row, column)
        assert (piece == slow.piece_at(stands, row, column)).all()
        y, x = np.nonzero(piece)
        # The box may have cells of the move itself.
        assert low <= y.min() <= y.max() <= high
        assert left <= x.min() <= x.max() <= right


def test_cuts_that_are_too_narrow_for_the_raster_are_said() -> None:
    """A raster of a stock of 2 m with cells for a mill of 1 mm would have 36 million."""
    operation = Operation(tool=Tool(1.0), depth_mm=3.2, side="outside")
    for size, is_said in ((100.0, False), (2000.0, True)):
        job = Job((operation,), stock=Stock(3.0, (0.0, 0.0), (size, size)))
        paths = box(20.0, 20.0, 20.0, 20.0), box(size - 40.0, size - 40.0, 20.0, 20.0)
        found = [each for each in found_in(job, *paths) if each.code.name == "STOCK_NOT_JUDGED"]
        assert len(found) == is_said
        for each in found:
            assert each.measured == 1.0
            assert each.limit is not None
            assert 1.0 < each.limit < 4.0
