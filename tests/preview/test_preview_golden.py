"""Pictures stay as they are: byte by byte against tests/golden, re-blessed only by --bless."""

from pathlib import Path

import pytest

from camtool.preview.draw import draw
from tests.preview.conftest import SCENES

GOLDEN = Path(__file__).parents[1] / "golden"
NAMES = ("drawing", "toolpath", "result", "line")


def compare(name: str, svg: str, folder: Path) -> None:
    path = folder / f"preview-{name}.svg"
    assert path.exists(), f"{path.name} is missing: look at the picture, then run with --bless"
    assert svg == path.read_text(encoding="utf-8"), f"{path.name} differs"


@pytest.mark.parametrize("name", NAMES)
def test_pictures_stay_as_they_are(name: str, pytestconfig: pytest.Config) -> None:
    svg = draw(SCENES[name])
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
