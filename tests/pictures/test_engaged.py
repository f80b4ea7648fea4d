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
from camtool.pictures.viewer.columns import ENTRY_DEG
from camtool.pictures.viewer.page import viewer_page
from camtool.records import replace
from camtool.stock.cutters import CutterProfile
from camtool.stock.moves import stock_moves_of_toolpath
from camtool.toolpath.builder import ToolpathBuilder
from tests.oracles import svg_page
from tests.oracles.page_paths import viewer_column

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
