"""How programs of the Matlab router are read, and what is no program."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import ProgramError
from camtool.findings import Severity
from camtool.toolpath.findings import ProgramCode
from camtool.toolpath.moves import Kind, Toolpath
from tests.postprocessors.matlab_router.parts import STAR, cut_points, posted, router, strokes
from tests.waiting import no_chewing

SQUARE = b"""%% job 1 of 1: 2 lines
xy = [
  100   140   140
  100   100   200
];
lxy = [
   40     0
    0   100
];
velxy = [
  480     0
    0   480
];
size_of_array = 2;
first_pointx = 100;
first_pointy = 100;
"""


def read(data: bytes, *settings: str) -> Toolpath:
    target = router(*settings)
    return target.target.read(data, target.machine)  # type: ignore[no-any-return]


def test_a_job_as_the_machine_runs_it() -> None:
    path = read(SQUARE)
    rows = [(move.kind.name, move.end, move.block) for move in path]
    assert rows == [
        ("RAPID", (0.0, 0.0, 9.0), 0),
        ("RAPID", (10.0, 0.0, 9.0), 0),
        ("RAPID", (10.0, 10.0, 9.0), 0),
        ("LINE", (10.0, 10.0, -1.0), 0),
        ("LINE", (14.0, 10.0, -1.0), 1),
        ("LINE", (14.0, 20.0, -1.0), 2),
        ("END", (14.0, 20.0, -1.0), 2),
    ]
    assert path.feed[3:6].tolist() == pytest.approx([234.375, 225.0, 225.0])
    assert path.findings == ()


def test_the_tool_is_raised_and_sent_home_in_the_text() -> None:
    path = read(SQUARE, "profile=text")
    assert [(move.kind.name, move.end) for move in path][-4:] == [
        ("RAPID", (14.0, 20.0, 9.0)),
        ("RAPID", (0.0, 20.0, 9.0)),
        ("RAPID", (0.0, 0.0, 9.0)),
        ("END", (0.0, 0.0, 9.0)),
    ]


def test_between_jobs_the_machine_goes_home() -> None:
    data = SQUARE + SQUARE.replace(b"100", b"200").replace(b"140", b"240")
    data = data.replace(
        b"  200   240   240\n  200   200   200", b"  200   240   240\n  200   200   400"
    )
    path = read(data)
    places = [move.end for move in path if move.kind == Kind.RAPID]
    assert places[3:] == [
        (14.0, 20.0, 9.0),
        (0.0, 20.0, 9.0),
        (0.0, 0.0, 9.0),
        (20.0, 0.0, 9.0),
        (20.0, 20.0, 9.0),
    ]
    assert path.block[-1] == 5


def test_the_tool_is_switched_where_its_speed_is_known() -> None:
    kinds = [move.kind.name for move in read(SQUARE, "spindle_rpm=12000")]
    assert kinds == [*["RAPID"] * 3, "LINE", "SPINDLE_CW", "LINE", "LINE", "SPINDLE_OFF", "END"]


def test_odd_distances_are_cut_short() -> None:
    """The drift of the star, in 0.1 mm, by which each vertex is off the one that was sent."""
    target = router("grid_mm=0.1", "bend_tolerance_mm=9")
    path = target.target.read(posted("star.csv", target), target.machine)
    (points,) = cut_points(path)
    drift = np.rint(np.array(points) * 10).astype(int) - np.array(STAR)
    assert (drift[:, 0] + 1).tolist() == [0, -1, -1, 0, 0, 0, 1, 1, 1, 1, 2]
    assert drift[:, 1].tolist() == [0, -1, 0, -1, -1, -2, -3, -3, -3, -2, -2]
    (finding,) = path.findings
    assert (finding.code, finding.severity) == (ProgramCode.EXECUTED_OTHERWISE, Severity.WARNING)
    assert finding.measured == pytest.approx(0.3)


def test_the_listed_master_begins_at_20_mm() -> None:
    target = router("profile=listing", "format=stream")
    path = target.target.read(posted("star.csv", target), target.machine)
    assert cut_points(path)[0][0] == (15.0, 20.0)
    assert any("begin at Y 20 mm" in finding.message for finding in path.findings)


def test_speeds_that_bend_a_line_are_seen() -> None:
    data = SQUARE.replace(
        b"  100   140   140\n  100   100   200", b"  100   140   140\n  100   200   300"
    )
    data = data.replace(b"    0   100", b"  100   100").replace(b"    0   480", b"  480   480")
    path = read(data)
    assert cut_points(path) == [[(10.0, 10.0), (14.0, 14.0), (14.0, 20.0), (14.0, 30.0)]]
    assert path.block.tolist()[-4:] == [1, 1, 2, 2]
    assert path.feed[-4] == pytest.approx(225.0 * np.sqrt(2.0))
    assert path.feed[-3] == pytest.approx(225.0)
    assert [f.where for f in path.findings] == ["job 1, line 1"]


def test_limits_are_findings() -> None:
    outside = read(SQUARE.replace(b"140", b"2140").replace(b" 40 ", b"2040 "))
    assert [(f.code, f.severity) for f in outside.findings] == [
        (ProgramCode.OUT_OF_TRAVEL, Severity.ERROR)
    ]
    fast = read(SQUARE.replace(b"480     0", b"481     0"))
    assert [(f.code, f.where) for f in fast.findings] == [
        (ProgramCode.FEED_ABOVE_LIMIT, "job 1, line 1")
    ]


def test_a_line_of_no_length_is_passed_over() -> None:
    data = SQUARE.replace(b"   100   200", b"   100   100").replace(b"    0   100", b"    0     0")
    path = read(data)
    assert cut_points(path) == [[(10.0, 10.0), (14.0, 10.0)]]
    assert [f.code for f in path.findings] == [ProgramCode.MOVE_COLLAPSED]


FORMS = [
    SQUARE.replace(b"\n", b"\r\n"),
    SQUARE.replace(b";\n", b" % remark\n"),
    SQUARE.replace(b"480     0", b"+480,\t-0"),
    SQUARE.replace(b"\n  100   100", b";100 100"),
    SQUARE.replace(b"\n", b"\n \t\n").replace(b" \t\n]", b" , \n\n]"),
    SQUARE + b"% the end",
    SQUARE.strip(),
]


@pytest.mark.parametrize("data", FORMS)
def test_other_ways_to_write_it(data: bytes) -> None:
    assert cut_points(read(data)) == cut_points(read(SQUARE))


BAD_TEXT = {
    "empty": (b"", "the program is empty"),
    "only a comment": (b"% xy\n", "the program is empty"),
    "a decimal point": (SQUARE.replace(b"140   140", b"140.5 140"), "line 3, column 12: a dec"),
    "a decimal comma": (SQUARE.replace(b"140   140", b"14,0   140"), "line 4, column 3: a row"),
    "a calculation": (SQUARE.replace(b"140   140", b"140-1 140"), "line 3, column 9: '140-1' is"),
    "a letter": (SQUARE.replace(b"140   140", b"1e3   140"), "line 3, column 10: 'e3"),
    "beyond int16": (SQUARE.replace(b"140   140", b"140 32768"), "line 3, column 13: '32768' is"),
    "many digits": (SQUARE.replace(b"140   140", b"9" * 5000), "line 3, column 9: '9999"),
    "a function": (b"xy = zeros(2, 3);\n" + SQUARE, r"line 1, column 6: 'zeros\(2, 3\);' is no"),
    "a command": (b"system('ls');\n" + SQUARE, r"line 1, column 1: \"system\('ls'\);\" is no"),
    "another array": (b"abc = 1;\n" + SQUARE, "line 1, column 1: 'abc' is none of the arrays"),
    "two statements": (SQUARE.replace(b"= 2;", b"= 2; x = 3"), "line 14, column 18: '; x = 3'"),
    "twice": (SQUARE.replace(b"lxy", b"xy", 1), "line 6, column 1: xy is assigned twice; lxy of"),
    "incomplete": (SQUARE[: SQUARE.index(b"first_pointy")], "line 16, .*ends before first_pointy"),
    "broken off": (SQUARE[:60], "the program breaks off inside an array"),
    "no number": (SQUARE.replace(b"= 2;", b"= ;"), "line 14, column 17: ';' is no whole number"),
    "another count": (SQUARE.replace(b"= 2;", b"= 3;"), "line 2, .*xy has 2 rows of 3 numbers"),
    "no lines": (SQUARE.replace(b"= 2;", b"= 0;"), "line 14, column 17: 0 lines: a job has 1"),
    "too many lines": (SQUARE.replace(b"= 2;", b"= 129;"), "129 lines: a job has 1 to 128"),
    "another start": (SQUARE.replace(b"tx = 100", b"tx = 102"), "line 15, column 16: .*begins at"),
    "another length": (SQUARE.replace(b"   40 ", b"   42 "), "line 7, column 4: 42 in lxy does"),
    "another way": (SQUARE.replace(b" 480     0", b"-480     0"), "line 11, column 2: -480 in"),
    "a speed of 0": (SQUARE.replace(b"  480     0", b"    0     0"), "0 in velxy never ends"),
    "a negative length": (SQUARE.replace(b"   40 ", b"  -40 "), "line 7, column 3: -40 in lxy"),
    "a byte": (SQUARE.replace(b"job", b"j\xf3b"), "line 1, column 5: the byte 0xf3"),
    "jobs too early": (b"jobs{1} = {xy};\n" + SQUARE, r"line 1, column 1: jobs\{1\} does"),
    "other jobs": (SQUARE + b"jobs{1} = {xy};\n", "line 17, column 11: jobs takes the six names"),
    "an open array": (SQUARE.replace(b"];", b"", 1), r"line 6, column 1: 'lxy = \['"),
    "three rows": (SQUARE.replace(b"];", b"1 2 3\n];", 1), "line 2, .*xy has 3 rows of 3 numbers"),
    "a stream": (b"1\r5\r5\r", "this is a serial stream; use --set dialect.format=stream"),
}


@pytest.mark.parametrize("name", BAD_TEXT)
def test_bad_text(name: str) -> None:
    data, message = BAD_TEXT[name]
    with pytest.raises(ProgramError) as caught:
        read(data)
    assert re.search(message, str(caught.value)), str(caught.value)


def test_what_would_run_away() -> None:
    one = SQUARE.replace(b"140", b"101").replace(b"   40 ", b"    1 ")
    with pytest.raises(ProgramError, match="1 in lxy makes the slave run away"):
        read(one)
    assert cut_points(read(one, "odd=kept"))[0][1] == (10.1, 10.0)
    home = SQUARE.replace(b"100   140   140\n", b"  0    40    40\n").replace(
        b"tx = 100", b"tx = 0"
    )
    with pytest.raises(ProgramError, match="line 15, column 16: a first point at 0 makes"):
        read(home)


STREAM = b"2\r100\r100\r40\r0\r0\r100\r480\r0\r0\r480\r"

BAD_STREAM = {
    "empty": (b"", "the stream is empty"),
    "inside a number": (STREAM[:-2], "byte 30: the stream breaks off inside a number"),
    "a number short": (STREAM[:-4], "job 1, number 11, byte 30: the stream ends after 7 of 8"),
    "a header short": (STREAM + b"1\r5\r", "job 2, number 3, byte 38: .*inside the header"),
    "a line feed": (STREAM.replace(b"\r", b"\r\n"), "byte 3: a line feed"),
    "a letter": (STREAM.replace(b"40", b"4O"), "job 1, number 4, byte 11: b'4O' is no whole"),
    "a decimal": (STREAM.replace(b"40", b"4.0"), "number 4, byte 11: b'4.0'"),
    "a plus": (STREAM.replace(b"40", b"+40"), "number 4, byte 11"),
    "six digits": (STREAM.replace(b"40", b"123456"), "at most 5 digits"),
    "beyond int16": (STREAM.replace(b"40", b"40000"), "number 4, byte 11: 40000 in lxy is beyond"),
    "no lines": (STREAM.replace(b"2", b"0", 1), "number 1, byte 1: 0 lines"),
    "many lines": (STREAM.replace(b"2", b"129", 1), "number 1, byte 1: 129 lines: a job has 1 to"),
    "a speed of 0": (STREAM.replace(b"480", b"0", 1), "number 8, byte 22: 0 in velxy never ends"),
    "negative": (STREAM.replace(b"40", b"-40"), "number 4, byte 11: -40 in lxy is negative"),
    "a character": (STREAM.replace(b"\r100\r40", b"\rV\r40"), "b'V', as the listing sends it"),
    "a text": (SQUARE, "this is no serial stream; use --set dialect.format=m"),
    "noise": (b"\x00\xff", "no whole number|breaks off"),
}


@pytest.mark.parametrize("name", BAD_STREAM)
def test_bad_streams(name: str) -> None:
    data, message = BAD_STREAM[name]
    with pytest.raises(ProgramError) as caught:
        read(data, "format=stream")
    assert re.search(message, str(caught.value)), str(caught.value)


def test_the_stream_says_the_same() -> None:
    assert cut_points(read(STREAM, "format=stream")) == cut_points(read(SQUARE))


def test_a_character_for_y_is_its_digit_or_nothing() -> None:
    listed = STREAM.replace(b"\r100\r40", b"\r5\r40")
    path = read(listed, "format=stream", "first_y=character")
    assert cut_points(path)[0][0] == (10.0, 0.4)
    with pytest.raises(ProgramError, match="a first point at 0 makes the slave run away"):
        read(listed.replace(b"\r5\r", b"\rV\r"), "format=stream", "first_y=character")
    with pytest.raises(ProgramError, match="is not one character"):
        read(STREAM, "profile=listing", "format=stream")


PROGRAMS = {
    "m": posted("star.csv", router())
    + router().target.write(strokes([(5, 5), (9, 7)]), router().machine).data,
    "stream": posted("star.csv", router("format=stream")),
}


@pytest.mark.parametrize("form", ["m", "stream"])
@given(st.data())
def test_cut_and_noisy_programs_are_errors_or_programs(form: str, data: st.DataObject) -> None:
    whole = PROGRAMS[form]
    at = data.draw(st.integers(0, len(whole)))
    noise = data.draw(st.binary(max_size=8))
    drop = data.draw(st.integers(0, 40))
    damaged = data.draw(st.sampled_from([whole[:at], whole[:at] + noise + whole[at + drop :]]))
    try:
        path = read(damaged, f"format={form}")
    except ProgramError:
        return
    assert np.isfinite(path.end).all()


@given(st.binary(max_size=200), st.sampled_from(["m", "stream"]))
def test_noise_is_an_error(data: bytes, form: str) -> None:
    with pytest.raises(ProgramError):
        read(data, f"format={form}")


@pytest.mark.parametrize(
    "data",
    [
        b"xy = [" + b"1 " * 5_000_000,
        b"xy = [" + b"1" * 10_000_000,
        b"%" * 10_000_000,
        b"xy = " * 2_000_000,
        b"\n" * 10_000_000 + b"[",
        b" " * 10_000_000 + b"(",
        b"xy = [" + b",;" * 5_000_000 + b"]",
        b"1\r" * 5_000_000,
        b"1" * 10_000_000,
        b"-" * 10_000_000 + b"\r",
    ],
)
def test_ten_megabytes_are_an_error_soon(data: bytes) -> None:
    for form in ("m", "stream"):
        with no_chewing(), pytest.raises(ProgramError):
            read(data, f"format={form}")
