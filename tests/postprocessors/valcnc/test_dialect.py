"""valcnc: golden programs, the scale, what the firmware takes and what is refused."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

from camtool.errors import MachineError, PostError, ProgramError
from camtool.findings import Severity
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.findings import ProgramCode
from camtool.toolpath.moves import Kind, Toolpath
from tests.oracles.rs274 import compare, needs_rs274
from tests.postprocessors.gcode.plain_parts import part
from tests.postprocessors.golden import GOLDEN, compare_golden

ONE = ("dialect.coord_scale=1",)
CALIBRATED = (
    "axes.x.coded_step_mm=0.04038",
    "axes.y.coded_step_mm=0.04043",
    "axes.z.coded_step_mm=0.0403",
)


def read(data: bytes, *settings: str) -> Toolpath:
    target = load_target("valcnc", settings=settings)
    path: Toolpath = target.target.read(data, target.machine)
    return path


def write(path: Toolpath, *settings: str) -> list[str]:
    target = load_target("valcnc", settings=settings)
    lines: list[str] = target.target.write(path, target.machine).data.decode("ascii").splitlines()
    return lines


@pytest.mark.parametrize(("file", "settings"), [("part", ()), ("part-unscaled", ONE)])
def test_the_golden_programs(file: str, settings: tuple[str, ...], bless: bool) -> None:
    data = "\n".join([*write(part(14400.0, 14400.0), *settings), ""]).encode()
    compare_golden(GOLDEN / f"valcnc-{file}.ngc", data, bless=bless)


def test_every_block_says_everything_and_is_short() -> None:
    motion = r"G0[01] X-?\d+\.\d{4} Y-?\d+\.\d{4} Z-?\d+\.\d{4}"
    arc = motion.replace("[01]", "[23]") + r" I-?\d+\.\d{4} J-?\d+\.\d{4}"
    for line in write(part(14400.0, 14400.0)):
        assert re.fullmatch(f"{motion}|{arc}", line)
        assert len(line) <= 127


def test_the_scale() -> None:
    path = ToolpathBuilder().rapid(10.0, 20.0, 0.0).finish()
    assert write(path) == ["G00 X1.2500 Y2.5000 Z0.0000"]
    assert write(path, *ONE) == ["G00 X10.0000 Y20.0000 Z0.0000"]
    assert read(b"G00X1.25Y2.5Z0").end.tolist() == [[10.0, 20.0, 0.0]]
    assert read(b"G00X10Y20Z0", *ONE).end.tolist() == [[10.0, 20.0, 0.0]]


def test_the_scale_is_warned_of_until_it_was_measured() -> None:
    path = ToolpathBuilder().rapid(1.0, 2.0).finish()
    for settings, codes in (
        ((), [ProgramCode.COORDINATES_SCALED]),
        (("coord_scale_checked=true",), []),
    ):
        target = load_target("valcnc", settings=[f"dialect.{one}" for one in settings])
        program = target.target.write(path, target.machine)
        assert [finding.code for finding in program.findings] == codes
        decoded = target.target.read(program.data, target.machine)
        assert [finding.code for finding in decoded.findings] == codes
        assert all(finding.severity == Severity.WARNING for finding in program.findings)


def test_calibrated_leads_scale_each_axis() -> None:
    """Ten turns were 80.76, 80.86 and 80.60 mm (L1649-1682): 80 mm then need fewer steps."""
    path = ToolpathBuilder().rapid(80.76, 80.86, 80.6).finish()
    assert write(path, *CALIBRATED)[-1] == "G00 X10.0000 Y10.0000 Z10.0000"
    end = read(b"G00X0Y0Z10\nG00X10Y10Z10", *CALIBRATED).end[-1]
    np.testing.assert_allclose(end, [80.76, 80.86, 80.6])


def test_circles_on_axes_of_unequal_steps_become_lines() -> None:
    target = load_target("valcnc", settings=CALIBRATED)
    path = ToolpathBuilder().rapid(10.0, 0.0).arc(0.0, 10.0, centre=(0, 0), ccw=True, feed=14400.0)
    program = target.target.write(path.finish(), target.machine)
    decoded = target.target.read(program.data, target.machine)
    assert not decoded.is_arc.any()
    radii = np.hypot(*decoded.end[:, :2].T)
    assert np.abs(radii - 10.0).max() < 0.001
    middles = (decoded.end[:-1, :2] + decoded.end[1:, :2]) / 2.0
    assert np.abs(np.hypot(*middles.T) - 10.0).max() < 0.006
    (mended,) = (f for f in program.findings if f.code == ProgramCode.ARC_MENDED)
    assert "ellipses" in mended.message
    with pytest.raises(ProgramError, match="this arc is an ellipse"):
        target.target.read(b"G00X1Y0Z0\nG03X0Y1Z0I-1J0", target.machine)


def test_no_arc_is_longer_than_asked_for() -> None:
    path = ToolpathBuilder().rapid(10.0, 0.0).arc(10.0, 0.0, centre=(0, 0), ccw=True, feed=14400.0)
    for degrees, count in ((90, 4), (45, 8), (60, 6), (85, 5)):
        setting = f"dialect.max_sweep_deg={degrees}"
        back = read("\n".join(write(path.finish(), setting)).encode())
        sweeps = np.abs(back.sweeps()[back.is_arc])
        assert len(sweeps) == count
        assert sweeps.max() <= math.radians(degrees) + 1e-3


def test_feeds_and_events_that_have_no_word_are_found() -> None:
    target = load_target("valcnc")
    path = ToolpathBuilder().event(Kind.SPINDLE_CW, 1000).line(1.0, 0.0, feed=100.0).finish()
    found = {f.code: f for f in target.target.write(path, target.machine).findings}
    assert found[ProgramCode.FEED_ROUNDED].severity == Severity.WARNING
    assert found[ProgramCode.FEED_ROUNDED].limit == 14400.0
    assert "SPINDLE_CW" in found[ProgramCode.EVENT_LEFT_OUT].message


def test_nothing_stops_for_another_tool() -> None:
    path = ToolpathBuilder().event(Kind.TOOL_CHANGE, 1).line(1, feed=14400)
    assert write(path.finish()) == write(ToolpathBuilder().line(1, feed=14400).finish())
    with pytest.raises(PostError, match=r"move 2: .* tool change; write a program for each"):
        write(path.event(Kind.TOOL_CHANGE, 2).finish())


def test_texts_of_drawings_never_reach_a_program() -> None:
    path = ToolpathBuilder().message("a\nG00 X0Y0Z-9\n(;%").rapid(1.0, 0.0)
    path.source = "\nG00 X9Y9Z9"
    assert write(path.finish()) == ["G00 X0.1250 Y0.0000 Z0.0000"]


@pytest.mark.parametrize(
    ("setting", "where"),
    [
        ("dialect.coord_scale=0", "coord_scale"),
        ("dialect.decimals=7", "decimals"),
        ("dialect.max_sweep_deg=91", "max_sweep_deg"),
        ("dialect.max_sweep_deg=0.5", "max_sweep_deg"),
        ("dialect.decimals=2", "decimals"),
        ("dialect.arc_spread_mm=0.0008", "arc_spread_mm"),
        ("dialect.missing_words=guess", "missing_words"),
        ("dialect.z_order=first", "z_order"),
        ("dialect.steps=200", "steps"),
    ],
)
def test_wrong_options_are_named(setting: str, where: str) -> None:
    with pytest.raises(MachineError, match=where):
        load_target("valcnc", settings=[setting])


def test_a_block_that_is_too_long_is_refused() -> None:
    path = ToolpathBuilder().rapid(1.0, 0.0).finish()
    with pytest.raises(PostError, match="block of 27 characters, the controller takes 26"):
        write(path, "dialect.block_chars=26")
    assert write(path, "dialect.block_chars=27")


@pytest.mark.parametrize("kind", [Kind.HOME_XY, Kind.HOME_Z])
def test_homing_is_refused(kind: Kind) -> None:
    with pytest.raises(PostError, match="no code to go to machine zero"):
        write(ToolpathBuilder().event(kind).finish())


ARC = b"G00X1Y0Z0\nG03X0Y1Z0"
BAD = {
    "nothing": (b"", "the program is empty"),
    "G1": (b"G1X1Y1Z1", "block 1, line 1, column 1: G1 is not a code"),
    "G04": (b"G00X1Y1Z0\nG04X1Y1Z1", "block 2, line 2, column 1: G04 is not a code"),
    "code behind": (b"X1Y1Z1G00", "column 1: X1 is not a code"),
    "no code": (b"X1Y1Z1", "column 1: X1 is not a code"),
    "feed": (b"G01 X1 Y1 Z1 F100", "column 14: the letter F is no word here"),
    "spindle": (b"M03", "column 1: the letter M is no word here"),
    "block number": (b"N1 G00X1Y1Z1", "the letter N is no word"),
    "percent": (b"%\n", "block 1, line 1, column 1: "),
    "comment": (b"G00X1Y1Z1 (cut)", "column 11: this dialect has no comments"),
    "small letters": (b"g00x1y1z1", "takes no small letters"),
    "comma": (b"G00X1,5Y1Z1", "column 6: a decimal comma"),
    "exponent": (b"G00X1E3Y1Z1", "column 6: the letter E is no word"),
    "no digits": (b"G00XY1Z1", "column 5: no number after X"),
    "cut": (b"G00X1Y1Z", "column 8: no number after Z"),
    "two of X": (b"G00X1Y1Z1X2", "column 10: a second X"),
    "two codes": (b"G00G01X1Y1Z1", "column 4: a second G"),
    "tab": (b"G00\tX1Y1Z1", "a tab"),
    "too long": (b"G00X1Y1Z1." + b"0" * 118, "line 1, column 128: the line has more than 127"),
    "no Z": (b"G00X1Y1", "no Z: it is not known whether the axis then stays"),
    "code alone": (b"G00", "no X: it is not known whether"),
    "Z along": (b"G01X1Y1Z1", "column 8: Z moves along with X or Y"),
    "Z along with an arc": (b"G00X1Y0Z0\nG03X0Y1Z1I-1J0", "Z moves along with an arc"),
    "I on a line": (b"G01X1Y1Z0I1", "column 10: I in a G01"),
    "no I": (ARC + b"J0", "an arc without I"),
    "no J": (ARC + b"I-1", "block 2, line 2, column 1: an arc without J"),
    "no radius": (ARC + b"I0J0", "column 10: an arc about its own start"),
    "radii": (ARC + b"I-1J0.1", "column 10: the radii at the arc's start and end differ"),
    "full circle": (b"G00X1Y0Z0\nG03X1Y0Z0I-1J0", "an arc that ends where it starts"),
    "chord": (b"G00X1Y0Z0\nG03X-1.001Y0Z0I-1J0", "the arc's chord is longer than its diameter"),
    "far": (b"G00X100000Y1Z1", "column 4: a number beyond"),
    "byte": (b"G00X1Y1Z1\n\xc3", "line 2, column 1: the byte 0xc3"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_programs_are_named_with_their_place(name: str) -> None:
    data, message = BAD[name]
    with pytest.raises(ProgramError) as error:
        read(data)
    assert message in str(error.value)


@pytest.mark.parametrize(
    "data",
    [
        b"G 0 1 X 1 . 5 Y 2 Z 0",
        b"G01X1.5Y2Z0\n",
        b"G01 Z0 Y2.0 X+1.50\r\n",
        b"\n\nG01X1.5Y2Z0\n\n",
    ],
)
def test_blanks_and_order_do_not_matter(data: bytes) -> None:
    (move,) = read(data, *ONE)
    assert (move.kind, move.end, move.feed) == (Kind.LINE, (1.5, 2.0, 0.0), 14400.0)


def test_missing_words() -> None:
    data = b"G00X1Y2Z0\nG00X3"
    keep = read(data, *ONE, "dialect.missing_words=keep")
    assert keep.end[1].tolist() == [3.0, 2.0, 0.0]
    zero = read(data, *ONE, "dialect.missing_words=zero")
    assert zero.end[1].tolist() == [3.0, 0.0, 0.0]


@pytest.mark.parametrize(
    ("order", "ends"),
    [
        ("before", [[0.0, 0.0, 3.0], [1.0, 2.0, 3.0]]),
        ("after", [[1.0, 2.0, 0.0], [1.0, 2.0, 3.0]]),
        ("together", [[1.0, 2.0, 3.0]]),
    ],
)
def test_z_along_with_xy(order: str, ends: list[list[float]]) -> None:
    path = read(b"G01X1Y2Z3", *ONE, f"dialect.z_order={order}")
    assert path.end.tolist() == ends
    assert set(path.block.tolist()) == {0}


@pytest.mark.parametrize(("order", "kinds"), [("before", [0, 1, 3]), ("after", [0, 3, 1])])
def test_z_along_with_an_arc(order: str, kinds: list[int]) -> None:
    path = read(b"G00X1Y0Z0\nG03X0Y1Z1I-1J0", *ONE, f"dialect.z_order={order}")
    assert path.kind.tolist() == kinds
    assert path.end[-1].tolist() == [0.0, 1.0, 1.0]


def test_full_circles_if_asked_for() -> None:
    path = read(b"G00X1Y0Z0\nG03X1Y0Z0I-1J0", "dialect.full_circles=whole")
    assert path.sweeps()[1] == pytest.approx(2.0 * math.pi)


def test_half_circles_miss_their_end_by_the_firmware_s_arcsine() -> None:
    """A chord of 1.9998 on a diameter of 2: 2·arcsin(C/2R) is 178.4°, with the end where 180°
    would be; below 90° the arcsine does no harm."""
    path = read(b"G00X1Y0Z0\nG03X-0.9998Y0Z0I-1J0")
    (finding,) = (f for f in path.findings if f.code == ProgramCode.ARC_MISSES_END)
    assert finding.measured == pytest.approx(8.0 * 2.0 * math.acos(0.9999), rel=1e-6)
    assert finding.where == "block 2"
    assert ProgramCode.ARC_MISSES_END not in {f.code for f in read(ARC + b"I-1J0").findings}
    exact = read(b"G00X1Y0Z0\nG03X-1Y0Z0I-1J0")
    assert ProgramCode.ARC_MISSES_END not in {f.code for f in exact.findings}


class TestReferee:
    pytestmark = needs_rs274

    def test_linuxcnc_finds_the_same_moves(self, tmp_path: Path) -> None:
        """The unscaled program is G-code too, but for the feed and the end."""
        data = "\n".join(write(part(14400.0, 14400.0), *ONE)).encode()
        frame = b"G21 G17 G90 G91.1 G94 F14400\n"
        compare(read(data, *ONE), frame + data + b"\nM2\n", tmp_path)
