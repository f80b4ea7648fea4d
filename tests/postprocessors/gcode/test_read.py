"""What the readers of grbl and linuxcnc make of programs, good and bad."""

import functools
import math
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import ProgramError
from camtool.findings import Severity
from camtool.target.registry import load_target
from camtool.toolpath.findings import ProgramCode
from camtool.toolpath.lower import carried_over
from camtool.toolpath.moves import Kind, PathMode, Toolpath
from tests.postprocessors.gcode.parts import part

TARGETS = ("grbl", "linuxcnc")


loaded = functools.cache(lambda name, settings: load_target(name, settings=settings))


def read(data: bytes | str, name: str = "grbl", *settings: str) -> Toolpath:
    target = loaded(name, settings)
    text = data.encode() if isinstance(data, str) else data
    path: Toolpath = target.target.read(text, target.machine)
    return path


def read_part(data: str, name: str, *settings: str) -> Toolpath:
    """The rows of a program without an end, which LinuxCNC wants to be told."""
    path = read(data if name == "grbl" else f"%\n{data}\n%\n", name, *settings)
    assert Kind.END not in path.kind
    return path


def ends(path: Toolpath) -> list[tuple[float, ...]]:
    return [tuple(row) for row in path.end[path.is_motion].tolist()]


@pytest.mark.parametrize("name", TARGETS)
def test_modes_and_modal_words(name: str) -> None:
    path = read(
        "n10 g17 g21 g90 g94 g54 g40 g49\nN20 G0X1 Y2 (go)\nz3 ; up\nG91 X1 Y-1\nG90\n"
        "G20\nG1 X1 F10\nG21 Y.5\nF100.5 Y1\nM30\n",
        name,
    )
    assert ends(path) == [
        (1, 2, 0),
        (1, 2, 3),
        (2, 1, 3),
        (25.4, 1, 3),
        (25.4, 0.5, 3),
        (25.4, 1, 3),
    ]
    assert path.feed[path.is_feed].tolist() == [254.0, 254.0, 100.5]
    assert path.block.tolist() == [1, 2, 3, 6, 7, 8, 9]
    assert path.kind[-1] == Kind.END


def test_grbl_begins_with_rapids_and_linuxcnc_with_nothing() -> None:
    assert read("X1\n").kind.tolist() == [Kind.RAPID]
    with pytest.raises(ProgramError, match="no motion word in force"):
        read("X1\n", "linuxcnc")
    with pytest.raises(ProgramError, match="no motion word in force"):
        read("G80\nX1\n", "grbl")


@pytest.mark.parametrize("name", TARGETS)
def test_arcs_by_centre_and_by_radius(name: str) -> None:
    path = read_part(
        "F60 G0 X10\nG2 X0 Y-10 I-10 J0\nG3 X10 Y0 R10\nG2 X0 Y-10 R-10\nG3 I0 J10 X0 Y-10\n"
        "X0 Y-10 I1\n",
        name,
    )
    centres = [(0, 0), (0, 0), (10, -10), (0, 0), (1, -10)]
    np.testing.assert_allclose(path.centre[path.is_arc], centres, atol=1e-12)
    turns = np.array([-90.0, 90.0, -270.0, 360.0, 360.0])
    np.testing.assert_allclose(path.sweeps()[path.is_arc], np.radians(turns), atol=1e-9)


def test_absolute_centres_are_linuxcnc_s() -> None:
    path = read_part("G90.1 F60 G0 X10 Y1\nG3 X0 Y11 I0 J1\n", "linuxcnc")
    assert path.centre[-1].tolist() == [0.0, 1.0]
    with pytest.raises(ProgramError, match=r"G90\.1 is unknown"):
        read("G90.1", "grbl")
    assert len(read("G91.1\nG0 X1", "grbl")) == 1


def test_events() -> None:
    path = read("M3 S100\nS200\nM4\nM5\nS5\nG4 P.5\nM8\nM9\nM0\nM2", "grbl")
    rows = [(move.kind, move.value) for move in path]
    assert rows == [
        (Kind.SPINDLE_CW, 100.0),
        (Kind.SPINDLE_CW, 200.0),
        (Kind.SPINDLE_CCW, 200.0),
        (Kind.SPINDLE_OFF, None),
        (Kind.DWELL, 0.5),
        *[(Kind.DWELL, 0.0)] * 3,  # coolant that nothing answers to, and M0, stop it too
        (Kind.END, None),
    ]
    assert [(note.code, note.where) for note in path.findings] == [
        (ProgramCode.WORDS_PASSED_OVER, "block 7"),
        (ProgramCode.WORDS_PASSED_OVER, "block 9"),
    ]


def test_tools_and_messages() -> None:
    path = read("T2 M6\n(MSG, swap the vice)\nG0 X1 (msg,also here)\nM2", "linuxcnc")
    assert [(move.kind, move.value) for move in path] == [
        (Kind.TOOL_CHANGE, 2.0),
        (Kind.MESSAGE, 0.0),
        (Kind.MESSAGE, 1.0),
        (Kind.RAPID, None),
        (Kind.END, None),
    ]
    assert path.texts == ("swap the vice", "also here")
    pause = read("T2 M0\nM0\nM2", "grbl", "dialect.tool_change=pause")
    assert pause.kind.tolist() == [Kind.TOOL_CHANGE, Kind.DWELL, Kind.END]
    assert pause.findings[0].where == "block 2"
    with pytest.raises(ProgramError, match="M6 is unknown to grbl"):
        read("T2 M6", "grbl", "dialect.tool_change=pause")


@pytest.mark.parametrize("name", TARGETS)
def test_homing_goes_to_machine_zero(name: str) -> None:
    path = read_part(
        "G0 X1 Y1 Z1\nG53 G0 Z0\nG53 X0 Y0\n", name, "controller.machine_zero_mm=[-5, -6, 7]"
    )
    assert path.kind.tolist() == [Kind.RAPID, Kind.HOME_Z, Kind.HOME_XY]
    assert path.end.tolist() == [[1, 1, 1], [1, 1, 7], [-5, -6, 7]]


@pytest.mark.parametrize("name", TARGETS)
def test_the_work_frame_of_a_program_is_its_part_zero(name: str) -> None:
    assert ends(read_part("G56\nG55 G0 X1\nG55 Y2\n", name)) == [(1, 0, 0), (1, 2, 0)]


def test_lengths_of_tools_leave_the_tip_where_it_is_programmed() -> None:
    path = read("T1 M6\nG0 X1\nG43 Z15. H1\nG49\nM2\n", "linuxcnc")
    assert ends(path) == [(1, 0, 0), (1, 0, 15)]
    with pytest.raises(ProgramError, match="G43 is unknown to grbl"):
        read("G43 Z1")


@pytest.mark.parametrize("name", TARGETS)
def test_helices_are_read_as_such(name: str) -> None:
    path = read_part("F60 G0 X10 Z2\nG3 X10 Y0 Z-2 I-10\nG2 X0 Y10 Z-1 I-10 J0\n", name)
    assert path.kind.tolist() == [Kind.RAPID, Kind.ARC_CCW, Kind.ARC_CW]
    assert path.end.tolist() == [[10, 0, 2], [10, 0, -2], [0, 10, -1]]
    assert path.centre[1:].tolist() == [[0, 0], [0, 0]]
    assert path.sweeps()[1:] == pytest.approx([2.0 * math.pi, -1.5 * math.pi])


def test_a_turn_of_next_to_nothing_is_a_full_circle_to_grbl() -> None:
    path = read("F60 G0 X1000\nG3 X1000 Y0.0004 I-1000\n")
    assert path.kind.tolist() == [Kind.RAPID, Kind.ARC_CCW, Kind.LINE]
    assert path.sweeps()[1] == pytest.approx(2.0 * math.pi)
    assert path.end[2].tolist() == [1000.0, 0.0004, 0.0]
    assert read("F60 G0 X1000\nG3 X1000 Y0.001 I-1000\n").sweeps()[1] == pytest.approx(1e-6)


@pytest.mark.parametrize(
    ("radius", "difference", "fine"),
    [
        (1.0, 0.0049, True),
        (1.0, 0.0051, False),
        (100.0, 0.099, True),
        (100.0, 0.101, False),
        (1500.0, 0.49, True),
        (1500.0, 0.51, False),
    ],
)
def test_the_rule_for_arcs_is_grbl_s(radius: float, difference: float, fine: bool) -> None:
    text = f"F60\nG2 X{2.0 * radius + difference:.6f} Y0 I{radius:.6f} J0\n"
    if fine:
        assert read(text).is_arc[-1]
        return
    with pytest.raises(ProgramError, match="error:33") as caught:
        read(text)
    assert str(caught.value.where).startswith("block 2, line 2, column ")


@pytest.mark.parametrize("name", TARGETS)
def test_feeds_above_the_limit_are_a_finding(name: str) -> None:
    path = read_part("G1 F9999 X1\nF100 X2\nF8888 X3\n", name)
    (finding,) = path.findings
    assert (finding.code, finding.severity) == (ProgramCode.FEED_ABOVE_LIMIT, Severity.WARNING)
    assert path.feed.tolist() == [9999.0, 100.0, 8888.0]  # as programmed
    assert (finding.where, finding.measured) == ("block 1", 9999.0)


BAD = [
    ("G0 X1\nG0 X1,5\n", 2, 6, "decimal comma"),
    ("G0 X\n", 1, 4, "no number after X"),
    ("G0 X1 X2\n", 1, 7, "two X words"),
    ("G0 G1 X1 F1\n", 1, 4, "two G words of one group|that both use the coordinates"),
    ("G1 X1\n", 1, 1, "no feed yet"),
    ("F9 G2 X1 Y1\n", 1, 1, "without I, J or R"),
    ("F9 G2 X0 Y0 R1\n", 1, 13, "by its radius that ends where it starts"),
    ("F9 G2 X5 Y0 R1\n", 1, 13, "more than the radius|less than half the chord"),
    ("F9 G2 X5 I1 J0\n", 1, 10, "radius"),
    ("G0 X1 I1\n", 1, 7, "nothing in the block uses the I word"),
    ("P1\n", 1, 1, "nothing in the block uses the P word"),
    ("G4\n", 1, 1, "a dwell without P"),
    ("G4 P-0.5\n", 1, 4, "a (dwell|time) below 0"),
    ("S-5\n", 1, 1, "a speed below 0"),
    ("M3 M4 S1\n", 1, 4, "two M? ?words of one group"),
    ("M8 M9\n", 1, 4, "two M? ?words of one group"),
    ("G38.2 Z-5\n", 1, 1, "probes"),
    ("G77 X1\n", 1, 1, "(does not know G77|G77 is unknown)"),
    ("G1.5 X1\n", 1, 1, "does not know G1.5|error:23"),
    ("M77\n", 1, 1, "does not know M77|M77 is unknown"),
    ("M3.5 S1\n", 1, 1, "does not know M3.5|error:23"),
    ("G99999999999999999999\n", 1, 1, "does not know G|is unknown"),
    ("$H\n", 1, 1, "a command of the controller"),
]


@pytest.mark.parametrize(("text", "line", "column", "message"), BAD)
@pytest.mark.parametrize("name", TARGETS)
def test_refused(name: str, text: str, line: int, column: int, message: str) -> None:
    refused(name, text, line, column, message)


def refused(name: str, text: str, line: int, column: int, message: str) -> None:
    with pytest.raises(ProgramError, match=message) as caught:
        read(text, name)
    assert caught.value.where == f"block {line}, line {line}, column {column}"


@pytest.mark.parametrize(
    ("text", "line", "column", "message"),
    [
        ("G1 X1 F0\n", 1, 1, r"no feed yet \(error:22\)"),
        ("G1 X1 F-5\n", 1, 7, r"a feed below 0 \(error:4\)"),
        ("F9 G2\n", 1, 1, "error:26"),
        ("F9 G2 Z-1 I-5 J0\n", 1, 1, "error:32"),
        ("F9 G2 X5 Y0 R5 I2\n", 1, 16, "uses the I word .error:36"),
        ("F9 G2 X5 Z1 K3\n", 1, 1, "error:35"),
        ("G18 F9 G2 Y1 K3\n", 1, 1, "error:32"),
        ("G4 P1 K1\n", 1, 7, "uses the K word .error:36"),
        ("G43.1 X1\n", 1, 1, "error:37"),
        ("G43 Z1\n", 1, 1, "G43 is unknown to grbl .error:20"),
        ("G2 G53 X1 I1 F1\n", 1, 4, "error:30"),
        ("G92\n", 1, 1, "error:26"),
        ("G92.2\n", 1, 1, "error:20"),
        ("G10 L2 P7 X1\n", 1, 8, "error:29"),
        ("G10 L1 P1 X1\n", 1, 1, "error:20"),
        ("G10 X1\n", 1, 1, "error:28"),
        ("G28 G0 X1\n", 1, 5, "error:24"),
        ("G80 X1\n", 1, 1, "error:31"),
        ("G93 G1 X1\n", 1, 1, "error:22"),
        ("N10000001 X1\n", 1, 1, "error:27"),
        ("T256\n", 1, 1, "error:38"),
        ("M7\n", 1, 1, "error:20"),
        ("M6 T1\n", 1, 1, "M6 is unknown to grbl .error:20"),
        ("G0 X1.2.3\n", 1, 8, "error:1"),
        ("%\n", 1, 1, "a %, where the letter .* error:1|a %"),
        ("#1=5\n", 1, 1, "a parameter.*error:1"),
        ("G0 X1 (a (b)) Y1\n", 1, 13, "error:1"),
        ("$H\n", 1, 1, "error:3"),
        ("$J=X1\n", 1, 1, "error:22"),
        ("$J=G20 G17 X1 F1\n", 1, 8, "error:16"),
        ("G0 X1.\n" + "X" + "1" * 79, 2, 80, "error:11"),
    ],
)
def test_refused_by_grbl(text: str, line: int, column: int, message: str) -> None:
    refused("grbl", text, line, column, message)


@pytest.mark.parametrize(
    ("text", "line", "column", "message"),
    [
        ("G1 X1 F0\n", 1, 1, "no feed yet"),
        ("G1 X1 F-5\n", 1, 7, "a feed below 0"),
        ("F9 G2\n", 1, 1, "without I, J or R"),
        ("F9 G2 R5\n", 1, 1, "by its radius without X or Y"),
        ("F9 G2 X5 I2.5 K1\n", 1, 15, "K of an arc in the plane"),
        ("G4 P1 X1\n", 1, 1, "no motion word in force"),
        ("G28 G0 X1\n", 1, 5, "two G words that both use the coordinates"),
        ("G53 G2 X1 I1 F1\n", 1, 5, "G53 without G0 or G1"),
        ("G91 G53 G0 X1\n", 1, 9, "G53 with G91"),
        ("G92\n", 1, 1, "G92 without an axis"),
        ("G10 L3 P1\n", 1, 1, "G10 wants L0"),
        ("G10 L2 P10\n", 1, 8, "from 0 to 9"),
        ("M66 P0 L3\n", 1, 1, "without a time Q"),
        ("M101\n", 1, 1, "runs a program of the machine"),
        ("G0 U1\n", 1, 4, "the letter U is no word"),
        ("G71 X1\n", 1, 1, "does not know|a plane other than XZ"),
        ("G41 D5\n", 1, 1, "whose diameter only the tool table knows"),
        ("G41.1 G0 X5\n", 1, 7, "G41.1 without D"),
        ("G95 G1 X1 F1\n", 1, 1, "of a spindle at speed 0"),
        ("G93 G1 X1\n", 1, 1, "inverse time"),
        ("G18 F1 G2 X1 I1 J1\n", 1, 17, "J of an arc"),
        ("G17.1\n", 1, 1, "a plane of U, V and W"),
        ("F9 G5 X1 Y1 I1\n", 1, 4, "both I and J"),
        ("G5.3\n", 1, 1, "G5.3 without G5.2"),
        ("G0 X[1/0]\n", 1, 7, "a division by zero"),
        ("G0 X[1+\n", 1, 8, "no number"),
        ("G0 X#<a>\n", 1, 5, "nobody has set #<a>"),
        ("#5420=1\n", 1, 1, "cannot be set"),
        ("#1\n", 1, 3, "a parameter without ="),
        ("G0 X#<_ini[a]b>\n", 1, 5, "INI file, which only the machine knows"),
        ("G0 X#5061\n", 1, 5, "a result of probing"),
        ("o1 if [1\n", 1, 9, "closing bracket"),
        ("o1 jump\n", 1, 4, "no word of O lines"),
        ("o1 endif\n", 1, 1, "no word with the label"),
        ("o1 call\n", 1, 1, "there is no sub o<1>"),
        ("(abort, stop here)\n", 1, 1, "stops itself: stop here"),
        ("(py,print(1)\n", 1, 1, "nested"),
        ("(py,x=1)\n", 1, 1, "Python of the machine"),
    ],
)
def test_refused_by_linuxcnc(text: str, line: int, column: int, message: str) -> None:
    refused("linuxcnc", text, line, column, message)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("H1", "nothing in the block uses the H word"),
        ("G84 X1 Z-1 R1", "and no feed yet"),
        ("F9 G84 X1 Z-1 R1", "while the spindle stands"),
        ("G33 Z-1 K1", "while the spindle stands"),
        ("M6", "before any T word"),
        ("G90.1 F9\nG2 X1 Y1 I1", "needs both I and J"),
        ("F9 G2 X.001 I.0005", "an arc of radius 0.00050 mm is none"),
        ("G0 X1 (" + "a" * 250 + ")", "more than 252 characters"),
        ("F9 G2 X1 I1 P0", "a whole number from 1"),
        ("F9 G2 X1 I1 P1.5", "a whole number from 1"),
        ("F9 G2 X2 I1 P99999", "an arc of more than 10000 turns"),
        ("G0 X1 P2", "uses the P word"),
        ("G0 X1\n%\n", "frames no program"),
        ("(c)\n%\nG0 X1\nM2\n%\n", "frames no program"),
        ("% foo\nG0 X1\n%\n", "frames no program"),
        ("%\nG0 X1\n% foo\nM2", "frames no program"),
    ],
)
def test_linuxcnc_refuses(text: str, message: str) -> None:
    with pytest.raises(ProgramError, match=message):
        read(text, "linuxcnc")


@pytest.mark.parametrize("text", ["G0 X1\nX2", "%\nG0 X1\nX2\n", "G0 X1\nX2\n(c)\n\n"])
def test_linuxcnc_reads_what_has_no_end_and_says_so(text: str) -> None:
    path = read(text, "linuxcnc")
    assert ends(path) == [(1.0, 0.0, 0.0), (2.0, 0.0, 0.0)]
    errors = [each for each in path.findings if each.severity is Severity.ERROR]
    assert [each.code.name for each in errors] == ["linuxcnc.NO_END"]
    assert read_part("G0 X1\nX2", "linuxcnc").findings == ()
    with pytest.raises(ProgramError, match="the program is empty"):
        read("%\n\n", "linuxcnc")


def test_grbl_stops_at_its_end_and_drops_comments() -> None:
    with pytest.raises(ProgramError, match="a block after the end"):
        read("M2\nG0 X1\n")
    assert len(read("G0 X1 (" + "a" * 200 + ")" + " " * 100)) == 1  # dropped as it comes in
    assert ends(read("G0 X1 (never closed\nG0 Y2 ( ; ) Z3\n")) == [(1, 0, 0), (1, 2, 3)]


@pytest.mark.parametrize("data", [b"", b"\n\n", b"(nothing)\n; at all"])
@pytest.mark.parametrize("name", TARGETS)
def test_an_empty_program_is_an_error(name: str, data: bytes) -> None:
    with pytest.raises(ProgramError, match="the program is empty"):
        read(data, name)


@pytest.mark.parametrize("end", ["\r\n", "\r", "\n\n", "\r\n\r"])
@pytest.mark.parametrize("name", TARGETS)
def test_line_ends_of_any_system(name: str, end: str) -> None:
    assert ends(read(f"G0 X1{end}Y2{end}Z3{end}M2", name)) == [(1, 0, 0), (1, 2, 0), (1, 2, 3)]


def program(name: str) -> bytes:
    target = load_target(name)
    data: bytes = target.target.write(part(tools=name == "linuxcnc"), target.machine).data
    return data


def outcome(data: bytes, name: str) -> str:
    """ "read", or where the reader stopped; anything but a ProgramError escapes."""
    try:
        read(data, name)
    except ProgramError as error:
        return str(error.where or error)
    return "read"


@pytest.mark.parametrize("name", TARGETS)
def test_a_program_cut_anywhere_is_read_or_refused_at_its_last_line(name: str) -> None:
    whole = program(name)
    outcomes = [outcome(whole[:at], name) for at in range(len(whole))]
    lines = [len(whole[:at].splitlines()) for at in range(len(whole))]
    stopped = [
        (re.findall(r"line (\d+)", where), line)
        for where, line in zip(outcomes, lines, strict=True)
        if "line" in where
    ]
    assert "read" in outcomes
    assert len(stopped) > 50
    assert all(found == [str(line)] for found, line in stopped)


@pytest.mark.parametrize("name", TARGETS)
@given(data=st.data())
def test_a_damaged_program_is_read_or_refused(name: str, data: st.DataObject) -> None:
    whole = bytearray(program(name))
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(whole) - 1))
        damage = data.draw(st.sampled_from(["change", "remove", "insert", "swap"]))
        if damage == "change":
            whole[at] = data.draw(st.integers(0, 255))
        elif damage == "remove":
            del whole[at]
        elif damage == "insert":
            whole[at:at] = data.draw(st.sampled_from([b"G", b"X", b"\n", b",", b"-", b"9", b"("]))
        else:
            whole[at:] = whole[at:][::-1]
    assert outcome(bytes(whole), name)


WORDS = ["G0", "G1", "G2", "G3", "G4", "G20", "G21", "G53", "G90", "G91", "M3", "M5", "M2", "X1"]
MORE = ["Y-2.5", "Z.5", "I1", "J-1", "R2", "F100", "S9", "T1", "P1", "K1", "X0", "Y0", "(a)", ";"]


@pytest.mark.parametrize("name", TARGETS)
@given(words=st.lists(st.sampled_from([*WORDS, *MORE, "\n", "\n", "\n"]), max_size=40))
def test_words_in_any_order_are_read_or_refused(name: str, words: list[str]) -> None:
    assert outcome(" ".join(words).encode(), name)


@pytest.mark.parametrize("name", TARGETS)
@given(data=st.binary(max_size=100))
def test_noise_is_read_or_refused(name: str, data: bytes) -> None:
    assert outcome(data, name)


@pytest.mark.parametrize("name", TARGETS)
def test_ten_megabytes_on_one_line_are_refused(name: str) -> None:
    assert outcome(b"G0 X1 Y1 " * 1_200_000, name).startswith("block 1, line 1, column")


def test_foreign_signs_stand_in_comments_of_linuxcnc_alone() -> None:
    text = "G21 G0 X1 (größer)\nM2\n".encode()
    linuxcnc, grbl = load_target("linuxcnc"), load_target("grbl")
    assert linuxcnc.target.read(text, linuxcnc.machine).end[0, 0] == 1.0
    # grbl takes bytes above 7F for commands wherever they stand.
    with pytest.raises(ProgramError, match="0xc3 belongs to no program"):
        grbl.target.read(text, grbl.machine)
    for outside in ("G0 Xß1\n", "G0 X1ß\n", "Gß0\n", "µ\n", "\x85G0 X1\n"):
        with pytest.raises(ProgramError) as caught:
            linuxcnc.target.read(outside.encode(), linuxcnc.machine)
        assert "line 1, column" in str(caught.value.where)


def test_a_circle_may_say_its_centre_alone_in_linuxcnc() -> None:
    text = b"G21 F100 G0 X1\nG3 I2\nM2\n"
    linuxcnc, grbl = load_target("linuxcnc"), load_target("grbl")
    path = linuxcnc.target.read(text, linuxcnc.machine)
    assert path.centre[1].tolist() == [3.0, 0.0]
    assert path.sweeps()[1] == pytest.approx(6.283185307)
    with pytest.raises(ProgramError, match="an arc without coordinates"):
        grbl.target.read(text, grbl.machine)
    for bad in (b"G21 F100 G3 R2\nM2\n", b"G21 F100 G3\nM2\n", b"G21 F100 G1 I2\nM2\n"):
        with pytest.raises(ProgramError):
            linuxcnc.target.read(bad, linuxcnc.machine)


@pytest.mark.parametrize(
    ("said", "mode"),
    [
        ("G64 P0.01", PathMode("blend", 0.01, 0.01)),
        ("G64 P0.01 Q0", PathMode("blend", 0.01, 0.0)),
        ("G64 P0.01 Q-1", PathMode("blend", 0.01, 0.01)),
        ("G64 Q0.3", PathMode("blend", 0.0, 0.3)),
        ("G64", PathMode("blend", 0.0, 0.0)),
        ("G64 P-1", PathMode("blend", 0.0, 0.0)),
        ("G20 G64 P0.5", PathMode("blend", 12.7, 12.7)),
        ("G61", PathMode("exact-path")),
        ("G61.1", PathMode("exact-stop")),
    ],
)
def test_the_program_says_how_corners_are_met(said: str, mode: PathMode) -> None:
    """As `rs274 -g` prints them (SET_MOTION_CONTROL_MODE, SET_NAIVECAM_TOLERANCE)."""
    path = read(f"G0 X1\n{said} X2\nX3\nG4 P1\nM2\n", "linuxcnc")
    assert path.modes == (mode,)
    assert path.mode.tolist() == [-1, 0, 0, 0, 0]
    assert path.findings == ()
    assert read("G61 G0 X1\nM2\n", "grbl").modes == ()


def test_path_modes_are_written_where_they_change() -> None:
    text = (
        "G0 Z1\nG61\nX1\nG64 P0.25 Q0.5\nG1 X2 F9\nG64 P0.25\nG4 P1\nY2\nG64\nX5\nG61.1\nX0\nM2\n"
    )
    path = read(text, "linuxcnc")
    target = loaded("linuxcnc", ())
    program = target.target.write(carried_over(path), target.machine)
    again = target.target.read(program.data, target.machine)
    moves, wanted = again.is_motion, path.is_motion
    assert [again.modes[k] for k in again.mode[moves][1:]] == [
        path.modes[k] for k in path.mode[wanted][1:]
    ]
    assert again.modes[again.mode[moves][0]] == PathMode("blend", 0.01, 0.01)
    said = [line for line in program.data.decode().splitlines() if line.startswith("G6")]
    assert said == ["G64 P0.01", "G61", "G64 P0.25 Q0.5", "G64 P0.25", "G64", "G61.1"]
    grbl = loaded("grbl", ())
    assert b"G6" not in grbl.target.write(carried_over(path), grbl.machine).data


@pytest.mark.parametrize("name", TARGETS)
def test_a_spindle_may_start_before_its_speed_is_said(name: str) -> None:
    """As Gcodetools writes it; the new program says no speed either."""
    path = read("M3\nG0 X1\nS500\nM5\nM2\n", name)
    starts = [(move.kind, move.value) for move in path if not path.is_motion[move.index]]
    assert starts == [
        (Kind.SPINDLE_CW, None),
        (Kind.SPINDLE_CW, 500.0),
        (Kind.SPINDLE_OFF, None),
        (Kind.END, None),
    ]
    found = [(one.code, one.severity, one.where) for one in path.findings]
    assert found == [(ProgramCode.SPINDLE_SPEED_NOT_SAID, Severity.WARNING, "block 1")]
    for other in (*TARGETS, "valcnc"):
        target = loaded(other, ())
        text = target.target.write(carried_over(path), target.machine).data.decode()
        assert ("M3\n" in text) == (other != "valcnc")
        assert "nan" not in text


def test_g94_forgets_the_feed_on_linuxcnc() -> None:
    text = "G21 F100\nG94 G1 X1\nM2\n"
    assert read(text, "grbl").feed[0] == 100.0
    with pytest.raises(ProgramError, match="no feed yet"):
        read(text, "linuxcnc")


def test_a_feed_beside_a_change_of_units_is_in_the_controller_s_own_order() -> None:
    """LinuxCNC sets the feed before the units, grbl after them."""
    text = "G21 G0 X0\nG20 F10 G1 X1\nM2\n"
    assert read(text, "linuxcnc").feed[1] == 10.0
    assert read(text, "grbl").feed[1] == 254.0


@pytest.mark.parametrize(
    ("block", "ccw", "whole", "sweep", "ends_at"),
    [
        ("G2 I5 J0 P3 Z-3", False, 2, 2.0 * math.pi, [(0, 0, -1), (0, 0, -2), (0, 0, -3)]),
        ("G3 X10 Y0 I5 P2 Z3", True, 1, math.pi, [(0, 0, 2), (10, 0, 3)]),
        ("G2 X10 Y0 R5 P2", False, 1, math.pi, [(0, 0, 0), (10, 0, 0)]),
        ("G2 X0 Y0 I5 P1", False, 0, 2.0 * math.pi, [(0, 0, 0)]),
        ("G3 X10 Y0 I5 P2.0009", True, 1, math.pi, [(0, 0, 0), (10, 0, 0)]),
    ],
)
def test_p_tells_the_turns_of_an_arc(
    block: str, ccw: bool, whole: int, sweep: float, ends_at: list[tuple[float, ...]]
) -> None:
    path = read(f"F60\n{block}\nG0 Z5\nM2\n", "linuxcnc")
    sweeps = np.array([2.0 * math.pi] * whole + [sweep]) * (1.0 if ccw else -1.0)
    assert path.sweeps()[path.is_arc] == pytest.approx(sweeps)
    assert np.array(ends(path)[:-1]) == pytest.approx(np.array(ends_at, dtype=float))
    assert set(path.block[path.is_arc].tolist()) == {1}


@pytest.mark.parametrize(
    ("text", "behind"),
    [
        ("%\nG0 X1\n%\n", None),
        ("\n \n  % \nG0 X1\n %\t\n\n", None),
        ("%\nG0 X1\n%\nG0 X3\nM2\n", ("line 4", 2.0)),
        ("%\nG0 X1\nM2\n%\n", None),
        ("G0 X1\nM2\n%\n(end)\n", None),
        ("G0 X1\nM2\nG0 X2\n\nwhatever [#1\n", ("line 3", 2.0)),
        ("N1.5 G8 G0 X1\nN2 M30\n", None),
    ],
)
def test_where_a_program_of_linuxcnc_ends(text: str, behind: tuple[str, float] | None) -> None:
    path = read(text, "linuxcnc")
    assert ends(path) == [(1, 0, 0)]
    found = [
        (one.where, one.measured) for one in path.findings if one.code == ProgramCode.NEVER_READ
    ]
    assert found == ([behind] if behind else [])
