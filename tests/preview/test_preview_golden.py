"""Pictures stay as they are: byte by byte against tests/golden, re-blessed only by --bless."""

from dataclasses import replace
from pathlib import Path

import pytest

from camtool.geometry.polylines import Polylines, Segments
from camtool.preview.draw import draw
from camtool.preview.layers import LAYERS
from camtool.preview.options import Options
from tests.preview.conftest import SCENES, circle

GOLDEN = Path(__file__).parents[1] / "golden"
DRESSED = replace(
    SCENES["result"],
    wanted=Segments.of(Polylines.of([circle(2.5, 2.5, 2.0)])),
    worst=((4.5, 2.5), (2.5, 4.5)),
)
MILLED = replace(SCENES["toolpath"], tool_mm=0.5)
PICTURES = {
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
