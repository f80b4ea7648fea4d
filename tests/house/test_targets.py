"""Adding a machine touches one folder: nothing in `camtool` knows any target by its name."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FOLDERS = sorted(path.parent.name for path in ROOT.glob("postprocessors/*/machine.toml"))
COMMON = {"iso": r"postprocessors\.iso\b|IsoDialect"}
"""A folder whose name is a word besides, as of a view or a standard: what would name it."""
NAMES = re.compile(
    "|".join(COMMON.get(name, name.replace("_", "[-_]?")) for name in FOLDERS), re.IGNORECASE
)


def files() -> list[Path]:
    found = sorted(ROOT.glob("camtool/**/*.py"))
    assert len(found) > 50
    return found


def words(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield (line, word) of every identifier, and of every literal that is a single word, such as
    a key. Sentences may have a target as their example."""
    for node in ast.walk(tree):
        line = getattr(node, "lineno", 0)
        match node:
            case ast.Name(id=word) | ast.Attribute(attr=word) | ast.arg(arg=word):
                yield line, word
            case ast.FunctionDef(name=word) | ast.ClassDef(name=word):
                yield line, word
            case ast.keyword(arg=str(word)) | ast.ImportFrom(module=str(word)):
                yield line, word
            case ast.alias(name=word, asname=other):
                yield from ((line, each) for each in (word, other or ""))
            case ast.Constant(value=str(text)) if not re.search(r"\s", text.strip()):
                yield line, text


def named(source: str) -> list[str]:
    return [f"line {n}: {word}" for n, word in words(ast.parse(source)) if NAMES.search(word)]


def test_every_folder_is_looked_for() -> None:
    assert len(FOLDERS) > 5
    assert "pic_mmh" in FOLDERS


def test_no_target_is_named() -> None:
    every = {path: named(path.read_text(encoding="utf-8")) for path in files()}
    assert {path: names for path, names in every.items() if names} == {}


@pytest.mark.parametrize(
    "source",
    [
        "if name == 'pic-mmh': pass",
        "from camtool_postprocessors.grbl.controller import GrblModel",
        "class PicMmhController: pass",
        "def f(linuxcnc): pass",
        "made = {'flashcut': 1}",
        "x = y.matlab_router",
    ],
)
def test_the_rule_can_be_broken(source: str) -> None:
    assert named(source)
