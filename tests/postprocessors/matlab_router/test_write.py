"""What the writer sends to the Matlab router, and what it refuses."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from camtool.errors import MachineError, PostError
from camtool.findings import Code, Severity
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.findings import ProgramCode
from camtool.toolpath.moves import Kind, Toolpath
from tests.oracles.matlab_router import gui_arrays, off_line, run_line
from tests.postprocessors.matlab_router.parts import (
    STAR,
    STAR_LXY,
    STAR_VELXY,
    arrays,
    posted,
    router,
    strokes,
)

STREAM = (
    "10 151 {} 249 230 55 240 314 101 106 288 214 67 179 179 345 208 3 357 354 20 237 342 "
    "480 480 -77 480 -480 -136 -144 -480 433 -94 345 -374 480 416 5 480 -480 33 -480 -480 "
)


def program(toolpath: Toolpath, *settings: str) -> bytes:
    target = router(*settings)
    return bytes(target.target.write(toolpath, target.machine).data)


def codes(toolpath: Toolpath, *settings: str) -> list[Code]:
    target = router(*settings)
    return [finding.code for finding in target.target.write(toolpath, target.machine).findings]


@pytest.mark.parametrize("setting", ["grid_mm=0.1", "profile=text", "profile=listing"])
def test_the_star_gives_all_numbers_of_the_thesis(setting: str) -> None:
    (job,) = arrays(posted("star.csv", router(setting)))
    assert list(zip(*job["xy"], strict=True)) == STAR
    assert job["lxy"] == STAR_LXY
    assert job["velxy"] == STAR_VELXY
    assert (job["size_of_array"], job["first_pointx"], job["first_pointy"]) == (
        [[10]],
        [[151]],
        [[86]],
    )


@pytest.mark.parametrize(
    ("settings", "y"),
    [
        (("profile=listing",), "V"),
        (("profile=listing", "first_y=number"), "86"),
        (("grid_mm=0.1",), "86"),
    ],
)
def test_the_star_as_a_stream(settings: tuple[str, ...], y: str) -> None:
    data = posted("star.csv", router("format=stream", *settings))
    assert data.decode("ascii") == STREAM.format(y).replace(" ", "\r")


def test_the_star_on_the_grid_that_the_slaves_run() -> None:
    (job,) = arrays(posted("star.csv", router()))
    assert all(value % 2 == 0 for row in job["xy"] for value in row)
    points = list(zip(*job["xy"], strict=True))
    assert (job["lxy"], job["velxy"]) == gui_arrays(points)
    assert np.abs(np.array(points) - np.array(STAR)).max() == 1


def test_blocks_are_mapped_to_moves() -> None:
    target = router()
    toolpath = strokes([(5, 5), (10, 5), (10, 10)], [(20, 20), (30, 20)])
    written = target.target.write(toolpath, target.machine)
    assert written.row_of_block.tolist() == [-1, 3, 4, -1, 8]
    assert (written.target, written.extension) == ("matlab-router", ".m")


def test_one_job_a_stroke_and_all_of_them_in_one_list() -> None:
    text = program(strokes([(5, 5), (10, 5)], [(20, 20), (30, 20)])).decode()
    assert text.count("%% job ") == 2
    assert "jobs{2} = {xy, lxy, velxy, size_of_array, first_pointx, first_pointy};" in text
    assert "jobs{" not in program(strokes([(5, 5), (10, 5)])).decode()


@pytest.mark.parametrize(("settings", "most"), [((), 128), (("profile=text",), 255)])
def test_long_strokes_become_jobs(settings: tuple[str, ...], most: int) -> None:
    zigzag = [(1.0 + 0.4 * index, 5.0 + 0.4 * (index % 2)) for index in range(400)]
    jobs = arrays(program(strokes(zigzag), *settings))
    counts = [job["size_of_array"][0][0] for job in jobs]
    assert sum(counts) == 399
    assert max(counts) == most
    for job, following in pairwise(jobs):
        assert [row[-1] for row in job["xy"]] == [row[0] for row in following["xy"]]
    assert ProgramCode.MOVE_SPLIT in codes(strokes(zigzag), *settings)


def test_no_job_begins_on_an_axis() -> None:
    up = [(5.0, 5.0)] + [(0.0 if index > 120 else 1.0, 5.0 + 0.2 * index) for index in range(140)]
    jobs = arrays(program(strokes(up)))
    assert all(job["xy"][0][0] >= 2 and job["xy"][1][0] >= 2 for job in jobs)
    wall = [(5.0, 5.0)] + [(0.0, 5.0 + 0.2 * index) for index in range(400)]
    with pytest.raises(PostError, match="have no vertex at which a job could begin"):
        program(strokes(wall))


def test_a_start_at_home_moves_to_the_first_chunk() -> None:
    target = router()
    written = target.target.write(
        strokes([(0, 0), (10, 0), (10, 10), (0, 10), (0, 0)]), target.machine
    )
    (job,) = arrays(written.data)
    assert job["xy"] == [[2, 100, 100, 0, 0], [2, 0, 100, 100, 0]]
    (snapped,) = [f for f in written.findings if f.code == ProgramCode.PLACES_SNAPPED]
    assert snapped.severity == Severity.WARNING
    assert snapped.measured == pytest.approx(0.2 * math.sqrt(2.0))
    assert "1 stroke begins at least 0.2 mm from home" in snapped.message


def test_part_zero_may_lie_anywhere() -> None:
    data = program(strokes([(-5, -5), (5, -5)]), "controller.machine_zero_mm=[-10,-20,9]")
    assert arrays(data)[0]["xy"] == [[50, 150], [150, 150]]


def test_a_stroke_below_the_grid_is_told() -> None:
    toolpath = strokes([(5, 5), (5.05, 5)], [(10, 10), (20, 10)])
    (finding,) = [
        finding
        for finding in router().target.write(toolpath, router().machine).findings
        if finding.code == ProgramCode.MOVE_COLLAPSED and finding.unit == "strokes"
    ]
    assert (finding.severity, finding.measured) == (Severity.WARNING, 1.0)
    with pytest.raises(PostError, match=r"nothing is left to cut on a grid of 0\.2 mm"):
        program(strokes([(5, 5), (5.05, 5)]))


def test_arcs_become_lines_within_the_tolerance() -> None:
    circle = ToolpathBuilder().rapid(z=9).rapid(60, 50).line(z=-1, feed=200)
    circle.arc(60, 50, centre=(50, 50), ccw=True, feed=200).rapid(z=9)
    (job,) = arrays(program(circle.finish(), "grid_mm=0.1", "arc_tolerance_mm=0.02"))
    x, y = np.array(job["xy"]) / 10.0
    assert len(x) > 30
    assert np.abs(np.hypot(x - 50, y - 50) - 10.0).max() < 0.15
    middle = np.hypot((x[1:] + x[:-1]) / 2 - 50, (y[1:] + y[:-1]) / 2 - 50)
    assert (10.0 - middle).max() < 0.02 + 0.15


def test_the_two_meanings_of_a_feed() -> None:
    line = strokes([(10, 10), (40, 50)], feed=100.0)
    assert arrays(program(line))[0]["velxy"] == [[160], [213]]
    assert arrays(program(line, "speed=path"))[0]["velxy"] == [[128], [171]]
    assert ProgramCode.FEED_ROUNDED in codes(line)


@pytest.mark.parametrize("speed", ["axis", "path"])
def test_feeds_may_be_limited(speed: str) -> None:
    line = strokes([(10, 10), (40, 50)], feed=1e6)
    settings = (f"speed={speed}", "too_fast=limited")
    assert arrays(program(line, *settings))[0]["velxy"] == [[360], [480]]
    findings = router(*settings).target.write(line, router(*settings).machine).findings
    assert (findings[0].code, findings[0].severity) == (ProgramCode.FEED_ROUNDED, Severity.WARNING)


@given(
    st.integers(0, 1990),
    st.integers(0, 1990),
    st.integers(1, 480),
    st.sampled_from(["0.2", "0.1"]),
)
def test_no_line_runs_away_stops_or_bends(dx: int, dy: int, counts: int, grid: str) -> None:
    """The slaves stay near any line: within half a chunk, or a chunk where no finer piece can be
    sent."""
    assume(max(dx, dy) > 2)
    target = router(f"grid_mm={grid}", "odd=kept")
    toolpath = strokes([(0.4, 0.4), (0.4 + dx / 10, 0.4 + dy / 10)], feed=counts * 0.46875)
    data = target.target.write(toolpath, target.machine).data
    at = np.array([4.0, 4.0])
    end = np.array([4.0 + dx, 4.0 + dy])
    for job in arrays(data):
        lengths, speeds = np.array(job["lxy"]).T, np.array(job["velxy"]).T
        assert not (lengths == 1).any()
        assert not ((lengths > 0) & (speeds == 0)).any()
        assert (lengths.max(axis=1) > 0).all()
        assert (np.abs(speeds) <= counts).all()
        assert job["xy"][0][0] >= 2
        assert job["xy"][1][0] >= 2
        for length, speed in zip(lengths.tolist(), np.abs(speeds).tolist(), strict=True):
            for place in run_line(tuple(length), tuple(speed), 7):
                assert off_line(tuple(length), place) <= 1.51
        at = np.array([job["xy"][0][-1], job["xy"][1][-1]])
    assert np.abs(at - end).max() <= 1.0


@given(st.lists(st.tuples(st.integers(1, 1000), st.integers(1, 1000)), min_size=2, max_size=12))
def test_speeds_are_those_of_the_listing(half: list[tuple[int, int]]) -> None:
    """Without lines that had to be split, the arrays are those of the GUI for these points."""
    points = [(2 * x, 2 * y) for x, y in half]
    if all(point == points[0] for point in points):
        return
    target = router("bend_tolerance_mm=100")
    toolpath = strokes([(x / 10, y / 10) for x, y in points])
    (job,) = arrays(target.target.write(toolpath, target.machine).data)
    sent = list(zip(*job["xy"], strict=True))
    lxy, velxy = gui_arrays(sent)
    assert job["lxy"] == lxy
    assert job["velxy"] == velxy


def builder() -> ToolpathBuilder:
    return ToolpathBuilder().rapid(z=9.0).rapid(10, 10)


REFUSED = {
    "another depth": (
        builder().line(z=-2, feed=99).line(20, 10, feed=99),
        r"always plunges 10 mm from home, to Z -1 mm.*machine_zero_mm=\[0,0,8\]",
    ),
    "a rapid in the stock": (builder().rapid(z=-1).rapid(20, 10), "a rapid below the top"),
    "a hole": (
        builder()
        .line(z=-1, feed=99)
        .rapid(z=9)
        .rapid(20, 20)
        .line(z=-1, feed=99)
        .line(30, 20, feed=99),
        r"drills no holes, because its tool stands until the first line",
    ),
    "outside": (builder().line(z=-1, feed=99).line(200.2, 10, feed=99), r"X 200\.2 mm from home"),
    "left of home": (builder().line(z=-1, feed=99).line(-0.2, 10, feed=99), r"X -0\.2 mm"),
    "where home may lie": (
        builder().line(z=-1, feed=99).line(-30.4, 10, feed=99),
        r"machine_zero_mm=\[-32,0,9\]",
    ),
    "nearly too long": (
        builder().line(z=-1, feed=99).line(208, 10, feed=99),
        r"machine_zero_mm=\[9,0,9\]",
    ),
    "too long": (builder().line(z=-1, feed=99).line(230, 10, feed=99), "scale the drawing down"),
    "far outside": (builder().line(z=-1, feed=99).line(1e300, 10, feed=99), "outside of 0 to 200"),
    "too fast": (builder().line(z=-1, feed=99).line(20, 10, feed=226), "above what its axes"),
    "too slow": (builder().line(z=-1, feed=99).line(20, 10, feed=0.2), "below one count"),
    "no feed": (builder().line(z=-1, feed=99).line(20, 10, feed=0.0), "without a feed above 0"),
    "nothing": (builder(), "nothing is left to cut; cut below"),
    "the other way round": (
        builder().event(Kind.SPINDLE_CCW, 100).line(z=-1, feed=99).line(20, 10, feed=99),
        "one way only",
    ),
    "a tool change": (
        builder()
        .line(z=-1, feed=99)
        .line(20, 10, feed=99)
        .rapid(z=9)
        .event(Kind.TOOL_CHANGE, 2)
        .line(z=-1, feed=99)
        .line(20, 20, feed=99),
        "a tool change between cuts",
    ),
    "another part zero": (
        builder().event(Kind.SET_ZERO).line(z=-1, feed=99).line(20, 10, feed=99),
        "part zero can only be set at part zero",
    ),
    "behind the end": (
        builder().event(Kind.END).line(z=-1, feed=99).line(20, 10, feed=99),
        "follow the end",
    ),
    "home through the stock": (
        builder()
        .line(z=-1, feed=99)
        .line(20, 10, feed=99)
        .set_position(0, 0, -1)
        .event(Kind.HOME_XY),
        "X and Y go home below",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refused(name: str) -> None:
    path, message = REFUSED[name]
    with pytest.raises(PostError, match=message):
        program(path.finish())


def test_events_that_the_master_has_and_has_not() -> None:
    path = ToolpathBuilder().event(Kind.SET_ZERO).event(Kind.TOOL_CHANGE, 1).rapid(z=9)
    path.event(Kind.SPINDLE_CW, 9000).event(Kind.DWELL, 2).message("(M3)\nG0").rapid(10, 10)
    path.line(z=-1, feed=99).line(20, 10, feed=99).event(Kind.SPINDLE_OFF).rapid(z=9)
    toolpath = path.event(Kind.END).finish()
    assert codes(toolpath).count(ProgramCode.EVENT_LEFT_OUT) == 3
    assert b"M3" not in program(toolpath)
    assert program(toolpath) == program(strokes([(10, 10), (20, 10)], feed=99))


def test_moves_of_xy_and_z_are_parted() -> None:
    path = builder().line(10.4, 10, -1, feed=99).line(20, 10, feed=99).rapid(20, 20, 9)
    assert ProgramCode.MOVE_SPLIT in codes(path.event(Kind.END).finish())
    # A ramp down from the top and its way back: travel, then all of it at the one depth.
    assert program(path.finish()) == program(strokes([(10.4, 10), (20, 10)], feed=99))


def test_a_slope_within_the_stock_is_refused() -> None:
    path = builder().line(12, 10, -0.5, feed=99).line(14, 10, -1, feed=99).line(20, 10, feed=99)
    with pytest.raises(PostError, match=r"move \d+: a slope in the stock"):
        program(path.finish())


@pytest.mark.parametrize("y", [1.3, 25.6])
def test_what_the_listing_cannot_send_as_a_character(y: float) -> None:
    toolpath = strokes([(10, y), (20, y)])
    with pytest.raises(PostError, match="cannot be sent as one character"):
        program(toolpath, "profile=listing", "format=stream")
    program(toolpath, "profile=listing", "format=stream", "first_y=number")


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("grid_mm=0.15", "no multiple of 0.1 mm"),
        ("grid_mm=0.0", "grid_mm"),
        ("profile=thesis", "profile"),
        ("format=gcode", "format"),
        ("max_lines=256", "max_lines"),
        ("colour=red", "unknown key"),
        ("first_y=2", "first_y"),
    ],
)
def test_options_are_checked(setting: str, message: str) -> None:
    with pytest.raises(MachineError, match=message):
        router(setting)


def test_an_option_overrides_its_profile() -> None:
    text = program(strokes([(5, 5), (10, 5)]), "profile=text", "baud=4800").decode()
    assert "% serial line: 4800 baud, 8 bits" in text
