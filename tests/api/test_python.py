"""camtool from Python: the names, what they give, and that it is what the commands do."""

import ast
import inspect
import pkgutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path
from typing import get_type_hints

import pytest

import camtool
from camtool import api
from camtool.cli.main import cli
from camtool.importers.options import ReadOptions, Selection
from camtool.pictures.options import PictureOptions
from camtool.records import replace
from camtool.run import Run
from camtool.target import registry

LOGO = Path("samples/logo.dxf")
SQUARE = "0,0\n4,0\n4,4\n0,4\n0,0\n"


@pytest.fixture
def square(tmp_path: Path) -> Path:
    file = tmp_path / "square.csv"
    file.write_text(SQUARE)
    return file


@pytest.fixture(scope="module")
def posted(tmp_path_factory: pytest.TempPathFactory) -> Run:
    file = tmp_path_factory.mktemp("api") / "square.csv"
    file.write_text(SQUARE)
    return api.post(file, "pic-mmh")


def test_every_name_is_there_and_documented() -> None:
    for name in camtool.__all__:
        value = getattr(camtool, name)
        assert (value.__doc__ or "").strip(), name
        assert name in dir(camtool)
    with pytest.raises(AttributeError, match="no attribute 'plann'"):
        _ = camtool.plann


def test_the_names_are_the_same_for_all() -> None:
    assert camtool.__all__ == api.__all__
    assert camtool.__all__ == sorted(camtool.__all__)
    # What editors and type checkers see.
    tree = ast.parse(inspect.getsource(camtool))
    seen = next(node for node in tree.body if isinstance(node, ast.If)).body
    imports = [node for node in seen if isinstance(node, ast.ImportFrom)]
    assert [(node.module, node.names[0].name) for node in imports] == [("camtool.api", "*")]


@pytest.mark.parametrize("first", ["camtool.verification", "camtool.pictures.draw", "camtool.api"])
def test_calls_are_functions_whoever_comes_first(first: str) -> None:
    """A room is named by a noun and a call by a verb: neither takes the other's place."""
    code = f"""
import {first}, camtool.pictures.draw, camtool.pipeline, inspect
assert camtool.Job and inspect.isfunction(camtool.verify) and inspect.isfunction(camtool.preview)
assert inspect.ismodule(camtool.pictures.draw) and not callable(camtool.pipeline)
"""
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize(
    "first", ["camtool.load_target('grbl')", "import camtool.pipeline", "import camtool.target"]
)
def test_every_name_holds_after_any_other(first: str) -> None:
    """No room has the name of a call, so that none takes its place when it is imported."""
    code = f"import camtool; {first}; assert camtool.targets()"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_no_room_has_the_name_of_a_call() -> None:
    rooms = {module.name for module in pkgutil.iter_modules(camtool.__path__)}
    assert not rooms & set(camtool.__all__)


def test_reading_takes_every_field_of_the_options() -> None:
    patterns = {each.name: Sequence[str] for each in fields(Selection)}
    options = get_type_hints(ReadOptions)
    del options["select"]
    assert get_type_hints(api.Reading) == options | patterns


def test_pictures_take_every_option() -> None:
    assert set(api.Looks.__annotations__) == {each.name for each in fields(PictureOptions)}


def test_looks_change_a_picture(posted: Run) -> None:
    usual = camtool.preview(posted)
    for looks in ({"size_px": 400}, {"dark": True}, {"crop_mm": (0.0, 0.0, 1.0, 1.0)}):
        assert camtool.preview(posted, **looks).svg != usual.svg
    assert usual.svg == usual.render("square.svg").decode() == usual._repr_svg_()
    assert repr(usual) == "<Picture of square.csv>"


def test_the_viewer_has_the_programs_blocks(posted: Run, tmp_path: Path) -> None:
    camtool.preview(posted).save(tmp_path / "square.html")
    assert posted.verification is not None
    page = camtool.preview(camtool.verify(posted.data, "pic-mmh")).render("x.html")
    assert b"<html" in page
    assert b"G01" in page
    assert (tmp_path / "square.html").read_bytes().startswith(b"<!")


def test_a_drawing_prints_and_shows_itself() -> None:
    drawing = camtool.read_drawing(LOGO, target="pic-mmh")
    assert repr(drawing) == (
        "<Drawing samples/logo.dxf: 4.880 × 4.880 mm, 23 closed and 9 open contours>"
    )
    assert drawing._repr_svg_().startswith("<svg")
    cut = camtool.read_drawing(LOGO, layers=["CUT"])
    assert set(cut.layers) == {"CUT"}
    assert set(camtool.read_drawing(LOGO, colours=["red"]).colours) == {"#ff0000"}


def test_the_targets_tolerance_reads_a_drawing() -> None:
    coarse = camtool.read_drawing(LOGO, target="grbl")
    fine = camtool.read_drawing(LOGO, target="grbl", tolerance_mm=0.0001)
    assert len(fine.paths.vertices) > len(coarse.paths.vertices)


def test_post_gives_what_the_command_writes(posted: Run, tmp_path: Path) -> None:
    from click.testing import CliRunner

    output = tmp_path / "square.pic"
    arguments = ["post", posted.drawing.file, "-t", "pic-mmh", "-q", "-o", str(output)]
    CliRunner().invoke(cli, arguments, standalone_mode=False, catch_exceptions=False)
    assert posted.data == output.read_bytes()
    assert not posted.failed
    assert "µm at most" in str(posted)
    assert repr(posted).startswith("<Run of square.csv on pic-mmh: ")


def test_verify_of_bytes_a_file_and_a_program(posted: Run, tmp_path: Path) -> None:
    file = tmp_path / "square.pic"
    file.write_bytes(posted.data)
    assert posted.program is not None
    by = [camtool.verify(each, "pic-mmh") for each in (posted.data, file, posted.program)]
    assert len({each.report.error_um.total.max for each in by}) == 1
    assert [each.report.source for each in by] == ["<bytes>", str(file), "<bytes>"]
    held = camtool.verify(file, "pic-mmh", against=posted.drawing)
    assert posted.verification is not None
    assert held.report.error_um.total.max == posted.verification.report.error_um.total.max
    assert "error " in repr(held)


def test_everything_has_a_picture(posted: Run) -> None:
    verdict = posted.verification
    assert isinstance(verdict, camtool.Verification)
    path = camtool.plan(posted.drawing, "pic-mmh")
    again = camtool.verify(posted.data, "pic-mmh")
    shown = [camtool.preview(posted.drawing), camtool.preview(path), camtool.preview(posted)]
    shown.append(camtool.preview(again))
    pictures = [each.svg for each in shown]
    assert all(svg.startswith("<svg") for svg in pictures)
    assert pictures[0] != pictures[1] != pictures[2]
    assert camtool.preview(posted).svg == posted._repr_svg_()
    with pytest.raises(camtool.CamtoolError, match="drawing is of type int"):
        camtool.preview(3)  # type: ignore[arg-type]


def test_the_houses_own_records_have_pictures_too(square: Path) -> None:
    from camtool.importers.read import read_drawing

    assert camtool.preview(read_drawing(square)).svg.startswith("<svg")


def test_a_picture_is_saved_by_its_extension(square: Path, tmp_path: Path) -> None:
    picture = camtool.preview(camtool.read_drawing(square))
    picture.save(tmp_path / "square.svg")
    picture.save(tmp_path / "square.png")
    assert (tmp_path / "square.svg").read_text(encoding="utf-8") == picture.svg
    assert (tmp_path / "square.png").read_bytes().startswith(b"\x89PNG")
    with pytest.raises(camtool.CamtoolError, match=r"square\.gif"):
        picture.save(tmp_path / "square.gif")


def test_jobs_say_how_it_is_cut(square: Path) -> None:
    job = camtool.job_of(tool_diameter_mm=1.0, side="outside")
    path = camtool.plan(square, "grbl", job)
    assert path.end[:, 0].max() == pytest.approx(4.5)
    assert repr(path).startswith("<Toolpath of square.csv: ")


def test_settings_of_a_machine() -> None:
    other = camtool.load_target("pic-mmh", settings={"axes.x.backlash_mm": 0.25})
    assert other.machine.axes.x.backlash_mm == 0.25
    same = camtool.load_target("pic-mmh", settings=["axes.x.backlash_mm=0.25"])
    assert same.machine == other.machine
    with pytest.raises(camtool.CamtoolError, match="did you mean pic-mmh"):
        camtool.load_target("pic-mh")


def test_a_program_with_errors_has_no_bytes(posted: Run) -> None:
    without = replace(posted, program=None)
    with pytest.raises(camtool.CamtoolError, match="must not be run"):
        _ = without.data


def test_mistakes_are_one_line(tmp_path: Path) -> None:
    with pytest.raises(camtool.CamtoolError, match="cannot be read"):
        camtool.verify(tmp_path / "none.pic", "pic-mmh")
    with pytest.raises(camtool.CamtoolError, match="there is no such file"):
        camtool.post(tmp_path / "none.dxf", "pic-mmh")
    with pytest.raises(camtool.CamtoolError, match="unknown unit"):
        camtool.read_drawing(LOGO, units="furlong")


def test_targets_are_listed_and_a_broken_one_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    names = [each.target.name for each in camtool.targets()]
    assert "pic-mmh" in names
    assert names == sorted(names)
    monkeypatch.setattr(registry, "target_names", lambda: ["grbl", "broken"])
    with pytest.warns(UserWarning, match="broken"):
        assert [each.target.name for each in camtool.targets()] == ["grbl"]
