"""Facing: the whole top of the stock is cleared, and no more than the overhang beyond it."""

import json
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest
import shapely

import camtool
from camtool.errors import OptionError
from camtool.planning.job import Entry, Job, Operation, Stock, Tool
from camtool.run import Run as Posted
from tests.cli import conftest

Run = conftest.Run
command = conftest.camtool
"""The fixture that runs the command line."""

STOCK = Stock(12.0, (-5.0, 3.0), (40.0, 25.0))
BOX = shapely.box(-5.0, 3.0, 35.0, 28.0)
TOOL = Tool(6.0, number=1, name="face")
EDGE_MM = 1e-3
"""Discs of shapely are polygons: with 64 sides to a quarter they miss less than this."""


@pytest.fixture
def drawing(tmp_path: Path) -> Path:
    """A square of 10 mm on the stock."""
    document = ezdxf.new(units=ezdxf.units.MM)
    corners = [(5.0, 8.0), (15.0, 8.0), (15.0, 18.0), (5.0, 18.0)]
    document.modelspace().add_lwpolyline(corners, close=True)
    document.saveas(tmp_path / "part.dxf")
    return tmp_path / "part.dxf"


def facing(overhang: float | None = None, **settings: Any) -> Operation:
    own = () if overhang is None else (("overhang_mm", overhang),)
    plain = {"tool": TOOL, "depth_mm": 1.0, "spindle_rpm": 9000.0, "plunge_feed_mm_min": 60.0}
    return Operation(kind="facing", own=own, **{**plain, **settings})


def posted(drawing: Path, *operations: Operation, target: str = "linuxcnc") -> Posted:
    return camtool.post(str(drawing), target, Job(operations=operations, stock=STOCK))


def cut_at(run: Posted, z_mm: float, radius_mm: float) -> Any:
    """Return the polygon that the tool sweeps with its tip at a height."""
    toolpath = run.wanted
    assert toolpath is not None
    level = toolpath.is_feed & np.isclose(toolpath.end[:, 2], z_mm)
    level &= np.isclose(toolpath.starts[:, 2], z_mm)
    ends = np.stack([toolpath.starts[level, :2], toolpath.end[level, :2]], axis=1)
    moves = shapely.linestrings(ends)
    return shapely.union_all(shapely.buffer(moves, radius_mm, quad_segs=64))


def codes(run: Posted) -> set[str]:
    return {finding.code.name for finding in run.findings}


@pytest.mark.parametrize("pattern", ["contour", "zigzag"])
@pytest.mark.parametrize(
    ("overhang", "step_over"), [(0.0, 0.3), (1.5, 0.85), (None, 0.5), (8.0, 0.85)]
)
def test_its_area_is_that_of_the_stock_and_the_overhang(
    drawing: Path, pattern: str, overhang: float | None, step_over: float
) -> None:
    operation = facing(overhang, pattern=pattern, step_over=step_over, step_down_mm=0.5)
    run = posted(drawing, operation)
    reach = (3.0 if overhang is None else overhang) + 3.0
    wanted = shapely.buffer(BOX, reach, quad_segs=64, join_style="mitre")
    for z in (-0.5, -1.0):
        cut = cut_at(run, z, 3.0)
        assert shapely.difference(BOX, cut).area < EDGE_MM
        assert shapely.difference(cut, wanted).area < EDGE_MM
        rounded = shapely.buffer(
            shapely.buffer(BOX, reach - 3.0, join_style="mitre"), 3.0, quad_segs=64
        )
        assert cut.area == pytest.approx(rounded.area, abs=0.05)
    assert codes(run) <= {"PLAY_NOT_KNOWN", "END_NOT_REACHED"}
    assert run.verification is not None
    assert run.verification.report.error_um.total.max < 10.0


@pytest.mark.parametrize("degrees", [0.0, 30.0, 90.0, 137.0])
def test_lines_at_any_angle_leave_nothing(drawing: Path, degrees: float) -> None:
    turned = facing(0.0, pattern="zigzag", step_over=0.9, angle_rad=np.radians(degrees))
    assert shapely.difference(BOX, cut_at(posted(drawing, turned), -1.0, 3.0)).area < EDGE_MM


@pytest.mark.parametrize("pattern", ["contour", "zigzag"])
def test_the_tool_comes_down_beside_the_stock(drawing: Path, pattern: str) -> None:
    """With the default overhang it touches the stock at most: nothing is said of a plunge. One
    that comes down on the stock is told of, as that of a pocket is."""
    run = posted(drawing, facing(pattern=pattern, plunge_feed_mm_min=None), target="grbl")
    toolpath = run.wanted
    assert toolpath is not None
    downs = toolpath.is_feed & (toolpath.starts[:, 2] > 0.0) & (toolpath.end[:, 2] < 0.0)
    assert downs.any()
    assert shapely.distance(shapely.points(toolpath.end[downs, :2]), BOX).min() >= 3.0 - 1e-9
    assert "CUT_DOUBTFUL" not in codes(run)
    plain = facing(1.0, pattern=pattern, plunge_feed_mm_min=None)
    on_stock = posted(drawing, plain, target="grbl")
    assert "CUT_DOUBTFUL" in codes(on_stock)


@pytest.mark.parametrize(
    ("direction", "material_right"), [("climb", True), ("conventional", False)]
)
def test_the_direction_is_that_of_the_teeth(
    drawing: Path, direction: str, material_right: bool
) -> None:
    """Along the outermost round the stock is on the right of a tool that climbs."""
    run = posted(drawing, facing(direction=direction, step_over=0.5))
    toolpath = run.wanted
    assert toolpath is not None
    level = np.flatnonzero(toolpath.is_feed & (toolpath.starts[:, 2] == -1.0))
    begin, end = toolpath.starts[level[0], :2], toolpath.end[level[0], :2]
    ahead, centre = end - begin, np.array([15.0, 15.5]) - begin
    assert (ahead[0] * centre[1] - ahead[1] * centre[0] < 0.0) == material_right


def test_ramps_slope_and_helices_are_refused(drawing: Path) -> None:
    run = posted(drawing, facing(0.0, entry=Entry("ramp"), plunge_feed_mm_min=None), target="grbl")
    assert "CUT_DOUBTFUL" not in codes(run)
    with pytest.raises(OptionError, match="entered by a helix"):
        facing(entry=Entry("helix"))


@pytest.mark.parametrize("target", ["grbl", "linuxcnc", "valcnc"])
def test_it_is_cut_before_a_profile_and_held_against_its_program(
    drawing: Path, target: str
) -> None:
    profile = Operation(tool=Tool(2.0, number=1), depth_mm=3.0, spindle_rpm=9000.0)
    face = facing(tool=Tool(2.0, number=1))
    job = Job(operations=(face, profile), stock=STOCK)
    run = camtool.post(str(drawing), target, job)
    assert not codes(run) & {"GOUGE", "UNCUT", "NOT_IN_DRAWING", "OUT_OF_STOCK"}
    assert run.program is not None
    read = camtool.verify(run.program.data, target, against=str(drawing), job=job)
    assert not [each for each in read.findings if each.severity.name == "ERROR"]


def test_a_line_that_is_missing_is_found(drawing: Path) -> None:
    job = Job(operations=(facing(pattern="zigzag", step_over=0.8),), stock=STOCK)
    run = camtool.post(str(drawing), "linuxcnc", job)
    assert run.program is not None
    blocks = run.program.data.split(b"\n")
    lines = [row for row, block in enumerate(blocks) if block.startswith(b"X3")]
    damaged = b"\n".join(block for row, block in enumerate(blocks) if row != lines[1])
    read = camtool.verify(damaged, "linuxcnc", against=str(drawing), job=job)
    assert [each for each in read.findings if each.severity.name == "ERROR"]


JOB = """
[stock]
corner = ["-5mm", "3mm"]
size = ["40mm", "25mm"]
thickness = "12mm"
[tools.face]
diameter = "6mm"
number = 1
[[operations]]
name = "top"
kind = "facing"
tool = "face"
depth = "1mm"
step_down = "0.5mm"
overhang = "2mm"
spindle = 9000
plunge_feed = "60mm/min"
"""


def test_summary_and_setup_sheet_describe_it(command: Run, drawing: Path, tmp_path: Path) -> None:
    (tmp_path / "job.toml").write_text(JOB, encoding="utf-8")
    outputs = ("-o", "a.ngc", "--json", "a.json", "--report", "a.html")
    done = command("post", str(drawing), "-t", "linuxcnc", "--job", "job.toml", *outputs)
    assert done.returncode == 0
    told = done.stdout + done.stderr
    assert b"top: tool face 6 mm, spindle 9000" in told
    assert b"1 mm deep in 2 passes of 0.5 at most" in told
    (row,) = json.loads((tmp_path / "a.json").read_text(encoding="utf-8"))["planned"]["operations"]
    assert (row["name"], row["kind"], row["passes"]) == ("top", "facing", 2)
    page = (tmp_path / "a.html").read_text(encoding="utf-8")
    assert ">facing</td>" in page


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            ('[stock]\ncorner = ["-5mm", "3mm"]\nsize = ["40mm", "25mm"]\nthickness = "12mm"', ""),
            "the size of the stock, whose top is cleared, is not known",
        ),
        (
            ('corner = ["-5mm", "3mm"]\nsize = ["40mm", "25mm"]\n', ""),
            "the size of the stock, whose top is cleared, is not known",
        ),
        (('overhang = "2mm"', 'overhang = "-2mm"'), "an overhang of -2 mm is not between 0 and"),
        (('overhang = "2mm"', "step_over = 1.1"), "step-over 1.1 is not above 0 and at most 1"),
        (('overhang = "2mm"', "step_over = 1e-8"), "would make"),
        (
            ('diameter = "6mm"', 'diameter = "0mm"'),
            "facing needs an end mill, not one of no width",
        ),
        (('depth = "1mm"', 'depth = "12mm"'), "12 mm is all of the stock"),
        (('overhang = "2mm"', 'side = "outside"'), "means nothing to the kind facing"),
        (('overhang = "2mm"', 'layers = ["0"]'), "means nothing to the kind facing"),
    ],
)
def test_what_cannot_be_is_refused(
    command: Run, drawing: Path, tmp_path: Path, change: tuple[str, str], words: str
) -> None:
    (tmp_path / "job.toml").write_text(JOB.replace(*change), encoding="utf-8")
    done = command("post", str(drawing), "-t", "linuxcnc", "--job", "job.toml", "-o", "a.ngc")
    assert done.returncode == 2
    assert words.encode() in done.stderr
    assert not (tmp_path / "a.ngc").exists()


def test_overhang_is_for_facing_alone(drawing: Path) -> None:
    assert camtool.job_of(kind="facing", overhang_mm="2mm", stock=STOCK, tool_diameter_mm=6.0)
    with pytest.raises(TypeError, match="overhang_mm"):
        camtool.job_of(kind="pocket", overhang_mm=2.0)
