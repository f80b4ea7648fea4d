"""What the pages and docstrings show is run, and gives what they show.

On each page, in order, in one temporary folder with the samples in it:

- a block `console` is commands after `$ ` and what they print (both streams, as on a terminal);
- a block `python` goes on where the page's one before it ended; a block `text` right after it is
  what it prints.

A line `...` stands for any number of lines. `pytest --bless tests/docs/test_examples.py` writes
what comes out into the pages.
"""

import contextlib
import doctest
import importlib
import io
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.commands import run_here

ROOT = Path(__file__).parents[2]
BLOCK = re.compile(r"^```(console|python|text)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
PYTHON_PAGES = {"python.md", "tutorial.md", "uncertainty.md"}
"""Pages whose Python is run; others show parts of files."""


def runnable(page: Path) -> bool:
    kinds = {match[1] for match in BLOCK.finditer(page.read_text(encoding="utf-8"))}
    return "console" in kinds or ("python" in kinds and page.name in PYTHON_PAGES)


PAGES = [ROOT / "README.md", *filter(runnable, sorted(ROOT.glob("docs/**/*.md")))]


def shell(command: str, folder: Path, before: int) -> tuple[str, int]:
    """Run a command and return its output and exit code; `$?` is the previous exit code."""
    environment = os.environ | {
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
        "PYTHONUNBUFFERED": "1",
        "NO_COLOR": "1",
    }
    result = subprocess.run(
        ["bash", "-c", f"(exit {before})\n{command}"],
        cwd=folder,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    return result.stdout, result.returncode


PLAIN = re.compile(r"camtool [^|<>;&$*?~`#(){}!]*", re.DOTALL)
"""A command that no shell needs to change or to join with others: it is run in this process, which
saves the start of one, as long as many commands take."""


def run(command: str, folder: Path, before: int) -> tuple[str, int]:
    """Run a command, by a shell where it needs one, and return its output and exit code."""
    if not PLAIN.fullmatch(command):
        return shell(command, folder, before)
    words = shlex.split(command.replace("\\\n", " "))
    done = run_here(*words[1:], folder=folder, merged=True)
    return done.stdout.decode(), done.returncode


def commands(block: str) -> Iterator[tuple[str, str]]:
    """Yield each command of a block with its shown output; a backslash continues a command."""
    for part in re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]:
        lines = part.splitlines(keepends=True)
        end = next(row for row, line in enumerate(lines, 1) if not line.endswith("\\\n"))
        yield "".join(lines[:end]), "".join(lines[end:])


def as_shown(shown: str, came: str) -> str:
    """Return the shown text if it matches the output, otherwise the output."""
    lines = (".*?" if line == "...\n" else re.escape(line) for line in shown.splitlines(True))
    return shown if re.fullmatch("".join(lines), came, re.DOTALL) else came


def console(block: str, folder: Path) -> str:
    """Run the commands of a block and return it with their output."""
    code, made = 0, []
    for command, shown in commands(block):
        came, code = run(command, folder, code)
        made.append(f"$ {command}{as_shown(shown, came)}")
    return "".join(made)


def run_page(text: str, folder: Path) -> str:
    """Run the blocks of a page and return the page with their output."""
    space: dict[str, Any] = {}
    parts: list[str] = []
    end, printed, after = 0, "", -1
    for match in BLOCK.finditer(text):
        kind, block = match[1], match[2]
        if kind == "console":
            block = console(block, folder)
        elif kind == "python":
            with contextlib.redirect_stdout(io.StringIO()) as stream:
                exec(compile(block, "<page>", "exec"), space)
            printed, after = stream.getvalue(), match.end()
        elif after >= 0 and not text[after : match.start()].strip():
            block = as_shown(block, printed)
        parts += [text[end : match.start()], f"```{kind}\n{block}```"]
        end = match.end()
    return "".join([*parts, text[end:]])


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_pages_show_what_comes_out(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, bless: bool
) -> None:
    (tmp_path / "samples").symlink_to(ROOT / "samples")
    monkeypatch.chdir(tmp_path)
    text = page.read_text(encoding="utf-8")
    made = run_page(text, tmp_path)
    if bless:
        page.write_text(made, encoding="utf-8")
        return
    assert made.splitlines() == text.splitlines()


def test_there_are_pages_to_run() -> None:
    assert {"README.md", "tutorial.md", "python.md"} <= {page.name for page in PAGES}


def test_what_is_wrong_is_seen(tmp_path: Path) -> None:
    right = "```console\n$ echo one; false\none\n$ echo $?\n1\n```\n"
    assert run_page(right, tmp_path) == right
    assert run_page(right.replace("\n1\n", "\n0\n"), tmp_path) == right
    python = "```python\nx = 2\nprint(x)\n```\n\n```text\n3\n```\n"
    assert run_page(python, tmp_path) == python.replace("3", "2")
    with pytest.raises(NameError):
        run_page("```python\nunknown\n```\n", tmp_path)
    dots = "```console\n$ seq 4\n1\n...\n4\n```\n"
    assert run_page(dots, tmp_path) == dots
    assert run_page(dots.replace("\n4\n", "\n5\n"), tmp_path) != dots


def modules_with_examples() -> list[str]:
    """Return the dotted names of the modules whose docstrings show examples."""
    files = [*ROOT.glob("camtool/**/*.py"), *ROOT.glob("postprocessors/**/*.py")]
    shown = [path for path in files if ">>> " in path.read_text(encoding="utf-8")]
    return sorted(".".join(path.relative_to(ROOT).with_suffix("").parts) for path in shown)


@pytest.mark.parametrize("name", modules_with_examples())
def test_docstrings_show_what_comes_out(name: str) -> None:
    result = doctest.testmod(importlib.import_module(name))
    assert result.attempted
    assert not result.failed
