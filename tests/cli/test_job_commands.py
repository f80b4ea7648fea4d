"""`camtool job new` writes files that load, whatever a drawing holds; `job check` says what is."""

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.jobs.build import build_job
from camtool.jobs.file import Said, read_job_file
from camtool.jobs.template import job_template, pattern_of, quoted
from camtool.geometry.drawing import Drawing, Mark, Units
from camtool.geometry.polylines import Polyline, Polylines
from camtool.patterns import matches
from camtool.planning.job import Job
from tests.cli.conftest import ROOT, Run

SAMPLES = ("logo.dxf", "logo.svg", "plate.dxf", "coupon.dxf", "star.csv")
NASTY = (
    '"]\nkind = "drill"\n[[operations]]',
    'a"""b\\',
    "# no comment\r\n[stock]\nthickness = 1",
    "{x = 1}",
    "[a-z]*?",
    "\x00\x07\x1b\x7f\x85\u2028\u202e",
    "Fräsen ± µ ⌀ 𝄞",
    "lone \ud800 half",
    "",
    " ",
    "x" * 300,
)


def square(side: float, x: float = 0.0) -> Polyline:
    points = np.array([[0, 0, 0], [side, 0, 0], [side, side, 0], [0, side, 0.0]])
    return Polyline(points + np.array([x, 0.0, 0.0]), True)


def circle(diameter: float) -> Polyline:
    return Polyline(np.array([[0, 0, 1.0], [diameter, 0, 1.0]]), True)


def stroke() -> Polyline:
    return Polyline(np.array([[0, 0, 0], [1, 1, 0.0]]))


def drawn(*rows: tuple[Polyline, str, str], marks: tuple[str, ...] = ()) -> Drawing:
    """A drawing of paths, each with its layer and colour, and of marks on layers."""
    return Drawing(
        Polylines.of(path for path, _, _ in rows),
        tuple(layer for _, layer, _ in rows),
        tuple(colour for _, _, colour in rows),
        ("",) * len(rows),
        "part\n.dxf",
        Units("mm", 1.0, "said by the test"),
        marks=tuple(Mark((0.0, 0.0), layer, "", "") for layer in marks),
    )


def loaded(text: str, folder: Path) -> Job:
    (folder / "made.toml").write_text(text, encoding="utf-8")
    return build_job(read_job_file(folder / "made.toml"), Said())


def told(job: Job) -> list[tuple[str, str]]:
    return [(operation.kind, operation.name) for operation in job.operations]


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


def test_the_kinds_and_their_order(tmp_path: Path) -> None:
    made = drawn(
        (square(50), "OUTLINE", ""),
        (circle(3), "HOLES", ""),
        (circle(5), "HOLES", ""),
        (circle(5.3), "BORES", ""),
        (stroke(), "LINES", ""),
        (square(5), "Engraving", ""),
        (square(9), "WINDOW", ""),
        (stroke(), "WINDOW", ""),
        marks=("POINTS", "HOLES", "WINDOW"),
    )
    text = job_template(made)
    job = loaded(text, tmp_path)
    assert told(job) == [
        ("drill", "POINTS"),
        ("drill", "HOLES"),
        ("engrave", "LINES"),
        ("engrave", "Engraving"),
        ("profile", "BORES"),
        ("profile", "WINDOW"),
        ("profile", "OUTLINE"),
    ]
    assert "2 closed and 0 open paths, 1 points" in text
    assert text.count("# The points are not cut by this") == 1
    assert job.placement.origin == "lower-left"


def test_layers_that_differ_in_case_are_one(tmp_path: Path) -> None:
    made = drawn((square(5), "Cut", ""), (square(6), "CUT", ""), (stroke(), "cut2", ""))
    job = loaded(job_template(made), tmp_path)
    assert told(job) == [("engrave", "cut2"), ("profile", "Cut")]
    assert [job.operations[1].takes(layer) for layer in ("Cut", "CUT", "cut2")] == [1, 1, 0]


def test_one_layer_of_several_colours(tmp_path: Path) -> None:
    made = drawn((square(5), "0", "#ff0000"), (stroke(), "0", "#00ff00"), (stroke(), "0", ""))
    job = loaded(job_template(made), tmp_path)
    assert told(job) == [
        ("engrave", "#00ff00"),
        ("engrave", "no colour"),
        ("profile", "#ff0000"),
    ]
    for operation, colour in zip(job.operations, ("#00ff00", "", "#ff0000"), strict=True):
        taken = [c for c in ("#00ff00", "", "#ff0000") if operation.takes("0", c)]
        assert taken == [colour]


def test_names_of_any_kind_are_text_and_nothing_else(tmp_path: Path) -> None:
    made = drawn(*((square(5.0 + row), name, "") for row, name in enumerate(NASTY)))
    text = job_template(made)
    assert all(char.isprintable() or char == "\n" for char in text)
    said = tomllib.loads(text)
    assert set(said) == {"place", "tools", "operations"}
    assert len(said["operations"]) == len(NASTY)
    for row in said["operations"]:
        assert set(row) == {"name", "kind", "layers", "tool"}
    job = loaded(text, tmp_path)
    for operation, name in zip(job.operations, NASTY, strict=True):
        assert [other for other in NASTY if operation.takes(other)] == [name]


@given(st.text(st.characters(), max_size=20))
def test_any_text_is_a_toml_string(text: str) -> None:
    line = f"a = {quoted(text)} # {text if text.isprintable() else ''}"
    expected = "".join("?" if "\ud800" <= char <= "\udfff" else char for char in text)
    assert tomllib.loads(line) == {"a": expected}


@given(st.text(max_size=8), st.text(alphabet="ab*?[]!-^&|~", max_size=8))
def test_a_pattern_of_a_name_matches_that_name_alone(name: str, other: str) -> None:
    for one in (name, other):
        assert matches((pattern_of(one),), one)
    assert matches((pattern_of(other),), name) == (name.casefold() == other.casefold())


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
        rows = done.stdout.decode().splitlines()[2::2]
        assert [row.strip() for row in rows] == [f"{each}, 0 points" for each in taken]
