"""How a drawing is read, as a user says it: check, selection, formats, stdin."""

import io
import json
from pathlib import Path

import ezdxf
import pytest

from tests.cli.conftest import Run


@pytest.fixture
def plate(tmp_path: Path) -> Path:
    """A square of loose lines with a gap, one line twice, a point, a text and two layers."""
    document = ezdxf.new(units=4)
    space = document.modelspace()
    corners = [(0, 0), (10, 0), (10, 10), (0, 10)]
    for index, corner in enumerate(corners):
        end = corners[(index + 1) % 4]
        space.add_line(corner, end, dxfattribs={"layer": "CUT", "color": 1})
    space.add_line((2, 0), (6, 0), dxfattribs={"layer": "CUT", "color": 1})
    space.add_line((3, 3), (7, 7.0), dxfattribs={"layer": "Engrave", "linetype": "DASHED"})
    space.add_line((7, 7.0005), (8, 3), dxfattribs={"layer": "Engrave"})
    space.add_point((5, 5), dxfattribs={"layer": "DRILL"})
    space.add_text("words", height=1.0, dxfattribs={"layer": "Engrave"}).set_placement((1, 1))
    document.layers.add("CUT")
    file = tmp_path / "plate.dxf"
    document.saveas(file)
    return file


def facts(camtool: Run, *arguments: str | Path) -> dict[str, object]:
    done = camtool("check", *arguments, "--json", "-")
    assert done.returncode == 0, done.stderr
    loaded: dict[str, object] = json.loads(done.stdout)
    return loaded


def test_check_says_everything_in_lines(camtool: Run, plate: Path) -> None:
    done = camtool("check", plate)
    assert done.returncode == 0
    lines = done.stdout.decode().splitlines()
    for line in (
        "units     mm ($INSUNITS 4)",
        "size      10 × 10 mm",
        "points    1 single",
        "layer     CUT: 1 closed, 0 open",
        "layer     DRILL: 0 closed, 0 open, 1 points",
        "layer     Engrave: 0 closed, 1 open",
        "left out  1 parts lying on others, 4 mm",
        "gap       0.0005 mm at 7.0000, 7.0002 on Engrave, was closed",
        "open      from 3.0000, 3.0000 to 8.0000, 3.0000 on Engrave",
    ):
        assert line in lines, done.stdout.decode()
    assert any(line.startswith("not used  1 TEXT: ") and "--text" in line for line in lines)


def test_long_lists_are_cut_unless_asked_for(camtool: Run, tmp_path: Path) -> None:
    rows = "\n\n".join(f"{3 * k},0\n{3 * k},{k + 1}" for k in range(14))
    (tmp_path / "rows.csv").write_text(rows)
    short = camtool("check", "rows.csv").stdout.decode()
    assert short.count("\nopen  ") == 11
    assert "and 4 more (-v shows all)" in short
    assert camtool("check", "-v", "rows.csv").stdout.decode().count("\nopen  ") == 14


@pytest.mark.parametrize(
    ("flags", "closed", "open_", "marks"),
    [
        ([], 1, 1, 1),
        (["--layer", "cut"], 1, 0, 0),
        (["--exclude-layer", "c*"], 0, 1, 1),
        (["--exclude-layer", "CUT", "--exclude-layer", "drill"], 0, 1, 0),
        (["--colour", "red"], 1, 0, 0),
        (["--colour", "1"], 1, 0, 0),
        (["--line-type", "dash*"], 0, 1, 0),
        (["--gap", "0.1um", "--layer", "Engrave"], 0, 2, 0),
    ],
)
def test_a_selection_is_read(
    camtool: Run, plate: Path, flags: list[str], closed: int, open_: int, marks: int
) -> None:
    found = facts(camtool, plate, *flags)
    assert (found["closed"], found["open"], found["marks"]) == (closed, open_, marks)


def test_a_misspelt_layer_is_an_error_that_names_the_layers(camtool: Run, plate: Path) -> None:
    done = camtool("post", plate, "--target", "pic-mmh", "--layer", "CUTS")
    assert done.returncode == 2
    assert b"no layer matches 'CUTS'" in done.stderr
    assert b"CUT, DRILL, Engrave" in done.stderr
    assert not list(plate.parent.glob("*.pic"))


def test_layer_flags_override_the_job_file(camtool: Run, plate: Path, tmp_path: Path) -> None:
    (tmp_path / "job.toml").write_text('layers = ["Engrave"]\n')
    room = ("--set", "axes.x.travel_mm=50.0", "--set", "axes.y.travel_mm=50.0")
    common = ("--target", "pic-mmh", *room, "--job", "job.toml", "--no-verify", "-o", "-")
    for flags, lines in ((), 2), (("--layer", "cut"), 4):
        done = camtool("post", plate, *common, *flags)
        assert done.returncode == 0, done.stderr
        assert done.stdout.count(b"G01X") == lines


def test_text_is_read_when_asked_for(camtool: Run, plate: Path) -> None:
    plain, strokes = facts(camtool, plate), facts(camtool, plate, "--text", "stroke")
    assert strokes["open"] > plain["open"]


def test_stdin_is_a_drawing(camtool: Run, plate: Path, samples: Path) -> None:
    piped = camtool("check", "-", "--json", "-", stdin=plate.read_bytes())
    assert piped.returncode == 0, piped.stderr
    found = json.loads(piped.stdout)
    assert found["file"] == "<stdin>"
    assert found["closed"] == 1
    named = camtool("check", "-", "--format", "points", stdin=b"0 0\n1 1\n")
    assert named.returncode == 0
    wrong = camtool("check", "-", "--format", "svg", stdin=b"0 0\n1 1\n")
    assert wrong.returncode == 2
    assert b"<stdin>" in wrong.stderr


def test_a_drawing_from_stdin_gives_its_program_to_stdout(camtool: Run, samples: Path) -> None:
    data = (samples / "logo.dxf").read_bytes()
    piped = camtool("post", "-", "--target", "pic-mmh", "--no-verify", stdin=data)
    assert piped.returncode == 0, piped.stderr
    camtool("post", samples / "logo.dxf", "--target", "pic-mmh", "--no-verify", "-o", "logo.pic")
    assert piped.stdout.startswith(b"G54;")
    again = camtool("post", samples / "logo.dxf", "--target", "pic-mmh", "--no-verify", "-o", "-")
    assert piped.stdout == again.stdout


def test_scripts_run_only_when_allowed(camtool: Run, tmp_path: Path) -> None:
    (tmp_path / "part.py").write_text("raise SystemExit('it ran')\n")
    done = camtool("check", "part.py")
    assert done.returncode == 2
    assert b"--allow-scripts" in done.stderr
    assert b"it ran" not in done.stderr
    allowed = camtool("check", "part.py", "--allow-scripts")
    assert allowed.returncode == 2
    assert b"Traceback" not in allowed.stderr


def test_chords_become_arcs_when_asked_for(camtool: Run, tmp_path: Path) -> None:
    import math

    turns = [2.0 * math.pi * k / 48 for k in range(48)]
    points = [f"{5 * math.cos(t):.6f},{5 * math.sin(t):.6f}" for t in turns]
    text = io.StringIO("\n".join([*points, points[0]])).read()
    (tmp_path / "ring.csv").write_text(text)
    assert facts(camtool, "ring.csv")["arcs"] == 0
    found = facts(camtool, "ring.csv", "--recognise-arcs")
    assert found["lines"] == 0
    assert 1 <= found["arcs"] <= 2
