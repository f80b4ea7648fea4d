"""`camtool post --split tool`: a program for each turn of a tool, all of them or none."""

import json
import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import camtool as library
from camtool.geometry.polylines import Polyline
from camtool.planning.job import Job, Operation, Placement, Tool
from camtool.planning.plan import parted, planned, turns_of_tools
from camtool.target.registry import load_target
from camtool.toolpath.moves import Kind, Toolpath
from tests.cli.conftest import ROOT, Run
from tests.drawings import drawing_of
from tests.strategies import examples

SAMPLES = ROOT / "samples"
PLATE = ("post", str(SAMPLES / "plate.dxf"), "--job", str(SAMPLES / "plate.toml"), "-t", "grbl")
PROGRAMS = ["plate-1-mill.nc", "plate-2-drill.nc", "plate-3-bit.nc", "plate-4-mill.nc"]


def programs(folder: Path) -> list[str]:
    return sorted(each.name for each in folder.glob("*.nc"))


def test_each_program_is_complete_and_verified(camtool: Run, tmp_path: Path) -> None:
    done = camtool(*PLATE, "--split", "tool", "--json", "r.json", "--preview", "p.svg")
    assert done.returncode == 0, done.stderr
    assert b"TOOL_BY_HAND" not in done.stderr
    assert programs(tmp_path) == PROGRAMS
    listed = json.loads((tmp_path / "r.json").read_text())["programs"]
    assert [each["program"] for each in listed] == PROGRAMS
    assert [each["tool"]["number"] for each in listed] == [1, 2, 3, 1]
    for number, each in enumerate(listed, 1):
        picture = (tmp_path / each["preview"]).read_text()
        assert f"plate.dxf, program {number} of 4" in picture
        lines = (tmp_path / each["program"]).read_text().splitlines()
        blocks = [line for line in lines if not line.startswith("(")]
        assert blocks[:4] == ["G17 G21 G90 G94", "G54", "G0 Z5.000", "M3 S12000"]
        assert blocks[-4:] == ["G0 Z5.000", "M5", "X0.000 Y0.000", "M2"]
        assert not any("T" in line for line in blocks)
        assert each["report"]["moves"] > 0
        again = camtool("verify", each["program"], "-t", "grbl")
        assert again.returncode == 0, again.stderr
    names = [cut["name"] for each in listed for cut in each["report"]["planned"]["operations"]]
    assert names == ["pocket", "slot", "window", "holes", "sign", "line", "outline"]


def test_names_begin_with_the_one_that_is_given(camtool: Run, tmp_path: Path) -> None:
    """The list of programs may go to stdout."""
    done = camtool(*PLATE, "--split", "tool", "-q", "-o", "left.nc", "--json", "-")
    assert done.returncode == 0, done.stderr
    names = [name.replace("plate", "left") for name in PROGRAMS]
    assert programs(tmp_path) == names
    assert [each["program"] for each in json.loads(done.stdout)["programs"]] == names
    assert not (tmp_path / "left.nc").exists()


def test_all_programs_or_none(camtool: Run, tmp_path: Path) -> None:
    (tmp_path / PROGRAMS[2]).mkdir()
    done = camtool(*PLATE, "--split", "tool", "--report", "page.html")
    assert done.returncode == 2
    assert b"plate-3-bit.nc: is a folder" in done.stderr
    assert [each.name for each in tmp_path.iterdir()] == [PROGRAMS[2]]
    late = camtool(*PLATE, "--split", "tool", "--max-error", "1um", "--report", "page.html")
    assert late.returncode == 2  # the folder is still in the way


def test_an_error_in_one_program_keeps_all_back(camtool: Run, tmp_path: Path) -> None:
    done = camtool(*PLATE, "--split", "tool", "--max-error", "6.3um")
    assert done.returncode == 1
    assert done.stderr.strip().endswith(b"nothing was written; fix the errors above")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("more", [("-o", "-"), ("--report", "-")])
def test_stdout_holds_no_more_than_one(
    camtool: Run, tmp_path: Path, more: tuple[str, str]
) -> None:
    done = camtool(*PLATE, "--split", "tool", *more)
    assert done.returncode == 2
    assert b"--split writes several files" in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_one_tool_is_one_program(camtool: Run, tmp_path: Path) -> None:
    flags = ("-t", "grbl", "--tool-diameter", "2mm", "--spindle", "9000", "-q")
    assert camtool("post", str(SAMPLES / "logo.dxf"), *flags, "--split", "tool").returncode == 0
    assert camtool("post", str(SAMPLES / "logo.dxf"), *flags).returncode == 0
    assert programs(tmp_path) == ["logo-1-mill.nc", "logo.nc"]
    assert (tmp_path / "logo-1-mill.nc").read_bytes() == (tmp_path / "logo.nc").read_bytes()


def test_names_of_tools_are_made_fit_for_files(camtool: Run, tmp_path: Path) -> None:
    (tmp_path / "job.toml").write_text(
        '[tools."../ä b"]\nnumber = 1\ndiameter = "1mm"\n[[operations]]\ntool = "../ä b"\n'
    )
    done = camtool("post", str(SAMPLES / "logo.dxf"), "--job", "job.toml", "-t", "grbl", "-q",
                   "--split", "tool", "-o", "a.nc")  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert programs(tmp_path) == ["a-1-b.nc"]


def square(x: float, y: float, side: float) -> Polyline:
    corners = [(x, y), (x + side, y), (x + side, y + side), (x, y + side)]
    return Polyline(np.array([(*corner, 0.0) for corner in corners]), closed=True)


DRAWING = drawing_of([square(3, 2, 30), square(10, 10, 8), square(22, 20, 6)])
TOOLS = (
    Tool(1.0, number=1),
    Tool(2.0, number=2),
    Tool(1.5),
    Tool(3.0, "drill", math.radians(118), number=3),
)


@st.composite
def jobs(draw: st.DrawFn) -> Job:
    """Operations of several tools, some of which cut nothing."""

    def operation() -> Operation:
        tool = draw(st.sampled_from(TOOLS))
        kind = "drill" if tool.kind == "drill" else draw(st.sampled_from(["profile", "pocket"]))
        taken = draw(st.sampled_from([("outer",), ("inner",), ()]))
        return Operation(
            kind, tool=tool, select=taken, spindle_rpm=draw(st.sampled_from([None, 5000.0]))
        )

    count = draw(st.integers(1, 5))
    place = Placement(origin=draw(st.sampled_from(["drawing", "lower-left", "centre"])))
    goal = draw(st.sampled_from(["rapids", "reversals"]))
    return Job(tuple(operation() for _ in range(count)), place, safe_z_mm=4.0, minimise=goal)


def cuts(path: Toolpath) -> list[tuple[float, ...]]:
    """Return kind, end, centre and feed of each cutting move, in order."""
    rows = np.column_stack([path.kind, path.end, path.centre, path.feed])[path.is_feed]
    return [tuple(row) for row in np.nan_to_num(rows, nan=-1.0).tolist()]


@examples(20, 600)
@given(job=jobs())
def test_the_programs_together_cut_what_the_one_would(job: Job) -> None:
    machine = load_target("grbl").machine
    whole = planned(DRAWING, job, machine)
    parts = parted(whole, turns_of_tools(whole), DRAWING, machine)
    assert [cut for part in parts for cut in cuts(part.toolpath)] == cuts(whole.toolpath)
    every = [operation for part in parts for operation in part.job.operations]
    assert every == list(job.operations)
    for part in parts:
        used = {step.operation.tool for step in part.steps if step.runs}
        assert len(used) <= 1
        changes = int((part.toolpath.kind == Kind.TOOL_CHANGE).sum())
        assert changes == sum(tool.number is not None for tool in used)
        assert part.toolpath.kind[-1] == Kind.END
    tools = [
        next((step.operation.tool for step in part.steps if step.runs), None) for part in parts
    ]
    assert all(a != b for a, b in pairwise(tools))


def test_from_python() -> None:
    job = Job(tuple(Operation(tool=tool) for tool in TOOLS[:2]), safe_z_mm=4.0)
    runs = library.post_by_tool(DRAWING, "grbl", job, compensate=True)
    assert len(runs) == 2
    assert [run.title for run in runs] == [f"test.dxf, program {k} of 2" for k in (1, 2)]
    for run in runs:
        assert run.report is not None
        assert run.before is not None
        assert len(run.data) > 0
