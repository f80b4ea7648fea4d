"""flashcut: the two examples of its thesis, golden programs, what it takes and what it refuses."""

from pathlib import Path

import numpy as np
import pytest
from camtool_postprocessors.flashcut import read as reader
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import MachineError, PostError, ProgramError
from camtool.findings import Finding, Severity
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.findings import ProgramCode
from camtool.toolpath.moves import Kind, Toolpath
from tests.oracles.rs274 import compare, needs_rs274
from tests.postprocessors.gcode.plain_parts import FLASHCUT, on_grid, part
from tests.postprocessors.golden import GOLDEN, compare_golden
from tests.strategies import examples

EXAMPLES = {
    # L1004-1005; the text has a blank before G02, which is read and not written.
    "L1004": (b"G01 X1.0 Y1.0 F3.0\n G02 X3.0 Y3.0 I1.0 J1.0\n", (2.0, 2.0), 3.0),
    "L1020": (b"G01 X2.0 Y1.0 F8.0\nG03 X0.0 Y3.0 I-1.0 J1.0\n", (1.0, 2.0), 8.0),
}


def read(data: bytes, *settings: str) -> Toolpath:
    target = load_target("flashcut", settings=settings)
    path: Toolpath = target.target.read(data, target.machine)
    return path


def write(path: Toolpath, *settings: str) -> list[str]:
    target = load_target("flashcut", settings=settings)
    lines: list[str] = target.target.write(path, target.machine).data.decode("ascii").splitlines()
    return lines


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_examples_of_the_thesis(name: str) -> None:
    data, centre, feed = EXAMPLES[name]
    line, arc = read(data)
    assert (line.kind, line.feed, arc.feed) == (Kind.LINE, feed, feed)
    assert arc.centre == centre
    assert arc.kind == (Kind.ARC_CW if name == "L1004" else Kind.ARC_CCW)
    wanted = [text.strip() for text in data.decode().splitlines()]
    assert write(read(data)) == [*wanted, "M30"]


@pytest.mark.parametrize("name", EXAMPLES)
def test_their_arcs_are_half_circles(name: str) -> None:
    data, _, _ = EXAMPLES[name]
    assert abs(read(data).sweeps()[1]) == pytest.approx(np.pi)


def test_the_golden_program(bless: bool) -> None:
    data = "\n".join([*write(part(3.0, 8.0)), ""]).encode()
    compare_golden(GOLDEN / "flashcut-part.nc", data, bless=bless)


def test_feeds_stand_only_where_the_syntax_has_them() -> None:
    path = ToolpathBuilder().rapid(1.0, 0.0).line(z=-0.02, feed=2.0).line(2.0, 0.0, feed=2.0)
    path.line(3.0, 0.0, feed=4.0).arc(3.0, 2.0, centre=(3.0, 1.0), ccw=True, feed=5.0)
    wanted = path.finish()
    assert write(wanted) == [
        "G00 X1.0 Y0.0",
        "G01 X1.0 Y0.0 F2.0",
        "G01 Z-0.02",
        "G01 X2.0 Y0.0",
        "G01 X3.0 Y0.0 F4.0",
        "G01 X3.0 Y0.0 F5.0",
        "G03 X3.0 Y2.0 I0.0 J1.0",
        "M30",
    ]
    assert write(wanted, "dialect.feed_words=everywhere") == [
        "G00 X1.0 Y0.0",
        "G01 Z-0.02 F2.0",
        "G01 X2.0 Y0.0",
        "G01 X3.0 Y0.0 F4.0",
        "G03 X3.0 Y2.0 I0.0 J1.0 F5.0",
        "M30",
    ]


@pytest.mark.parametrize("name", ["dialect.feed_words=syntax", "dialect.feed_words=everywhere"])
def test_blocks_that_only_set_the_feed_are_no_moves(name: str) -> None:
    path = ToolpathBuilder().rapid(1.0, 0.0).line(z=-0.02, feed=2.0).event(Kind.END).finish()
    back = read("\n".join(write(path, name)).encode(), name)
    assert back.kind.tolist() == path.kind.tolist()
    assert back.feed[1] == 2.0


def test_options() -> None:
    path = ToolpathBuilder().rapid(z=0.5).rapid(1.25, 0.0).event(Kind.END).finish()
    assert write(path, "dialect.z_up=-") == ["G00 Z-0.5", "G00 X1.25 Y0.0", "M30"]
    assert write(path, "dialect.trailing_zeros=true")[1] == "G00 X1.250 Y0.000"
    assert write(path, "dialect.program_end=M02")[2] == "M02"
    fine = ToolpathBuilder().rapid(1.23456, 0.0).finish()
    assert write(fine, "dialect.decimals=4")[0] == "G00 X1.2346 Y0.0"
    assert write(path, "feed.unit_mm_min=0.01") == write(path)


def test_rapids_above_the_stock_go_along_one_axis_at_a_time() -> None:
    path = ToolpathBuilder().rapid(z=0.5).rapid(1.0, 2.0).rapid(3.0, 2.0).rapid(3.0, 0.0)
    path.rapid(z=0.0).rapid(1.0, 1.0).rapid(z=-0.1).rapid(2.0, 2.0)  # in what is cleared
    wanted = path.finish()
    straight = [
        "G00 Z0.5",
        "G00 X1.0 Y2.0",
        "G00 X3.0 Y2.0",
        "G00 X3.0 Y0.0",
        "G00 Z0.0",
        "G00 X1.0 Y1.0",
        "G00 Z-0.1",
        "G00 X2.0 Y2.0",
        "M30",
    ]
    assert write(wanted, "dialect.rapids=straight") == straight
    corners = straight.copy()
    corners.insert(5, "G00 X1.0 Y0.0")
    corners.insert(1, "G00 X1.0 Y0.0")
    assert write(wanted) == corners
    back = read("\n".join(corners).encode())
    assert back.end[back.block == 7].tolist() == [[1.0, 1.0, 0.0]]


def too_long(program: bytes, *settings: str) -> list[Finding]:
    found = read(program, *settings).findings
    return [one for one in found if one.code == ProgramCode.EXECUTED_OTHERWISE]


def test_what_the_timers_make_too_long_is_found() -> None:
    program = b"G00 X1.9 Y0.95\nG01 X0.0 Y0.0 F3.0\nG01 X1.9 Y0.0\nG01 X1.928 Y0.028\nM30\n"
    (finding,) = too_long(program)
    # At 20 ms ⌊1000·21 / (20·1000/500 + 1)⌋ = 512 steps instead of 500; F3.0 would be 18 ms.
    assert (finding.code, finding.severity) == (ProgramCode.EXECUTED_OTHERWISE, Severity.WARNING)
    assert finding.message.startswith("2 straight moves of both axes")
    assert (finding.where, finding.measured) == ("block 1", pytest.approx(12 * 1.9))
    assert "it stays in all that follows" in finding.message
    (late,) = too_long(program, "controller.clock=late-longer")
    assert late.measured == pytest.approx(25 * 1.9)
    (seen,) = too_long(program, "controller.goes_on_from=reached", "controller.half_period_ms=3")
    assert seen.measured == pytest.approx(71 * 1.9)  # the rapid at 3 ms, ⌊4000 / 7⌋
    assert "stays" not in seen.message
    for gone in ("controller.half_period_ms=1000", "controller.model=path"):
        assert too_long(program, gone) == []
    assert too_long(b"G01 X1.0 Y0.0 F3.0\nG01 X1.03 Y0.03\nM30\n") == []


def test_what_a_feed_becomes_is_said() -> None:
    """14.25 mm/min at 3 ms along one axis, 2.71 at 20 ms along two; Z is one axis."""

    def held(program: bytes, *settings: str) -> list[tuple[Severity, str, float | None]]:
        found = [
            one for one in read(program, *settings).findings if one.code == ProgramCode.FEED_HELD
        ]
        return [(one.severity, one.where, one.measured) for one in found]

    square = b"G01 X1.0 Y0.0 F14.1\nG01 X1.0 Y1.0\nG01 Z-0.1\nG00 X3.0 Y3.0\n"
    assert held(square + b"M30\n") == []
    slant = square + b"G01 X4.0 Y3.5\nG02 X5.0 Y3.5 I0.5 J0.0\nM30\n"
    assert held(slant) == [(Severity.WARNING, "block 5", pytest.approx(2.714, abs=1e-3))]
    assert held(slant.replace(b"F14.1", b"F5.0")) == [
        (Severity.INFO, "block 5", pytest.approx(2.714, abs=1e-3))
    ]
    assert held(slant.replace(b"F14.1", b"F2.7")) == []
    assert held(slant, "controller.half_period_ms=3") == []
    alone = ("controller.single_axis_half_period_ms=10",)
    assert held(square + b"M30\n", *alone) == [
        (Severity.WARNING, "block 1", pytest.approx(5.182, abs=1e-3))
    ]


@given(part_rows=st.integers(1, 7), seed=st.integers(0, 2**32 - 1))
def test_findings_do_not_depend_on_how_many_rows_are_looked_at_together(
    part_rows: int, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    moves = rng.integers(0, 60, (20, 2)) / 10.0
    codes = rng.choice(["G00", "G01"], 20).tolist()
    lines = [
        f"{code} X{x:.1f} Y{y:.1f}" for code, (x, y) in zip(codes, moves.tolist(), strict=True)
    ]
    data = "\n".join(["G01 X0.1 Y0.0 F14.1", *lines, "G01 Z-0.1", "M30", ""]).encode()
    whole = read(data).findings
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(reader, "ROWS_AT_ONCE", part_rows)
        assert read(data).findings == whole


def test_the_spindle_may_not_stop() -> None:
    target = load_target("flashcut", settings=["dialect.spindle_stops=false"])
    path = ToolpathBuilder().event(Kind.SPINDLE_CW).event(Kind.SPINDLE_OFF).finish()
    program = target.target.write(path, target.machine)
    assert program.data == b"M03\nM05\nM30\n"
    (finding,) = program.findings
    assert (finding.code, finding.severity) == (ProgramCode.EVENT_LEFT_OUT, Severity.WARNING)
    assert "turns with every move" in finding.message


def test_stops_come_back_as_stops() -> None:
    path = read(b"M03\nM00\nM04\nM05\nM02\n")
    kinds = [Kind.SPINDLE_CW, Kind.MESSAGE, Kind.SPINDLE_CCW, Kind.SPINDLE_OFF, Kind.END]
    assert path.kind.tolist() == kinds
    assert write(path) == ["M03", "M00", "M04", "M05", "M30"]


def test_texts_of_drawings_never_reach_a_program() -> None:
    path = ToolpathBuilder().message("a\nG00 Z-9.0\n(;%").rapid(1.0, 0.0)
    path.source = "M03\nG00 X9.0 Y9.0"
    path.rapid(2.0, 0.0)
    assert write(path.finish()) == ["G00 X1.0 Y0.0", "G00 X2.0 Y0.0", "M30"]


@pytest.mark.parametrize(
    ("settings", "where"),
    [
        (["dialect.decimals=0"], "decimals"),
        (["dialect.decimals=5"], "decimals"),
        (["dialect.decimals=2"], "add 1 to decimals"),
        (["dialect.arc_spread_mm=0.001"], "rounding alone"),
        (["dialect.feed_words=never"], "feed_words"),
        (["dialect.arc_spread_mm=0"], "arc_spread_mm"),
        (["dialect.colour=red"], "colour"),
        (["feed.unit_mm_min=0.3"], "unit_mm_min"),
    ],
)
def test_wrong_options_are_named(settings: list[str], where: str) -> None:
    with pytest.raises(MachineError, match=where):
        load_target("flashcut", settings=settings)


REFUSED = {
    "start": (ToolpathBuilder((1.0, 0.0, 0.0)).rapid(2.0, 0.0), "starts at"),
    "too fast": (ToolpathBuilder().line(1.0, 0.0, feed=14.2), "above the machine's highest, 14.1"),
    "no feed": (ToolpathBuilder().line(1.0, 0.0, feed=0.0), "without a feed"),
    "a feed of 0": (ToolpathBuilder().line(1.0, 0.0, feed=0.01), "becomes 0 in an F word"),
    "far": (ToolpathBuilder().rapid(1.0, 10000.0), "four digits"),
    "deep": (ToolpathBuilder().rapid(z=-10000.0), "four digits"),
    "homing": (ToolpathBuilder().event(Kind.HOME_Z), "no code to go to machine zero"),
    "after the end": (ToolpathBuilder().event(Kind.END).rapid(1.0, 0.0), "follow the end"),
    "zero elsewhere": (ToolpathBuilder().rapid(1.0, 0).event(Kind.SET_ZERO), "set at part zero"),
    "two radii": (
        ToolpathBuilder().arc(2.0, 0.0, centre=(0.9, 0.0), ccw=True, feed=1.0),
        "radii at start and end",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_the_machine_cannot_do_is_refused(name: str) -> None:
    path, message = REFUSED[name]
    with pytest.raises(PostError, match=message):
        write(path.finish())


BAD = {
    "nothing": (b"", "the program is empty"),
    "blank lines": (b"\n \r\n", "the program is empty"),
    "G1": (b"G1 X1.0 Y1.0 F3.0", "block 1, line 1, column 1: G1 is not known"),
    "unknown M": (b"M03\nM08", "block 2, line 2, column 1: M08 is not known"),
    "inches": (b"G20", "column 1: G20 is an arc in this controller's list"),
    "no Y": (b"G00 X1.0", "column 5: G00 lacks a word; write G00 X Y or G00 Z"),
    "no X": (b"G00 Y1.0", "column 5: Y has no place here"),
    "Z with X": (b"G00 X1.0 Y1.0 Z1.0", "column 15: Z has no place here"),
    "no word": (b"G00", "column 1: G00 lacks a word"),
    "no J": (b"G01 X1.0 Y0.0 F3.0\nG02 X1.0 Y2.0 I0.0", "block 2, line 2, column 15: G02 lacks"),
    "no I": (b"G02 X1.0 Y2.0 J0.0", "column 15: J has no place"),
    "radius": (b"G02 X1.0 Y2.0 R1.0", "column 15: the letter R is no word here"),
    "F on an arc": (b"G02 X1.0 Y2.0 I0.5 J1.0 F3.0", "column 25: F has no place"),
    "F on a rapid": (b"G00 X1.0 Y2.0 F3.0", "column 15: F has no place"),
    "F on Z": (b"G01 Z1.0 F3.0", "column 10: F has no place"),
    "F alone": (b"F3.0", "column 1: F3.0 is not known"),
    "words alone": (b"X1.0 Y1.0", "column 1: X1.0 is not known"),
    "spindle speed": (b"M03 S1000", "column 5: the letter S is no word"),
    "two codes": (b"G01 G00 X1.0 Y1.0", "column 5: G has no place"),
    "small letters": (b"g00 x1.0 y1.0", "column 1: this controller takes no small letters"),
    "comma": (b"G00 X1,5 Y1.0", "column 7: a decimal comma"),
    "no digits": (b"G00 X Y1.0", "column 6: no number after X"),
    "two signs": (b"G00 X--1.0 Y1.0", "no number after X"),
    "two points": (b"G00 X1.0.0 Y1.0", "column 9: a number without its letter"),
    "exponent": (b"G00 X1e3 Y1.0", "column 7"),
    "comment": (b"G00 X1.0 Y1.0 (fast)", "column 15: this dialect has no comments"),
    "percent": (b"%\nM30", "block 1, line 1, column 1: "),
    "block number": (b"N10 G00 X1.0 Y1.0", "column 1: the letter N is no word"),
    "no blank": (b"G00X1.0Y1.0", "one space"),
    "two blanks": (b"G00  X1.0 Y1.0", "one space"),
    "tab": (b"G00\tX1.0 Y1.0", "one space"),
    "one word lost": (b"G00X1.0  Y1.0", "one space"),
    "byte": (b"M03\nG00 X\xff1.0 Y1.0", "line 2, column 6: the byte 0xff"),
    "zero byte": (b"M30\n\x00", "the byte 0x00"),
    "cut": (b"G00 X1.0 Y", "column 10: no number after Y"),
    "after the end": (b"M30\nM30", "block 2, line 2, column 1: a block after M30"),
    "no feed yet": (b"G01 X1.0 Y1.0", "G01 before any F"),
    "no feed for an arc": (b"G02 X1.0 Y2.0 I0.5 J1.0", "G02 before any F"),
    "feed of 0": (b"G01 X1.0 Y1.0 F0", "column 15: a feed must be above 0"),
    "negative feed": (b"G01 X1.0 Y1.0 F-3.0", "column 15: a feed must be above 0"),
    "far": (b"G00 X1.0 Y12345.0", "column 10: a number beyond"),
    "endless number": (b"G00 X1.0 Y" + b"9" * 400, "column 10: a number beyond"),
    "no radius": (b"G01 X1.0 Y1.0 F3.0\nG02 X1.0 Y1.0 I0.0 J0.0", "column 15: an arc about its"),
    "radii": (
        b"G01 X1.0 Y1.0 F3.0\nG02 X3.0 Y3.1 I1.0 J1.0",
        "block 2, line 2, column 15: the arc's start is 1.41421 mm from its centre",
    ),
    "full circle": (
        b"G01 X1.0 Y1.0 F3.0\nG02 X1.0 Y1.0 I1.0 J1.0",
        "column 5: an arc that ends where it starts",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_programs_are_named_with_their_place(name: str) -> None:
    data, message = BAD[name]
    with pytest.raises(ProgramError) as error:
        read(data)
    assert message in str(error.value)


GOOD = {
    "line ends": b"M03\r\nG00 X1.0 Y1.0\rG00 Z1.0\n\n M05 \nM30",
    "numbers": b"G00 X+1 Y-.5\nG00 X1. Y-0",
    "no end": b"G00 X1.0 Y1.0",
}


@pytest.mark.parametrize("name", GOOD)
def test_good_programs_are_taken(name: str) -> None:
    path = read(GOOD[name])
    assert path.is_motion.any()
    assert not (np.signbit(path.end) & (path.end == 0.0))[:, 2].any()


def test_settings_let_more_be_taken() -> None:
    circle = b"G01 X1.0 Y1.0 F3.0\nG02 X1.0 Y1.0 I1.0 J1.0"
    assert read(circle, "dialect.full_circles=whole").sweeps()[1] == pytest.approx(-2.0 * np.pi)
    assert read(b"G01 Z1.0 F3.0", "dialect.feed_words=everywhere").feed[0] == 3.0
    assert read(b"G00 Z1.0", "dialect.z_up=-").end[0, 2] == -1.0


def test_feeds_above_the_limit_are_found() -> None:
    path = read(b"M03\nG01 X1.0 Y1.0 F14.1\nG01 X2.0 Y1.0 F15.0\nG01 X3.0 Y1.0 F20")
    finding, held = path.findings
    assert (finding.code, finding.severity) == (ProgramCode.FEED_ABOVE_LIMIT, Severity.WARNING)
    assert (held.code, held.measured) == (ProgramCode.FEED_HELD, pytest.approx(2.714, abs=1e-3))
    assert path.feed[path.is_feed].tolist() == [14.1, 15.0, 20.0]  # as programmed
    assert (finding.where, finding.measured, finding.limit) == ("block 3", 20.0, 14.1)


FRAME = b"G21 G17 G90 G91.1 G94\n"


def moving(path: Toolpath) -> Toolpath:
    """Without the moves that move nothing: feeds said by G01 to where the tool is."""
    keep = path.is_arc | (path.is_motion & (path.end != path.starts).any(axis=1))
    return path.picked(np.flatnonzero(keep))


class TestReferee:
    pytestmark = needs_rs274

    @given(wanted=on_grid(FLASHCUT))
    @examples(25)
    def test_linuxcnc_finds_the_same_moves(
        self, wanted: Toolpath, tmp_path_factory: pytest.TempPathFactory
    ) -> None:
        lines = write(wanted, "dialect.feed_words=everywhere", "dialect.rapids=straight")
        data = FRAME + "\n".join(lines).encode() + b"\n"
        compare(moving(wanted), data, tmp_path_factory.mktemp("rs274"))

    def test_and_of_the_golden_part(self, tmp_path: Path) -> None:
        lines = write(part(3.0, 8.0), "dialect.feed_words=everywhere")
        data = "\n".join(lines).encode()
        decoded = read(data, "dialect.feed_words=everywhere")
        compare(moving(decoded), FRAME + data + b"\n", tmp_path)
