"""Patterns that every Python matches alike.

Before 3.11.5 a possessive group, such as `(?:a|b)*+`, kept what a failed turn had passed over
(CPython issue 106052): a word of G-code without a number was taken for a word. An atomic group
around a plain one, `(?>(?:a|b)*)`, says the same everywhere.
"""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
POSSESSIVE = re.compile(r"\)(?:[*?+]|\{[\d,]+\})\+")


def files() -> list[Path]:
    found = sorted([*ROOT.glob("camtool/**/*.py"), *ROOT.glob("postprocessors/**/*.py")])
    assert len(found) > 100
    return found


@pytest.mark.parametrize("path", files(), ids=lambda p: str(p.relative_to(ROOT)))
def test_no_group_is_possessive(path: Path) -> None:
    assert POSSESSIVE.search(path.read_text(encoding="utf-8")) is None


def test_the_rule_can_be_broken() -> None:
    assert POSSESSIVE.search(r"(?:X\d++)*+")
    assert POSSESSIVE.search(r"(?:X\d++){2,3}+")
    assert not POSSESSIVE.search(r"(?>(?:X\d++)*)")
