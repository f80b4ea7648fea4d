"""What the i8751 writer refuses, changes, and says of it."""

import math

import numpy as np
import pytest
from camtool_postprocessors.i8751 import write as writer

from camtool.errors import MachineError, PostError
from camtool.findings import Code, Severity
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.findings import ProgramCode
from camtool.toolpath.moves import Kind, Toolpath
from camtool.toolpath.program import Program
from tests.postprocessors.i8751.machines import STEP_MM, loaded


def write(path: ToolpathBuilder | Toolpath, *settings: str) -> Program:
    target = loaded(*settings)
    toolpath = path.finish() if isinstance(path, ToolpathBuilder) else path
    program: Program = target.target.write(toolpath, target.machine)
    return program


def line(*steps: int) -> ToolpathBuilder:
    """A cut of so many steps, below the stock's top."""
    ends = [step * STEP_MM for step in steps]
    return ToolpathBuilder().line(*ends, feed=30)


def records(program: Program) -> bytes:
    """The bytes between the key and the end of the only packet."""
    assert program.data[:1] == b"\x13"
    assert program.data[-2:] == b"\x45\x54"
    return program.data[1:-2]


def codes(program: Program) -> set[Code]:
    return {finding.code for finding in program.findings}


@pytest.mark.parametrize(
    ("setting", "data"),
    [
        ("key=once", "01 03 01 2C 02 05 00 00 03 05 00 00"),
        ("plus_backward=x", "01 04 01 2C 02 05 00 00 03 05 00 00"),
        ("plus_backward=yz", "01 03 01 2C 02 05 00 00 03 05 00 00"),
        ("dwell_mark=30H", "01 03 01 2C 02 05 30 00 03 05 30 00"),
        ("high_byte='255'", "01 03 01 2D 02 05 00 00 03 05 00 00"),
        ("first_pulse=repeats", "01 03 01 2D 02 05 00 00 03 05 00 00"),
    ],
)
def test_readings_of_the_thesis(setting: str, data: str) -> None:
    assert records(write(line(300, 0), setting, "long_runs=true")) == bytes.fromhex(data)


@pytest.mark.parametrize(
    ("steps", "setting", "count", "first"),
    [
        (65535, "high_byte='256'", 1, "FF FF"),
        (65536, "high_byte='256'", 2, "FF FF"),
        (65280, "high_byte='255'", 1, "FF FF"),
        (65281, "high_byte='255'", 2, "FF FF"),
        (255, "high_byte='255'", 1, "00 FF"),
        (256, "high_byte='255'", 1, "01 01"),
        (256, "high_byte='256'", 1, "01 00"),
        (65534, "first_pulse=repeats", 1, "FF FF"),
        (65535, "first_pulse=repeats", 2, "FF FF"),
    ],
)
def test_the_most_steps_of_a_record(steps: int, setting: str, count: int, first: str) -> None:
    for path in (line(-steps, 0), ToolpathBuilder().line(z=-steps * STEP_MM, feed=30)):
        program = write(path, setting, "long_runs=true")
        assert len(program.row_of_block) == count + 1
        assert (ProgramCode.MOVE_SPLIT in codes(program)) == (count > 1)
        assert bytes.fromhex("04 " + first) in program.data


@pytest.mark.parametrize("steps", [255, 256, 510, 511, 1000, 65535])
@pytest.mark.parametrize("setting", ["high_byte='256'", "first_pulse=repeats"])
def test_no_run_needs_a_high_byte(steps: int, setting: str) -> None:
    """So a program leads to the same places whatever a unit of PH is worth."""
    most = 255 - (setting == "first_pulse=repeats")
    for path in (line(-steps, 0), line(steps, -steps), line(0, steps // 2 + 1)):
        program = write(path, setting)
        as_256, as_255 = (
            loaded(setting.replace("high_byte='256'", "key=once"), f"high_byte='{unit}'")
            for unit in (256, 255)
        )
        there, here = (made.target.read(program.data, made.machine) for made in (as_256, as_255))
        np.testing.assert_array_equal(there.end, here.end)
        np.testing.assert_allclose(there.end[-1], path.finish().end[-1], atol=1e-9)
        assert ProgramCode.READ_TWO_WAYS not in {one.code for one in there.findings}
    assert len(write(line(-steps, 0), setting).row_of_block) == -(-steps // most) + 1


def test_five_records_a_packet() -> None:
    path = ToolpathBuilder()
    for number in range(1, 12):
        path.line(number * STEP_MM, feed=30)
    step = bytes.fromhex("01 03 00 01 02 05 00 00 03 05 00 00")
    packet = step * 5 + b"\x45"
    assert write(path).data == b"\x13" + packet * 2 + step + b"\x45\x54"
    again = write(path, "key=each-packet").data
    assert again == (b"\x13" + packet) * 2 + b"\x13" + step + b"\x45\x54"


def test_waits() -> None:
    path = line(5, 0).event(Kind.DWELL, 3).event(Kind.DWELL, 0.2)
    program = write(path)
    assert records(program) == bytes.fromhex("01 03 00 05 02 05 00 00 03 05 00 04")
    assert ProgramCode.VALUE_ROUNDED in codes(program)
    still = "01 05 02 05 00 00 03 05 00 "
    program = write(ToolpathBuilder().event(Kind.DWELL, 300).line(STEP_MM, feed=30))
    move = "01 03 00 01 02 05 00 00 03 05 00 00"
    assert records(program) == bytes.fromhex(still + "FF" + still + "2D" + move)
    assert program.row_of_block.tolist() == [0, 0, 1, -1]


def test_rows_of_blocks() -> None:
    path = ToolpathBuilder().rapid(z=1).rapid(1, 1, 1).line(2, 1.5, 0.5, feed=30)
    program = write(path.event(Kind.DWELL, 600).event(Kind.END))
    *rows, end = program.row_of_block.tolist()
    assert rows == sorted(rows)
    assert set(rows) == {0, 1, 2, 3}
    assert end == 4


def test_z_never_alone() -> None:
    path = ToolpathBuilder().rapid(z=5 * STEP_MM).rapid(STEP_MM, 0).rapid(z=0)
    data = records(write(path, "z_alone=with-step"))
    # Aside with Z up; standing still would undo it, so it stays; Z down on the way back.
    expected = [
        "01 03 00 01 02 05 00 00 03 03 00 05 00 00",
        "01 03 00 01 02 05 00 00 03 05 00 00",
        "01 04 00 01 02 05 00 00 03 04 00 05 00 00",
    ]
    assert data == bytes.fromhex(" ".join(expected))
    with pytest.raises(PostError, match="a record in which nothing moves"):
        write(ToolpathBuilder().event(Kind.DWELL, 1).line(STEP_MM, feed=30), "z_alone=with-step")


def test_rapids_are_not_cut_for_their_dog_leg() -> None:
    rapid = write(ToolpathBuilder().rapid(250 * STEP_MM, 100 * STEP_MM))
    assert len(rapid.row_of_block) == 2
    cut = write(line(400, 160))
    # e = 160·240/430.8 = 89 steps, the tolerance is 4: n = (89/4 + 1)/2 = 11.6
    assert len(cut.row_of_block) == 13
    (finding,) = (f for f in cut.findings if f.code == ProgramCode.MOVE_SPLIT)
    assert finding.measured == 12
    assert finding.severity == Severity.INFO


@pytest.mark.parametrize("form", ["packets", "listing", "hex"])
def test_extensions(form: str) -> None:
    expected = ".bin" if form == "packets" else ".txt"
    assert write(line(5), f"format={form}").extension == expected


@pytest.mark.parametrize("form", ["listing", "hex"])
def test_texts_of_a_drawing_are_comments_only(form: str) -> None:
    evil = "END\r\n\x1aX+1.0 Y+1.0 T0 Z-9.0 T0\n0000  54 ; <- A µ%(G0)" + "x" * 500
    plain = write(line(5, 3).line(0, 0, feed=30), f"format={form}")
    path = line(5, 3)
    path.source = evil
    path.message(evil).line(0, 0, feed=30)
    target = loaded(f"format={form}")
    program = write(path, f"format={form}")
    lines = program.data.decode("ascii").splitlines()
    assert [text for text in lines if "X+1.0" not in text] == plain.data.decode().splitlines()
    (comment,) = [text for text in lines if "X+1.0" in text]
    assert comment.startswith("; END X+1.0 ")
    assert len(comment) <= 62
    read = [target.target.read(p.data, target.machine).end for p in (program, plain)]
    np.testing.assert_array_equal(*read)


def test_what_cannot_be_said_is_told() -> None:
    path = ToolpathBuilder().event(Kind.SPINDLE_CW, 900).rapid(z=1).rapid(0.001, 0)
    path.line(1, 1, -1, feed=30).arc(1, 1, centre=(1, 2), ccw=True, feed=30)
    program = write(path.event(Kind.SPINDLE_OFF))
    by_code = {}
    for finding in program.findings:
        by_code.setdefault(finding.code, finding)
    assert by_code[ProgramCode.EVENT_LEFT_OUT].message.startswith("2 spindle events")
    assert by_code[ProgramCode.EVENT_LEFT_OUT].severity == Severity.WARNING
    assert by_code[ProgramCode.MOVE_COLLAPSED].measured == 1
    assert by_code[ProgramCode.FEED_ROUNDED].severity == Severity.INFO
    assert by_code[ProgramCode.MOVE_SPLIT].message.startswith(
        "1 feed move in XY and Z became steps"
    )
    assert by_code[ProgramCode.MOVE_SPLIT].severity == Severity.WARNING


def test_the_first_tool_is_mounted_by_hand() -> None:
    program = write(ToolpathBuilder().event(Kind.TOOL_CHANGE, 2).line(1, feed=30))
    assert program.data == write(ToolpathBuilder().line(1, feed=30)).data
    assert ProgramCode.EVENT_LEFT_OUT in codes(program)


def nan_arc() -> ToolpathBuilder:
    return ToolpathBuilder().arc(1, 0, centre=(math.nan, 0), ccw=True, feed=9)


REFUSED = {
    "nothing": (ToolpathBuilder(), "nothing moves by a whole step"),
    "less than a step": (ToolpathBuilder().line(0.001, feed=9), "nothing moves"),
    "start": (ToolpathBuilder((0, 0, 1)).line(1, feed=9), "starts at (0, 0, 1) mm"),
    "home": (ToolpathBuilder().event(Kind.HOME_Z), "move 0: this machine has no limit switches"),
    "tool": (
        ToolpathBuilder().line(1, feed=9).event(Kind.TOOL_CHANGE, 2),
        "move 1: this machine has no stop for a tool change",
    ),
    "zero": (
        ToolpathBuilder().rapid(1).event(Kind.SET_ZERO),
        "move 1: part zero is set away from where",
    ),
    "long dwell": (ToolpathBuilder().event(Kind.DWELL, 36_001), "a dwell of 36001 s"),
    "no dwell": (ToolpathBuilder().event(Kind.DWELL), "a dwell of nan s"),
    "dwell back": (ToolpathBuilder().event(Kind.DWELL, -1), "a dwell of -1 s"),
    "after the end": (
        ToolpathBuilder().event(Kind.END).rapid(1),
        "move 1: something follows the end",
    ),
    "two ends": (ToolpathBuilder().event(Kind.END).event(Kind.END), "move 1: something follows"),
    "far": (ToolpathBuilder().rapid(0, 2e5), "Y = 200000 mm is more than 10000000 steps"),
    "no feed": (ToolpathBuilder().line(1, feed=0), "a feed of 0 mm/min; give a feed above 0"),
    "feed nan": (
        ToolpathBuilder().line(1, feed=math.nan),
        "a feed of nan mm/min; give a feed above 0",
    ),
    "feed inf": (
        ToolpathBuilder().line(1, feed=math.inf),
        "a feed of inf mm/min; give a feed above 0",
    ),
    "arc": (
        ToolpathBuilder().arc(1, 0, centre=(0.4, 0), ccw=True, feed=9),
        "radii at start and end of an arc differ by 0.2000 mm",
    ),
    "no centre": (nan_arc(), "an arc without a centre; give the arc a centre"),
    "moving event": (
        ToolpathBuilder().rapid(1).set_position(2, 0, 0).event(Kind.DWELL, 1),
        "a DWELL cannot move the tool",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refused(name: str) -> None:
    path, message = REFUSED[name]
    with pytest.raises(PostError) as caught:
        write(path)
    assert message in str(caught.value)


def test_a_program_without_bounds_is_refused() -> None:
    path = ToolpathBuilder()
    for _ in range(40):
        path.line(90_000, 40_000, feed=9).line(0, 0, feed=9)
    with pytest.raises(PostError, match="records, more than 2000000"):
        write(path)


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("tolerance_mm=0.006", "finer than the steps of the machine can be; use 0.00625 mm"),
        ("tolerance_mm=0", "tolerance_mm"),
        ("plus_backward=zx", "'zx' names no axes"),
        ("format=bin", "key format"),
        ("high_byte='254'", "key high_byte"),
        ("start_reload=0", "key start_reload"),
        ("speed=1", "unknown key"),
    ],
)
def test_dialects_that_are_none(setting: str, message: str) -> None:
    with pytest.raises(MachineError) as caught:
        loaded(setting)
    assert message in str(caught.value)


def test_the_steps_must_be_said_by_the_user() -> None:
    with pytest.raises(MachineError, match="coded_step_mm"):
        load_target("i8751")


@pytest.mark.parametrize("form", ["packets", "hex", "listing"])
def test_the_line_carries_packets_whatever_the_file_is(form: str) -> None:
    target = loaded(f"format={form}")
    data = write(line(300, 700, 0), f"format={form}").data
    wanted = len(write(line(300, 700, 0)).data)
    assert target.target.line_bytes(data, target.machine) == wanted
    assert (len(data) == wanted) == (form == "packets")


@pytest.mark.parametrize("key", ["once", "each-packet"])
@pytest.mark.parametrize("count", [1, 4, 5, 6, 10, 11, 31])
def test_bytes_do_not_depend_on_how_many_records_are_written_together(
    key: str, count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    dialect = loaded(f"key={key}").machine.dialect
    rng = np.random.default_rng(count)
    steps, waits = rng.integers(-300, 300, (count, 3)), rng.integers(0, 3, (count, 2))
    table, used = writer.byte_table(steps, waits, dialect)
    for at_once in (5, 10):
        monkeypatch.setattr(writer, "RECORDS_AT_ONCE", at_once)
        assert writer.packet_bytes(steps, waits, dialect) == table[used].tobytes() + b"\x54"
