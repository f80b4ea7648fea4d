"""Which drawings a batch takes, and where their outputs go."""

from pathlib import Path

import pytest

from camtool.batch.inputs import find_tasks, refuse_overwriting
from camtool.errors import InputError, OutputError


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def drawn(*names: str) -> None:
    for name in names:
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        Path(name).write_text("drawing")


def stems(*sources: str, out: str = "build", made: frozenset[Path] = frozenset()) -> list[str]:
    return [task.stem for task in find_tasks(sources, Path(out), made)]


@pytest.mark.usefixtures("here")
def test_a_folder_keeps_its_structure() -> None:
    drawn("d/a.dxf", "d/x/y/b.SVG", "d/x/c.d.step", "d/notes.txt", "d/.git/e.dxf", "d/.f.dxf")
    assert stems("d") == ["a", "x/c.d", "x/y/b"]
    assert stems("d/") == stems("d")


@pytest.mark.usefixtures("here")
def test_a_pattern_keeps_what_lies_below_its_wildcards() -> None:
    drawn("parts/a.dxf", "parts/x/b.dxf", "parts/x/c.svg", "parts/x/p.csv")
    assert stems("parts/**/*.dxf") == ["a", "x/b"]
    assert stems("parts/x/*") == ["b", "c", "p"]
    assert stems("*/*.dxf") == ["parts/a"]


def test_an_absolute_pattern(here: Path) -> None:
    drawn("parts/x/b.dxf")
    assert stems(f"{here}/parts/**/*.dxf") == ["x/b"]


@pytest.mark.usefixtures("here")
def test_a_file_is_taken_whatever_its_extension_or_name() -> None:
    drawn("points/p.csv", "points/[1].dxf")
    assert stems("points/p.csv", "points/[1].dxf") == ["[1]", "p"]


@pytest.mark.usefixtures("here")
def test_outputs_are_no_drawings() -> None:
    drawn("a.dxf", "build/a.svg", "old/b.svg", "old/c.svg")
    assert stems(".") == ["a", "old/b", "old/c"]
    assert stems(".", made=frozenset({Path("old/b.svg").resolve()})) == ["a", "old/c"]


@pytest.mark.usefixtures("here")
def test_a_drawing_that_is_named_twice_counts_once() -> None:
    drawn("d/x/a.dxf")
    assert stems("d", "d/x/*.dxf", "d/../d/x/a.dxf") == ["x/a"]


@pytest.mark.usefixtures("here")
def test_two_drawings_to_one_output_are_refused_and_named() -> None:
    drawn("d/a.dxf", "d/a.svg", "e/a.dxf")
    with pytest.raises(OutputError, match=r"d/a\.dxf and d/a\.svg would both be written as a\.\*"):
        stems("d")
    with pytest.raises(OutputError, match=r"d/a\.dxf and e/a\.dxf"):
        stems("d/*.dxf", "e")


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize("source", ["nothing", "*.dxf", "empty"])
def test_a_source_without_drawings_is_an_error(source: str) -> None:
    Path("empty").mkdir()
    with pytest.raises(InputError, match=source.replace("*", r"\*")):
        stems(source)


@pytest.mark.usefixtures("here")
def test_an_output_never_takes_the_place_of_a_drawing() -> None:
    drawn("a.svg", "b.dxf")
    tasks = find_tasks(["."], Path(), frozenset())
    with pytest.raises(OutputError, match=r"take the place of a\.svg"):
        refuse_overwriting(tasks, Path(), [".pic", ".svg"])
    refuse_overwriting(tasks, Path(), [".pic", ".png"])
    refuse_overwriting(tasks, Path("build"), [".pic", ".svg"])
