"""`--report`: pages about programs, whatever names drawings have."""

import base64
import json
import re
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import pytest

from camtool.findings import Finding, Severity
from camtool.importers.findings import DrawingCode
from camtool.verification.report import (
    HTML_ROWS,
    PAGE_BYTES,
    ChangedValue,
    ReportPage,
    Setup,
    finding_reports,
    markdown_words,
    page_html,
    page_json,
    page_markdown,
)
from tests.cli.conftest import Run

SQUARE = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="4mm" height="4mm" viewBox="0 0 4 4">'
    '<g id="{layer}"><circle cx="2" cy="2" r="1"/></g></svg>'
)
SLY = "<script>alert(1)</script>\"'|`x` [a](http://evil) ![p](//e) @all $x$ \u202e\x1b[31m\n# H"
WIDE = SQUARE.replace("4mm", "4000mm")


class Tags(HTMLParser):
    """The tags of a page and the addresses that they name."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: set[str] = set()
        self.addresses: list[str] = []
        self.attributes: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        self.attributes |= {name for name, _ in attrs}
        self.addresses += [value or "" for name, value in attrs if name in ("src", "href")]


@pytest.fixture
def drawing(tmp_path: Path) -> Path:
    file = tmp_path / "ring.svg"
    file.write_text(SQUARE.format(layer="CUT"))
    return file


def sly_page(count: int = 3) -> ReportPage:
    """A page full of names that want to be more than words."""
    findings = [
        Finding(DrawingCode.UNITLESS, Severity.ERROR, f"{SLY}{n}", SLY) for n in range(count)
    ]
    setup = Setup("m: " + SLY, "0" * 64, None, (ChangedValue(SLY, SLY, SLY),), ((SLY, SLY),))
    return ReportPage(SLY, None, finding_reports(findings), setup, ((SLY, "a b).svg"),))


def test_html_is_one_page_without_scripts(camtool: Run, drawing: Path, tmp_path: Path) -> None:
    done = camtool("post", drawing, "-t", "grbl", "--set", "axes.x.backlash_mm=0.02",
                   "--tool-diameter", "0.5", "-q", "--report", "r.html")  # fmt: skip
    assert done.returncode == 0, done.stderr
    text = (tmp_path / "r.html").read_text()
    found = Tags(text)
    assert not found.tags & {"script", "iframe", "object", "link", "svg", "a", "base", "form"}
    assert not [name for name in found.attributes if name.startswith("on")]
    head = "data:image/svg+xml;base64,"
    assert len(found.addresses) == 4  # the stock; the whole, its worst place, a circle
    for address in found.addresses:
        assert address.startswith(head)
        assert ElementTree.fromstring(base64.b64decode(address[len(head) :])).tag.endswith("svg")
    for words in (
        "The largest error, near (",
        "the largest circular error, ",
        "error by source",
        "dimension",
        "circle at mm",
        "worst moves",
        "ring.svg",
    ):
        assert words in text, words
    assert "axes.x.backlash_mm" in text
    assert "0.02 (the target&#x27;s own: 0.0)" in text
    assert "--tool-diameter" in text


def test_equal_input_gives_equal_bytes(camtool: Run, drawing: Path, tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        for ending in ("html", "md", "json"):
            page = f"{name}/r.{ending}"
            assert camtool("post", drawing, "-t", "grbl", "--report", page).returncode == 0
    for file in ("r.html", "r.md", "r.json", "r.svg"):
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes()


def test_markdown_links_to_the_picture_beside_it(
    camtool: Run, drawing: Path, tmp_path: Path
) -> None:
    (tmp_path / "out").mkdir()
    camtool("post", drawing, "-t", "grbl", "--report", "out/my ring.md")
    text = (tmp_path / "out" / "my ring.md").read_text()
    assert "](my%20ring.svg)" in text
    assert (tmp_path / "out" / "my ring.svg").read_bytes().startswith(b"<svg")
    camtool("post", drawing, "-t", "grbl", "--report", "out/b.md", "--preview", "p.png")
    assert "](../p.png)" in (tmp_path / "out" / "b.md").read_text()
    assert not (tmp_path / "out" / "b.svg").exists()


def test_markdown_on_stdout_has_no_picture(camtool: Run, drawing: Path, tmp_path: Path) -> None:
    camtool("post", drawing, "-t", "grbl", "-o", "ring.nc")
    done = camtool("verify", "ring.nc", "-t", "grbl", "--report", "-")
    text = done.stdout.decode()
    assert done.returncode == 0
    assert text.startswith("# ring.nc\n")
    assert "![" not in text
    assert "| total |" in text
    assert sorted(path.name for path in tmp_path.iterdir()) == ["ring.nc", "ring.svg"]


def test_json_has_the_keys_of_the_report(camtool: Run, drawing: Path, tmp_path: Path) -> None:
    camtool("post", drawing, "-t", "grbl", "-o", "ring.nc")
    camtool("convert", "ring.nc", "--from", "grbl", "--to", "linuxcnc", "--report", "r.json",
            "--json", "plain.json")  # fmt: skip
    page, report = (json.loads((tmp_path / n).read_text()) for n in ("r.json", "plain.json"))
    assert {key: page[key] for key in report} == report
    assert page["verdict"] == "fine"
    assert page["setup"]["flags"] == [["--from", "grbl"]]
    assert re.fullmatch("[0-9a-f]{64}", page["setup"]["machine_sha256"])


def test_a_machine_that_needs_numbers_tells_of_them(
    camtool: Run, drawing: Path, samples: Path, tmp_path: Path
) -> None:
    done = camtool("post", drawing, "-t", "i8751", "--machine", samples / "i8751-sample.toml",
                   "--report", "r.json")  # fmt: skip
    assert done.returncode == 0, done.stderr
    changed = json.loads((tmp_path / "r.json").read_text())["setup"]["changed"]
    own = {item["key"]: item["was"] for item in changed}
    assert own["axes.x.coded_step_mm"] == "not said"


@pytest.mark.parametrize("ending", ["html", "md", "json"])
def test_a_spoilt_part_has_a_page_and_no_program(
    camtool: Run, drawing: Path, tmp_path: Path, ending: str
) -> None:
    done = camtool("post", drawing, "-t", "grbl", "--max-time", "1s", "--report", f"r.{ending}")
    assert done.returncode == 1
    assert "ABOVE_GATE" in (tmp_path / f"r.{ending}").read_text()
    assert b"no program was written" in done.stderr
    assert not (tmp_path / "ring.nc").exists()


def test_what_cannot_be_planned_has_a_page_too(camtool: Run, tmp_path: Path) -> None:
    (tmp_path / "wide.svg").write_text(WIDE.format(layer="CUT"))
    done = camtool("post", "wide.svg", "-t", "pic-mmh", "--report", "r.html")
    assert done.returncode == 1
    assert "OUT_OF_TRAVEL" in (tmp_path / "r.html").read_text()


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (("--report", "r.txt"), b"ends in none of"),
        (("--report", "r.md", "--no-verify"), b"--report is the report"),
        (("--report", "no/r.md"), b"does not exist"),
        (("--report", "ring.md"), b"is the input itself"),  # its picture would be the drawing
        (("--report", "-", "-o", "-"), b"asked for twice"),
    ],
)
def test_wrong_use_says_so(camtool: Run, drawing: Path, flags, words: bytes) -> None:
    done = camtool("post", drawing, "-t", "grbl", *flags)
    assert done.returncode == 2
    assert words in done.stderr


def test_a_comparison_has_no_page(camtool: Run, samples: Path) -> None:
    done = camtool("verify", samples / "circle-30-steps.pic", "-t", "pic-mmh", "--compare",
                   "mechanics", "--report", "r.md")  # fmt: skip
    assert done.returncode == 2
    assert b"drop --compare" in done.stderr


def test_a_sly_layer_name_is_words_on_every_page(camtool: Run, tmp_path: Path) -> None:
    layer = "&lt;img src=x onerror=alert(1)&gt;|[a](b)"
    (tmp_path / "sly.svg").write_text(SQUARE.format(layer=layer))
    for ending in ("html", "md"):
        camtool("post", "sly.svg", "-t", "grbl", "--report", f"r.{ending}", "-o", "x.nc")
    text = (tmp_path / "r.html").read_text()
    assert "onerror=alert" in text  # the name is there
    assert "onerror" not in Tags(text).attributes
    text = (tmp_path / "r.md").read_text()
    assert "\\<img src=x" in text
    assert not re.search(r"(?<!\\)<", text)


def test_sly_names_are_words_in_html() -> None:
    found = Tags(page_html(sly_page()))
    assert "script" not in found.tags
    assert found.addresses == ["a b).svg"]
    assert not [sign for sign in page_html(sly_page()) if ord(sign) in (0x202E, 0x1B)]


def test_sly_names_are_words_in_markdown() -> None:
    text = page_markdown(sly_page())
    assert not re.search(r"(?<!\\)<(?!!-- -->)", text)
    assert text.count("![") == 1  # the page's own picture
    assert "](a%20b%29.svg)" in text
    assert "@all" not in text
    assert "http://" not in text
    assert not [line for line in text.splitlines()[1:] if line.startswith("# ")]
    assert not re.search(r"(?<!\\)\$", text)


def test_a_row_stays_one_row() -> None:
    assert markdown_words("a|b\nc") == "a\\|b\\\\nc"
    rows = [
        line for line in page_markdown(sly_page()).splitlines() if line.startswith("| machine | ")
    ]
    (row,) = rows
    assert len(re.findall(r"(?<!\\)\|", row)) == 3


def test_a_page_of_ten_thousand_findings_fits() -> None:
    page = sly_page(10_000)
    text = page_markdown(page)
    assert len(text.encode()) <= PAGE_BYTES + 100
    assert "and 9950 more findings" in text
    assert f"and {10_000 - HTML_ROWS} more findings" in page_html(page)
    assert len(json.loads(page_json(page))["findings"]) == 10_000


def test_a_page_that_is_too_long_says_so() -> None:
    many = tuple(ChangedValue(f"{n}{'€' * 190}", "1", "2") for n in range(1000))
    page = ReportPage("t", None, (), Setup("m", "0", None, many))
    text = page_markdown(page)
    assert len(text.encode()) <= PAGE_BYTES + 100
    assert text.endswith("would be too long.*\n")
    assert "would be too long" not in page_markdown(ReportPage("t", None, (), Setup("m", "0")))
