"""What the pic-mmh reader makes of programs, good and bad."""

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from camtool.errors import ProgramError
from camtool.findings import Severity
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.findings import ProgramCode
from camtool.toolpath.moves import Kind, Move, Toolpath

pytestmark = pytest.mark.checked

THESIS = b"G02X02969.00Y03400.00I03012.00J03040.00F08;"
ANNEX = b"G02X+02969Y+03400I+03012J+03040F08;"


def read(data: bytes, *settings: str) -> Toolpath:
    target = load_target("pic-mmh", settings=settings)
    path: Toolpath = target.target.read(data, target.machine)
    return path


@pytest.mark.parametrize(("data", "form"), [(THESIS, "example"), (ANNEX, "annex")])
def test_the_block_of_the_thesis_is_its_arc(data: bytes, form: str) -> None:
    (move,) = read(data, f"dialect.form={form}")
    assert move == Move(
        index=0,
        kind=Kind.ARC_CW,
        start=(0.0, 0.0, 0.0),
        end=(2.969, 3.4, 0.0),
        centre=(3.012, 3.04),
        feed=0.8,
        value=None,
        source="",
        block=0,
    )


def test_every_code() -> None:
    settings = "controller.machine_zero_mm=[-1.0, -2.0, 3.0]"
    path = read(
        b"G54;G90; \r\n\tM06T07;M03S1200;M04S0001;M05;G04P99;G00Z00200.00;"
        b"G00X01000.00Y-02000.50;G01Z-00000.14F01;G01X00000.00Y-00000.00F13;"
        b"G02X00001.00Y00001.00I00000.50J00000.50F08;G03X00000.00Y00000.00I00000.50J00000.50F08;"
        b"G28Z0;G28X0Y0;M30;\n",
        settings,
    )
    rows = [(move.kind.name, move.value, move.feed, move.end, move.block) for move in path]
    zero, low = (0.0, 0.0, 0.0), -0.00014
    assert rows == [
        ("SET_ZERO", None, None, zero, 0),
        ("TOOL_CHANGE", 7, None, zero, 2),
        ("SPINDLE_CW", 1200, None, zero, 3),
        ("SPINDLE_CCW", 1, None, zero, 4),
        ("SPINDLE_OFF", None, None, zero, 5),
        ("DWELL", 99, None, zero, 6),
        ("RAPID", None, None, (0.0, 0.0, 0.2), 7),
        ("RAPID", None, None, (1.0, -2.0005, 0.2), 8),
        ("LINE", None, 0.1, (1.0, -2.0005, low), 9),
        ("LINE", None, 1.3, (0.0, 0.0, low), 10),
        ("ARC_CW", None, 0.8, (0.001, 0.001, low), 11),
        ("ARC_CCW", None, 0.8, (0.0, 0.0, low), 12),
        ("HOME_Z", None, None, (0.0, 0.0, 3.0), 13),
        ("HOME_XY", None, None, (-1.0, -2.0, 3.0), 14),
        ("END", None, None, (-1.0, -2.0, 3.0), 15),
    ]
    assert not np.signbit(path.end[9, 1])  # -00000.00 is 0


def test_a_program_needs_no_header_and_no_end() -> None:
    (move,) = read(b"G00X00001.00Y00002.00;")
    assert (move.kind, move.end) == (Kind.RAPID, (0.001, 0.002, 0.0))
    assert len(read(b"G90;")) == 0


BAD = {
    "nothing": (b"", "the program is empty"),
    "blanks": (b" \r\n\t", "the program is empty"),
    "no end": (b"G90;\nG54", "block 2, column 3: the program breaks off"),
    "cut": (THESIS[:-2], "block 1, column 41: the program breaks off"),
    "empty block": (b"G90;;", "block 2, column 1: an empty block"),
    "after the end": (b"M30;G90;", "block 2, column 1: a block after M30"),
    "small letters": (b"g90;", "column 1: this controller takes no small letters"),
    "a small word": (b"G01x00001.00Y00001.00F08;", "column 4: this controller takes no small"),
    "block number": (b"G90;N01G90;", "block 2, column 1: 'N01G90' is no block"),
    "comment": (b"(LOGO);", "neither G nor M"),
    "percent": (b"%\nG90;", "neither G nor M"),
    "no digits": (b"GX;", "column 2: 'GX': wanted two digits"),
    "one digit": (b"G1X00001.00Y00001.00F08;", "column 2"),
    "unknown G": (b"G91;", "does not know G91; it knows G00 G01"),
    "unknown M": (b"M02;", "does not know M02"),
    "two codes": (b"G90G54;", "column 4: 'G90G54': wanted ; after the last word of G90"),
    "short number": (b"G00X0001.00Y00001.00;", "column 5"),
    "one decimal": (b"G00X00001.00Y00001.0;", "column 14: 'G00X00001.00Y00001.0': wanted Y with"),
    "three decimals": (b"G00X00001.000Y00001.00;", "column 13"),
    "no decimals": (b"G00X00001Y00001;", "column 5"),
    "plus and minus": (b"G00X+-00001.00Y00001.00;", "column 5"),
    "two signs": (b"G00X--0001.00Y00001.00;", "column 5"),
    "blank inside": (b"G00X00001.00 Y00001.00;", "column 13"),
    "line end inside": (b"G00X00001.00\nY00001.00;", "column 13"),
    "no Y": (b"G00X00001.00;", "column 13: 'G00X00001.00': wanted Y"),
    "Y first": (b"G00Y00001.00X00001.00;", "column 4"),
    "Z with XY": (b"G00X00001.00Y00001.00Z00001.00;", "column 22: "),
    "no feed": (
        b"G01X00001.00Y00001.00;",
        "column 22: 'G01X00001.00Y00001.00': wanted F with two",
    ),
    "feed on a rapid": (b"G00X00001.00Y00001.00F08;", "column 22"),
    "feed of three": (b"G01X00001.00Y00001.00F108;", "column 25"),
    "F00": (b"G01X00001.00Y00001.00F00;", "column 23: the controller divides by the feed"),
    "no centre": (b"G02X00001.00Y00001.00F08;", "column 22: 'G02X00001.00Y00001.00F08': wanted I"),
    "half a centre": (b"G02X00001.00Y00001.00I00000.00F08;", "column 31"),
    "home X alone": (b"G28X0;", "column 6"),
    "home elsewhere": (b"G28X1Y0;", "column 5: 'G28X1Y0': wanted X with the digit 0"),
    "spindle of three": (b"M03S100;", "column 5: 'M03S100': wanted S with four digits"),
    "other form": (ANNEX, "is in the annex form; use --set dialect.form=annex"),
    "part zero later": (b"G00Z00001.00;G54;", "block 2, column 1: G54 away from part zero"),
    "NUL": (b"G90;\n G9\x000;", "block 2, column 3: the byte 0x00"),
    "not ASCII": ("G90;µ".encode(), "block 2, column 1: the byte 0xc2"),
    "escape": (b"\x1b[31mG90;", "block 1, column 1: the byte 0x1b"),
}
BAD |= {
    f"interactive {text}": (
        f"G90;{text};".encode(),
        f"column 1: '{text}' is an interactive command",
    )
    for text in ["A", "H", "Q", "W", "V", "JX+", "&X+Y-", "&X+Y-Z+", "PX+0014", "BX200", "FX+250"]
}


@pytest.mark.parametrize("name", BAD)
def test_errors_name_block_and_column(name: str) -> None:
    data, message = BAD[name]
    with pytest.raises(ProgramError) as caught:
        read(data)
    assert message in str(caught.value)
    assert len(str(caught.value)) < 250
    assert str(caught.value).isprintable()


@pytest.mark.parametrize("data", [b"G00X00001.00Y00001.00;", b"G01Z-00001.00F08;"])
def test_the_annex_form_takes_no_example_and_says_so(data: bytes) -> None:
    with pytest.raises(ProgramError, match=r"use --set dialect\.form=example"):
        read(data, "dialect.form=annex")


@pytest.mark.parametrize(
    "data",
    [
        b"G" * 10_000_000,
        b"G01X" + b"0" * 10_000_000 + b";",
        b";" * 10_000_000,
        b"G90;" + b" " * 10_000_000 + b"x",
        b"\xff" * 10_000_000,
        b"G90" * 3_000_000 + b"\x00",
    ],
    ids=range(6),
)
def test_ten_megabytes_of_nothing_are_refused_shortly(data: bytes) -> None:
    with pytest.raises(ProgramError) as caught:
        read(data)
    assert len(str(caught.value)) < 250


def test_a_plus_is_no_other_sense_than_none() -> None:
    signed = read(b"G01X+00100.00Y-00001.50F08;G00X00002.00Y+00003.00;")
    plain = read(b"G01X00100.00Y-00001.50F08;G00X00002.00Y00003.00;")
    np.testing.assert_array_equal(signed.end, plain.end)


def test_a_feed_above_the_link_is_decoded_and_found() -> None:
    path = read(b"G01X00001.00Y00001.00F13;G01X00002.00Y00001.00F14;G01X00003.00Y00001.00F99;")
    (finding,) = path.findings
    assert (finding.code, finding.severity) == (ProgramCode.FEED_ABOVE_LIMIT, Severity.WARNING)
    assert finding.where == "block 2"
    assert finding.measured == 9.9
    assert finding.limit == pytest.approx(1.3944)
    assert path.feed.tolist() == [1.3, 1.4, 9.9]


def test_long_blocks_are_one_finding() -> None:
    (finding,) = read(b"G90;" + THESIS + THESIS, "dialect.buffer_chars=35").findings
    assert (finding.code, finding.severity) == (ProgramCode.BLOCK_TOO_LONG, Severity.WARNING)
    assert (finding.measured, finding.limit, finding.where) == (43.0, 35.0, "block 2")
    assert "2 blocks" in finding.message
    assert read(b"G90;" + THESIS + THESIS).findings == ()
    assert read(ANNEX, "dialect.form=annex").findings == ()


# --- Whatever comes in: a toolpath or a clean error -----------------------------------------

VALID = (
    b"G54;\nG90;\nM03S1200;\nG04P02;\nG00Z00200.00;\nG00X02926.00Y03400.00;\nG01Z-00020.00F08;\n"
    + THESIS
    + b"\nG01X00000.00Y-00001.50F13;\nG28Z0;\nG28X0Y0;\nM05;\nM30;\n"
)


def reads_or_says_why(data: bytes) -> None:
    for form in ("example", "annex"):
        text = ""
        try:
            assert np.isfinite(read(data, f"dialect.form={form}").end).all()
        except ProgramError as error:
            text = str(error)
        assert text.isprintable()


@given(st.binary(max_size=200))
def test_any_bytes(data: bytes) -> None:
    reads_or_says_why(data)


@given(st.text("GMXYZIJFPST0123456789.+-; \n", max_size=120))
def test_any_words(text: str) -> None:
    reads_or_says_why(text.encode())


@given(st.integers(0, len(VALID)))
def test_any_part(length: int) -> None:
    reads_or_says_why(VALID[:length])
    reads_or_says_why(VALID[length:])


@given(
    st.lists(
        st.tuples(st.integers(0, len(VALID) - 1), st.binary(max_size=3), st.integers(0, 3)),
        min_size=1,
        max_size=4,
    )
)
def test_any_change(changes: list[tuple[int, bytes, int]]) -> None:
    data = VALID
    for at, put, removed in changes:
        data = data[:at] + put + data[at + removed :]
    reads_or_says_why(data)


# --- read(write(t)) == t ----------------------------------------------------------------------

hundredths = st.integers(-400_000, 400_000).filter(lambda number: number % 14 != 7)
feeds = st.integers(1, 13)


@given(st.lists(st.tuples(hundredths, hundredths, hundredths, feeds), max_size=20))
def test_lines_that_the_dialect_can_say_come_back_equal(
    rows: list[tuple[int, int, int, int]],
) -> None:
    path = ToolpathBuilder().event(Kind.SET_ZERO)
    for x, y, z, feed in rows:
        here = [round(value * 1e5) for value in path.position]
        if max(abs(x - here[0]), abs(y - here[1])) > 14:
            path.line(x / 1e5, y / 1e5, feed=feed / 10)
        if abs(z - here[2]) > 14:
            path.rapid(z=z / 1e5)
    wanted = path.event(Kind.END).finish()
    target = load_target("pic-mmh")
    program = target.target.write(wanted, target.machine)
    back = target.target.read(program.data, target.machine)
    for name in ("kind", "end", "centre", "feed", "value"):
        np.testing.assert_array_equal(getattr(back, name), getattr(wanted, name))
    np.testing.assert_array_equal(program.row_of_block[back.block], np.arange(len(wanted)))
    # and what was read is written as it was
    assert target.target.write(back, target.machine).data == program.data


coordinates = st.floats(-4.0, 4.0)
angles = st.floats(-math.pi, math.pi)
moves = st.lists(
    st.one_of(
        st.tuples(st.just("line"), coordinates, coordinates),
        st.tuples(st.just("rapid"), coordinates, coordinates),
        st.tuples(st.just("up"), coordinates, coordinates),
        st.tuples(st.just("arc"), angles, st.floats(-6.2, 6.2)),
        st.tuples(st.just("circle"), angles, st.sampled_from([-1.0, 1.0])),
    ),
    max_size=8,
)


def built(rows: list[tuple[str, float, float]], radius: float) -> Toolpath:
    path = ToolpathBuilder()
    for what, first, second in rows:
        x, y, _ = path.position
        cx, cy = x - radius * math.cos(first), y - radius * math.sin(first)
        to = first + second
        if what == "line":
            path.line(first, second, feed=0.5)
        elif what == "rapid":
            path.rapid(first, second)
        elif what == "up":
            path.rapid(z=first)
        elif what == "circle":
            path.arc(x, y, centre=(cx, cy), ccw=second > 0.0, feed=1.0)
        else:
            end = (cx + radius * math.cos(to), cy + radius * math.sin(to))
            path.arc(*end, centre=(cx, cy), ccw=second > 0.0, feed=1.0)
    return path.finish()


@given(moves, st.floats(math.log(0.001), math.log(1.0)), st.sampled_from(["example", "annex"]))
@example(rows=[("arc", -0.875, 4.0)], log_radius=-5.0, form="annex")  # lacks more than half a turn
def test_what_was_written_is_read_to_the_dialects_resolution(
    rows: list[tuple[str, float, float]], log_radius: float, form: str
) -> None:
    wanted = built(rows, math.exp(log_radius))
    target = load_target("pic-mmh", settings=[f"dialect.form={form}"])
    program = target.target.write(wanted, target.machine)
    back = target.target.read(program.data, target.machine)
    # half a unit of the form, one unit more where that would lie between two steps
    unit_mm, step_mm = (0.000015 if form == "example" else 0.0005), 0.00014
    row_of = program.row_of_block[back.block]
    for row, move in enumerate(wanted):
        mine = np.flatnonzero(row_of == row)
        if not len(mine):  # of no step
            continue
        # A row that moves Z alone, behind one of no step, leaves X and Y where that one left them.
        stays = (back.end[mine[-1], :2] == back.starts[mine[0], :2]).all()
        within = max(unit_mm, step_mm) if stays else unit_mm
        assert np.abs(back.end[mine[-1]] - move.end).max() <= within + 1e-9
        if move.kind <= Kind.LINE:
            assert set(back.kind[mine]) == {move.kind}
        elif back.is_arc[mine[0]]:
            assert back.kind[mine[0]] == move.kind
            assert np.abs(back.centre[mine[0]] - move.centre).max() <= unit_mm + 1e-9
            turned = back.sweeps()[mine[0]]
            wanted_turn = wanted.sweeps()[row]
            radius = math.dist(move.end[:2], move.centre or (0.0, 0.0))
            chord = math.hypot(*(back.end[mine[-1], :2] - back.end[mine[0], :2]))
            # What an arc lacks is a chord: of up to half a turn, or of more.
            lost = chord * math.pi / 2.0
            if abs(wanted_turn) > math.pi:
                lost = max(lost, 2.0 * math.pi * radius - chord)
            assert abs(turned - wanted_turn) * radius <= lost + 4.0 * (unit_mm + step_mm)
        assert np.isnan(back.feed[mine]).all() == (move.kind == Kind.RAPID)
