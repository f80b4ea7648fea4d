"""The site: its pages are there, links out of docs/ become words, mkdocs builds it strictly."""

import functools
import http.server
import importlib.util
import re
import subprocess
import sys
import textwrap
import threading
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

import camtool
from camtool.cli.main import COMMANDS
from camtool.geometry.polylines import POSITION_EPS_MM

ROOT = Path(__file__).parents[2]
CHROMIUM = "/usr/bin/chromium"
PHONE_PX = 420
FAULTS = """() => {
  const wide = document.documentElement.scrollWidth > document.documentElement.clientWidth;
  const gone = [...document.images].filter(one => one.complete && !one.naturalWidth);
  return [...gone.map(one => one.src), ...(wide ? ["wider than the window"] : [])];
}"""
SETTINGS = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")


class Silent(http.server.SimpleHTTPRequestHandler):
    """Serves files without a log."""

    def log_message(self, *_: object) -> None:
        return


@pytest.fixture(scope="module")
def hooks() -> ModuleType:
    spec = importlib.util.spec_from_file_location("site_hooks", ROOT / "docs" / "site_hooks.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_page_of_the_site_exists(hooks: ModuleType) -> None:
    pages = re.findall(r"- (?:[^:\n]+: )?([\w./-]+\.md)$", SETTINGS, re.MULTILINE)
    assert len(pages) > 30
    assert [page for page in pages if not (ROOT / "docs" / page).exists()] == [hooks.NUMERICS]


def test_the_page_of_constants_has_those_of_the_code(hooks: ModuleType) -> None:
    source = (
        'A_MM = 1e-6\n"""Least gap |."""\nB: int = 2 * N\nC = "text"\nd = 3\nE = True\nF = -1\n'
    )
    assert list(hooks.constants(source)) == [
        ("A_MM", "1e-06", "Least gap \\|."),
        ("B", "2 * N", ""),
        ("F", "-1", ""),
    ]
    assert list(hooks.constants("cdef int a = 1\nB = 2\n")) == []
    page = hooks.numerics()
    assert "\n## camtool/geometry/polylines.py\n" in page
    assert f"| `POSITION_EPS_MM` | `{POSITION_EPS_MM!r}` |" in page
    assert page.count("\n| `") > 400


@pytest.mark.parametrize(
    ("text", "made"),
    [
        ("see [the readme](../../README.md#use).", "see the readme."),
        ("see [jobs](../jobs.md)", "see [jobs](../jobs.md)"),
        ("[a](https://example.org/a)", "[a](https://example.org/a)"),
        ("![one](../images/logo.png)", "![one](../images/logo.png)"),
    ],
)
def test_links_out_of_docs_become_words(hooks: ModuleType, text: str, made: str) -> None:
    page = SimpleNamespace(file=SimpleNamespace(src_uri="dialects/grbl.md"))
    assert hooks.on_page_markdown(text, page=page) == made


def test_the_page_of_commands_has_their_help(hooks: ModuleType) -> None:
    text = hooks.commands()
    for name in ("camtool", *(f"camtool {name}" for name in COMMANDS), "camtool job new"):
        assert re.search(rf"^##+ {name}\n\n```text\nUsage: {name} ", text, re.MULTILINE), name
    assert max(map(len, text.splitlines())) <= 100
    page = SimpleNamespace(file=SimpleNamespace(src_uri=hooks.COMMANDS))
    assert hooks.on_page_markdown("# Commands\n", page=page) == f"# Commands\n\n{text}"


def test_the_help_of_commands_needs_no_camtool_that_is_installed() -> None:
    lines = """
        import runpy, sys
        sys.meta_path = [each for each in sys.meta_path if "editable" not in repr(each).lower()]
        sys.path = [each for each in sys.path if "camtool" not in each]
        print(runpy.run_path(sys.argv[1])["commands"]()[:60])
    """
    script = [sys.executable, "-I", "-c", textwrap.dedent(lines), "docs/site_hooks.py"]
    done = subprocess.run(script, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.stdout.startswith("## camtool\n"), done.stderr


def test_the_reference_has_every_name() -> None:
    page = (ROOT / "docs" / "reference" / "api.md").read_text(encoding="utf-8")
    listed = re.findall(r"^::: camtool\.api\.(\w+)$", page, re.MULTILINE)
    assert sorted(listed) == camtool.__all__


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the site without a warning and return its folder."""
    for package in ("material", "mkdocstrings"):
        if importlib.util.find_spec(package) is None:
            pytest.skip(f"{package} is not installed: pip install '.[docs]'")
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
    built = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stderr
    return folder


@pytest.mark.slow
def test_the_site_has_its_references_and_needs_no_network(site: Path) -> None:
    functions = (site / "reference" / "api" / "index.html").read_text(encoding="utf-8")
    assert [name for name in camtool.__all__ if f'id="camtool.api.{name}"' not in functions] == []
    commands = (site / "reference" / "commands" / "index.html").read_text(encoding="utf-8")
    assert "--minimise" in commands
    for page in site.rglob("*.html"):
        loaded = re.findall(
            r'<(?:script|img|link)[^>]*(?:src|href)="(https?:[^"]+)"', page.read_text()
        )
        assert loaded == [], page


@pytest.mark.slow
@pytest.mark.skipif(not Path(CHROMIUM).exists(), reason=f"{CHROMIUM} is not installed")
def test_pages_are_whole_in_a_browser(site: Path) -> None:
    """Every page fits the width of a phone, with all of its pictures and without errors."""
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    handler = functools.partial(Silent, directory=str(site))
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    root = f"http://127.0.0.1:{server.server_address[1]}"
    faults: list[str] = []
    with playwright.sync_playwright() as tool:
        browser = tool.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": PHONE_PX, "height": 900})
        page.set_content('<img src="data:,none"><div style="width: 900px">wide</div>')
        assert page.evaluate(FAULTS) == ["data:,none", "wider than the window"]
        page.on("pageerror", lambda error: faults.append(str(error)))
        page.on(
            "response", lambda answer: faults.append(answer.url) if answer.status >= 400 else None
        )
        for file in sorted(site.rglob("index.html")):
            place = file.relative_to(site).as_posix()
            page.goto(f"{root}/{place}")
            faults += [f"{place}: {each}" for each in page.evaluate(FAULTS)]
        browser.close()
    server.shutdown()
    server.server_close()
    assert faults == []
