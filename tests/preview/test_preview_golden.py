"""Pictures stay as they are: byte by byte against tests/golden, re-blessed only by --bless."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from camtool.geometry.polylines import Polylines, Segments
from camtool.preview.draw import Scene, draw
from camtool.preview.layers import LAYERS
from camtool.preview.options import Options
from camtool.preview.rounds import Round
from tests.preview.conftest import SCENES, circle

GOLDEN = Path(__file__).parents[1] / "golden"
DRESSED = replace(
    SCENES["result"],
    wanted=Segments.of(Polylines.of([circle(2.5, 2.5, 2.0)])),
    worst=((4.5, 2.5), (2.5, 4.5)),
)
MILLED = replace(SCENES["toolpath"], tool_mm=0.5)


def lobed() -> Scene:
    """A circle whose radius is off by three lobes of 10 µm, in bins of one point each."""
    angle = (np.arange(720) + 0.5) * np.pi / 360.0
    radius = 2.0 + 0.01 * np.sin(3.0 * angle)
    point = radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    square = radius[:, None] ** 2
    bins = np.hstack([np.ones((720, 1)), point, square, point, square, point])
    one = Round((0.0, 0.0), 2.0, False, bins, 0.02, (0.01, -0.01, 0.0), (0.001, -0.002))
    return Scene("Three lobes", rounds=(one,))


PICTURES = {
    "polar": (lobed(), Options(polar=1)),
    **{name: (SCENES[name], Options()) for name in ("drawing", "toolpath", "result", "line")},
    "dark": (DRESSED, Options(dark=True, size_px=400, exaggerate=10.0)),
    "layers": (MILLED, Options(layers=frozenset(LAYERS), crop_mm=(0.0, 0.0, 3.0, 3.0))),
}


def compare(name: str, svg: str, folder: Path) -> None:
    path = folder / f"preview-{name}.svg"
    assert path.exists(), f"{path.name} is missing: look at the picture, then run with --bless"
    assert svg == path.read_text(encoding="utf-8"), f"{path.name} differs"


@pytest.mark.parametrize("name", list(PICTURES))
def test_pictures_stay_as_they_are(name: str, pytestconfig: pytest.Config) -> None:
    scene, options = PICTURES[name]
    svg = draw(scene, options=options)
    if pytestconfig.getoption("--bless", default=False):
        (GOLDEN / f"preview-{name}.svg").write_text(svg, encoding="utf-8")
    compare(name, svg, GOLDEN)


def test_the_comparison_can_fail(tmp_path: Path) -> None:
    svg = draw(SCENES["line"])
    with pytest.raises(AssertionError, match="is missing"):
        compare("line", svg, tmp_path)
    (tmp_path / "preview-line.svg").write_text(svg.replace("0.5", "0.6", 1), encoding="utf-8")
    with pytest.raises(AssertionError, match="differs"):
        compare("line", svg, tmp_path)
