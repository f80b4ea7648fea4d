"""What a page says for the machine: the stock and its zero, tools, operations, warnings."""

import json
import re
from html.parser import HTMLParser
from pathlib import Path

import pytest

from camtool.verification.report import SETUP, PlannedStock, _zero_words
from tests.cli.conftest import Run

CHROMIUM = Path("/usr/bin/chromium")


class Tables(HTMLParser):
    """The tables of the part that is for the machine, row by row."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tables: list[list[list[str]]] = []
        self._within = self._cell = False
        self.pictures = 0
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._within |= ("class", "setup") in attrs
        self._cell = self._within and tag in ("td", "th")
        if self._within and tag == "table":
            self.tables.append([])
        if self._within and tag == "tr":
            self.tables[-1].append([])
        self.pictures += self._within and tag == "img"

    def handle_endtag(self, tag: str) -> None:
        self._within &= tag != "section"
        self._cell = False

    def handle_data(self, data: str) -> None:
        if self._cell:
            self.tables[-1][-1].append(data)


def plate(camtool: Run, samples: Path, page: str, *more: str) -> bytes:
    """The page of the sample plate."""
    job = str(samples / "plate.toml")
    args = (str(samples / "plate.dxf"), "-t", "linuxcnc", "--job", job, "-o", "plate.nc")
    done = camtool("post", *args, "--report", page, "-q", *more)
    assert done.returncode == 0
    return done.stdout


def test_the_sample_plate(camtool: Run, samples: Path, tmp_path: Path) -> None:
    plate(camtool, samples, "plate.html", "--json", "plate.json")
    page = Tables((tmp_path / "plate.html").read_text(encoding="utf-8"))
    facts, tools, operations = page.tables
    told = dict(facts)
    assert told["stock"] == "96 × 66 × 6 mm; on a board that may be cut 1 mm deep"
    assert told["zero"].startswith("X0 Y0 is 8 mm right of and 8 mm above the lower left corner")
    assert told["mounted"] == "T1 mill, then T2 drill, then T3 bit, then T1 mill"
    assert [row[0] for row in tools[1:]] == ["T1 mill", "T2 drill", "T3 bit"]
    assert [row[1] for row in tools[1:]] == [
        "end mill 3 mm",
        "drill 3 mm, 118°",
        "V bit 6 mm, 60°",
    ]
    assert [row[2] for row in tools[1:]] == ["6", "6", "2.5"]
    names = [row[0] for row in operations[1:]]
    assert names == ["pocket", "slot", "window", "holes", "sign", "line", "outline"]
    assert page.pictures == 1
    report = json.loads((tmp_path / "plate.json").read_text(encoding="utf-8"))
    planned = report["planned"]
    assert planned["stock"]["corner_mm"] == [-8.0, -8.0]
    assert [each["reach_mm"] for each in planned["tools"]] == [6.0, 6.0, 2.5]
    times = [each["time_s"] for each in planned["operations"]]
    assert min(times) > 0.0
    assert sum(times) == pytest.approx(report["time_s"], abs=1e-3)


@pytest.mark.parametrize("flags", [(), ("--compensate",), ("--minimise", "reversals")])
def test_all_of_the_time_belongs_to_an_operation(
    camtool: Run, samples: Path, flags: tuple[str, ...]
) -> None:
    job = str(samples / "logo.toml")
    args = (str(samples / "logo.dxf"), "--job", job, "-t", "pic-mmh", "-o", "a.pic", "-q")
    done = camtool("post", *args, *flags, "--json", "-")
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    times = [each["time_s"] for each in report["planned"]["operations"]]
    assert len(times) > 1
    assert min(times) > 0.0
    assert sum(times) <= report["time_s"] + 1e-3
    assert sum(times) > 0.9 * report["time_s"]


def test_markdown_has_the_same(camtool: Run, samples: Path) -> None:
    page = plate(camtool, samples, "-").decode()
    assert f"## {SETUP}" in page
    assert "| T2 drill | drill 3 mm, 118° | 6 | – |" in page
    assert "- **mounted:** T1 mill, then T2 drill" in page


def test_a_program_that_was_only_read_has_none(
    camtool: Run, samples: Path, tmp_path: Path
) -> None:
    plate(camtool, samples, "plate.md")
    done = camtool("verify", "plate.nc", "-t", "linuxcnc", "--report", "-")
    assert SETUP not in done.stdout.decode()


@pytest.mark.parametrize(
    ("corner", "words"),
    [
        ((0.0, 0.0), "X0 Y0 is the lower left corner of the stock"),
        ((-0.0, 0.0), "X0 Y0 is the lower left corner of the stock"),
        ((-8.0, 3.0), "8 mm right of and 3 mm below"),
        ((8.0, -3.5), "8 mm left of and 3.5 mm above"),
        (None, "where the drawing has part zero"),
    ],
)
def test_zero_as_seen_from_the_stock(corner: tuple[float, float] | None, words: str) -> None:
    size = None if corner is None else (10.0, 10.0)
    assert words in _zero_words(PlannedStock(3.0, corner, size, 1.0))


@pytest.mark.xdist_group("chromium")
@pytest.mark.skipif(not CHROMIUM.exists(), reason="Chromium is not installed")
def test_it_fits_one_printed_side(camtool: Run, samples: Path, tmp_path: Path) -> None:
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    plate(camtool, samples, "plate.html")
    with playwright.sync_playwright() as tool:
        browser = tool.chromium.launch(executable_path=str(CHROMIUM), args=["--no-sandbox"])
        page = browser.new_page()
        page.goto((tmp_path / "plate.html").as_uri())
        sheets = []
        for only in ("", ".setup ~ * { display: none }"):
            page.add_style_tag(content=only or "/* all */")
            printed = page.pdf(prefer_css_page_size=True)
            sheets.append(len(re.findall(rb"/Type\s*/Page[^s]", printed)))
        browser.close()
    whole, setup = sheets
    assert setup == 1
    assert whole > 1
