"""What pages and pictures show, read back from their data and from their pixels, is the program,
as a reader of its own decodes it."""

from __future__ import annotations

import base64
import io
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import ezdxf
import ezdxf.path
import numpy as np
import pytest
from PIL import Image

from camtool.arrays import Bools, Floats
from camtool.sending.live import LivePage
from camtool.target.registry import load_target
from tests.cli.conftest import Run
from tests.oracles import svg_page
from tests.oracles.page_paths import (
    Paths,
    beside,
    embedded_pictures,
    ink_beside,
    program_paths,
    svg_paths,
    viewer_paths,
)
from tests.pictures.viewer_browser import NEEDS_BROWSER, browser

pytestmark = pytest.mark.xdist_group("chromium")
"""One worker posts the samples, once."""

__all__ = ["browser"]

JOBS = {"mount": "grbl", "plate": "linuxcnc"}
"""Samples whose jobs have one tool and three, and for which machine they are posted."""

BLUE = (15, 106, 196)
"""What is fed, on light ground and on dark."""

PLUNGE = (240, 138, 29)
"""Slopes."""

Made = Callable[..., tuple[Path, Paths]]
POSTED: dict[tuple[str, str], Path] = {}
"""Folders of what was posted before, by the sample and the layers of its pictures."""


@pytest.fixture
def made(camtool: Run, samples: Path, tmp_path_factory: pytest.TempPathFactory) -> Made:
    """Posts a sample, once, with these layers: the folder of the program, the viewer and the
    report, and the program's moves."""

    def make(name: str, layers: str = "feeds,path") -> tuple[Path, Paths]:
        if (name, layers) not in POSTED:
            folder = tmp_path_factory.mktemp(name)
            drawing, job = samples / f"{name}.dxf", samples / f"{name}.toml"
            files = ("-o", folder / "p.nc", "--preview", folder / "p.html", "--report")
            line = ("post", drawing, "-t", JOBS[name], "--job", job, "-q", *files)
            done = camtool(*line, folder / "r.html", "--layers", layers)
            assert done.returncode == 0, done.stderr
            POSTED[name, layers] = folder
        folder = POSTED[name, layers]
        return folder, program_paths((folder / "p.nc").read_text())

    return make


def across(paths: list[Floats]) -> list[Floats]:
    """Those that move in XY."""
    return [path for path in paths if len(path) > 1]


def groups(svg: str, *names: str) -> list[Floats]:
    """The lines and arcs of groups of a picture, mm."""
    root = svg_page.parse(svg)
    found = [svg_page.group(root, name) for name in names]
    return [path for group in found if group is not None for path in svg_paths(group)]


@pytest.mark.parametrize("name", JOBS)
def test_the_data_of_every_page_is_the_program(made: Made, name: str) -> None:
    folder, program = made(name)
    cuts = across(program.cuts)
    # The viewer has every move, in its order.
    shown = viewer_paths((folder / "p.html").read_text())
    assert len(shown.cuts) == len(program.cuts)
    for one, other in zip(shown.cuts, program.cuts, strict=True):
        assert one.shape == other.shape
        assert np.abs(one - other).max() < 1e-4
    assert beside(shown.rapids, program.rapids) < 1e-4
    # The report shows the program, and beside it, as near as the error says, the predicted path.
    page = (folder / "r.html").read_text()
    picture = next(each for each in embedded_pictures(page) if 'id="slide-path"' in each)
    assert beside(groups(picture, "feeds"), cuts) < 2e-3
    assert beside(groups(picture, "slide-path"), cuts) < 0.05


@pytest.mark.parametrize("name", JOBS)
def test_the_data_of_pictures_is_the_program(
    made: Made, camtool: Run, samples: Path, tmp_path: Path, name: str
) -> None:
    folder, program = made(name)
    for line in (
        (str(folder / "p.nc"),),
        (str(samples / f"{name}.dxf"), "--job", str(samples / f"{name}.toml")),
    ):
        done = camtool("preview", *line, "-t", JOBS[name], "-o", "p.svg")
        assert done.returncode == 0, done.stderr
        svg = (tmp_path / "p.svg").read_text()
        assert beside(groups(svg, "feeds", "ramps"), across(program.cuts)) < 2e-3
        assert beside(groups(svg, "rapids"), across(program.rapids)) < 2e-3


@pytest.mark.parametrize("name", JOBS)
def test_the_setup_sheet_shows_the_drawing(made: Made, samples: Path, name: str) -> None:
    folder, _ = made(name)
    drawn = []
    for entity in ezdxf.readfile(samples / f"{name}.dxf").modelspace():
        if entity.dxftype() in ("DIMENSION", "TEXT", "MTEXT", "POINT"):
            continue
        points = ezdxf.path.make_path(entity).flattening(1e-4)
        drawn.append(np.array([(point.x, point.y) for point in points]))
    picture = embedded_pictures((folder / "r.html").read_text())[0]
    assert beside(groups(picture, "drawing"), drawn) < 2e-3


def pixels(png: bytes, *colours: tuple[int, int, int], near: int = 60) -> Bools:
    """Mark the pixels of a picture that have nearly one of the colours."""
    rgb = np.array(Image.open(io.BytesIO(png)).convert("RGB")).astype(int)
    alike = [np.abs(rgb - colour).sum(axis=2) < near for colour in colours]
    return np.asarray(np.logical_or.reduce(alike))


def check_ink(ink: Bools, paths: list[Floats], wide_px: float, zoom: int = 1) -> None:
    """Ink lies along the paths, and nowhere else; it is so wide at most, in px of the page, of
    which each is `zoom` pixels."""
    box = np.concatenate(paths)
    far, missing = ink_beside(ink, paths, (*box.min(axis=0).tolist(), *box.max(axis=0).tolist()))
    assert far < zoom * (0.5 * wide_px + 1.5)
    assert missing < zoom * (0.5 * wide_px + 1.5)


def test_the_comparison_of_pixels_can_fail() -> None:
    square = np.array([[0.0, 0.0], [9.0, 0.0], [9.0, 9.0], [0.0, 9.0], [0.0, 0.0]])
    dense = [np.linspace(a, b, 100) for a, b in pairwise(square)]
    ink = np.zeros((100, 100), dtype=np.bool_)
    ink[5, 5:96] = ink[95, 5:96] = ink[5:96, 5] = ink[5:96, 95] = True
    check_ink(ink, dense, 1.0)
    bow_tie = square[[0, 1, 3, 2, 0]]
    crossed = [np.linspace(a, b, 100) for a, b in pairwise(bow_tie)]
    with pytest.raises(AssertionError):
        check_ink(ink, crossed, 1.0)
    with pytest.raises(AssertionError):
        check_ink(ink, dense[:3], 1.0)


def done_ink(page: Any) -> Bools:
    """Pixels of the viewer's canvas of what is done."""
    page.wait_for_timeout(100)
    page.wait_for_function("() => !document.body.dataset.waiting")
    shown = page.evaluate(
        "() => document.getElementById('done').toDataURL('image/png').split(',')[1]"
    )
    rgba = np.array(Image.open(io.BytesIO(base64.b64decode(shown))).convert("RGBA"))
    return np.asarray(rgba[:, :, 3] > 100)


WINDOWS = [
    pytest.param(1200, "light", id="desk"),
    pytest.param(390, "dark", id="phone in the dark"),
]
BROWSER = [*NEEDS_BROWSER]


def density(width: int) -> int:
    """Pixels of the screen for one of the page, as phones have them."""
    return 3 if width < 500 else 1


def opened(browser: Any, file: Path, width: int, scheme: str) -> Any:
    """The page in a window; nothing of it is wider than that."""
    page = browser.new_page(
        viewport={"width": width, "height": 850},
        color_scheme=scheme,
        device_scale_factor=density(width),
    )
    page.goto(file.as_uri())
    page.wait_for_timeout(200)
    assert page.evaluate("() => document.documentElement.scrollWidth") <= width
    return page


@pytest.mark.parametrize(("width", "scheme"), WINDOWS)
@pytest.mark.parametrize("name", ["mount", pytest.param("plate", marks=pytest.mark.slow)])
class TestPixels:
    """Pixels of the pages in a browser."""

    pytestmark = BROWSER

    def test_the_live_page(
        self, made: Made, browser: Any, name: str, width: int, scheme: str
    ) -> None:
        folder, program = made(name)
        target = load_target(JOBS[name])
        data = (folder / "p.nc").read_bytes()
        live = LivePage(folder / "live.html", "p.nc", target.target.read(data, target.machine))
        text = live.html("finished", {"block": "9"}, 10**6, share=1.0)
        assert beside(viewer_paths(text).cuts, program.cuts) < 1e-3
        live.write(text)
        page = opened(browser, folder / "live.html", width, scheme)
        page.wait_for_selector("body[data-painted]")
        page.keyboard.press("r")  # without rapids
        check_ink(done_ink(page), program.cuts, 5.0, density(width))
        assert "100 %" in page.inner_text("body")

    def test_the_report(
        self, made: Made, browser: Any, name: str, width: int, scheme: str
    ) -> None:
        folder, program = made(name, "feeds")
        page = opened(browser, folder / "r.html", width, scheme)
        picture = page.locator("figure img").first
        # The legend has these colours too.
        svg = next(
            each
            for each in embedded_pictures((folder / "r.html").read_text())
            if 'id="feeds"' in each
        )
        root = svg_page.parse(svg)
        frame = next(svg_page.group(root, "axes").iter(f"{svg_page.SVG}rect"))  # type: ignore[union-attr]
        left, low, wide, high = (float(frame.attrib[key]) for key in ("x", "y", "width", "height"))
        # A phone shows lines of a pixel, which are blended with the paper.
        ink = pixels(picture.screenshot(), BLUE, PLUNGE, near=200)
        zoom = ink.shape[1] / float(root.attrib["viewBox"].split()[2])
        inner = [round(zoom * each) for each in (low, low + high, left, left + wide)]
        ink = ink[inner[0] + 2 : inner[1] - 2, inner[2] + 2 : inner[3] - 2]
        check_ink(ink, across(program.cuts), 4.0, density(width))

    def test_the_viewer(
        self, made: Made, browser: Any, name: str, width: int, scheme: str
    ) -> None:
        folder, program = made(name)
        page = opened(browser, folder / "p.html", width, scheme)
        page.wait_for_selector("body[data-painted]")
        page.keyboard.press("r")  # without rapids
        check_ink(done_ink(page), program.cuts, 5.0, density(width))
