"""Job files and flags together: which value counts, and what the job is in the end."""

import math
import os
import re
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from camtool.cli.options import DrawingFlags, JobFlags
from camtool.jobs.build import JobTables, build_job, read_job_file
from camtool.jobs.keys import OPERATION, PLACE, TOOL_KEYS, WHOLE
from camtool.planning.job import Entry, Job, Lead, Operation, Placement, Stock, Tabs, Tool, job_of
from tests.cli.conftest import ROOT, Run

WHOLE_FILE = """
safe_z = "0.5mm"
minimise = "reversals"
approach = true
compensate = true
depth = "100um"
step_down = 0.05
tool_table = "tool.tbl"
tool_table_units = "in"

[place]
origin = ["1mm", 2]
mirror = "y"
rotate = "90deg"
fit = ["8mm", 0]
copies = [3, 2]
pitch = "12x9mm"

[stock]
corner = [-1, "-2mm"]
size = "10x5cm"
thickness = "2mm"

[tools.fine]
diameter = "0.2mm"
number = 7
[tools.vee]
diameter = "3mm"
tip_angle = "60deg"
tip_diameter = "0.1mm"

[[operations]]
kind = "drill"
layers = ["HOLES*", "P?"]
tool = 3
peck = "0.05mm"
dwell = "200ms"
max_hole = 2
depth = 1
[[operations]]
name = "outline"
tool = "fine"
colours = ["red", "#FF*", 3, ""]
side = "outside"
direction = "climb"
allowance = "0.01mm"
feed = "1.5mm/s"
plunge_feed = 30
spindle = 12000
last_pass = "0.02mm"
entry = { kind = "ramp", angle = "2deg" }
lead_in = "arc:1mm"
lead_out = { kind = "line", length = 2 }
overlap = 0.3
tabs = { spacing = "20mm", width = 1, height = 0.05, ramped = true }
corners = "overcut"
joins = "mitre"
mitre_limit = 3
start = [3, "4mm"]
[[operations]]
kind = "pocket"
tool = 7
pattern = "zigzag"
angle = 30
step_over = "45%"
entry = "helix:3deg:0.05mm"
[[operations]]
kind = "vcarve"
tool = "vee"
"""
TABLE = "T3 P1 D0.125 ;1/8 end mill\nT7 P2 D1\n"

EXPECTED = Job(
    operations=(
        Operation(
            "drill",
            "drill 1",
            layers=("HOLES*", "P?"),
            tool=Tool(3.175, number=3, name="1/8 end mill"),
            depth_mm=1.0,
            peck_mm=0.05,
            dwell_s=0.2,
            max_hole_mm=2.0,
        ),
        Operation(
            "profile",
            "outline",
            colours=("#ff0000", "#FF*", "#00ff00", ""),
            tool=Tool(0.2, number=7, name="fine"),
            side="outside",
            direction="climb",
            allowance_mm=0.01,
            feed_mm_min=90.0,
            plunge_feed_mm_min=30.0,
            spindle_rpm=12000.0,
            depth_mm=0.1,
            step_down_mm=0.05,
            last_pass_mm=0.02,
            entry=Entry("ramp", math.radians(2.0)),
            lead_in=Lead("arc", 1.0),
            lead_out=Lead("line", 2.0),
            overlap_mm=0.3,
            tabs=Tabs(spacing_mm=20.0, width_mm=1.0, height_mm=0.05, ramped=True),
            corners="overcut",
            joins="mitre",
            mitre_limit=3.0,
            start=(3.0, 4.0),
        ),
        Operation(
            "pocket",
            "pocket 3",
            tool=Tool(0.2, number=7, name="fine"),
            depth_mm=0.1,
            step_down_mm=0.05,
            pattern="zigzag",
            angle_rad=math.radians(30.0),
            step_over=0.45,
            entry=Entry("helix", math.radians(3.0), 0.05),
        ),
        Operation(
            "vcarve",
            "vcarve 4",
            tool=Tool(3.0, "v", math.radians(60.0), 0.1, name="vee"),
            depth_mm=0.1,
            step_down_mm=0.05,
        ),
    ),
    placement=Placement(
        (1.0, 2.0), "y", math.radians(90.0), fit_mm=(8.0, 0.0), copies=(3, 2), pitch_mm=(12.0, 9.0)
    ),
    stock=Stock(2.0, (-1.0, -2.0), (10.0, 50.0)),
    safe_z_mm=0.5,
    minimise="reversals",
    approach=True,
    compensate=True,
)


def job(
    folder: Path, text: str, *, layers: tuple[str, ...] = (), only: str = "", **flags: str
) -> Job:
    """The job of this text in a file, with flags over it."""
    (folder / "job.toml").write_text(text)
    (folder / "tool.tbl").write_text(TABLE)
    chosen = (only,) if only else ()
    given = JobFlags(str(folder / "job.toml"), chosen, flags)
    return given.job(DrawingFlags({"layers": layers}))


def test_every_key_has_its_place(tmp_path: Path) -> None:
    # "10x5cm": the unit behind both is that of both.
    expected_stock = Stock(2.0, (-1.0, -2.0), (100.0, 50.0))
    made = job(tmp_path, WHOLE_FILE)
    for got, expected in zip(made.operations, EXPECTED.operations, strict=True):
        assert got == expected
    assert made.stock == expected_stock
    assert (made.placement, made.safe_z_mm) == (EXPECTED.placement, EXPECTED.safe_z_mm)
    assert (made.minimise, made.approach, made.compensate) == ("reversals", True, True)


def test_an_empty_file_is_the_job_that_says_nothing(tmp_path: Path) -> None:
    assert job(tmp_path, "") == job_of() == build_job(JobTables(), JobTables())


def test_the_flat_form_is_one_operation_without_a_name(tmp_path: Path) -> None:
    made = job(
        tmp_path,
        'tool_diameter = "0.2mm"\nside = "inside"\nfeed = 0.8\nplunge_feed = "0.5"\ndepth = 1\n'
        'safe_z = 2\nspindle = 100.5\norigin = "centre"\nlayers = ["CUT", "ENG*"]\n',
    )
    assert made == job_of(
        tool_diameter_mm=0.2,
        side="inside",
        feed_mm_min=0.8,
        plunge_feed_mm_min=0.5,
        depth_mm=1.0,
        safe_z_mm=2.0,
        spindle_rpm=100.5,
        origin="centre",
        layers=("CUT", "ENG*"),
    )


@pytest.mark.parametrize(
    ("name", "text", "expected"),
    [
        ("entry", "ramp", Entry("ramp")),
        ("entry", "ramp:2deg", Entry("ramp", math.radians(2.0))),
        ("lead_in", "arc", Lead("arc")),
        ("lead_out", "line:2mm", Lead("line", 2.0)),
        ("tabs", "4", Tabs(4)),
        ("tabs", "20mm", Tabs(spacing_mm=20.0)),
        ("tabs", "4.5", Tabs(spacing_mm=4.5)),
        ("tabs", "3:1mm:0.2mm", Tabs(3, None, 1.0, 0.2)),
        ("tabs", "1in:1mm", Tabs(spacing_mm=25.4, width_mm=1.0)),
        ("start", "corner", "corner"),
        ("start", "1mm,-2", (1.0, -2.0)),
        ("overlap", "1/8in", 3.175),
    ],
)
def test_short_texts_are_the_same_in_files_and_flags(
    tmp_path: Path, name: str, text: str, expected: object
) -> None:
    field = OPERATION[name].field
    for made in (job(tmp_path, f'{name} = "{text}"'), job(tmp_path, "", **{name: text})):
        assert getattr(made.operations[0], field) == expected


@pytest.mark.parametrize(
    ("name", "text", "expected"),
    [
        ("fit", "8x6mm", (8.0, 6.0)),
        ("fit", "8 × 6", (8.0, 6.0)),
        ("fit", "1x2in", (25.4, 50.8)),
        ("fit", "1mmx2in", (1.0, 50.8)),
        ("fit", "8pt x 36pt", (8 * 25.4 / 72, 12.7)),
        ("fit", "0x6mm", (0.0, 6.0)),
        ("origin", "lower-left", "lower-left"),
        ("origin", "-1,2.5mm", (-1.0, 2.5)),
        ("rotate", "-90", math.radians(-90.0)),
    ],
)
def test_short_texts_of_the_placement(
    tmp_path: Path, name: str, text: str, expected: object
) -> None:
    field = PLACE[name].field
    for made in (job(tmp_path, f'[place]\n{name} = "{text}"'), job(tmp_path, "", **{name: text})):
        assert getattr(made.placement, field) == expected


TWO = """
depth = 1
tool = "a"
[tools.a]
diameter = 1
[tools.b]
diameter = 2
[[operations]]
name = "one"
layers = ["A"]
step_down = 0.5
[[operations]]
name = "two"
kind = "drill"
tool = "b"
depth = 2
peck = 0.3
"""


def _each(made: Job, name: str) -> list[object]:
    return [getattr(operation, name) for operation in made.operations]


def test_the_nearest_value_counts(tmp_path: Path) -> None:
    plain = job(tmp_path, TWO)
    assert _each(plain, "depth_mm") == [1.0, 2.0]
    assert [tool.diameter_mm for tool in _each(plain, "tool")] == [1.0, 2.0]
    over = job(tmp_path, TWO, depth="3", step_down="0.2", safe_z="4")
    assert _each(over, "depth_mm") == [3.0, 3.0]
    # A drill knows no passes: the flag changes those that do.
    assert _each(over, "step_down_mm") == [0.2, None]
    assert _each(over, "peck_mm") == [None, 0.3]
    assert over.safe_z_mm == 4.0


def test_tools_by_name_number_and_key(tmp_path: Path) -> None:
    def tools(**flags: str) -> list[tuple[str, float]]:
        made = job(tmp_path, TWO, **flags)
        return [(o.tool.name, o.tool.diameter_mm) for o in made.operations]

    assert tools() == [("a", 1.0), ("b", 2.0)]
    assert tools(tool="b") == [("b", 2.0)] * 2
    assert tools(tool_diameter="3") == [("a", 3.0), ("b", 3.0)]
    numbered = 'tool = 7\ntool_table = "tool.tbl"\n'
    assert job(tmp_path, numbered).operations[0].tool == Tool(1.0, number=7)
    named = numbered + "[tools.mill]\nnumber = 7\n"
    assert job(tmp_path, named).operations[0].tool == Tool(1.0, number=7, name="mill")
    # An operation's own keys change the tool that is named for all; a tool of its own replaces it.
    changed = 'tool = "a"\n[tools.a]\ndiameter = 1\n[[operations]]\ntool_diameter = 5\n'
    assert job(tmp_path, changed).operations[0].tool == Tool(5.0, name="a")
    replaced = 'tool_diameter = 5\n[tools.a]\nnumber = 4\n[[operations]]\ntool = "a"\n'
    assert job(tmp_path, replaced).operations[0].tool == Tool(0.0, number=4, name="a")


def test_a_tool_with_a_tip_is_a_v_bit_or_drills(tmp_path: Path) -> None:
    text = "[tools.a]\ntip_angle = 90\n[[operations]]\ntool = 'a'\n[[operations]]\ntool = 'a'\n"
    made = job(tmp_path, text + "kind = 'drill'\n")
    assert [operation.tool.kind for operation in made.operations] == ["v", "drill"]


def test_one_operation_of_the_file(tmp_path: Path) -> None:
    assert _each(job(tmp_path, TWO, only="two"), "name") == ["two"]
    assert _each(job(tmp_path, TWO, only="1"), "name") == ["one"]
    assert _each(job(tmp_path, TWO, only="two", peck="0.1"), "peck_mm") == [0.1]


def test_a_flag_takes_the_place_of_what_contradicts_it_in_the_file(tmp_path: Path) -> None:
    assert job(tmp_path, "[place]\nfit = '8x6'", scale="2").placement == Placement(scale=2.0)
    fit = Placement(fit_mm=(8.0, 6.0))
    assert job(tmp_path, "[place]\nscale = 2", fit="8x6").placement == fit


def test_the_layer_flag_is_for_the_drawing_and_for_a_job_of_one_operation(tmp_path: Path) -> None:
    assert _each(job(tmp_path, "layers = ['A']", layers=("B",)), "layers") == [("B",)]
    assert _each(job(tmp_path, TWO, layers=("B",)), "layers") == [("A",), ()]
    assert _each(job(tmp_path, TWO, layers=("B",), only="one"), "layers") == [("B",)]


def test_paths_are_relative_to_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "sub").mkdir()
    text = 'tool = 3\ntool_table = "tool.tbl"\n'
    assert job(tmp_path / "sub", text).operations[0].tool.diameter_mm == 0.125
    monkeypatch.chdir(tmp_path / "sub")
    flags = JobFlags(None, (), {"tool": "3", "tool_table": "tool.tbl"})
    made = flags.job(DrawingFlags())
    assert made.operations[0].tool == Tool(0.125, number=3, name="1/8 end mill")


def test_help_shows_every_key_under_its_heading(camtool: Run) -> None:
    text = camtool("post", "--help").stdout.decode()
    flags = {*WHOLE, *PLACE, *TOOL_KEYS, *(name for name, key in OPERATION.items() if key.help)}
    for name in flags - {"tool_tip_angle"}:
        assert f"--{name.replace('_', '-')} " in text
    assert "--tool-angle" in text
    headings = re.findall(r"^(\w.*):$", text, re.MULTILINE)
    assert len(headings) == len(set(headings)) >= 6


def test_flags_reach_the_program(camtool: Run, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_bytes(b"0,0\n4,0\n4,3\n0,3\n0,0\n")
    flags = ["--scale", "0.5", "--copies", "2x1", "--pitch", "3x0", "--origin", "1,0"]
    flags += ["--depth", "0.2mm", "--no-verify"]
    done = camtool("post", "a.csv", "-t", "grbl", "-o", "-", *flags)
    assert done.returncode == 0, done.stderr
    numbers = re.findall(r"X(-?[\d.]+)", done.stdout.decode())
    assert (min(map(float, numbers)), max(map(float, numbers))) == (-1.0, 4.0)
    assert min(map(float, re.findall(r"Z(-?[\d.]+)", done.stdout.decode()))) == -0.2


PAGE = (ROOT / "docs" / "jobs.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("text", re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL))
def test_the_examples_of_the_page_cut_the_logo(camtool: Run, tmp_path: Path, text: str) -> None:
    (tmp_path / "job.toml").write_text(text)
    logo = ROOT / "samples" / "logo.dxf"
    checked = camtool("job", "check", "job.toml", "--against", logo)
    assert checked.returncode == 0, checked.stderr
    done = camtool(
        "post", logo, "-t", "pic-mmh", "--job", "job.toml", "--no-verify", "-o", "a.pic"
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(("name", "target"), [("logo", "pic-mmh"), ("plate", "linuxcnc")])
def test_the_samples_post(camtool: Run, tmp_path: Path, name: str, target: str) -> None:
    sample = ROOT / "samples" / name
    flags = ["--job", sample.with_suffix(".toml"), "--target", target, "-o", "a.out"]
    done = camtool("post", sample.with_suffix(".dxf"), *flags, "--no-verify")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "a.out").stat().st_size > 1000
    assert read_job_file(sample.with_suffix(".toml")).operations


def test_help_is_instant() -> None:
    """The flags are made without the packages that do the work."""
    code = "import sys; import camtool.cli.main; print(sorted(sys.modules))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True).stdout
    for heavy in ("numpy", "shapely", "ezdxf", "msgspec"):
        assert f"'{heavy}'".encode() not in loaded


@pytest.mark.parametrize(
    ("text", "flags", "deep"),
    [
        ("breakthrough = '0.3mm'", {}, [3.3]),
        ("breakthrough = '0.3mm'\n[[operations]]\ndepth = 1\n[[operations]]", {}, [1.0, 3.3]),
        ("depth = 1\n[[operations]]\nbreakthrough = 0.1\n[[operations]]", {}, [3.1, 1.0]),
        ("breakthrough = '0.3mm'", {"depth": "2mm"}, [2.0]),
        ("depth = 2", {"breakthrough": "0.2mm"}, [3.2]),
        ("breakthrough = 1", {}, [4.0]),
        ("kind = 'drill'\nbreakthrough = 0.1\ntool_diameter = 1\ntool_tip_angle = 90", {}, [3.6]),
        ("kind = 'drill'\nbreakthrough = 0.1\ntool_diameter = 1", {}, [3.1]),
    ],
)
def test_a_breakthrough_is_a_depth(
    tmp_path: Path, text: str, flags: dict[str, str], deep: list[float]
) -> None:
    made = job(tmp_path, f"{text}\n[stock]\nthickness = 3\n", **flags)
    assert _each(made, "depth_mm") == pytest.approx(deep)
    assert _each(made, "breakthrough_mm") == [None] * len(deep)


def test_a_job_from_a_pipe_is_read_whole(
    camtool_process: Run, tmp_path: Path, samples: Path
) -> None:
    # It can be read only once, and is needed twice: for the files that it names, and itself.
    (tmp_path / "job.toml").write_text('kind = "engrave"\nlayers = ["CUT"]\n', encoding="utf-8")
    logo = str(samples / "logo.dxf")
    args = (logo, "-t", "pic-mmh", "--no-verify", "-q")
    assert camtool_process("post", *args, "--job", "job.toml", "-o", "a.pic").returncode == 0
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    text = (tmp_path / "job.toml").read_bytes()
    writer = threading.Thread(target=pipe.write_bytes, args=(text,), daemon=True)
    writer.start()
    done = camtool_process("post", *args, "--job", "pipe", "-o", "b.pic")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "a.pic").read_bytes() == (tmp_path / "b.pic").read_bytes()


def test_a_carving_by_a_file_is_that_by_flags(camtool: Run, tmp_path: Path, samples: Path) -> None:
    """A job of one operation has no name, and nothing of another one to clear."""
    tool = {"tool_kind": "v", "tool_tip_angle": "60deg", "tool_diameter": "3mm"}
    keys = {"kind": "vcarve", "depth": "0.4mm", **tool}
    text = "".join(f'{key} = "{value}"\n' for key, value in keys.items())
    (tmp_path / "flat.toml").write_text(text)
    (tmp_path / "listed.toml").write_text(f"[[operations]]\n{text}")
    post = ("post", samples / "letter.svg", "-t", "grbl", "--fit", "30x30mm", "-o", "-")
    flags = camtool(
        *post, "--kind", "vcarve", "--depth", "0.4mm", "--tool-angle", "60deg",
        "--tool-diameter", "3mm", "--tool-kind", "v",
    )  # fmt: skip
    assert flags.returncode == 0, flags.stderr
    for name in ("flat.toml", "listed.toml"):
        done = camtool(*post, "--job", name)
        assert done.returncode == 0, done.stderr
        assert done.stdout == flags.stdout
