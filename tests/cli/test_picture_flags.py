"""`--size`, `--crop` and `--dark` of the commands that make pictures."""

from pathlib import Path

import click
import pytest

from camtool.cli.main import cli
from camtool.errors import OptionError
from tests.oracles.png import decode


@pytest.fixture
def drawing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    Path("a.csv").write_text("0,0\n4,0\n4,3\n0,0\n", encoding="utf-8")
    return "a.csv"


def run(*arguments: str) -> None:
    cli.main([*arguments, "-q"], standalone_mode=False)


def test_a_picture_is_as_wide_as_asked(drawing: str) -> None:
    run("preview", drawing, "-o", "a.png", "--size", "321")
    assert decode(Path("a.png").read_bytes()).shape[1] == 321
    run("preview", drawing, "-o", "a.svg", "--size", "321")
    assert '<svg xmlns="http://www.w3.org/2000/svg" width="321"' in Path("a.svg").read_text()


def test_a_dark_picture_has_a_dark_ground(drawing: str) -> None:
    run("preview", drawing, "-o", "a.png", "--size", "100", "--dark")
    assert decode(Path("a.png").read_bytes())[0, 0, :3].max() < 48


def test_a_part_is_given_in_lengths(drawing: str) -> None:
    run("preview", drawing, "-o", "a.svg", "--crop", "1mm,0.5, 1/8in,2000um")
    assert "part zero" not in Path("a.svg").read_text()
    run("preview", drawing, "-o", "b.svg", "--crop", "1,0.5,3.175,2")
    assert Path("a.svg").read_bytes() == Path("b.svg").read_bytes()


@pytest.mark.parametrize("crop", ["1,2,3", "1,2,3,4,5", "a,b,c,d", "1,2,0,4", "1,2,3,-4", ""])
def test_what_is_no_part_is_refused(drawing: str, crop: str) -> None:
    with pytest.raises((click.UsageError, OptionError)):
        run("preview", drawing, "-o", "a.svg", "--crop", crop)
    assert not Path("a.svg").exists()


def test_sizes_that_nobody_can_look_at_are_refused(drawing: str) -> None:
    with pytest.raises(OptionError, match="pixels wide"):
        run("preview", drawing, "-o", "a.svg", "--size", "1000000")


def test_verify_and_preview_draw_the_same_picture(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    circle = str(Path("samples/circle-30-steps.pic").absolute())
    monkeypatch.chdir(tmp_path)
    flags = ("-t", "pic-mmh", "--size", "500", "--dark", "--exaggerate", "2")
    run("preview", circle, *flags, "--simulate", "-o", "a.svg")
    run("verify", circle, *flags, "--preview", "b.svg")
    assert Path("a.svg").read_bytes() == Path("b.svg").read_bytes()
    assert "error × 2" in Path("a.svg").read_text(encoding="utf-8")


def test_there_is_nothing_to_exaggerate_without_a_prediction(drawing: str) -> None:
    with pytest.raises(click.UsageError, match="--simulate"):
        run("preview", drawing, "-o", "a.svg", "-t", "pic-mmh", "--exaggerate", "2")


def test_layers_are_named_or_left_out(drawing: str) -> None:
    post = ("preview", drawing, "-t", "grbl", "--tool-diameter", "0.2")
    run(*post, "-o", "a.svg")
    assert {'id="swept"', 'id="order"'} <= set(Path("a.svg").read_text().replace(">", " ").split())
    run(*post, "-o", "b.svg", "--no-layer", "swept", "--no-layer", "order")
    assert not {'id="swept"', 'id="order"'} & set(Path("b.svg").read_text().split())
    run(*post, "-o", "c.svg", "--layers", "feeds, reversals")
    assert "rapids" not in Path("c.svg").read_text()
    with pytest.raises(OptionError, match="no layer"):
        run(*post, "-o", "c.svg", "--layers", "fed")


def test_a_circle_of_a_program_is_plotted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    circle = str(Path("samples/circle-30-steps.pic").absolute())
    monkeypatch.chdir(tmp_path)
    run("verify", circle, "-t", "pic-mmh", "--without", "play", "--without", "compensation",
        "--polar", "1", "--preview", "a.svg")  # fmt: skip
    assert "circle 1: radius 0.0042 mm" in Path("a.svg").read_text(encoding="utf-8")
    with pytest.raises(OptionError, match="no circle 2"):
        run("verify", circle, "-t", "pic-mmh", "--polar", "2", "--preview", "b.svg")
