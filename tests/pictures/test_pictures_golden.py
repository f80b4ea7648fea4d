"""Pictures stay as they are: SVG byte by byte, PNG pixel by pixel against tests/golden, re-blessed
only by --bless."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from camtool.geometry.polylines import Polylines, Segments
from camtool.pictures.beside import draw_beside
from camtool.pictures.draw import draw, png
from camtool.pictures.layers import layer_names
from camtool.pictures.options import PictureOptions
from camtool.pictures.overlay import Overlay, draw_overlay
from camtool.pictures.scene import Round, Scene
from camtool.records import replace
from tests.oracles.png import decode
from tests.pictures.conftest import SCENES, circle, cut_by, followed, plate

GOLDEN = Path(__file__).parents[1] / "golden"
PNG_PX = 240
"""Width of the goldens of pixels: as small as can be read."""

MAX_CHANGED_SHARE, CHANGED = 5e-4, 48
"""So many of the pixels may be another by more than this: another version of the renderer may
round an edge the other way, but moves nothing."""

DRESSED = replace(
    SCENES["result"],
    wanted=Segments.of(Polylines.of([circle(2.5, 2.5, 2.0)])),
    worst=((4.5, 2.5), (2.5, 4.5)),
)
MENDED = replace(DRESSED, title="the same, bent", trace_error_mm=0.4 * DRESSED.trace_error_mm)
ENGAGED = replace(SCENES["toolpath"], cut=cut_by(followed(plate()), 0.5))
MILLED = replace(SCENES["toolpath"], tool_mm=0.5)


def lobes(ccw: bool, phase: float, number: int | None) -> Round:
    """A circle whose radius is off by three lobes of 10 µm, in bins of one point each."""
    angle = (np.arange(720) + 0.5) * np.pi / 360.0
    radius = 2.0 + 0.01 * np.sin(3.0 * angle + phase)
    point = radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    square = radius[:, None] ** 2
    bins = np.hstack([np.ones((720, 1)), point, square, point, square, point])
    figures = (0.02, (0.01, -0.01, 0.0), (0.001, -0.002))
    return Round((0.0, 0.0), 2.0, ccw, bins, *figures, number, 0.021)


LOBED = Scene("Three lobes", rounds=(lobes(False, 0.0, None),))
BALLBAR = Scene("Both ways", rounds=(lobes(True, 0.0, 2), lobes(False, 0.5, 1)))


def compared() -> Overlay:
    """Two ways to run the plate's path, one of them beside it."""
    angle = np.linspace(0.0, 2.0 * np.pi, 60)
    ring = 2.5 + 0.98 * np.column_stack([np.cos(angle), np.sin(angle)])
    steps = np.array([[0.5, 0.5], [2.5, 0.55], [4.5, 0.55]])
    window = np.array([[0.0, 4.0], [0.2, 3.6]])
    runs = [("stairs", [ring]), ("bridge", [ring + 0.05, steps])]
    return Overlay("Two methods", window, followed(plate()), runs, ("a note",))


def one(scene: Scene, **looks: object) -> Callable[[], str]:
    return lambda: draw(scene, PictureOptions(**looks))


def beside(*scenes: Scene, **looks: object) -> Callable[[], str]:
    return lambda: draw_beside(scenes, PictureOptions(**looks))


PICTURES = {
    **{name: one(SCENES[name]) for name in ("drawing", "toolpath", "result", "line", "ramp")},
    "dark": one(DRESSED, dark=True, size_px=400, exaggerate=10.0),
    "layers": one(MILLED, layers=frozenset(layer_names()), crop_mm=(0.0, 0.0, 3.0, 3.0)),
    "engagement": one(ENGAGED, layers=frozenset({"drawing", "engagement"})),
    "engagement-dark": one(ENGAGED, layers=frozenset({"engagement", "rapids"}), dark=True),
    "overlay": lambda: draw_overlay(compared()),
    "polar": one(LOBED, polar=1),
    "polar-both": one(BALLBAR, polar=2, dark=True),
    "beside": beside(DRESSED, MENDED, exaggerate=20.0),
    "beside-wide": beside(SCENES["wide"], SCENES["wide"], dark=True),
    "beside-polar": beside(LOBED, BALLBAR, polar=1),
}


def compare(name: str, svg: str, folder: Path) -> None:
    path = folder / f"preview-{name}.svg"
    assert path.exists(), f"{path.name} is missing: look at the picture, then run with --bless"
    assert svg == path.read_text(encoding="utf-8"), f"{path.name} differs"


def compare_pixels(name: str, image: bytes, folder: Path) -> None:
    path = folder / f"preview-{name}.png"
    assert path.exists(), f"{path.name} is missing: look at the picture, then run with --bless"
    new, old = decode(image).astype(int), decode(path.read_bytes()).astype(int)
    assert new.shape == old.shape, f"{path.name} has another size"
    changed = (np.abs(new - old).max(axis=2) > CHANGED).mean()
    assert changed <= MAX_CHANGED_SHARE, f"{path.name}: {changed:.1%} of its pixels differ"


@pytest.mark.parametrize("name", list(PICTURES))
def test_pictures_stay_as_they_are(name: str, pytestconfig: pytest.Config) -> None:
    svg = PICTURES[name]()
    image = png(svg, PNG_PX)
    if pytestconfig.getoption("--bless", default=False):
        (GOLDEN / f"preview-{name}.svg").write_text(svg, encoding="utf-8")
        (GOLDEN / f"preview-{name}.png").write_bytes(image)
    compare(name, svg, GOLDEN)
    compare_pixels(name, image, GOLDEN)


def test_no_golden_is_left_over() -> None:
    found = {path.name for path in GOLDEN.glob("preview-*")}
    assert found == {f"preview-{name}.{kind}" for name in PICTURES for kind in ("svg", "png")}


def test_the_comparison_can_fail(tmp_path: Path) -> None:
    svg = draw(SCENES["line"])
    with pytest.raises(AssertionError, match="is missing"):
        compare("line", svg, tmp_path)
    (tmp_path / "preview-line.svg").write_text(svg.replace("0.5", "0.6", 1), encoding="utf-8")
    with pytest.raises(AssertionError, match="differs"):
        compare("line", svg, tmp_path)


def test_the_comparison_of_pixels_can_fail(tmp_path: Path) -> None:
    svg = draw(SCENES["line"])
    image = png(svg, PNG_PX)
    with pytest.raises(AssertionError, match="is missing"):
        compare_pixels("line", image, tmp_path)
    (tmp_path / "preview-line.png").write_bytes(image)
    compare_pixels("line", image, tmp_path)
    without_scale_bar = svg[: svg.index('<g id="scale-bar"')] + "</svg>"
    with pytest.raises(AssertionError, match="of its pixels differ"):
        compare_pixels("line", png(without_scale_bar, PNG_PX), tmp_path)
