"""Job files begun from a drawing: one operation for each layer, and text that loads."""

import tomllib
from pathlib import Path

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from camtool.geometry.drawing import Drawing, Mark, Units
from camtool.geometry.polylines import Polyline, Polylines
from camtool.jobs.build import job_of_file
from camtool.jobs.template import Proposal, job_template, pattern_of, toml_string
from camtool.patterns import matches
from camtool.planning.job import Job
from camtool.planning.plan import plan
from camtool.target.registry import load_target

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
    return job_of_file(folder / "made.toml")


def told(job: Job) -> list[tuple[str, str]]:
    return [(operation.kind, operation.name) for operation in job.operations]


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
        ("drill", "WINDOW points"),
        ("engrave", "LINES"),
        ("engrave", "Engraving"),
        ("engrave", "WINDOW open"),
        ("profile", "BORES"),
        ("profile", "WINDOW"),
        ("profile", "OUTLINE"),
    ]
    assert "2 closed and 0 open paths, 1 points" in text
    assert job.placement.origin == "lower-left"


def test_layers_that_differ_in_case_are_one(tmp_path: Path) -> None:
    made = drawn((square(5), "Cut", ""), (square(6), "CUT", ""), (stroke(), "cut2", ""))
    job = loaded(job_template(made), tmp_path)
    assert told(job) == [("engrave", "cut2"), ("profile", "Cut")]
    assert [job.operations[1].takes(layer, "") for layer in ("Cut", "CUT", "cut2")] == [1, 1, 0]


def test_one_layer_of_several_colours(tmp_path: Path) -> None:
    made = drawn((square(5), "0", "#ff0000"), (stroke(), "0", "#00ff00"), (stroke(), "0", ""))
    job = loaded(job_template(made), tmp_path)
    assert told(job) == [("engrave", "#00ff00"), ("engrave", "no colour"), ("profile", "#ff0000")]
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
        assert [other for other in NASTY if operation.takes(other, "")] == [name]


@given(st.text(st.characters(), max_size=20))
def test_any_text_is_a_toml_string(text: str) -> None:
    line = f"a = {toml_string(text)} # {text if text.isprintable() else ''}"
    expected = "".join("?" if "\ud800" <= char <= "\udfff" else char for char in text)
    assert tomllib.loads(line) == {"a": expected}


@given(st.text(max_size=8), st.text(alphabet="ab*?[]!-^&|~", max_size=8))
def test_a_pattern_of_a_name_matches_that_name_alone(name: str, other: str) -> None:
    for one in (name, other):
        assert matches((pattern_of(one),), one)
    assert matches((pattern_of(other),), name) == (name.casefold() == other.casefold())


def test_small_outlines_get_as_many_tabs_as_they_have_room_for(tmp_path: Path) -> None:
    # Tabs of 6 mm with a tool of 3 mm, 9 mm of its path each: half of the path is left.
    machine = load_target("grbl").machine
    for side, tabs in ((60.0, 4), (20.0, 4), (12.0, 3), (4.0, 1), (1.0, 0)):
        drawing = drawn((square(side), "0", "#000000"))
        job = loaded(job_template(drawing, None, Proposal(3.0, 3.0)), tmp_path)
        (operation,) = job.operations
        assert (operation.tabs.count if operation.tabs is not None else 0) == tabs
        plan(drawing, job, machine)


def test_a_drawing_of_points_alone_has_a_proposal(tmp_path: Path) -> None:
    text = job_template(drawn(marks=("0",)), None, Proposal(3.0, 3.0))
    (operation,) = loaded(text, tmp_path).operations
    assert operation.kind == "drill"
