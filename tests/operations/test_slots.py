"""Trochoidal slots: a band beside contours and on lines, with a limit of the engagement."""

from __future__ import annotations

import math
from pathlib import Path

import ezdxf
import numpy as np
import pytest
from scipy.spatial import cKDTree

import camtool
from camtool.arrays import Floats
from camtool.errors import OptionError
from camtool.geometry.distance import nearest
from camtool.geometry.nesting import inside
from camtool.geometry.polylines import Polyline, Polylines, Segments, reverse, rotate
from camtool.operations.profile import checked
from camtool.operations.profile.work import profile
from camtool.planning.items import CutRun, Fixed
from camtool.planning.job import Entry, Job, Operation, Tabs, Tool
from camtool.planning.strategies import width
from camtool.planning.strokes import chords
from camtool.planning.trochoids import middles, trochoid_legs, trochoid_step
from camtool.records import replace
from tests.oracles.contours import closed
from tests.paths import mirrored
from tests.planning.pocket_cases import chosen_of, setting_of

PART = closed((0, 0), (9, 0), (9, 7), (5, 3), (0, 7))
HOLE = closed((3.5, 1.5, 1), (1.5, 1.5, 1))
LIMIT = math.radians(50.0)
OWN = (("strategy", "trochoidal"), ("engagement_rad", LIMIT))
RADIUS, SLOT = 0.75, 2.25
SLACK_MM = 0.02
"""Cusps on the far side of a slot, and feet of corners, are smaller than this."""


def slots(paths: list[Polyline], **options: object) -> list[CutRun]:
    """Return the runs of the slots beside paths, the first of which are rims of parts."""
    given = {"kind": "profile", "own": OWN, "entry": Entry("helix"), "stage": "rough", **options}
    chosen = chosen_of(paths)
    chosen = replace(chosen, rim=chosen.nesting.levels.depth % 2 == 0)
    work = profile(chosen, setting_of(2.0 * RADIUS, **given))
    assert all(isinstance(item, Fixed) for item in work.items)
    return [run for item in work.items if isinstance(item, Fixed) for run in item.runs]


def centre_moves(runs: list[CutRun]) -> Floats:
    """(K, 4) short straight moves of the tool's centre at the full depth."""
    parts = []
    for run in runs:
        low = run.vertices[:, 2] < run.vertices[:, 2].min() + 1e-9
        for row in np.flatnonzero(low[:-1] & low[1:]).tolist():
            move = run.vertices[row : row + 2, [0, 1, 3]] * [[1.0, 1.0, 1.0], [1.0, 1.0, 0.0]]
            if np.hypot(*(move[1, :2] - move[0, :2])) > 1e-9:
                parts.append(chords(move, 1e-3))
    return np.concatenate(parts)


def length_of(runs: list[CutRun]) -> float:
    moves = centre_moves(runs)
    return float(np.hypot(*(moves[:, 2:] - moves[:, :2]).T).sum())


def grid(low: float, high: float, step: float) -> Floats:
    axis = np.arange(low, high, step)
    return np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)


def is_cut(points: Floats, runs: list[CutRun]) -> Floats:
    """(P,) how far inside (above 0) or outside of what the tool clears each point is, mm."""
    moves = centre_moves(runs)
    rows = Segments.between(moves[:, :2], moves[:, 2:], np.zeros(len(moves)))
    return RADIUS - nearest(points, rows).distance


def check_slots(paths: list[Polyline], runs: list[CutRun], kept: Floats, points: Floats) -> None:
    """All nearer to the paths than the slot is wide is cut where it is free; nothing else is."""
    distance = nearest(points, Segments.of(Polylines.of(paths))).distance
    depth = is_cut(points, runs)
    # A disc of the tool reaches all but the feet of inner corners, which are not looked at.
    corner = np.hypot(*(points - [5.0, 3.0]).T) < RADIUS * 1.5
    assert (depth[kept & (distance > SLACK_MM)] < 0.0).all()
    is_free = ~kept & ~corner & (distance > SLACK_MM)
    assert (depth[is_free & (distance < SLOT - SLACK_MM)] > 0.0).all()
    assert (depth[distance > SLOT + SLACK_MM] < 0.0).all()
    assert (depth > 0.0).any()


@pytest.mark.parametrize("direction", ["climb", "conventional"])
def test_a_slot_is_cleared_and_nothing_else(direction: str) -> None:
    points = grid(-4.0, 13.0, 0.23)
    kept = inside(points, Segments.of(PART))
    check_slots([PART], slots([PART], direction=direction), kept, points)


def test_a_hole_narrower_than_its_slot_is_cleared_wholly() -> None:
    points = grid(1.0, 4.0, 0.07)
    runs = slots([PART, HOLE])
    in_hole = np.hypot(*(points - [2.5, 1.5]).T)
    depth = is_cut(points, runs)
    assert (depth[in_hole < 1.0 - SLACK_MM] > 0.0).all()
    assert (depth[(in_hole > 1.0 + SLACK_MM) & inside(points, Segments.of(PART))] < 0.0).all()


def test_bands_of_near_parts_merge() -> None:
    parts = [closed((x, 0), (x + 4, 0), (x + 4, 3), (x, 3)) for x in (0.0, 6.0)]
    runs = slots(parts)
    assert len([run for run in runs if run.vertices[0, 2] == 0.0]) == 1
    points = grid(-3.0, 13.0, 0.23)
    kept = inside(points, Segments.of(Polylines.of(parts)))
    check_slots(parts, runs, kept, points)


@pytest.mark.parametrize("side", ["auto", "on"])
def test_an_open_path_gets_a_slot_on_both_sides(side: str) -> None:
    line = Polyline(np.array([[0.0, 0, 0], [6, 0, 0.4], [6, 4, 0], [2, 7, 0]]))
    runs = slots([line], side=side, stage="")
    points = grid(-3.0, 10.0, 0.13)
    distance = nearest(points, Segments.of(line)).distance
    depth = is_cut(points, runs)
    assert (depth[distance < 0.5 * SLOT - 2e-3] > 0.0).all()
    assert (depth[distance > 0.5 * SLOT + 2e-3] < 0.0).all()


def test_slots_follow_a_drawing_that_is_turned_mirrored_or_reversed() -> None:
    lengths = [
        length_of(slots([path])) for path in (PART, mirrored(rotate(PART, 0.7)), reverse(PART))
    ]
    assert lengths == pytest.approx([lengths[0]] * 3, rel=0.03)


def test_levels_begin_on_the_floor_before() -> None:
    runs = slots([PART], depth_mm=2.0, step_down_mm=1.0)
    first = [run.vertices[0, 2] for run in runs]
    assert first[0] == 0.0
    assert {-1.0, -2.0} == {run.vertices[-1, 2] for run in runs}


def test_middles_stand_at_corners_and_no_farther_apart_than_a_step() -> None:
    line = closed((0, 0), (4, 0, 0.5), (4, 3), (0, 3))
    places = middles(line, 0.4, 0.25)
    gaps = np.hypot(*(np.roll(places, -1, axis=0) - places).T)
    assert gaps.max() <= 0.25 + 1e-9
    corners = line.vertices[:, :2]
    assert np.hypot(*(places[:, None] - corners[None]).transpose(2, 0, 1)).min(axis=0).max() < 1e-6


@pytest.mark.parametrize("step", [3.0, 0.3])
def test_all_legs_keep_within_the_discs(step: float) -> None:
    """Corners to both sides, a spike among them, and arcs smaller than the circles."""
    corners = [(0, 0), (4, 0), (4, 4, 1), (3, 4), (1.5, 0.6), (1.0, 5), (0, 5)]
    for path in (closed(*corners), reverse(closed(*corners))):
        line = Polyline(path.vertices * [step, step, 1.0], closed=True)
        radius, tool_mm = 0.4, 1.0
        legs = trochoid_legs(line, radius, 0.3, tool_mm, LIMIT)[1]
        places = middles(line, radius, trochoid_step(radius, tool_mm, LIMIT))
        points = np.concatenate([chords(leg.vertices, 1e-4)[:, :2] for leg in legs])
        gaps, _ = cKDTree(places).query(points)
        assert gaps.max() <= radius + 1e-6
        ends = np.array([[leg.vertices[0, :2], leg.vertices[-1, :2]] for leg in legs])
        assert np.abs(ends[1:, 0] - ends[:-1, 1]).max() < 1e-6


@pytest.mark.parametrize("target_name", ["grbl", "linuxcnc"])
def test_the_limit_is_proved_on_the_predicted_slides(tmp_path: Path, target_name: str) -> None:
    document = ezdxf.new(units=ezdxf.units.MM)
    modelspace = document.modelspace()
    modelspace.add_lwpolyline([(0, 0), (6, 0), (6, 5), (3, 3), (0, 5)], close=True)
    modelspace.add_lwpolyline([(9, 0), (9, 3), (12, 3)])
    document.saveas(tmp_path / "part.dxf")
    operation = Operation(
        kind="profile",
        tool=Tool(3.0, number=1),
        depth_mm=1.0,
        spindle_rpm=9000.0,
        plunge_feed_mm_min=60.0,
        own=OWN,
    )
    target = camtool.load_target(target_name)
    run = camtool.post(str(tmp_path / "part.dxf"), target, Job(operations=(operation,)))
    names = [finding.code.name for finding in run.findings]
    assert names.count("ENGAGEMENT_KEPT") == 2
    wrong = {"ENGAGEMENT_TOO_HIGH", "GOUGE", "CUT_TOO_DEEP", "LEFT_UNCUT", "CONTOUR_MISSING"}
    assert not wrong & set(names)
    assert run.program is not None


def test_a_slot_that_comes_over_another_part_is_an_error(tmp_path: Path) -> None:
    document = ezdxf.new(units=ezdxf.units.MM)
    modelspace = document.modelspace()
    for x, layer in ((0.0, "A"), (9.0, "B")):
        points = [(x, 0), (x + 5, 0), (x + 5, 4), (x, 4)]
        modelspace.add_lwpolyline(points, close=True, dxfattribs={"layer": layer})
    document.saveas(tmp_path / "part.dxf")
    common = Operation(kind="profile", tool=Tool(3.0, number=1), depth_mm=1.0)
    wide = replace(common, layers=("A",), own=OWN)
    job = Job(operations=(wide, replace(common, layers=("B",), name="other")))
    run = camtool.post(str(tmp_path / "part.dxf"), camtool.load_target("grbl"), job)
    assert "GOUGE" in {finding.code.name for finding in run.findings}


@pytest.mark.parametrize(
    ("options", "key"),
    [
        ({"own": (*OWN, ("slot_width", width("105%")))}, "slot_width"),
        ({"own": (*OWN, ("slot_width", width("5mm")))}, "slot_width"),
        ({"own": (("strategy", "adaptive"),)}, "strategy"),
        ({"tool": Tool(0.0)}, "tool"),
        ({"tabs": Tabs(count=2, ramped=True)}, "tabs"),
        ({"corners": "dogbone"}, "corners"),
        ({"joins": "sharp"}, "joins"),
    ],
)
def test_what_cannot_be_is_refused(options: dict[str, object], key: str) -> None:
    operation = Operation(**{"kind": "profile", "tool": Tool(1.5), "own": OWN, **options})  # type: ignore[arg-type]
    with pytest.raises(OptionError) as error:
        checked(operation, None)
    assert error.value.where is not None
    assert error.value.where.endswith(f"key {key}")
    assert error.value.mend


def test_too_many_circles_are_refused() -> None:
    with pytest.raises(OptionError, match="circles"):
        slots([closed((0, 0), (9e3, 0), (9e3, 9e3), (0, 9e3))])
