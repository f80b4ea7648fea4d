"""`--tolerances` and `--require`, as a user gives them."""

import json
from pathlib import Path

import ezdxf
import pytest

from tests.cli.conftest import Run

KNOWN = """extends = "linuxcnc"
[uncertainty]
squareness_rad = 0.0001
tool_diameter_mm = 0.004
runout_mm = 0.0
temperature_k = 0.0
machine_expansion_per_k = 0.0
part_expansion_per_k = 0.0
process_mm = 0.002
[uncertainty.x]
backlash_mm = 0.002
scale = 0.0001
[uncertainty.y]
backlash_mm = 0.002
scale = 0.0001
"""
SVG = """<svg xmlns="http://www.w3.org/2000/svg" width="50mm" height="40mm" viewBox="0 0 50 40">
<g fill="none" stroke="black"><rect x="5" y="5" width="40" height="30"/>
<circle cx="15" cy="20" r="4"/></g></svg>"""
FILE = """[[dimension]]
name = "bore"
kind = "diameter"
at = [15, 20]
limits = "{bore}"

[[dimension]]
name = "length"
kind = "distance"
from = [5, 20]
to = [45, 20]
limits = "±0.1"
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "plate.svg").write_text(SVG)
    (tmp_path / "mine.toml").write_text(KNOWN)
    (tmp_path / "fine.toml").write_text(FILE.format(bore="±0.1"))
    (tmp_path / "tight.toml").write_text(FILE.format(bore="±0.002"))
    return tmp_path


POST = ("post", "plate.svg", "--machine", "mine.toml", "--tool-diameter", "2mm", "-o", "p.ngc")


def test_verdicts_in_words_json_and_pictures(camtool: Run, folder: Path) -> None:
    files = ("--json", "p.json", "--report", "p.html", "--preview", "p.svg")
    done = camtool(*POST, "--tolerances", "fine.toml", "--require", "in", *files)
    assert done.returncode == 0
    assert b"bore: \xc3\x988 \xc2\xb10.1; predicted 8.00" in done.stderr
    verdicts = json.loads((folder / "p.json").read_text())["inspection"]
    assert [(each["name"], each["verdict"]) for each in verdicts] == [
        ("bore", "in"),
        ("length", "in"),
    ]
    assert verdicts[0]["contributions"][0]["input"] == "tool_diameter_mm"
    assert verdicts[0]["contributions"][0]["um"] == pytest.approx(4.0, rel=0.01)
    assert "dimensions-in" in (folder / "p.svg").read_text()
    assert "over 99.9 %" in (folder / "p.html").read_text()
    again = camtool(
        "verify", "p.ngc", "--machine", "mine.toml", "--against", "plate.svg",
        "--tool-diameter", "2mm", "--side", "auto", "--tolerances", "fine.toml", "--json", "-",
    )  # fmt: skip
    assert again.returncode == 0
    assert json.loads(again.stdout)["inspection"] == verdicts


def test_what_is_not_surely_in_is_not_written(camtool: Run, folder: Path) -> None:
    done = camtool(*POST, "--tolerances", "tight.toml", "--require", "in")
    assert done.returncode == 1
    assert b"bore is undecided" in done.stderr
    assert not (folder / "p.ngc").exists()
    told = camtool(*POST, "--tolerances", "tight.toml", "--require", "not-out")
    assert told.returncode == 0
    assert b"measure tool_diameter_mm" in told.stderr
    assert (folder / "p.ngc").exists()


@pytest.mark.parametrize("asked", ["drawing", "bare.toml"])
def test_a_gate_does_not_pass_on_nothing(camtool: Run, folder: Path, asked: str) -> None:
    bare = "\n".join(line for line in FILE.splitlines() if not line.startswith("limits"))
    (folder / "bare.toml").write_text(bare)
    nothing = b"error NOTHING_REQUIRED [tolerances]: no dimension with limits"
    for require in ("in", "not-out"):
        done = camtool(*POST, "--tolerances", asked, "--require", require)
        assert done.returncode == 1, require
        assert nothing in done.stderr
        assert not (folder / "p.ngc").exists()
    assert camtool(*POST, "--tolerances", asked).returncode == 0
    verify = (
        "verify", "p.ngc", "--machine", "mine.toml", "--against", "plate.svg",
        "--tool-diameter", "2mm", "--tolerances", asked,
    )  # fmt: skip
    assert camtool(*verify).returncode == 0
    for require in ("in", "not-out"):
        judged = camtool(*verify, "--require", require)
        assert judged.returncode == 1, require
        assert nothing in judged.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((*POST, "--require", "in"), b"--require needs --tolerances"),
        ((*POST, "--tolerances", "fine.toml", "--no-verify"), b"drop --tolerances"),
        ((*POST, "--tolerances", "fine.toml", "--split", "tool"), b"drop --tolerances"),
        ((*POST, "--tolerances", "fine.toml", "--scale", "2"), b"leave out fit and scale"),
        ((*POST, "--tolerances", "none.toml"), b"none.toml"),
        (("verify", "p.ngc", "--tolerances", "fine.toml", "-t", "grbl"), b"--against"),
    ],
)
def test_contradictions(
    camtool: Run, folder: Path, arguments: tuple[str, ...], words: bytes
) -> None:
    done = camtool(*arguments)
    assert done.returncode == 2
    assert words in done.stderr
    assert not (folder / "p.ngc").exists()


def test_dimensions_that_are_inspected_are_not_left_out(camtool: Run, tmp_path: Path) -> None:
    drawn = ezdxf.new(units=4, setup=True)
    space = drawn.modelspace()
    space.add_lwpolyline([(0, 0), (40, 0), (40, 20), (0, 20)], close=True)
    said = {"dimlfac": 1.0}
    space.add_linear_dim(base=(0, -5), p1=(0, 0), p2=(40, 0), override=said).render()
    space.add_leader([(0, 0), (5, 5)])
    drawn.saveas(tmp_path / "d.dxf")
    line = ("post", "d.dxf", "-t", "grbl", "--tool-diameter", "3mm", "-o", "d.nc", "-v")
    told = camtool(*line)
    assert b"1 DIMENSION left out" in told.stderr
    assert b"1 LEADER left out" in told.stderr
    told = camtool(*line, "--tolerances", "drawing", "--report", "d.md")
    assert told.returncode == 0
    for words in (told.stderr, (tmp_path / "d.md").read_bytes()):
        assert b"DIMENSION left out" not in words
        assert b"1 LEADER left out" in words
    assert b"predicted" in told.stderr
