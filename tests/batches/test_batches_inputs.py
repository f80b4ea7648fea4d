"""Which drawings a batch takes, and where their outputs go."""

import errno
import os
from pathlib import Path

import pytest

from camtool.batches.inputs import find_tasks
from camtool.batches.manifest import RealPaths
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
@pytest.mark.parametrize("source", ["d", "d/**/*.dxf", "d/**"])
def test_links_that_lead_round_in_circles(source: str) -> None:
    drawn("d/a.dxf", "d/x/z.dxf")
    Path("d/loop").symlink_to(".")
    Path("d/x/a-loop").symlink_to("..", target_is_directory=True)
    Path("d/x/linked.dxf").symlink_to("../../other.dxf")
    drawn("other.dxf")
    assert stems(source) == ["a", "x/linked", "x/z"]


@pytest.mark.usefixtures("here")
def test_patterns_hide_what_is_hidden_and_leave_the_output_folder_alone() -> None:
    drawn("d/a.svg", "d/.b.svg", "d/.git/c.svg", "d/build/e.svg", "d/x/build/f.svg")
    assert stems("d/**/*.svg", out="d/build") == ["a", "x/build/f"]
    assert stems("**/*.svg", out="d/build") == ["d/a", "d/x/build/f"]
    assert stems("d/.*.svg") == [".b"]
    assert stems("d/*/*.svg", out="d/build") == ["build/e"]  # by its name it is wanted
    assert stems("d/**/[ae].svg") == ["a", "build/e"]


@pytest.mark.usefixtures("here")
def test_odd_names_are_names() -> None:
    names = ("-a.dxf", "a b.dxf", "new\nline.dxf", "é.dxf", "\udcff.dxf", "%s.dxf", "'q'.dxf")
    drawn(*(f"d/{name}" for name in names))
    wanted = sorted(name.removesuffix(".dxf") for name in names)
    assert stems("d") == wanted
    assert stems("d/*") == wanted


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(
    ("one", "two"),
    [("A.dxf", "a.DXF"), ("x/é.dxf", "x/e\u0301.dxf"), ("Straße.svg", "STRASSE.svg")],
)
def test_names_that_are_one_file_elsewhere_are_refused(one: str, two: str) -> None:
    drawn(f"d/{one}", f"d/{two}")
    if len(list(Path("d").rglob("*.*"))) < 2:
        pytest.skip("they are one file here")
    with pytest.raises(OutputError, match="one file where case and the encoding of accents"):
        stems("d")


@pytest.mark.usefixtures("here")
def test_what_is_no_file_is_no_drawing() -> None:
    drawn("d/a.dxf", "d/b.dxf/c.txt")
    os.mkfifo("d/pipe.dxf")
    Path("d/gone.dxf").symlink_to("nowhere")
    assert stems("d") == ["a", "gone"]  # the link to nothing fails by its name when it is made
    assert stems("d/*.dxf") == ["a", "gone"]


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize("source", ["d", "d/**/*.dxf"])
def test_a_folder_that_cannot_be_searched_is_an_error(
    monkeypatch: pytest.MonkeyPatch, source: str
) -> None:
    drawn("d/a.dxf", "d/closed/b.dxf")
    scan = os.scandir

    def denied(place: str | Path) -> object:
        if Path(place).name == "closed":
            raise PermissionError(errno.EACCES, "Permission denied", str(place))
        return scan(place)

    monkeypatch.setattr(os, "scandir", denied)
    with pytest.raises(InputError, match=r"d/closed: cannot be searched \(Permission denied\)"):
        stems(source)


@pytest.mark.usefixtures("here")
def test_real_places_are_those_of_resolve() -> None:
    drawn("d/a.svg", "e/b.svg")
    Path("d/link.svg").symlink_to("../e/b.svg")
    Path("f").symlink_to("e")
    places = RealPaths()
    for name in ("d/a.svg", "d/link.svg", "f/b.svg", "f/../e/b.svg", "f/none", ".", "f", "d/.."):
        assert places.of(name) == Path(name).resolve(), name
        assert places.of(Path(name).absolute()) == Path(name).resolve(), name
