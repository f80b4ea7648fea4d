"""What programs say of their operations, and how tools are changed between them."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.findings import Finding, Severity
from camtool.geometry.polylines import Polyline
from camtool.pipeline import post_drawing, verify_program
from camtool.planning.findings import PlanningCode
from camtool.planning.job import Job, Operation, Tool
from camtool.planning.plan import plan
from camtool.records import replace
from camtool.target.registry import LoadedTarget, load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.findings import ProgramCode
from camtool.toolpath.moves import Kind, Toolpath
from camtool.toolpath.wanted import OperationNote, ToolNote
from camtool.verification.findings import VerificationCode
from tests.drawings import drawing_of
from tests.oracles.rs274 import RS274, interpreted
from tests.postprocessors.gcode.test_write import EVIL
from tests.postprocessors.golden import GOLDEN, compare_golden
from tests.strategies import examples

TARGETS = ("grbl", "linuxcnc")


def circle(x: float, y: float, radius: float) -> Polyline:
    """Counter-clockwise from the right."""
    return Polyline(np.array([[x + radius, y, 1.0], [x - radius, y, 1.0]]), closed=True)


def rectangle(x: float, y: float, width: float, height: float) -> Polyline:
    """Counter-clockwise."""
    corners = [(x, y), (x + width, y), (x + width, y + height), (x, y + height)]
    return Polyline(np.array([(*corner, 0.0) for corner in corners]), closed=True)


DRAWING = drawing_of([rectangle(0, 0, 40, 20), circle(8.0, 8.0, 1.5), circle(30.0, 10.0, 4.0)])
MILL = Tool(3.175, number=1, name="mill")
DRILL = Tool(3.0, "drill", math.radians(118.0), number=2, name="pilot")
JOB = Job(
    (
        Operation("drill", "holes", tool=DRILL, depth_mm=4.0, spindle_rpm=8000, peck_mm=1.5),
        Operation("pocket", "window", tool=MILL, select=("inner",), size_mm=(5.0, 10.0),
                  depth_mm=3.2, step_down_mm=1.1, spindle_rpm=12000, feed_mm_min=300.0,
                  plunge_feed_mm_min=90.0),
        Operation("profile", tool=MILL, select=("outer",), side="outside", depth_mm=4.0,
                  step_down_mm=1.5, spindle_rpm=12000, feed_mm_min=300.0,
                  plunge_feed_mm_min=90.0),
    ),
    safe_z_mm=5.0,
)  # fmt: skip

CASES = {
    "grbl-tools.nc": ("grbl", ("spindle.spin_up_s=3", "defaults.change_z_mm=30",
                               "defaults.change_mm=[0, 60]")),
    "linuxcnc-tools.ngc": ("linuxcnc", ("spindle.spin_up_s=3", "dialect.tool_lengths=true",
                                        "dialect.comments=operations")),
}  # fmt: skip


def target(name: str, *given: str) -> LoadedTarget:
    return load_target(name, settings=list(given))


def program(job: Job, name: str, *given: str) -> list[str]:
    run = post_drawing(DRAWING, job, target(name, *given), check=False)
    assert run.program is not None
    return run.program.data.decode("ascii").splitlines()


def blocks(lines: list[str]) -> list[str]:
    return [line for line in lines if not line.startswith(("(", "%"))]


@pytest.mark.parametrize("case", CASES)
def test_program(case: str, bless: bool) -> None:
    name, given = CASES[case]
    data = "\n".join(program(JOB, name, *given)) + "\n"
    compare_golden(GOLDEN / case, data.encode(), bless=bless)


def test_a_program_says_what_each_operation_does() -> None:
    lines = program(JOB, "linuxcnc")
    at = lines.index("(operation 2 of 3: window)")
    said = lines[at : at + 4]
    assert said[1] == "(tool 1 end mill 3.175 mm - 12000 rev/min)"
    assert said[2] == "(3.2 mm deep in 3 passes - feed 300 plunge 90 mm/min)"
    assert re.fullmatch(r"\(takes (\d+ min )?(\d+ s)?\)", said[3])
    assert "(tool 2 pilot: drill 3 mm 118 deg - 8000 rev/min)" in lines
    assert "(4 mm deep by 1.5 mm - plunge 90 mm/min)" not in lines
    assert "(operation 3 of 3: profile)" in lines
    assert lines.index("M5") < at < lines.index("T1 M6")


@pytest.mark.parametrize("name", TARGETS)
@pytest.mark.parametrize("comments", ["operations", "header", "none"])
def test_comments_change_no_block(name: str, comments: str) -> None:
    every = program(JOB, name)
    some = program(JOB, name, f"dialect.comments={comments}")
    assert blocks(some) == blocks(every)
    assert ("(operation 1 of 3: holes)" in some) == (comments == "operations")
    assert not any("CIRCLE" in line for line in some)


@pytest.mark.parametrize("text", EVIL)
@pytest.mark.parametrize("name", TARGETS)
def test_names_of_operations_and_tools_are_never_commands(name: str, text: str) -> None:
    operations = [
        replace(each, name=text, tool=replace(each.tool, name=text)) for each in JOB.operations
    ]
    lines = program(Job(tuple(operations), safe_z_mm=5.0), name)
    assert blocks(lines) == blocks(program(JOB, name))
    for line in lines:
        if line.startswith("("):
            assert re.fullmatch(r"\([A-Za-z0-9 ._+:/=-]{0,60}\)", line)


@st.composite
def cut_paths(draw: st.DrawFn) -> tuple[Toolpath, list[tuple[float, float]]]:
    """Draw operations of a few moves each, with the duration of the cuts of each, s, and the rise
    of its rapid, mm."""
    path, seconds = ToolpathBuilder().rapid(z=5.0), []
    for k in range(draw(st.integers(1, 4))):
        path.operation(OperationNote("profile", f"{k}", ToolNote(), 9.0, 9.0, 1.0))
        cut = 0.0
        for _ in range(draw(st.integers(0, 6))):
            feed, dz = draw(st.sampled_from([7.0, 60.0, 450.0])), draw(st.floats(-2.0, 2.0))
            x, y, z = path.position
            if draw(st.booleans()):
                dx, dy = draw(st.floats(-9.0, 9.0)), draw(st.floats(-9.0, 9.0))
                path.line(x + dx, y + dy, z + dz, feed=feed)
                cut += math.hypot(dx, dy, dz) / feed * 60.0
            else:
                radius = draw(st.floats(0.5, 20.0))
                path.arc(x, y + 2 * radius, z + dz, centre=(x, y + radius), ccw=True, feed=feed)
                cut += math.hypot(math.pi * radius, dz) / feed * 60.0
        seconds.append((cut, abs(5.0 - path.position[2])))
        path.rapid(z=5.0)
    return path.event(Kind.END).finish(), seconds


@given(cut_paths())
def test_the_time_of_an_operation_is_that_of_its_moves(
    case: tuple[Toolpath, list[tuple[float, float]]],
) -> None:
    from camtool_postprocessors.gcode.comments import _feed_seconds

    path, parts = case
    assert path.operations is not None
    ends = [*path.operations.begin[1:].tolist(), len(path)]
    for low, high, (wanted, _) in zip(path.operations.begin, ends, parts, strict=True):
        found = float(_feed_seconds(path.part(int(low), int(high))).sum())
        assert found == pytest.approx(wanted, rel=1e-9, abs=1e-9)
    # A controller that follows every line at its feed takes just that, and its rapids.
    exact = target("grbl", "controller.model=path", "controller.grid=none")
    rate_mm_s = exact.machine.axes.z.max_rate_mm_min / 60.0
    lines = exact.target.write(path, exact.machine).data.decode()
    said = [seconds_of(each) for each in re.findall(r"takes (.+)\)", lines)]
    first_mm = 5.0  # the rise from part zero, before the first operation
    wanted_s = [
        cut + (rise + first_mm * (k == 0)) / rate_mm_s for k, (cut, rise) in enumerate(parts)
    ]
    assert len(said) == len(parts)
    assert said == pytest.approx(wanted_s, abs=0.5 + 1e-6)


def seconds_of(words: str) -> float:
    """`1 min 5 s` as seconds; `less than 1 s` as none, since it is less than half of one."""
    if words.startswith("less"):
        return 0.0
    units = {"h": 3600.0, "min": 60.0, "s": 1.0}
    return sum(float(number) * units[unit] for number, unit in re.findall(r"(\d+) (\w+)", words))


@pytest.mark.parametrize("name", TARGETS)
def test_the_times_in_comments_are_those_of_the_simulated_program(name: str) -> None:
    """Small circles at a high feed take many times as long as the feed says: the axes do not reach
    it."""
    small = [
        Polyline(np.array([[5.0 * k, 0, 1], [5.0 * k + 0.4, 0, 1]]), closed=True) for k in range(9)
    ]
    feeds = {"tool": Tool(0.1), "feed_mm_min": 400.0, "plunge_feed_mm_min": 90.0}
    operations = (
        Operation("engrave", "circles", **feeds),  # type: ignore[arg-type]
        Operation("pocket", "pocket", depth_mm=2.0, step_down_mm=0.2, **feeds),  # type: ignore[arg-type]
    )
    machine = target(name)
    run = post_drawing(drawing_of(small), Job(operations), machine, check=False)
    assert run.program is not None
    text = run.program.data.decode()
    said = [seconds_of(each) for each in re.findall(r"takes (.+)\)", text)]
    decoded = machine.target.read(run.program.data, machine.machine)
    taken = np.zeros(len(decoded))
    for chunk in machine.simulate(decoded):
        np.add.at(taken, chunk.ledger.row, chunk.ledger.duration_s)
    wanted = float(taken[decoded.is_feed].sum())
    assert len(said) == 2
    assert sum(said) == pytest.approx(float(taken.sum()), abs=1.0)  # each is rounded to a second
    steps = np.linalg.norm(np.diff(decoded.end, axis=0, prepend=0.0), axis=1)
    steps[decoded.is_arc] *= 0.5 * math.pi  # half circles
    at_feeds = float((60.0 * steps[decoded.is_feed] / decoded.feed[decoded.is_feed]).sum())
    assert at_feeds < 0.7 * wanted


@given(cut_paths(), st.data())
def test_rows_keep_their_operation(
    case: tuple[Toolpath, list[float]], data: st.DataObject
) -> None:
    path, _ = case
    operations = path.operations
    assert operations is not None
    of = np.searchsorted(operations.begin, np.arange(len(path)), side="right") - 1
    rows = np.sort(data.draw(st.lists(st.integers(0, len(path) - 1), min_size=1)))
    low = data.draw(st.integers(0, len(path)))
    for part, kept in ((path.picked(rows), of[rows]), (path.part(low, len(path)), of[low:])):
        assert part.operations is not None
        mine = np.searchsorted(part.operations.begin, np.arange(len(part)), side="right") - 1
        assert mine[kept >= 0].tolist() == kept[kept >= 0].tolist()


@st.composite
def jobs(draw: st.DrawFn) -> Job:
    """Operations with tools of one to three numbers, with spindle and coolant or without."""
    return Job(
        tuple(
            Operation(
                "profile",
                tool=Tool(1.0, number=draw(st.integers(1, 3))),
                spindle_rpm=draw(st.sampled_from([None, 5000.0, 9000.0])),
                coolant=draw(st.sampled_from(["off", "flood"])),
                select=(draw(st.sampled_from(["outer", "inner"])),),
            )
            for _ in range(draw(st.integers(1, 4)))
        ),
        safe_z_mm=4.0,
    )


@pytest.mark.parametrize("name", TARGETS)
@examples(40)
@given(job=jobs(), lengths=st.booleans(), place=st.booleans())
def test_after_a_change_the_tool_goes_up_before_it_goes_across(
    name: str, job: Job, lengths: bool, place: bool
) -> None:
    """The real tool may stand anywhere then; the spindle stands still while hands are near it."""
    given = ["coolant.flood=true"]
    given += [f"dialect.tool_lengths={str(lengths).lower()}"] if name == "linuxcnc" else []
    given += ["defaults.change_mm=[3, 50]", "defaults.change_z_mm=20"] if place else []
    machine = target(name, *given)
    wanted = plan(DRAWING, job, machine.machine)
    written = machine.target.write(wanted, machine.machine)
    lines = blocks(written.data.decode().splitlines())
    turns = cools = False
    for at, line in enumerate(lines):
        turns = (turns or line.startswith(("M3", "M4"))) and line != "M5"
        cools = (cools or line == "M8") and line != "M9"
        if not line.startswith("T"):
            continue
        assert not turns
        assert not cools
        following = [word for word in lines[at + 1 :] if word[0] in "GXYZ"]
        if lengths and name == "linuxcnc":
            assert following.pop(0) == f"G43 H{line[1]}"
        assert re.fullmatch(r"G0 Z\d+\.000", following[0])
        across = next(word for word in following[1:] if "X" in word or "Y" in word)
        assert re.match(r"X\S+ Y\S+", across)
    read = machine.target.read(written.data, machine.machine)
    changes = [each.value for each in wanted if each.kind == Kind.TOOL_CHANGE]
    if name == "grbl":
        changes = changes[1:]
    assert [each.value for each in read if each.kind == Kind.TOOL_CHANGE] == changes
    stops = [each for each in written.findings if each.code == ProgramCode.TOOL_BY_HAND]
    assert len(stops) == (name == "grbl" and len(changes) > 0)
    assert not stops or stops[0].measured == len(changes)


@pytest.mark.referee
@pytest.mark.skipif(RS274 is None, reason="rs274 is missing")
@pytest.mark.parametrize("place", [(), ("defaults.change_mm=[3, 50]", "defaults.change_z_mm=20")])
def test_no_tool_moves_before_its_length_is_in_force(
    place: tuple[str, ...], tmp_path: Path
) -> None:
    """LinuxCNC's own interpreter with a table of tools 254 and 508 mm long: behind each change the
    length of that tool, and a rapid straight up to the safe height, before anything else."""
    data = ("\n".join(program(JOB, "linuxcnc", *place)) + "\n").encode()
    lengths_in = {1: 10.0, 2: 20.0}
    table = tmp_path / "tool.tbl"
    table.write_text("".join(f"T{k} P{k} Z{each:g} D3\n" for k, each in lengths_in.items()))
    tool, in_force, raised, heights = 0, 0.0, False, []
    here = [0.0, 0.0]
    for name, _, values in interpreted(data, tmp_path, table=table):
        if name == "CHANGE_TOOL":
            tool, in_force, raised = int(values[0]), 0.0, False
        elif name == "USE_TOOL_LENGTH_OFFSET":
            in_force = values[2] / 25.4
        elif name.startswith(("STRAIGHT_", "ARC_")):
            assert tool, "a move before the first change"
            assert in_force == lengths_in[tool]
            if not raised:
                assert name == "STRAIGHT_TRAVERSE"
                assert values[:2] == here
                heights.append(values[2])
            raised = True
            here = values[:2]
    assert len(heights) == 2
    assert min(heights) >= JOB.safe_z_mm


def test_the_operator_reads_what_to_mount() -> None:
    lines = program(JOB, "grbl")
    at = lines.index("T1 M0")
    mount = "(stop: mount tool 1 end mill 3.175 mm)"
    assert lines[at - 3 : at] == [
        mount,
        "(zero Z on top of the stock at X0 Y0 - not cut yet)",
        "(or set its tip to Z 25 mm here - then start)",
    ]
    assert lines[at + 1] == "G0 Z25.000"
    assert "T2 M0" not in lines
    quiet = program(JOB, "grbl", "dialect.comments=none")
    assert quiet[quiet.index("T1 M0") - 3] == mount
    by_hand = Job(tuple(replace(each, spindle_rpm=None) for each in JOB.operations))
    told = program(by_hand, "grbl", "spindle.switched=hand")
    assert told[told.index("T1 M0") - 4] == "(the spindle does not stop by itself: stop it)"


def test_a_spindle_that_another_controller_stops_is_stopped_before_hands_come_near() -> None:
    """LinuxCNC's M6 stops the spindle, grbl's M0 does not."""
    path = ToolpathBuilder().rapid(z=5).event(Kind.SPINDLE_CW, 900).line(z=-1, feed=9)
    path.event(Kind.COOLANT_FLOOD).rapid(z=5).event(Kind.TOOL_CHANGE, 2)
    path.event(Kind.SPINDLE_CW, 700).line(z=-1, feed=9).rapid(z=5)
    data = target("grbl", "coolant.flood=true")
    lines = data.target.write(path.finish(), data.machine).data.decode().splitlines()
    at = lines.index("T2 M0")
    assert lines[at - 5] == "(stop: mount tool 2)"
    assert lines[at - 2 : at] == ["M9", "M5"]
    assert lines[-3:] == ["G0 Z5.000", "M5", "M2"]


@pytest.mark.parametrize("name", TARGETS)
def test_such_programs_are_verified_and_hold_against_their_job(name: str) -> None:
    machine = target(name, "spindle.spin_up_s=2")
    run = post_drawing(DRAWING, JOB, machine)
    assert run.program is not None
    assert not run.failed
    text = run.program.data.decode()
    again = verify_program(run.program.data, machine, source="a.nc", drawing=DRAWING, job=JOB)
    assert [each for each in again.findings if each.severity == Severity.ERROR] == []
    change = "T1 M0" if name == "grbl" else "T1 M6"
    wrong = verify_program(
        text.replace(change, f"T7{change[2:]}").encode(), machine, source="a.nc",
        drawing=DRAWING, job=JOB,
    )  # fmt: skip
    assert VerificationCode.SETTING_DIFFERS in [
        each.code for each in wrong.findings if each.severity == Severity.ERROR
    ]


@pytest.mark.parametrize("name", TARGETS)
def test_the_spindle_is_at_speed_before_anything_goes_down(name: str) -> None:
    lines = blocks(program(JOB, name, "spindle.spin_up_s=2.5"))
    first = next(k for k, line in enumerate(lines) if line.startswith("G1 "))
    assert lines.index("M3 S8000") < lines.index("G4 P2.5") < first


def test_the_goldens_are_there() -> None:
    assert all(Path(GOLDEN / case).exists() for case in CASES)


def places_of_changes(name: str, *given: str) -> tuple[list[tuple[float, ...]], list[Finding]]:
    """Return the positions of the axes at each tool change between cuts, by the words of the
    program alone, and the findings about it."""
    run = post_drawing(DRAWING, JOB, target(name, *given), check=False)
    assert run.program is not None
    here, places, has_cut = {"X": 0.0, "Y": 0.0, "Z": 0.0}, [], False
    for line in blocks(run.program.data.decode().splitlines()):
        if re.match(r"T\d+ M", line) and has_cut:
            places.append(tuple(here.values()))
        has_cut |= here["Z"] < 0.0
        here |= {axis: float(value) for axis, value in re.findall(r"([XYZ])(-?[\d.]+)", line)}
    found = [each for each in run.findings if each.code == PlanningCode.TOOL_CHANGE_NOT_STATED]
    return places, found


@pytest.mark.parametrize("name", TARGETS)
def test_tools_are_changed_where_a_hand_has_room(name: str) -> None:
    """Not a few millimetres above the part where the tool happens to come up."""
    places, (said,) = places_of_changes(name)
    assert places == [(0.0, 0.0, 25.0)]
    assert "give change_mm and change_z_mm in its [defaults]" in said.message
    assert "X 0.000 Y 0.000" in said.where
    # Where it parks, and no higher than Z can go from the deepest cut, 4 mm below the stock.
    parked, (said,) = places_of_changes(
        name, "defaults.park_mm=[7, 60]", "defaults.change_z_mm=18"
    )
    assert parked == [(7.0, 60.0, 18.0)]
    assert "give change_mm in its [defaults]" in said.message
    low, _ = places_of_changes(name, "axes.z.travel_mm=20")
    assert low == [(0.0, 0.0, 16.0)]
    # A machine that states both is not told about it.
    assert places_of_changes(name, "defaults.change_mm=[3, 50]", "defaults.change_z_mm=20") == (
        [(3.0, 50.0, 20.0)],
        [],
    )
