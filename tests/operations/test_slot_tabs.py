"""Tabs in trochoidal slots: what stays in the band is the tabs, by a stock of needles that reads
the program itself."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import ezdxf
import numpy as np
import pytest
from scipy import ndimage

import camtool
from camtool.arrays import Bools, Floats
from camtool.errors import OptionError
from camtool.planning.job import Job, Operation, Stock, Tabs, Tool
from camtool.records import replace
from camtool.run import Run
from tests.oracles.stock import Cutter, Walls, moves_of
from tests.oracles.stock import Path as Outline
from tests.oracles.stock import Stock as Needles

RADIUS, SLOT, DEPTH = 1.0, 3.0, 2.4
WIDTH, HEIGHT = 2.0, 0.8
CELL_MM = 0.05
SLACK_MM = 0.03
"""Cusps on the far side of a slot are lower than this."""

TABS = Tabs(count=3, width_mm=WIDTH, height_mm=HEIGHT)
PART: Outline = [(0, 0, 0), (18, 0, 0.41421356), (20, 2, 0), (20, 14, 0), (0, 14, 0)]
RING: Outline = [(9, 0, 1), (-9, 0, 1)]
SLOTS = Operation(
    kind="profile",
    tool=Tool(2.0 * RADIUS, number=1),
    depth_mm=DEPTH,
    step_down_mm=1.6,
    spindle_rpm=9000.0,
    plunge_feed_mm_min=60.0,
    own=(("strategy", "trochoidal"), ("engagement_rad", math.radians(60.0))),
    tabs=TABS,
)
WRONG = {
    "ENGAGEMENT_TOO_HIGH",
    "GOUGE",
    "CUT_TOO_DEEP",
    "LEFT_UNCUT",
    "CONTOUR_MISSING",
    "LOOSE_PIECE",
    "MATERIAL_LEFT",
    "PASS_TOO_DEEP",
    "TAB_MISSING",
    "TAB_THIN",
}


def posted(
    folder: Path,
    outlines: Sequence[Outline],
    operation: Operation = SLOTS,
    target_name: str = "grbl",
    *,
    closed: bool = True,
) -> Run:
    document = ezdxf.new(units=ezdxf.units.MM)
    for outline in outlines:
        document.modelspace().add_lwpolyline(outline, format="xyb", close=closed)
    document.saveas(folder / "part.dxf")
    job = Job(operations=(operation,), stock=Stock(2.4))
    return camtool.post(str(folder / "part.dxf"), camtool.load_target(target_name), job)


def names(run: Run) -> list[str]:
    return [finding.code.name for finding in run.findings]


def cut_by(run: Run, low: tuple[float, float], high: tuple[float, float]) -> Needles:
    assert run.program is not None
    stock = Needles(low, high, CELL_MM)
    for move in moves_of(run.program.data.decode()):
        stock.cut(move, Cutter(RADIUS))
    return stock


def islands(stock: Needles, is_band: Bools) -> list[Floats]:
    """(K, 3) x, y and height of the needles of each piece that stands in the band, without cusps
    on the far side, which are no wider than a few needles."""
    standing = is_band.reshape(stock.height.shape) & (stock.height > -DEPTH + 0.01)
    numbers, count = ndimage.label(standing)
    y, x = np.meshgrid(stock.y, stock.x, indexing="ij")
    every = np.stack([x, y, stock.height], axis=-1)
    pieces = [every[numbers == number] for number in range(1, count + 1)]
    return [piece for piece in pieces if len(piece) > 20]


def check_tab(tab: Floats, distance: Floats, span: tuple[float, float]) -> None:
    """It is as high as asked, reaches across the band, and is as wide as asked in the middle of
    the slot, where it has no feet."""
    np.testing.assert_allclose(tab[:, 2], -DEPTH + HEIGHT, atol=2e-3)
    assert distance.min() < span[0] + 2.0 * CELL_MM
    assert distance.max() > span[1] - 2.0 * CELL_MM
    middle = tab[(distance > RADIUS) & (distance < SLOT - RADIUS), :2]
    area_mm2 = len(middle) * CELL_MM**2
    assert area_mm2 / (SLOT - 2.0 * RADIUS) == pytest.approx(WIDTH, abs=0.06)


@pytest.mark.parametrize(
    ("target_name", "direction"), [("grbl", "climb"), ("linuxcnc", "conventional")]
)
def test_what_stays_in_the_slot_is_the_tabs(
    tmp_path: Path, target_name: str, direction: str
) -> None:
    run = posted(tmp_path, [PART], replace(SLOTS, direction=direction), target_name)
    assert names(run).count("ENGAGEMENT_KEPT") == 2
    assert not WRONG & set(names(run))
    stock = cut_by(run, (-5.0, -5.0), (25.0, 19.0))
    wall = Walls.of([PART])
    points = stock.points
    distance, within = wall.distance(points), wall.within(points)
    is_band = ~within & (distance > SLACK_MM) & (distance < SLOT - SLACK_MM)
    tabs = islands(stock, is_band)
    assert len(tabs) == 3
    for tab in tabs:
        check_tab(tab, wall.distance(tab[:, :2]), (SLACK_MM, SLOT - SLACK_MM))
    height = stock.height.ravel()
    assert (height[within & (distance > SLACK_MM)] == 0.0).all()
    assert (height[~within & (distance > SLOT + SLACK_MM)] == 0.0).all()
    assert height.min() == pytest.approx(-DEPTH, abs=2e-3)


def test_tabs_hold_a_core_in_a_hole(tmp_path: Path) -> None:
    """A hole alone: what is within comes out, and is held until then."""
    run = posted(tmp_path, [RING], replace(SLOTS, side="inside"))
    assert names(run).count("ENGAGEMENT_KEPT") == 2
    assert not WRONG & set(names(run))
    stock = cut_by(run, (-10.0, -10.0), (10.0, 10.0))
    radius = np.hypot(*stock.points.T)
    is_band = (radius < 9.0 - SLACK_MM) & (radius > 9.0 - SLOT + SLACK_MM)
    tabs = islands(stock, is_band)
    assert len(tabs) == 3
    for tab in tabs:
        check_tab(tab, 9.0 - np.hypot(*tab[:, :2].T), (SLACK_MM, SLOT - SLACK_MM))


def test_tabs_across_a_slot_on_a_line(tmp_path: Path) -> None:
    line: Outline = [(0, 0, 0), (14, 0, 0.2), (14, 12, 0)]
    tabs = replace(TABS, count=2)
    run = posted(tmp_path, [line], replace(SLOTS, tabs=tabs), closed=False)
    assert names(run).count("ENGAGEMENT_KEPT") == 1
    assert not WRONG & set(names(run))
    stock = cut_by(run, (-4.0, -4.0), (20.0, 16.0))
    walls = Walls.of([line])
    ends = walls.ring == 0
    ends[-1] = False  # the oracle closes it
    walls = Walls(
        *(each[ends] for each in (walls.a, walls.b, walls.centre, walls.sweep, walls.ring))
    )
    found = islands(stock, walls.distance(stock.points) < 0.5 * SLOT - SLACK_MM)
    assert len(found) == 2
    for tab in found:
        np.testing.assert_allclose(tab[:, 2], -DEPTH + HEIGHT, atol=2e-3)
        middle = walls.distance(tab[:, :2]) < 0.5 * SLOT - RADIUS
        area_mm2 = np.count_nonzero(middle) * CELL_MM**2
        assert area_mm2 / (SLOT - 2.0 * RADIUS) == pytest.approx(WIDTH, abs=0.06)


def test_with_finish_the_tool_of_that_comes_over_the_tabs(tmp_path: Path) -> None:
    operation = replace(SLOTS, finish_mm=0.1, finish_tool=Tool(1.5, number=2))
    run = posted(tmp_path, [PART], operation)
    assert not (WRONG - {"ENGAGEMENT_TOO_HIGH"}) & set(names(run))


def test_tabs_stand_where_they_are_wanted(tmp_path: Path) -> None:
    places = ((6.0, -1.0), (-1.5, 9.0))
    run = posted(tmp_path, [PART], replace(SLOTS, tabs=replace(TABS, count=None, at_mm=places)))
    assert not WRONG & set(names(run))
    stock = cut_by(run, (-5.0, -5.0), (25.0, 19.0))
    wanted = np.array([(6.0, -1.5), (-1.5, 9.0), (10.0, -1.5)])
    np.testing.assert_allclose(
        stock.at(wanted), [-DEPTH + HEIGHT, -DEPTH + HEIGHT, -DEPTH], atol=2e-3
    )


def test_tabs_move_to_where_stock_is_left_beyond_the_slot(tmp_path: Path) -> None:
    """Two parts whose slots merge: between them nothing is left to hold on to."""
    parts: list[Outline] = [
        [(x, 0, 0), (x + 14, 0, 0), (x + 14, 12, 0), (x, 12, 0)] for x in (0.0, 18.0)
    ]
    run = posted(tmp_path, parts, replace(SLOTS, tabs=replace(TABS, count=4)))
    assert not WRONG & set(names(run))
    stock = cut_by(run, (-5.0, -5.0), (37.0, 17.0))
    points = stock.points
    wall = Walls.of(parts)
    distance = wall.distance(points)
    is_band = ~wall.within(points) & (distance > SLACK_MM) & (distance < SLOT - SLACK_MM)
    tabs = islands(stock, is_band)
    assert len(tabs) == 8
    centres = np.array([tab[:, :2].mean(axis=0) for tab in tabs])
    assert not ((centres[:, 0] > 14.0) & (centres[:, 0] < 18.0)).any()


@pytest.mark.parametrize(
    ("tabs", "message"),
    [
        (replace(TABS, height_mm=2.5), "higher than the cut"),
        (replace(TABS, count=16), "16 tabs of 5 mm \\(with the width of the slot\\) are longer"),
        (replace(TABS, count=1, width_mm=80.0), "1 tab"),
    ],
)
def test_tabs_that_cannot_be_are_refused(tmp_path: Path, tabs: Tabs, message: str) -> None:
    with pytest.raises(OptionError, match=message) as error:
        posted(tmp_path, [PART], replace(SLOTS, tabs=tabs))
    assert error.value.mend


def test_a_tab_without_stock_beyond_the_slot_is_left_out(tmp_path: Path) -> None:
    """The slot is wider than the hole is, so that nothing is left within it."""
    hole: Outline = [(2.5, 0, 1), (-2.5, 0, 1)]
    tabs = Tabs(count=1, width_mm=1.0, height_mm=HEIGHT)
    run = posted(tmp_path, [hole], replace(SLOTS, side="inside", tabs=tabs))
    left_out = [each for each in run.findings if each.code.name == "TAB_LEFT_OUT"]
    assert len(left_out) == 1
    assert "hold on to" in left_out[0].message
    stock = cut_by(run, (-3.0, -3.0), (3.0, 3.0))
    assert (stock.height.ravel()[np.hypot(*stock.points.T) < 2.4] < -DEPTH + 2e-3).all()
