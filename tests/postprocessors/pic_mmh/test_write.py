"""What the pic-mmh writer sends, block by block, and what it refuses."""

import math

import numpy as np
import pytest

from camtool.errors import MachineError, PostError
from camtool.findings import Code, Severity
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.findings import ProgramCode
from camtool.toolpath.moves import Kind, Toolpath


def written(path: ToolpathBuilder, *settings: str) -> list[str]:
    """The blocks between header and footer."""
    target = load_target("pic-mmh", settings=settings)
    blocks = target.target.write(path.finish(), target.machine).data.decode("ascii").splitlines()
    assert blocks[:2] == ["G54;", "G90;"]
    assert blocks[-1] == "M30;"
    return blocks[2:-1]


def findings(path: ToolpathBuilder, *settings: str) -> dict[Code, str]:
    target = load_target("pic-mmh", settings=settings)
    found = target.target.write(path.finish(), target.machine).findings
    assert len({finding.code for finding in found}) == len(found)
    return {finding.code: finding.message for finding in found}


@pytest.mark.parametrize(
    ("form", "blocks"),
    [
        (
            "example",
            [
                "G00Z00200.00;",
                "G00X01000.00Y-02000.50;",
                "G01Z-00020.00F08;",
                "G01X00000.00Y-02000.50F13;",
            ],
        ),
        (
            "annex",
            ["G00Z+00200;", "G00X+01000Y-02001;", "G01Z-00020F08;", "G01X+00000Y-02001F13;"],
        ),
    ],
)
def test_lines_in_both_forms(form: str, blocks: list[str]) -> None:
    path = ToolpathBuilder().rapid(z=0.2).rapid(1, -2.0005).line(z=-0.02, feed=0.8)
    path.line(-0.000001, -2.0005, feed=1.3)
    assert written(path, f"dialect.form={form}") == blocks


def test_events() -> None:
    path = ToolpathBuilder().event(Kind.SPINDLE_CW, 3000).event(Kind.SPINDLE_CCW, 50)
    path.event(Kind.DWELL, 7).event(Kind.SPINDLE_OFF).event(Kind.TOOL_CHANGE, 4)
    path.message("not sent; G00").event(Kind.HOME_Z).event(Kind.HOME_XY)
    assert written(path) == [
        "M03S3000;",
        "M04S0050;",
        "G04P07;",
        "M05;",
        "M06T04;",
        "G28Z0;",
        "G28X0Y0;",
    ]


def test_after_homing_the_controller_stands_at_machine_zero() -> None:
    path = ToolpathBuilder().line(1, 1, feed=1).set_position(-1.4, -0.7, 0).event(Kind.HOME_XY)
    path.line(-1.4, -0.7, feed=1).line(0, 0, feed=1)
    blocks = written(path, "controller.machine_zero_mm=[-1.4, -0.7, 0.0]")
    assert blocks[1:] == ["G28X0Y0;", "G01X00000.00Y00000.00F10;"]


def test_rows_of_blocks() -> None:
    target = load_target("pic-mmh")
    path = ToolpathBuilder().event(Kind.SET_ZERO).line(1, 1, feed=1).line(1, 1, feed=1)
    path.line(2, 2, 0.0005, feed=1).event(Kind.END)
    program = target.target.write(path.finish(), target.machine)
    assert program.data.decode().splitlines()[0::5] == ["G54;", "M30;"]
    assert program.row_of_block.tolist() == [0, -1, 1, 3, 3, 4]
    assert (program.target, program.extension) == ("pic-mmh", ".pic")
    bare = target.target.write(ToolpathBuilder().finish(), target.machine)
    assert bare.data == b"G54;\nG90;\nM30;\n"
    assert bare.row_of_block.tolist() == [-1, -1, -1]


def test_up_comes_first_and_down_last() -> None:
    path = ToolpathBuilder().rapid(1, 0, 1).rapid(2, 0, 0)
    assert [block[3] for block in written(path)] == ["Z", "X", "X", "Z"]
    assert findings(path) == {}
    path.line(3, 0, -1, feed=1).arc(3, 2, centre=(3, 1), ccw=True, feed=1)
    assert (
        "1 feed move in XY and Z became steps of at most 0.0005 mm"
        in (findings(path)[ProgramCode.MOVE_SPLIT])
    )


def test_slopes_and_helices_become_small_steps() -> None:
    path = ToolpathBuilder().line(0.9, 0, -0.0015, feed=1)
    path.arc(0.9, 0, -0.001, centre=(0.5, 0), ccw=True, feed=1)
    assert written(path) == [
        "G01X00300.00Y00000.00F10;",
        "G01Z-00000.50F10;",
        "G01X00600.00Y00000.00F10;",
        "G01Z-00001.00F10;",
        "G01X00900.00Y00000.00F10;",
        "G01Z-00001.50F10;",
        "G01Z-00001.00F10;",
        "G03X00900.00Y00000.00I00500.00J00000.00F10;",
    ]
    assert "2 feed moves" in findings(path)[ProgramCode.MOVE_SPLIT]


def test_errors_name_the_given_move_behind_a_slope() -> None:
    path = ToolpathBuilder().line(1, 0, -0.01, feed=1).rapid(0, 0, 0).event(Kind.DWELL, -1)
    with pytest.raises(PostError, match="move 2: dwell -1 does not fit into a block"):
        written(path)


def test_feeds_are_rounded_down_and_told() -> None:
    path = ToolpathBuilder().line(1, 0, feed=0.19).line(2, 0, feed=0.3).line(3, 0, feed=1.394)
    assert [block[-4:] for block in written(path)] == ["F01;", "F03;", "F13;"]
    assert "2 moves" in findings(path)[ProgramCode.FEED_ROUNDED]
    assert findings(ToolpathBuilder().line(1, 0, feed=0.7)) == {}


def test_dwells_are_split_and_rounded_up() -> None:
    path = ToolpathBuilder().event(Kind.DWELL, 200.25).event(Kind.DWELL, 0)
    assert written(path) == ["G04P99;", "G04P99;", "G04P03;"]
    assert ProgramCode.VALUE_ROUNDED in findings(path)


def test_moves_of_less_than_a_step_are_left_out() -> None:
    path = ToolpathBuilder().line(0.00001, 0, feed=1).line(0, 0, feed=1).rapid(0, 0, 0.00006)
    assert written(path) == []
    assert "3 moves" in findings(path)[ProgramCode.MOVE_COLLAPSED]


def test_no_coordinate_lies_half_way_between_two_steps() -> None:
    # 0.07 µm is half a step: said one hundredth farther out, which is the same step.
    path = ToolpathBuilder().line(0.00007, -0.00021, feed=1)
    assert written(path) == ["G01X00000.08Y-00000.22F10;"]


def test_long_blocks_are_one_finding() -> None:
    path = ToolpathBuilder().line(1, 0, feed=1).arc(1, 0, centre=(0, 0), ccw=True, feed=1)
    path.arc(1, 0, centre=(-1, 0), ccw=True, feed=1)
    for setting, severity in (
        ([], Severity.INFO),
        (["dialect.buffer_chars=35"], Severity.WARNING),
    ):
        target = load_target("pic-mmh", settings=setting)
        found = target.target.write(path.finish(), target.machine).findings
        (finding,) = [each for each in found if each.code == ProgramCode.BLOCK_TOO_LONG]
        assert finding.severity == severity
        assert (finding.measured, finding.limit) == (44.0, 35.0)
        assert "2 blocks" in finding.message
        assert "dialect.form=annex" in finding.message
    assert ProgramCode.BLOCK_TOO_LONG not in findings(path, "dialect.form=annex")
    assert ProgramCode.BLOCK_TOO_LONG not in findings(path, "dialect.buffer_chars=44")


def builder() -> ToolpathBuilder:
    path = ToolpathBuilder()
    path.source = "CIRCLE 2F"
    return path


REFUSED = {
    "feed 0": (builder().line(1, 0, feed=0), "a feed of 0 mm/min"),
    "feed not a number": (builder().line(1, 0, feed=math.nan), "a feed of nan mm/min"),
    "negative feed": (builder().line(1, 0, feed=-1), "a feed of -1 mm/min"),
    "feed below F01": (builder().line(1, 0, feed=0.09), "F00"),
    "feed above the link": (builder().line(1, 0, feed=1.4), "the highest feed is 1.3 mm/min"),
    "feed without bound": (builder().line(1, 0, feed=math.inf), "the highest feed is 1.3"),
    "X too long": (builder().rapid(100, 0), "X = 100 mm has more than five digits"),
    "Y too long": (builder().rapid(0, -1e300), "Y = -1e+300 mm"),
    "Z too long": (builder().rapid(z=99.999996), "Z = 100 mm"),
    "centre too far": (
        builder().arc(0, 0, centre=(0, 200), ccw=True, feed=1),
        "an arc that has to be written as lines leaves the five digits",
    ),
    "arc without centre": (
        builder().arc(1, 0, centre=(math.nan, 0), ccw=True, feed=1),
        "an arc without a centre; give the arc a centre",
    ),
    "arc of two radii": (
        builder().arc(1, 0, centre=(0.4, 0), ccw=True, feed=1),
        r"differ by 0.2000 mm (0.4000 and 0.6000 mm)",
    ),
    "spindle too fast": (builder().event(Kind.SPINDLE_CW, 10000), "spindle speed 10000"),
    "spindle without speed": (builder().event(Kind.SPINDLE_CW), "without a speed"),
    "tool of three digits": (builder().event(Kind.TOOL_CHANGE, 100), "tool 100"),
    "half a tool": (builder().event(Kind.TOOL_CHANGE, 1.5), "tool 1.5"),
    "negative dwell": (builder().event(Kind.DWELL, -1), "dwell -1"),
    "endless dwell": (builder().event(Kind.DWELL, 1e9), "dwell 1e+09"),
    "part zero elsewhere": (builder().rapid(1, 0).event(Kind.SET_ZERO), "part zero"),
    "moves after the end": (builder().event(Kind.END).rapid(1, 0), "follow the end"),
    "homing to another place": (builder().rapid(1, 0).event(Kind.HOME_XY), "HOME_XY cannot end"),
    "an event that moves": (builder().set_position(1, 0, 0).event(Kind.DWELL, 1), "DWELL cannot"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refusals_name_the_move_and_the_value(name: str) -> None:
    path, message = REFUSED[name]
    with pytest.raises(PostError, match=r"^move \d \(CIRCLE 2F\): ") as caught:
        written(path)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_annex_has_five_digits_too() -> None:
    assert written(ToolpathBuilder().rapid(99.999, -99.999), "dialect.form=annex") == [
        "G00X+99999Y-99999;"
    ]
    with pytest.raises(PostError, match=r"X = 99\.9996 mm"):
        written(ToolpathBuilder().rapid(99.9996, 0), "dialect.form=annex")


def test_a_path_that_starts_elsewhere_is_refused() -> None:
    with pytest.raises(PostError, match=r"starts at \(1, 0, 0\) mm"):
        written(ToolpathBuilder(start=(1.0, 0.0, 0.0)).rapid(2, 0))


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("controller.arcs=stairs", "controller.arcs=dsm"),
        ("axes.x.coded_step_mm=0.0001", "coded steps of X and Y differ"),
    ],
)
def test_arcs_are_planned_for_one_interpolator_and_one_step(setting: str, message: str) -> None:
    path = ToolpathBuilder().line(1, 0, feed=0.5)
    assert len(written(path, setting)) == 1
    with pytest.raises(PostError) as caught:
        written(path.arc(1, 0, centre=(0, 0), ccw=True, feed=0.5), setting)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    "setting",
    ["dialect.form=other", "dialect.buffer_chars=0", "dialect.buffer_chars=x", "dialect.forn=x"],
)
def test_a_dialect_table_that_does_not_fit_is_refused(setting: str) -> None:
    with pytest.raises(MachineError, match="dialect"):
        load_target("pic-mmh", settings=[setting])


def test_no_minus_zero_and_only_plain_characters() -> None:
    rng = np.random.default_rng(0)
    path = ToolpathBuilder()
    for x, y, z in rng.normal(scale=0.0002, size=(500, 3)):
        path.line(x, y, z, feed=1)
    for form in ("example", "annex"):
        text = "".join(written(path, f"dialect.form={form}"))
        assert set(text) <= set("G01XYZF0123456789.;-+")
        assert "-00000.00" not in text
        assert "-00000F" not in text
        assert "-00000Y" not in text


def test_text_of_a_drawing_never_reaches_the_program() -> None:
    path = ToolpathBuilder()
    path.source = "LAYER ;M03S9999;"
    path.line(1, 1, feed=1).message(";A;")
    assert written(path) == ["G01X01000.00Y01000.00F10;"]


def test_a_toolpath_is_left_as_it_is() -> None:
    target = load_target("pic-mmh")
    path = ToolpathBuilder().line(1, 1, feed=1).finish()
    before = [np.array(getattr(path, name)) for name in ("end", "kind", "feed")]
    assert isinstance(path, Toolpath)
    target.target.write(path, target.machine)
    for name, column in zip(("end", "kind", "feed"), before, strict=True):
        np.testing.assert_array_equal(getattr(path, name), column)
