"""`camtool job new` writes files that load, whatever a drawing holds; `job check` says what is."""

import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import ezdxf
import pytest

from camtool.jobs.build import JobTables, build_job, read_job_file
from camtool.planning.job import Job
from tests.cli.conftest import ROOT, Run

SAMPLES = ("logo.dxf", "logo.svg", "plate.dxf", "coupon.dxf", "star.csv")


def loaded(text: str, folder: Path) -> Job:
    (folder / "made.toml").write_text(text, encoding="utf-8")
    return build_job(read_job_file(folder / "made.toml"), JobTables())


@pytest.mark.parametrize("name", SAMPLES)
def test_a_new_file_works_as_it_is(camtool: Run, tmp_path: Path, name: str) -> None:
    sample = ROOT / "samples" / name
    done = camtool("job", "new", sample)
    assert done.returncode == 0, done.stderr
    assert b"written: job.toml" in done.stderr
    posted = camtool(
        "post", sample, "-t", "grbl", "--job", "job.toml", "--no-verify", "-o", "a.nc"
    )
    assert posted.returncode == 0, posted.stderr
    assert (tmp_path / "a.nc").stat().st_size > 100


@pytest.mark.parametrize("name", SAMPLES)
def test_every_comment_is_a_key_when_uncommented(camtool: Run, tmp_path: Path, name: str) -> None:
    text = camtool("job", "new", ROOT / "samples" / name, "-o", "-").stdout.decode()
    whole = re.sub(r"^# (?=\[stock\]|\w+ = )", "", text, flags=re.MULTILINE)
    assert len(tomllib.loads(whole)["operations"][-1]) >= 13
    (tmp_path / "tool.tbl").write_text("T1 P1 D1\n")
    job = loaded(whole, tmp_path)
    assert (job.minimise, job.approach, job.placement.copies) == ("reversals", True, (3, 2))
    assert job.stock is not None
    assert job.operations[-1].tool.kind == "v"


def test_the_machine_is_told(camtool: Run, samples: Path) -> None:
    logo, plate = samples / "logo.dxf", samples / "plate.dxf"
    text = camtool("job", "new", logo, "-t", "pic-mmh", "-o", "-").stdout.decode()
    assert "# pic-mmh: travel 10 by 7 mm\n" in text
    assert "# pic-mmh: feed 0.8 mm/min, depth 0.02 mm, safe_z 0.2 mm" in text
    assert 'fit = "10x7mm" in' not in text
    text = camtool("job", "new", plate, "-t", "pic-mmh", "-o", "-").stdout.decode()
    assert 'The drawing is larger: fit = "10x7mm" in [place]' in text


def test_an_old_file_stays(camtool: Run, tmp_path: Path, samples: Path) -> None:
    (tmp_path / "job.toml").write_text("old")
    done = camtool("job", "new", samples / "logo.dxf")
    assert done.returncode == 2
    assert b"job.toml: exists already" in done.stderr
    assert (tmp_path / "job.toml").read_text() == "old"


def test_a_drawing_that_is_none_leaves_no_file(camtool: Run, tmp_path: Path) -> None:
    assert camtool("job", "new", "none.dxf").returncode == 2
    assert list(tmp_path.iterdir()) == []


def test_check_says_what_is_done_with_what(camtool: Run, samples: Path) -> None:
    done = camtool("job", "check", samples / "plate.toml", "--against", samples / "plate.dxf")
    assert done.returncode == 0, done.stderr
    lines = done.stdout.decode().splitlines()
    assert lines[0] == "drawing    x 0.0000 … 80.0000   y 0.0000 … 50.0000 mm"
    assert "operation  4 holes: drill, tool 3 mm (drill), 6 mm deep" in lines
    assert lines[lines.index("operation  4 holes: drill, tool 3 mm (drill), 6 mm deep") + 1] == (
        "           4 closed paths, 0 open, 0 points"
    )
    assert lines[-1] == "stock      96 by 66 by 6 mm"
    assert camtool("job", "check", samples / "plate.toml").stdout.count(b"operation") == 7


def test_check_refuses_what_post_would(camtool: Run, tmp_path: Path, samples: Path) -> None:
    (tmp_path / "job.toml").write_text("[[operations]]\nname = 'a'\nlayers = ['NONE']\n")
    assert camtool("job", "check", "job.toml").returncode == 0
    done = camtool("job", "check", "job.toml", "--against", samples / "logo.dxf")
    assert done.returncode == 2
    assert b"operation 1 'a', key layers: no layer matches 'NONE'; it has CUT, ENGRAVE" in (
        done.stderr
    )


def test_layers_are_read_as_far_as_operations_need_them(
    camtool: Run, tmp_path: Path, samples: Path
) -> None:
    for head, taken in (
        ("", ["23 closed paths, 9 open", "9 closed paths, 5 open"]),
        ("layers = ['CUT']", ["14 closed paths, 4 open", "9 closed paths, 5 open"]),
        ("colours = ['blue']", ["14 closed paths, 4 open", "9 closed paths, 5 open"]),
    ):
        rest = "name = 'b'\nlayers = ['ENG*']\n"
        text = f"[[operations]]\nname = 'a'\n{head}\n[[operations]]\n{rest}"
        (tmp_path / "job.toml").write_text(text)
        done = camtool("job", "check", "job.toml", "--against", samples / "logo.dxf")
        rows = [row for row in done.stdout.decode().splitlines() if " closed paths" in row]
        assert [row.strip() for row in rows] == [f"{each}, 0 points" for each in taken]


def test_check_draws_what_is_cut(camtool: Run, tmp_path: Path, samples: Path) -> None:
    logo = samples / "logo.dxf"
    assert camtool("job", "new", logo, "-o", "j.toml").returncode == 0
    check = ("job", "check", "j.toml", "--against", logo)
    done = camtool(*check, "-t", "linuxcnc", "--preview", "p.svg")
    assert done.returncode == 0, done.stderr
    drawn = camtool("preview", logo, "-t", "linuxcnc", "--job", "j.toml", "-o", "q.svg")
    assert drawn.returncode == 0, drawn.stderr
    assert (tmp_path / "p.svg").read_bytes() == (tmp_path / "q.svg").read_bytes()
    assert b"--preview needs" in camtool(*check, "--preview", "r.svg").stderr
    assert not (tmp_path / "r.svg").exists()


@pytest.fixture
def labelled(tmp_path: Path) -> Path:
    """A plate with a window, a hole and a text on one layer."""
    drawing = ezdxf.new(units=4)
    drawing.styles.add("A", font="arial.ttf")
    space = drawing.modelspace()
    space.add_lwpolyline([(0, 0), (100, 0), (100, 60), (0, 60)], close=True)
    space.add_lwpolyline([(60, 25), (90, 25), (90, 45), (60, 45)], close=True)
    space.add_circle((90, 10), 5)
    text = space.add_text("BRASS 80", height=5.7, dxfattribs={"style": "A"})
    text.set_placement((10, 45))
    drawing.saveas(tmp_path / "plate.dxf")
    return tmp_path / "plate.dxf"


@pytest.mark.parametrize("mode", ["stroke", "outline"])
@pytest.mark.parametrize("target", ["grbl", "linuxcnc"])
def test_text_is_no_window(camtool: Run, labelled: Path, mode: str, target: str) -> None:
    """Closed strokes and counters of letters are nothing to cut out, and take no tabs away."""
    given = ("--text", mode)
    tool = ("--tool-diameter", "3.175mm", "--thickness", "3mm", "-o", "job.toml")
    begun = camtool("job", "new", labelled, *given, *tool)
    assert begun.returncode == 0
    if b"no outline font is installed" in begun.stderr:
        pytest.skip("no outline font is installed")
    whole = tomllib.loads((labelled.parent / "job.toml").read_text())
    text, *others = whole["operations"]
    assert (text["kind"], text["select"], text["depth"]) == ("engrave", ["text"], "0.2mm")
    assert all("not text" in each["select"] for each in others)
    assert [each["kind"] for each in others] == ["bore", "profile", "profile"]
    assert "tabs" in others[-1]
    done = camtool("post", labelled, "-t", target, *given, "--job", "job.toml", "-o", "a.nc",
                   "--no-verify")  # fmt: skip
    assert done.returncode == 0, done.stderr
    # Letters 5.7 mm high are too small for this tool, which is said with one that fits.
    told = done.stderr.decode()
    assert "LINES_RUN_TOGETHER" in told
    assert re.search(r"take a tool of less than [01]\.\d+ mm", told)
    assert "TEXT " in told.split("LINES_RUN_TOGETHER")[1].split("]")[0]
    assert "GOUGE" not in told


SVG_TEXT = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="80mm" height="40mm" viewBox="0 0 80 40">'
    '<rect width="80" height="40" fill="none" stroke="#000"/>'
    '<text x="8" y="24" font-size="12">BRASS</text></svg>'
)


def test_a_new_job_engraves_text_without_a_flag(camtool: Run, labelled: Path) -> None:
    """The job says how text is read, for which a flag of post stands above it."""
    (labelled.parent / "label.svg").write_text(SVG_TEXT)
    for name in ("plate.dxf", "label.svg"):
        begun = camtool("job", "new", name, "--tool-diameter", "3mm", "-o", f"{name}.toml")
        assert begun.returncode == 0, begun.stderr
        assert b"text: engrave, since text is engraved" in begun.stderr
        whole = tomllib.loads((labelled.parent / f"{name}.toml").read_text())
        assert whole["text"] == "stroke"
        post = ("post", name, "-t", "grbl", "--job", f"{name}.toml", "--no-verify", "-o", "-")
        done = camtool(*post)
        assert done.returncode == 0, done.stderr
        assert b"is text: read it with" not in done.stderr
        skipped = camtool(*post, "--text", "skip")
        assert skipped.returncode == 2
        assert b"operation '0 text': nothing on the layers 0 is text" in skipped.stderr
    plain = camtool("post", "label.svg", "-t", "grbl", "--no-verify", "-o", "-")
    assert b"is text: read it with" in plain.stderr


def test_text_that_is_cut_as_parts_is_named(camtool: Run, labelled: Path) -> None:
    """Gouges alone say nothing of the text that they come from."""
    cut = ("post", labelled, "-t", "grbl", "--tool-diameter", "3.175mm", "--depth", "1mm",
           "-o", "-", "--no-verify")  # fmt: skip
    told = camtool(*cut, "--text", "outline").stderr.decode()
    if "no outline font is installed" in told:
        pytest.skip("no outline font is installed")
    assert "TEXT_AS_EDGE" in told
    assert 'select = ["not text"]' in told
    without = camtool(*cut, "--text", "outline", "--select", "not text")
    assert without.returncode == 0, without.stderr
    assert b"TEXT_AS_EDGE" not in without.stderr


@pytest.mark.parametrize(
    ("answer", "kinds"),
    [("", ["engrave", "profile"]), ("profile", ["profile", "profile"]), ("leave", ["profile"])],
)
def test_what_is_in_doubt_is_asked_at_a_terminal(
    tmp_path: Path, answer: str, kinds: list[str]
) -> None:
    """Two parts that are too near to each other for the mill, and one that is not."""
    boxes = "".join(f'<rect x="{x}" width="30" height="40"/>' for x in (0, 32, 100))
    (tmp_path / "parts.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="150mm" height="40mm" '
        f'viewBox="0 0 150 40"><g fill="none" stroke="#000">{boxes}</g></svg>'
    )
    command = [sys.executable, "-m", "camtool", "job", "new", "parts.svg", "--ask"]
    flags = ["--tool-diameter", "3mm", "--thickness", "3mm"]
    environment = {**os.environ, "XDG_CONFIG_HOME": str(tmp_path)}
    master, slave = os.openpty()
    try:
        os.write(master, f"{answer}\n".encode())
        done = subprocess.run(
            [*command, *flags], cwd=tmp_path, stdin=slave, capture_output=True, env=environment
        )
    finally:
        os.close(master)
        os.close(slave)
    assert done.returncode == 0, done.stderr
    assert done.stderr.count(b"How is it cut (engrave, profile, leave) [engrave]") == 1
    whole = tomllib.loads((tmp_path / "job.toml").read_text())
    assert [each["kind"] for each in whole["operations"]] == kinds


def test_questions_need_a_terminal(camtool: Run, tmp_path: Path, samples: Path) -> None:
    done = camtool("job", "new", samples / "mount.dxf", "--ask", stdin=b"profile\n")
    assert done.returncode == 2
    assert b"--ask needs a terminal: leave it out" in done.stderr
    assert not (tmp_path / "job.toml").exists()


def test_a_note_beside_a_part_is_neither_cut_nor_an_edge(camtool: Run, tmp_path: Path) -> None:
    """Where no text is cut the job skips it: letters that are left would be edges to keep."""
    (tmp_path / "a.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="80mm" height="60mm" viewBox="0 0 80 60">'
        '<g fill="none" stroke="#000"><rect x="5" y="5" width="50" height="40"/></g>'
        '<text x="30" y="47" font-size="5">oboe 2x</text></svg>'
    )
    stock = ("--tool-diameter", "3mm", "--thickness", "3mm")
    done = camtool("job", "new", "a.svg", *stock, "-o", "a.toml")
    assert b"text beside parts: not cut" in done.stderr
    assert '\ntext = "skip"' in (tmp_path / "a.toml").read_text(encoding="utf-8")
    done = camtool("post", "a.svg", "--job", "a.toml", "-t", "linuxcnc", "-o", "a.ngc")
    assert done.returncode == 0, done.stderr
    assert b"GOUGE" not in done.stderr
    assert b"ENTITY_SKIPPED" in done.stderr
