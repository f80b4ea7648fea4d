"""What a page says for the machine: the stock and its zero, tools, operations, warnings."""

import base64
import json
import math
import re
from html.parser import HTMLParser
from pathlib import Path

import pytest
import shapely

from camtool.target.registry import load_target
from camtool.verification.report import SETUP, PlannedStock, _zero_words
from tests.cli.conftest import Run
from tests.oracles.page_paths import program_paths
from tests.pictures.viewer_browser import FLAGS

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
    assert told["blank"].startswith("at least 86.000 × 58.000 mm")
    assert told["stock"] == "96 × 66 × 6 mm; on a board that may be cut 1 mm deep"
    assert told["zero"].startswith("X0 Y0 is 8 mm right of and 8 mm above the lower left corner")
    mounted = "T1 mill, then T2 drill, then T3 bit, then T1 mill"
    assert told["mounted"] == f"{mounted}; touch off on the stock at X0 Y0"
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


def seconds_in(words: str) -> float:
    """`1 h 2 min 5 s`, or `1:02:05`, as seconds."""
    if ":" in words:
        return float(sum(int(part) * 60**k for k, part in enumerate(reversed(words.split(":")))))
    units = {"h": 3600, "min": 60, "s": 1}
    return float(sum(int(n) * units[u] for n, u in re.findall(r"(\d+) (h|min|s)\b", words)))


@pytest.mark.parametrize("target", ["grbl", "linuxcnc"])
def test_sheet_comments_and_twin_agree_about_the_time_of_every_operation(
    camtool: Run, samples: Path, tmp_path: Path, target: str
) -> None:
    """Pecking is mostly rapids: the cuts of the holes take a quarter of their time on grbl."""
    args = (str(samples / "plate.dxf"), "-t", target, "--job", str(samples / "plate.toml"))
    done = camtool("post", *args, "-o", "plate.nc", "--report", "plate.html", "-q")
    assert done.returncode == 0, done.stderr
    program = (tmp_path / "plate.nc").read_bytes()
    said = [seconds_in(each) for each in re.findall(r"takes (.+)\)", program.decode())]
    page = Tables((tmp_path / "plate.html").read_text(encoding="utf-8"))
    shown = [seconds_in(row[-1]) for row in page.tables[2][1:]]
    machine = load_target(target)
    taken: dict[int, float] = {}  # by block of the program
    decoded = machine.target.read(program, machine.machine)
    for chunk in machine.simulate(decoded):
        for row, seconds in zip(chunk.ledger.row, chunk.ledger.duration_s, strict=True):
            line = int(decoded.block[row])
            taken[line] = taken.get(line, 0.0) + float(seconds)
    lines = program.decode().splitlines()
    begins = [k for k, line in enumerate(lines) if line.startswith("(operation ")]
    blocks = [k for k, line in enumerate(lines) if line and line[0] not in "(%"]
    starts = [0, *(sum(k < begin for k in blocks) for begin in begins[1:])]
    ends = [*starts[1:], len(lines)]
    wanted = [
        sum(each for block, each in taken.items() if low <= block < high)
        for low, high in zip(starts, ends, strict=True)
    ]
    assert len(said) == 7
    assert said == pytest.approx(wanted, abs=0.6)
    assert shown == pytest.approx(wanted, abs=0.6)


def test_chips_speeds_allowance_and_work_by_hand(
    camtool: Run, samples: Path, tmp_path: Path
) -> None:
    """Against arithmetic: 450 mm/min by 2 flutes at 12000 rev/min, and the edge of 3 mm at that
    speed."""
    job = (samples / "plate.toml").read_text(encoding="utf-8")
    limits = "flutes = 2\nchip_load = '..0.05mm'\nsurface_speed = '60..300'"
    job = job.replace("[tools.mill]", f"[tools.mill]\n{limits}")
    job = job.replace('layers = ["POCKET"]', 'layers = ["POCKET"]\nfinish = "0.25mm"')
    (tmp_path / "job.toml").write_text(job, encoding="utf-8")
    args = (str(samples / "plate.dxf"), "-t", "linuxcnc", "--job", "job.toml", "-o", "a.nc", "-q")
    done = camtool("post", *args, "--report", "a.html", "--json", "a.json")
    assert done.returncode == 0, done.stderr
    facts, _, shown = Tables((tmp_path / "a.html").read_text(encoding="utf-8")).tables
    heads, first = shown[:2]
    rows = {row[0]: dict(zip(heads, row, strict=True)) for row in shown[1:]}
    assert first[0] == "pocket"
    chip, speed = 450.0 / (2 * 12000.0), math.pi * 3.0 * 12000.0 / 1000.0
    assert rows["pocket"]["mm per tooth"] == f"{chip:.2g} (at most 0.05)"
    assert rows["pocket"]["m/min"] == f"{speed:.3g} (60 to 300)"
    assert rows["sign"]["mm per tooth"] == "–"  # nobody says how many flutes the bit has
    left = {name: row["leaves mm"] for name, row in rows.items() if row["leaves mm"] != "–"}
    assert left == {"pocket": "0.25"}
    assert "pocket finish" in rows
    report = json.loads((tmp_path / "a.json").read_text(encoding="utf-8"))
    (loose,) = [each for each in report["findings"] if each["code"] == "LOOSE_PIECE"]
    assert dict(facts)["by hand"] == (
        f"cut 4 tabs of outline (T1 mill); take out what comes loose: {loose['where']}"
    )


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
        (None, "X0 Y0 is the drawing's own zero; Z0 is the top of the stock"),
    ],
)
def test_zero_as_seen_from_the_stock(corner: tuple[float, float] | None, words: str) -> None:
    size = None if corner is None else (10.0, 10.0)
    assert words in _zero_words(PlannedStock(3.0, corner, size, 1.0))


PATH = "M12 7 L40 7 L40 20 L26 29 L12 20 Z"
"""In a drawing 60 mm high: from X12 Y31 to X40 Y53, Y up."""


@pytest.mark.parametrize(
    ("origin", "zero", "box"),
    [
        ("drawing", "is the drawing's own zero", (12.0, 31.0, 40.0, 53.0)),
        ("lower-left", "is the lower left corner of the contours that", (0.0, 0.0, 28.0, 22.0)),
        ("centre", "is the centre of the contours that", (-14.0, -11.0, 14.0, 11.0)),
        ("5,6", "is at X5 Y6 of the drawing", (7.0, 25.0, 35.0, 47.0)),
    ],
)
def test_the_blank_holds_what_the_tool_cuts_and_zero_is_where_the_job_says(
    camtool: Run, tmp_path: Path, origin: str, zero: str, box: tuple[float, ...]
) -> None:
    svg = '<svg xmlns="http://www.w3.org/2000/svg" width="60mm" height="60mm" viewBox="0 0 60 60">'
    (tmp_path / "a.svg").write_text(f'{svg}<path d="{PATH}" fill="none" stroke="#000"/></svg>')
    line = ("post", "a.svg", "-t", "grbl", "--tool-diameter", "4mm", "--depth", "1mm")
    done = camtool(*line, "-o", "a.nc", "--report", "a.html", "-q", "--origin", origin)
    assert done.returncode == 0, done.stderr
    told = dict(Tables((tmp_path / "a.html").read_text(encoding="utf-8")).tables[0])
    assert told["zero"].startswith(f"X0 Y0 {zero}")
    numbers = [float(each.replace("−", "-")) for each in re.findall(r"[−\d.]+\d", told["blank"])]
    # The middle of the tool is half of it outside, and its edge as far again.
    left, low, right, top = (
        limit + sign * 4.0 for limit, sign in zip(box, (-1, -1, 1, 1), strict=True)
    )
    assert numbers == pytest.approx([right - left, top - low, left, right, low, top], abs=2e-3)
    program = program_paths((tmp_path / "a.nc").read_text())
    ends = shapely.union_all(
        [shapely.LineString(path).buffer(2.0) for path in program.cuts if len(path) > 1]
    ).bounds
    assert ends == pytest.approx((left, low, right, top), abs=2e-3)


@pytest.mark.xdist_group("chromium")
@pytest.mark.skipif(not CHROMIUM.exists(), reason="Chromium is not installed")
def test_it_is_readable_on_a_phone(camtool: Run, samples: Path, tmp_path: Path) -> None:
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    plate(camtool, samples, "plate.html")
    with playwright.sync_playwright() as tool:
        browser = tool.chromium.launch(executable_path=str(CHROMIUM), args=FLAGS)
        page = browser.new_page(viewport={"width": 390, "height": 844}, is_mobile=True)
        page.goto((tmp_path / "plate.html").as_uri())
        assert page.evaluate("() => document.documentElement.scrollWidth") == 390
        beyond = """() => [...document.querySelectorAll(".setup *")].filter(
            (each) => each.getBoundingClientRect().right > 390).length"""
        assert page.evaluate(beyond) == 0
        named = """() => [...document.querySelectorAll(".setup .rows td")].map(
            (each) => getComputedStyle(each, "::before").content)"""
        assert '"plunge mm/min"' in page.evaluate(named)
        browser.close()


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


@pytest.mark.parametrize("holder", [None, 20.0])
def test_clamps_may_be_where_no_tool_and_no_holder_passes(
    camtool: Run, samples: Path, tmp_path: Path, holder: float | None
) -> None:
    """The strips of the stock, against all moves of the program as wide as its widest tool."""
    job = (samples / "plate.toml").read_text(encoding="utf-8")
    if holder is not None:
        body = f'stickout = "25mm"\nholder_diameter = "{holder:g}mm"'
        for name in ("mill", "drill", "bit"):
            job = job.replace(f"[tools.{name}]", f"[tools.{name}]\n{body}")
    job = job.replace('size = ["96mm", "66mm"]', 'size = ["120mm", "90mm"]')
    (tmp_path / "job.toml").write_text(job, encoding="utf-8")
    args = (str(samples / "plate.dxf"), "-t", "linuxcnc", "--job", "job.toml", "-o", "a.nc", "-q")
    done = camtool("post", *args, "--report", "a.html")
    assert done.returncode == 0, done.stderr
    page = (tmp_path / "a.html").read_text(encoding="utf-8")
    facts, tools, _ = Tables(page).tables
    told = dict(facts)["clamps"].replace("−", "-")
    strips = re.findall(r"([XY]) (-?[\d.]+) to (-?[\d.]+)", told)
    assert len(strips) >= 2
    assert ("holders are not known" in told) == (holder is None)
    assert {row[3] for row in tools[1:]} == ({"–"} if holder is None else {"25"})
    stock = shapely.box(-8.0, -8.0, 112.0, 82.0)
    # As wide as the bit, 6 mm, or the holder: what the mill passes over is narrower.
    least, most = (1.5, 3.0) if holder is None else (0.5 * holder, 0.5 * holder)
    program = program_paths((tmp_path / "a.nc").read_text())
    lines = [
        shapely.LineString(path) for path in (*program.cuts, *program.rapids) if len(path) > 1
    ]
    passed = shapely.union_all([line.buffer(least) for line in lines])
    inner, outer = passed.bounds, passed.buffer(most - least).bounds
    for axis, begin, end in strips:
        low, high = float(begin), float(end)
        strip = shapely.box(low, -8.0, high, 82.0)
        strip = strip if axis == "X" else shapely.box(-8.0, low, 112.0, high)
        assert stock.buffer(2e-3).contains(strip)
        assert strip.buffer(-2e-3).intersection(passed).area == 0.0
        row = "XY".index(axis) + (0 if low == -8.0 else 2)
        within = high if low == -8.0 else low
        ends = sorted((inner[row], outer[row]))
        assert ends[0] - 2e-3 <= within <= ends[1] + 2e-3
    assert (
        "no clamps within"
        in base64.b64decode(re.findall(r"base64,([A-Za-z0-9+/=]+)", page)[0]).decode()
    )
