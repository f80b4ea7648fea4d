"""docs/formats.md: the importer that stands there is found by its entry point, and reads."""

import re
from pathlib import Path

import pytest

from tests.third_party import camtool

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "formats.md").read_text(encoding="utf-8")
PLOT = b"IN;SP1;PU0,0;PD400,0;PD400,200;PD0,200;PD0,0;PU0,0;"


def install(place: Path, text: str) -> Path:
    """A folder with the page's module, of this text, and its entry point, as pip leaves them."""
    metadata = place / "hpgl_lines-1.0.dist-info"
    metadata.mkdir(parents=True)
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: hpgl-lines\nVersion: 1.0\n")
    (metadata / "entry_points.txt").write_text("[camtool.importers]\nhpgl-lines = hpgl_lines\n")
    (place / "hpgl_lines.py").write_text(text, encoding="utf-8")
    return place


@pytest.fixture
def text() -> str:
    section = PAGE.partition("## Formats of your own")[2]
    found = re.search(r"```python\n(.*?)```", section, re.DOTALL)
    assert found
    return found[1]


def test_it_reads_what_camtool_refuses(text: str, tmp_path: Path) -> None:
    (tmp_path / "a.plt").write_bytes(PLOT)
    none = camtool(tmp_path / "nothing", tmp_path, "check", "a.plt")
    assert none.returncode == 2
    assert "is a plotter file (HPGL)" in none.stderr
    place = install(tmp_path / "place", text)
    done = camtool(place, tmp_path, "post", "a.plt", "-t", "grbl", "-o", "a.nc")
    assert done.returncode == 0, done.stderr
    told = camtool(place, tmp_path, "check", "a.plt").stdout
    assert "10 × 5 mm" in told
    assert "1 closed" in told


def test_its_faults_are_its_own(text: str, tmp_path: Path) -> None:
    (tmp_path / "a.plt").write_bytes(PLOT)
    place = install(
        tmp_path / "place", text.replace("pieces, last = [],", "pieces, last = {}[1],")
    )
    done = camtool(place, tmp_path, "check", "a.plt")
    assert done.returncode == 2
    assert "the importer 'hpgl-lines' fails (KeyError: 1)" in done.stderr
    assert "plug-in hpgl_lines" in done.stderr
