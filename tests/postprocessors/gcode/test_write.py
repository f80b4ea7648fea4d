"""What the writers of grbl and linuxcnc say, leave out and refuse."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import MachineError, PostError
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.findings import ProgramCode
from camtool.toolpath.moves import Kind, Toolpath
from camtool.toolpath.program import Program

TARGETS = ("grbl", "linuxcnc")
MODES = {
    "grbl": ["G17 G21 G90 G94", "G54"],
    "linuxcnc": ["G17 G21 G40 G54 G80 G90 G91.1 G94", "G64 P0.01"],
}


def write(path: Toolpath, name: str = "grbl", *settings: str) -> Program:
    target = load_target(name, settings=settings)
    program: Program = target.target.write(path, target.machine)
    return program


def lines(path: Toolpath, name: str = "grbl", *settings: str) -> list[str]:
    return write(path, name, *settings).data.decode("ascii").splitlines()


def blocks(path: Toolpath, name: str = "grbl", *settings: str) -> list[str]:
    """The lines that are blocks, without those of the header."""
    found = [line for line in lines(path, name, *settings) if line[0] not in "(%"]
    assert found[:2] == MODES[name]
    return found[2:]


@pytest.mark.parametrize("name", TARGETS)
def test_words_are_said_when_they_change(name: str) -> None:
    path = ToolpathBuilder().rapid(z=5).rapid(1, 2).line(z=-1, feed=100).line(3, 2, feed=100)
    path.line(3, 4, feed=50).line(3, 4, feed=50).line(0, 0, 0, feed=50).rapid(1, 0)
    assert blocks(path.finish(), name) == [
        "G0 Z5.000",
        "X1.000 Y2.000",
        "G1 Z-1.000 F100",
        "X3.000",
        "Y4.000 F50",
        "X0.000 Y0.000 Z0.000",
        "G0 X1.000",
        "M2",
    ]


def test_where_the_tool_may_stand_anywhere_both_coordinates_are_said() -> None:
    path = ToolpathBuilder().rapid(z=5).rapid(0, 0).line(z=-1, feed=9).line(0, 2, feed=9)
    path.rapid(z=5).set_position(0, 0, 5).event(Kind.HOME_XY).rapid(1, 0).rapid(1, 1)
    assert blocks(path.finish()) == [
        "G0 Z5.000",
        "X0.000 Y0.000",
        "G1 Z-1.000 F9",
        "Y2.000",
        "G0 Z5.000",
        "G53 G0 X0 Y0",
        "G0 X1.000 Y0.000",
        "Y1.000",
        "M2",
    ]


def test_an_arc_says_everything_about_itself() -> None:
    path = ToolpathBuilder().rapid(1, 0).arc(1, 0, centre=(0, 0), ccw=True, feed=60)
    path.arc(0, 1, centre=(0, 0), ccw=True, feed=60).arc(1, 0, centre=(0, 0), ccw=False, feed=60)
    whole = ["G3 X1.000 Y0.000 I-1.000 J0.000 F60"]
    rest = ["X0.000 Y1.000 I-1.000 J0.000", "G2 X1.000 Y0.000 I0.000 J-1.000", "M2"]
    assert blocks(path.finish()) == ["G0 X1.000 Y0.000", *whole, *rest]
    halves = ["G3 X-1.000 Y0.000 I-1.000 J0.000 F60", "X1.000 Y0.000 I1.000 J0.000"]
    said = blocks(path.finish(), "grbl", "dialect.full_circles=halves")
    assert said == ["G0 X1.000 Y0.000", *halves, *rest]


def test_rows_of_blocks() -> None:
    path = ToolpathBuilder().rapid(z=5).rapid(1, 2).rapid(1, 2).event(Kind.DWELL, 1)
    program = write(path.event(Kind.END).finish())
    assert program.row_of_block.tolist() == [-1, -1, 0, 1, 3, 4]
    assert (program.extension, program.target) == (".nc", "grbl")


@pytest.mark.parametrize("name", TARGETS)
def test_the_footer_says_what_is_missing(name: str) -> None:
    path = ToolpathBuilder().rapid(z=5).event(Kind.SPINDLE_CW, 800).rapid(1, 1)
    path.line(z=-1, feed=9)
    assert blocks(path.finish(), name)[-3:] == ["G0 Z5.000", "M5", "M2"]
    settings = ("dialect.retract=false", "dialect.program_end=M30")
    assert blocks(path.finish(), name, *settings)[-3:] == ["G1 Z-1.000 F9", "M5", "M30"]


@pytest.mark.parametrize("name", TARGETS)
def test_an_empty_toolpath_is_a_program_that_does_nothing(name: str) -> None:
    assert blocks(ToolpathBuilder().finish(), name) == ["M2"]


def test_tools() -> None:
    path = ToolpathBuilder().event(Kind.TOOL_CHANGE, 3).finish()
    assert blocks(path, "linuxcnc") == ["T3 M6", "G43 H3", "M2"]
    assert blocks(path, "grbl", "dialect.tool_change=pause") == ["T3 M0", "M2"]
    assert blocks(path, "grbl") == ["M2"]
    assert [finding.code for finding in write(path, "grbl").findings] == [
        ProgramCode.EVENT_LEFT_OUT
    ]
    second = (
        ToolpathBuilder().event(Kind.TOOL_CHANGE, 3).line(1, feed=9).event(Kind.TOOL_CHANGE, 4)
    )
    assert blocks(second.finish(), "grbl") == ["G1 X1.000 Y0.000 F9", "T4 M0", "M2"]
    for name, words in (("grbl", "grbl knows no tool change"), ("linuxcnc", "changes no tools")):
        setting = "dialect.tool_change=refuse"
        with pytest.raises(PostError, match=rf"move 2: .*{words}; .*--split tool"):
            blocks(second.finish(), name, setting)
        assert blocks(path, name, setting) == ["M2"]
        assert ProgramCode.EVENT_LEFT_OUT in [
            each.code for each in write(path, name, setting).findings
        ]


EVIL = [
    "layer)\nG0 Z-50\n(",
    "x%\r\nM3 S9999",
    "a;b(c)d",
    "!~?\x18",
    "(MSG,stop)",
    "PY,import os",
    "Räuber 日本",
    "x" * 500,
]


@pytest.mark.parametrize("text", EVIL)
@pytest.mark.parametrize("name", TARGETS)
def test_no_text_of_a_drawing_commands(name: str, text: str) -> None:
    def path(source: str) -> Toolpath:
        builder = ToolpathBuilder().rapid(z=5)
        builder.source = source
        return builder.rapid(1, 1).message(source).line(2, 2, feed=9).finish()

    assert blocks(path(text), name) == blocks(path("plain"), name)
    said = lines(path(text), name)
    for line in said:
        assert line.isascii()
        assert line.isprintable()
        assert len(line) <= 79
        assert line[0] != "(" or (line.count("(") == line.count(")") == 1 and line[-1] == ")")
        assert not set(line) & set(";%!~?$")


@given(st.text(max_size=100))
def test_no_text_at_all_commands(text: str) -> None:
    builder = ToolpathBuilder().rapid(z=5)
    builder.source = text
    path = builder.rapid(1, 1).finish()
    assert blocks(path) == ["G0 Z5.000", "X1.000 Y1.000", "M2"]


def test_contours_are_named_where_they_begin() -> None:
    path = ToolpathBuilder().rapid(z=5)
    path.source = "layer A"
    path.rapid(1, 1).line(z=-1, feed=9).event(Kind.DWELL, 1).line(2, 1, feed=9)
    path.source = "layer B"
    path.line(2, 1, feed=9)  # moves nothing: its name waits for the next block
    path.source = ""
    path.rapid(z=5)
    said = lines(path.finish())
    assert said[7:] == [
        "G0 Z5.000",
        "(layer A)",
        "X1.000 Y1.000",
        "G1 Z-1.000 F9",
        "G4 P1",
        "X2.000",
        "(layer B)",
        "G0 Z5.000",
        "M2",
    ]
    assert "(layer A)" not in lines(path.finish(), "grbl", "dialect.comments=header")
    assert lines(path.finish(), "grbl", "dialect.comments=none")[0] == MODES["grbl"][0]


def test_rounding_is_told() -> None:
    path = ToolpathBuilder().rapid(1, 1).line(2, 2, feed=33.333).event(Kind.DWELL, 1 / 3)
    path.rapid(2.0001, 2)
    program = write(path.finish())
    assert [note.code for note in program.findings] == [
        ProgramCode.FEED_ROUNDED,
        ProgramCode.MOVE_COLLAPSED,
        ProgramCode.VALUE_ROUNDED,
    ]
    assert b" F33.3\n" in program.data
    assert b"G4 P0.333\n" in program.data


@pytest.mark.parametrize(
    ("path", "message"),
    [
        (ToolpathBuilder((1.0, 0.0, 0.0)).rapid(1, 1), "starts at"),
        (ToolpathBuilder().rapid(1e6, 1), "move 0: a coordinate beyond"),
        (ToolpathBuilder().line(1, 1, feed=0.0), "move 0: a LINE without a feed above 0"),
        (ToolpathBuilder().line(1, 1, feed=math.nan), "without a feed"),
        (ToolpathBuilder().line(1, 1, feed=math.inf), "without a feed"),
        (
            ToolpathBuilder().line(1, 1, feed=0.01),
            "becomes 0 in an F word; use 0.1 mm/min or more",
        ),
        (ToolpathBuilder().line(1, 1, feed=1e5), "the machine's highest"),
        (
            ToolpathBuilder().rapid(1, 0).arc(0, 1, centre=(math.nan, 0.0), ccw=True, feed=9),
            "move 1: an arc without a centre",
        ),
        (
            ToolpathBuilder().rapid(1, 0).arc(0, 1.1, centre=(0.0, 0.0), ccw=True, feed=9),
            "radii at start and end of an arc differ by 0.1000 mm",
        ),
        (
            ToolpathBuilder().event(Kind.SPINDLE_CW, -1),
            "a SPINDLE_CW without a value of 0 or more",
        ),
        (ToolpathBuilder().event(Kind.DWELL, -1), "a DWELL without a value of 0 or more"),
        (ToolpathBuilder().event(Kind.DWELL, math.inf), "a DWELL without a value"),
        (ToolpathBuilder().event(Kind.END).rapid(1, 1), "moves follow the end"),
        (ToolpathBuilder().rapid(1, 1).event(Kind.SET_ZERO), "only be set at part zero"),
        (ToolpathBuilder().event(Kind.MESSAGE, 7), "a message without its text"),
    ],
)
@pytest.mark.parametrize("name", TARGETS)
def test_refused(name: str, path: ToolpathBuilder, message: str) -> None:
    with pytest.raises(PostError, match=message):
        write(path.finish(), name)


@pytest.mark.parametrize("name", TARGETS)
def test_a_feed_may_exceed_the_limit_by_rounding_alone(name: str) -> None:
    highest = load_target(name).machine.max_feed_mm_min
    write(ToolpathBuilder().line(1, 1, feed=highest * (1 + 1e-10)).finish(), name)
    with pytest.raises(PostError, match="the machine's highest"):
        write(ToolpathBuilder().line(1, 1, feed=highest * (1 + 1e-7)).finish(), name)


@pytest.mark.parametrize("name", TARGETS)
def test_an_arc_that_sinks_is_a_helix(name: str) -> None:
    path = ToolpathBuilder().rapid(1, 0).arc(0, 1, -0.5, centre=(0.0, 0.0), ccw=True, feed=9)
    path.arc(0, 1, -1.0, centre=(0.0, 0.0), ccw=True, feed=9)
    assert blocks(path.finish(), name)[-4:-2] == [
        "G3 X0.000 Y1.000 Z-0.500 I-1.000 J0.000 F9",
        "X0.000 Y1.000 Z-1.000 I0.000 J-1.000",
    ]
    halves = blocks(path.finish(), name, "dialect.full_circles=halves")
    assert halves[-4] == "X0.000 Y-1.000 Z-0.750 I0.000 J-1.000"


@pytest.mark.parametrize("name", TARGETS)
def test_helices_too_small_for_arcs_sink_all_the_same(name: str) -> None:
    path = ToolpathBuilder().rapid(1, 0)
    path.arc(1.0001, 0.0, -0.5, centre=(1.00005, 0.0), ccw=True, feed=9)
    path.arc(1.0, 0.0003, -0.75, centre=(1.0001, 0.0002), ccw=True, feed=9)
    assert [block for block in blocks(path.finish(), name) if "Z" in block] == [
        "G1 Z-0.500 F9",
        "Z-0.750",
        "G0 Z0.000",
    ]


def test_grbl_cannot_count_long_dwells() -> None:
    long = ToolpathBuilder().event(Kind.DWELL, 4000).finish()
    with pytest.raises(PostError, match="at most 3276 s"):
        write(long, "grbl")
    assert "G4 P4000" in blocks(long, "linuxcnc")


@pytest.mark.parametrize(("number", "name"), [(1.5, "grbl"), (-1, "linuxcnc"), (256, "grbl")])
def test_tool_numbers(number: float, name: str) -> None:
    settings = ["dialect.tool_change=pause"] if name == "grbl" else []
    with pytest.raises(PostError, match=r"no tool number|highest tool number"):
        write(ToolpathBuilder().event(Kind.TOOL_CHANGE, number).finish(), name, *settings)


def test_a_line_that_the_controller_does_not_take() -> None:
    at, centre = (-98_112.0, -98_112.0), (-99_112.1, -99_112.1)
    path = ToolpathBuilder().rapid(*at).arc(*at, centre=centre, ccw=True, feed=100.1).finish()
    settings = ("dialect.line_chars=64", "dialect.block_numbers=true", "dialect.decimals=6")
    with pytest.raises(PostError, match=r"line 9: a line of 70 characters, .* takes 64"):
        write(path, "grbl", *settings)


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("dialect.decimals=2", "decimals"),
        ("dialect.decimals=7", "decimals"),
        ("dialect.form=annex", "unknown key"),
        ("dialect.comments=all", "comments"),
        ("feed.unit_mm_min=0.3", "unit_mm_min"),
        ("feed.unit_mm_min=10", "unit_mm_min"),
        ("dialect.line_chars=10", "line_chars"),
    ],
)
@pytest.mark.parametrize("name", TARGETS)
def test_bad_options(name: str, setting: str, message: str) -> None:
    with pytest.raises(MachineError, match=message):
        load_target(name, settings=[setting])


def test_each_dialect_has_its_own_options() -> None:
    with pytest.raises(MachineError, match="unknown key"):
        load_target("grbl", settings=["dialect.percent=true"])
    with pytest.raises(MachineError, match="unknown key"):
        load_target("grbl", settings=["dialect.tool_lengths=true"])
    with pytest.raises(MachineError, match="use one of m6, refuse"):
        load_target("linuxcnc", settings=["dialect.tool_change=pause"])
