"""The site: its pages are there, links out of docs/ become words, mkdocs builds it strictly."""

import importlib.util
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import pytest

import camtool
from camtool.cli.main import cli

ROOT = Path(__file__).parents[2]
SETTINGS = (ROOT / "mkdocs.yml").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def hooks() -> ModuleType:
    spec = importlib.util.spec_from_file_location("site_hooks", ROOT / "docs" / "site_hooks.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_page_of_the_site_exists() -> None:
    pages = re.findall(r"- (?:[^:\n]+: )?([\w./-]+\.md)$", SETTINGS, re.MULTILINE)
    assert len(pages) > 30
    assert [page for page in pages if not (ROOT / "docs" / page).exists()] == []


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
    for name in ("camtool", *(f"camtool {name}" for name in cli.commands), "camtool job new"):
        assert re.search(rf"^##+ {name}\n\n```text\nUsage: {name} ", text, re.MULTILINE), name
    assert max(map(len, text.splitlines())) <= 100
    page = SimpleNamespace(file=SimpleNamespace(src_uri=hooks.COMMANDS))
    assert hooks.on_page_markdown("# Commands\n", page=page) == f"# Commands\n\n{text}"


def test_the_reference_has_every_name() -> None:
    page = (ROOT / "docs" / "reference" / "api.md").read_text(encoding="utf-8")
    listed = re.findall(r"^::: camtool\.api\.(\w+)$", page, re.MULTILINE)
    assert sorted(listed) == camtool.__all__


@pytest.mark.slow
def test_the_site_is_built_without_a_warning_and_needs_no_network(tmp_path: Path) -> None:
    for package in ("material", "mkdocstrings"):
        if importlib.util.find_spec(package) is None:
            pytest.skip(f"{package} is not installed: pip install '.[docs]'")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(tmp_path)]
    built = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stderr
    functions = (tmp_path / "reference" / "api" / "index.html").read_text(encoding="utf-8")
    assert 'id="camtool.api.read_drawing"' in functions
    commands = (tmp_path / "reference" / "commands" / "index.html").read_text(encoding="utf-8")
    assert "--minimise" in commands
    for page in tmp_path.rglob("*.html"):
        loaded = re.findall(
            r'<(?:script|img|link)[^>]*(?:src|href)="(https?:[^"]+)"', page.read_text()
        )
        assert loaded == [], page
