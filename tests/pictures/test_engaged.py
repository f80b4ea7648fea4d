"""Moves coloured by engagement: angles that geometry knows, held against the colours drawn."""

from __future__ import annotations

import math
import re
from itertools import groupby

import numpy as np
import pytest

from camtool.arrays import Floats
from camtool.pictures.beside import draw_beside
from camtool.pictures.colours import AIR, BINS, CUT_ENTRY, ENTRY, RAPID, UNKNOWN, bin_colours
from camtool.pictures.content import content_of
from camtool.pictures.draw import draw
from camtool.pictures.engaged import engagement_trace
from camtool.pictures.layers import layers_in
from camtool.pictures.options import PictureOptions
from camtool.pictures.scene import Scene, stock_pair
from camtool.pictures.viewer import columns
from camtool.pictures.viewer.columns import ENTRY_DEG
from camtool.pictures.viewer.page import viewer_page
from camtool.planning.job import Entry, Job, Operation, Tool
from camtool.planning.plan import planned
from camtool.planning.strokes import THICK_SHARE
from camtool.records import replace
from camtool.stock.cutters import CutterProfile
from camtool.stock.engagement import COARSE_RAD, engagement_of
from camtool.stock.moves import stock_moves_of_toolpath
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from tests.oracles import svg_page
from tests.oracles.contours import closed
from tests.oracles.page_paths import viewer_column
from tests.pictures.conftest import drawing_of

RADIUS_MM = 2.0
ENGAGED = PictureOptions(layers=frozenset({"engagement"}))


def scene(
    *sides_mm: float, cutter: CutterProfile | None = None, ends_mm: tuple[float, float] = (-9, 49)
) -> Scene:
    """Straight cuts through a block, one beside the other, from left to right in the air."""
    builder = ToolpathBuilder().rapid(z=5.0)
    for y in sides_mm:
        builder.rapid(ends_mm[0], y).line(z=-1.0, feed=100.0).line(ends_mm[1], y, feed=600.0)
        builder.rapid(z=5.0)
    toolpath = builder.finish()
    profile = cutter or CutterProfile(RADIUS_MM, RADIUS_MM)
    tools = np.zeros(len(toolpath), dtype=np.int64)
    moves = stock_moves_of_toolpath(toolpath, tools, (profile,))
    pair = stock_pair(moves, (0.0, 0.0, 40.0, 30.0), 2.0)
    return Scene(toolpath=toolpath, cut=lambda: pair)


def steps_along(picture: Scene) -> list[int]:
    """The steps of the moves, each once while it stays: moves are parted where entries may end."""
    trace = engagement_trace(picture)
    assert trace is not None
    return [step for step, _ in groupby(trace.step.tolist())]


def angles_of(picture: Scene) -> Floats:
    """The column of the viewer's page, degrees."""
    return viewer_column(viewer_page(picture).decode(), "move_engaged")


def step_of(angle_deg: float) -> float:
    return angle_deg / 180.0 * BINS


def strokes(picture: Scene) -> dict[str, str]:
    """The paths of the layer by their colours."""
    root = svg_page.parse(draw(picture, ENGAGED))
    (group,) = (each for each in root.iter() if each.attrib.get("id") == "engagement")
    return {each.attrib["stroke"]: each.attrib["d"] for each in group}


@pytest.mark.parametrize(
    ("wide_mm", "known_deg"), [(2.0, 90.0), (1.0, 60.0), (3.0, 120.0), (4.0, 180.0)]
)
def test_a_straight_cut_has_the_colour_of_its_width(wide_mm: float, known_deg: float) -> None:
    """A tool of radius r that takes w of the edge of a block is engaged by acos(1 − w / r)."""
    assert math.degrees(math.acos(1.0 - wide_mm / RADIUS_MM)) == pytest.approx(known_deg)
    (step,) = steps_along(scene(wide_mm - RADIUS_MM))
    assert abs(step + 0.5 - min(step_of(known_deg), BINS - 0.5)) <= 0.5 + step_of(1.0)
    (colour,) = strokes(scene(wide_mm - RADIUS_MM))
    assert colour == bin_colours()[step]


def test_a_second_cut_is_engaged_by_what_the_first_left() -> None:
    found = steps_along(scene(10.0, 11.0, 13.0))
    known = [180.0, *(math.degrees(math.acos(1.0 - w / RADIUS_MM)) for w in (1.0, 2.0))]
    for step, angle in zip(found, known, strict=True):
        assert abs(step + 0.5 - min(step_of(angle), BINS - 0.5)) <= 0.5 + step_of(1.0)


def test_air_and_entries_have_colours_of_their_own() -> None:
    """The second cut runs where the first one did; others go down in the block, so that their
    entries end a circumference behind that."""
    plunged = engagement_trace(scene(20.0, ends_mm=(10.0, 30.0)))
    assert plunged is not None
    assert steps_along(scene(10.0, 10.0)) == [BINS - 1, AIR]
    assert plunged.step.tolist() == [CUT_ENTRY, BINS - 1]
    length = 2.0 * math.pi * RADIUS_MM
    assert plunged.end[0].tolist() == pytest.approx([10.0 + length, 20.0])
    sloped = ToolpathBuilder().rapid(10.0, 10.0, 0.0).line(20.0, 10.0, -1.0, feed=50.0)
    path = sloped.line(60.0, 10.0, feed=50.0).finish()
    profile = CutterProfile(RADIUS_MM, RADIUS_MM)
    moves = stock_moves_of_toolpath(path, np.zeros(len(path), dtype=np.int64), (profile,))
    pair = stock_pair(moves, (0.0, 0.0, 70.0, 30.0), 2.0)
    assert steps_along(Scene(toolpath=path, cut=lambda: pair)) == [CUT_ENTRY, BINS - 1]
    found = strokes(Scene(toolpath=path, cut=lambda: pair))
    assert list(found) == [ENTRY, bin_colours()[-1]]
    assert RAPID in strokes(scene(10.0, 10.0))


def test_tools_whose_width_changes_are_not_judged() -> None:
    ball = CutterProfile(RADIUS_MM, 0.0, corner_mm=RADIUS_MM)
    assert steps_along(scene(10.0, cutter=ball)) == [UNKNOWN]


def test_the_scale_is_in_degrees_and_the_same_beside_each_other() -> None:
    both = [scene(2.0 - RADIUS_MM), scene(10.0)]
    for svg in (draw(both[0], ENGAGED), draw_beside(both, ENGAGED)):
        root = svg_page.parse(svg)
        (bar,) = (each for each in root.iter() if "engagement-scale" in each.attrib.get("id", ""))
        titles = [each.text for each in bar.iter() if each.tag.endswith("title")]
        assert titles == ["0", "30", "60", "90", "120", "150", "180", "engaged (°)"]
        assert not re.search("error-scale", svg)


def test_equal_scenes_give_equal_bytes() -> None:
    assert draw(scene(10.0, 11.0), ENGAGED) == draw(scene(10.0, 11.0), ENGAGED)


def test_without_a_tool_there_is_no_such_layer() -> None:
    bare = replace(scene(10.0), cut=None)
    assert "engagement" not in layers_in(content_of(bare, ENGAGED))
    assert "engagement" in layers_in(content_of(scene(10.0), ENGAGED))


def test_the_viewer_has_the_greatest_of_each_move() -> None:
    """A slot, half a diameter beside it, the same again, and a plunge with less than an entry."""
    picture = scene(10.0, 12.0, 12.0)
    assert picture.toolpath is not None
    angles = angles_of(picture)
    level = np.flatnonzero(picture.toolpath.is_feed & (picture.toolpath.end[:, 0] == 49.0))
    assert angles[level[:2]].tolist() == [
        pytest.approx(180.0, abs=1.0),
        pytest.approx(90.0, abs=1.0),
    ]
    assert np.isnan(np.delete(angles, level[:2])).all()
    short = scene(20.0, ends_mm=(10.0, 20.0))
    entries = angles_of(short)
    assert entries[~np.isnan(entries)].tolist() == [ENTRY_DEG, ENTRY_DEG]
    ball = CutterProfile(RADIUS_MM, 0.0, corner_mm=RADIUS_MM)
    assert not len(angles_of(scene(10.0, cutter=ball)))


DIRECTIONS, PLACES = 360, 5


def sampled(
    moves: Floats, number: int, place: Floats, behind_mm: Floats, thick_mm: float
) -> float:
    """The angle, rad, of the front of the tool's circle at a place of a move that no move (x, y to
    x, y) before has come nearer to than the radius: directions are looked at one by one."""
    heading = math.atan2(*(moves[number, 2:] - moves[number, :2])[::-1])
    angles = heading + ((np.arange(DIRECTIONS) + 0.5) / DIRECTIONS - 0.5) * math.pi
    rim = place + RADIUS_MM * np.column_stack([np.cos(angles), np.sin(angles)])
    start, along = moves[:number, None, :2], (moves[:number, 2:] - moves[:number, :2])[:, None]
    square = np.maximum((along**2).sum(axis=2), 1e-30)
    part = np.clip(((rim[None] - start) * along).sum(axis=2) / square, 0.0, 1.0)
    gaps = np.hypot(*np.moveaxis(rim[None] - start - part[..., None] * along, 2, 0))
    wider = np.where(behind_mm > 100.0 * thick_mm, thick_mm, 0.0)
    return float((gaps > RADIUS_MM - 1e-9 + wider[:, None]).all(axis=0).mean()) * math.pi


def test_a_large_program_has_engagements_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """A side cut of 60° in 21,000 rows; and in angles that are coarser, as in larger programs."""
    y = 0.5 * RADIUS_MM - RADIUS_MM
    builder = ToolpathBuilder().rapid(-9.0, y, 5.0).line(z=-1.0, feed=100.0)
    for x in np.linspace(-9.0, 49.0, 21_000)[1:].tolist():
        builder.line(x, y, feed=600.0)
    toolpath = builder.finish()
    tools, profile = np.zeros(len(toolpath), dtype=np.int64), CutterProfile(RADIUS_MM, RADIUS_MM)
    pair = stock_pair(
        stock_moves_of_toolpath(toolpath, tools, (profile,)), (0.0, 0.0, 40.0, 30.0), 2.0
    )
    for few, above_deg in ((columns.FINE_ENGAGED, 1.0), (1, 5.0)):
        monkeypatch.setattr(columns, "FINE_ENGAGED", few)
        column = columns.engagement_columns(pair, toolpath)["move_engaged"]
        angle = np.asarray(column)[(toolpath.end[:, 0] > 4.0) & (toolpath.end[:, 0] < 38.0)]
        chip_deg = math.degrees(math.acos(1.0 - 0.5 + THICK_SHARE))
        assert angle.min() >= chip_deg - 0.05
        assert angle.max() <= 60.0 + above_deg
    monkeypatch.setattr(columns, "MAX_ENGAGED", 20_000)
    assert len(columns.engagement_columns(pair, toolpath)["move_engaged"]) == 0


def test_rings_of_a_pocket_have_the_angles_of_an_independent_measure() -> None:
    """All moves at the depth of a pocket with rounded corners, outside of its entry."""
    operation = Operation(
        kind="pocket",
        tool=Tool(2.0 * RADIUS_MM),
        depth_mm=1.0,
        step_over=0.35,
        entry=Entry("helix", angle_rad=math.radians(5.0)),
    )
    shape = closed((0, 0), (17, 0), (22, 9), (17, 13), (6, 15), (0, 11))
    drawing = drawing_of([shape], ["CUT"])
    path = planned(drawing, Job((operation,)), load_target("linuxcnc").machine).toolpath
    cutters = (CutterProfile(RADIUS_MM, RADIUS_MM),)
    every = stock_moves_of_toolpath(path, np.zeros(len(path), dtype=np.int64), cutters)
    judged = engagement_of(every, path, None)
    moves = np.column_stack([judged.moves.start[:, :2], judged.moves.end[:, :2]])
    z = np.column_stack([judged.moves.start[:, 2], judged.moves.end[:, 2]])
    level = np.flatnonzero((z < -0.98).all(axis=1) & (moves[:, :2] != moves[:, 2:]).any(axis=1))
    rows, bound, is_entry = moves[level], judged.bound_rad[level], judged.is_entry[level]
    lengths = np.hypot(*(rows[:, 2:] - rows[:, :2]).T)
    travelled, thick = np.cumsum(lengths), THICK_SHARE * RADIUS_MM
    slack, above = 3.0 * math.pi / DIRECTIONS, list[float]()
    for number in np.flatnonzero(~is_entry).tolist():
        greatest = 0.0
        for share in np.linspace(0.001, 0.999, PLACES):
            place = rows[number, :2] + share * (rows[number, 2:] - rows[number, :2])
            before = travelled[number] - (1.0 - share) * lengths[number]
            own = np.vstack([rows[:number], [*rows[number, :2], *place], rows[number]])
            behind = np.append(before - travelled[:number], 0.0)
            greatest = max(greatest, sampled(own, number + 1, place, behind, thick))
        assert greatest <= bound[number] + slack
        above.append(bound[number] - greatest)
    assert len(above) > 20
    assert np.median(above) <= COARSE_RAD + slack  # some are greatest between the places
    assert bound[~is_entry].max() > math.radians(120.0)
