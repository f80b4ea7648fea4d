"""`--size`, `--crop`, `--dark`, `--layers` ... of the commands that make pictures."""

from base64 import b64encode
from pathlib import Path
from xml.etree import ElementTree

import click
import pytest

from camtool.cli.files import seal
from camtool.cli.main import cli
from camtool.errors import OptionError
from camtool.pictures.options import PictureOptions
from tests.cli.conftest import Run
from tests.oracles import svg_page
from tests.oracles.batch_works import HerePool
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


LOOKS = ("--size", "300", "--dark", "--exaggerate", "3", "--no-layer", "worst")
POST = ("-t", "grbl", "--tool-diameter", "0.2", "-o", "a.nc")


def test_every_command_draws_the_same_picture(drawing: str) -> None:
    run("post", drawing, *POST, *LOOKS, "--preview", "a.svg")
    run("preview", drawing, *POST[:-2], *LOOKS, "--simulate", "-o", "b.svg")
    assert Path("a.svg").read_bytes() == Path("b.svg").read_bytes()
    run("convert", "a.nc", "--from", "grbl", "--to", "linuxcnc", *LOOKS, "-o", "c.ngc",
        "--preview", "c.svg")  # fmt: skip
    run("preview", "c.ngc", "-t", "linuxcnc", *LOOKS, "--simulate", "-o", "d.svg")
    # The title is that of the program before.
    assert "error × 3" in Path("c.svg").read_text(encoding="utf-8")
    assert _path("c.svg") == _path("d.svg")
    run("check", drawing, "--size", "300", "--layers", "drawing", "--preview", "e.svg")
    run("preview", drawing, "--size", "300", "--layers", "drawing", "-o", "f.svg")
    assert Path("e.svg").read_bytes() == Path("f.svg").read_bytes()
    assert "part zero" not in Path("e.svg").read_text(encoding="utf-8")


def test_a_batch_draws_the_same_pictures_and_again_when_they_shall_look_otherwise(
    drawing: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("camtool.cli.batch_run.pool_for", lambda run, note: HerePool(run.work))
    run("post", drawing, *POST, *LOOKS, "--preview", "a.svg")
    batch = ("batch", drawing, *POST[:-2], "-o", "build", "--preview", "svg")
    run(*batch, "--size", "300")
    assert Path("build/a.svg").read_bytes() != Path("a.svg").read_bytes()
    run(*batch, *LOOKS)
    assert Path("build/a.svg").read_bytes() == seal(Path("a.svg").read_bytes(), "a")


def _path(picture: str) -> bytes:
    """The predicted path of a picture."""
    group = svg_page.group(svg_page.parse(Path(picture).read_text(encoding="utf-8")), "slide-path")
    assert group is not None
    return ElementTree.tostring(group)


SIMULATED = ("preview", "a.csv", "-t", "grbl", "--simulate", "-o", "x.svg")


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (("post", "a.csv", *POST, "--dark"), "--dark: there is no picture .* add --preview"),
        (("post", "a.csv", *POST, "--report", "-", "--polar", "1"), "no picture to make"),
        (("post", "a.csv", *POST, "--report", "r.json", "--dark"), "no picture to make"),
        (("check", "a.csv", "--size", "0"), "--size: there is no picture"),
        (("verify", "a.nc", "-t", "grbl", "--no-layer", "path"), "--no-layer: there is no pict"),
        (("convert", "a.nc", "--from", "grbl", "--to", "grbl", "--dark"), "no picture to make"),
        (("preview", "a.csv", "-o", "x.html", "--dark", "--crop", "1,1,2,2"),
         "--crop, --dark: an .html page has switches"),
        (("post", "a.csv", *POST, "--no-verify", "--preview", "x.svg", "--polar", "1"),
         "--polar needs the predicted path; drop --no-verify"),
        (("post", "a.csv", *POST, "--no-verify", "--preview", "x.svg", "--layers", "worst"),
         "--layers worst: .* drop --no-verify"),
        (("preview", "a.csv", "-t", "grbl", "-o", "x.svg", "--layers", "path"),
         "--layers path: .* add --simulate"),
        (("preview", "a.csv", "-o", "x.svg", "--layers", "feeds"), "--layers feeds: .* --target"),
        (("check", "a.csv", "--preview", "x.svg", "--exaggerate", "2"), "--simulate shows more"),
        (("verify", "a.nc", "-t", "grbl", "--compare", "mechanics", "--preview", "x.svg",
          "--layers", "feeds", "--polar", "1", "--dark"), "--layers, --polar: not for this"),
        (("batch", "a.csv", "-t", "grbl", "-o", "b", "--dark"), "--dark: there is no picture"),
        (("batch", "a.csv", "-t", "grbl", "-o", "b", "--preview", "svg", "--no-verify", "--polar",
          "1"), "drop --no-verify"),
        ((*SIMULATED, "--layers", "path,order"), "--layers order: it is left out"),
        ((*SIMULATED, "--layers", ","), "--layers names no layer"),
        ((*SIMULATED, "--layers", "feeds", "--no-layer", "feeds"), "no layer is left"),
        ((*SIMULATED, "--polar", "1", "--crop", "1,1,2,2"), "--crop: --polar plots"),
        ((*SIMULATED, "--exaggerate", "9", "--no-layer", "path"), "path, which is left out"),
    ],
)  # fmt: skip
def test_what_no_picture_can_honour_is_refused_by_name(
    drawing: str, line: tuple[str, ...], words: str
) -> None:
    with pytest.raises((click.UsageError, OptionError), match=words):
        run(*line)
    assert [path.name for path in Path().iterdir()] == ["a.csv"]


def test_a_named_layer_that_holds_nothing_is_told(camtool: Run, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("0,0\n4,0\n4,3\n0,0\n", encoding="utf-8")
    line = ("preview", "a.csv", "-t", "grbl", "-o", "a.svg", "--layers")
    done = camtool(*line, "feeds,swept,doubts,zero")
    assert done.returncode == 0
    told = [text for text in done.stderr.decode().splitlines() if "--layers" in text]
    assert [text.split(": ")[2] for text in told] == ["--layers swept", "--layers doubts"]
    assert "--tool-diameter" in told[0]
    assert b"--layers" not in camtool(*line, "feeds,zero").stderr
    assert b"--layers" not in camtool(*line, "feeds,swept", "-q").stderr


def test_the_picture_of_a_page_takes_the_flags_and_the_page_says_nothing_of_them(
    drawing: str,
) -> None:
    run("post", drawing, *POST, *LOOKS, "--report", "r.md", "--preview", "viewer.html")
    run("preview", drawing, *POST[:-2], *LOOKS, "--simulate", "-o", "b.svg")
    assert Path("r.svg").read_bytes() == seal(Path("b.svg").read_bytes(), "r.md")
    text = Path("r.md").read_text(encoding="utf-8")
    assert "](r.svg)" in text  # a viewer is no picture to link to
    assert "--tool-diameter" in text
    assert not [flag for flag in LOOKS if flag.startswith("--") and flag in text]
    run("post", drawing, *POST, *LOOKS, "--report", "r.html")
    assert b64encode(Path("b.svg").read_bytes()) in Path("r.html").read_bytes()


def test_a_page_about_a_spoilt_part_has_its_picture(drawing: str) -> None:
    spoilt = ("post", drawing, *POST, "--report", "r.md", "--max-time", "1s")
    run(*spoilt, "--preview", "p.svg", "--dark")
    assert "](p.svg)" in Path("r.md").read_text(encoding="utf-8")
    assert Path("p.svg").exists()
    assert not Path("a.nc").exists()


def test_where_nothing_can_be_judged_the_page_is_what_matters(
    camtool: Run, tmp_path: Path
) -> None:
    (tmp_path / "a.csv").write_text("0,0\n4,0\n4,3\n0,0\n", encoding="utf-8")
    wide = ("a.csv", "-t", "pic-mmh", "--scale", "1000", "--polar", "1")
    done = camtool("post", *wide, "--report", "r.html")
    assert done.returncode == 1
    assert b"--polar: the part cannot be judged" in done.stderr
    assert "OUT_OF_TRAVEL" in (tmp_path / "r.html").read_text(encoding="utf-8")
    said = camtool("preview", *wide, "--simulate", "-o", "x.svg").stderr
    assert b"--polar: the part cannot" in said
    assert b"OUT_OF_TRAVEL" in said


def test_a_circle_has_no_part_and_no_layers_for_nobody() -> None:
    for more in ({"crop_mm": (0.0, 0.0, 1.0, 1.0)}, {"exaggerate": 2.0}, {"layers": {"path"}}):
        with pytest.raises(OptionError, match="plotted alone"):
            PictureOptions(polar=1, **more)
    assert PictureOptions(polar=1, dark=True, size_px=400).polar == 1
