"""Patterns that every Python matches alike.

Before 3.11.5 a possessive group, such as `(?:a|b)*+`, kept what a failed turn had passed over
(CPython issue 106052): a word of G-code without a number was taken for a word. An atomic group
around a plain one, `(?>(?:a|b)*)`, says the same everywhere.
"""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
POSSESSIVE = re.compile(r"\)(?:[*?+]|\{[\d,]+\})\+")


def files() -> list[Path]:
    found = sorted([*ROOT.glob("camtool/**/*.py"), *ROOT.glob("postprocessors/**/*.py")])
    assert len(found) > 100
    return found


def test_no_group_is_possessive() -> None:
    assert [path for path in files() if POSSESSIVE.search(path.read_text(encoding="utf-8"))] == []


def test_the_rule_can_be_broken() -> None:
    assert POSSESSIVE.search(r"(?:X\d++)*+")
    assert POSSESSIVE.search(r"(?:X\d++){2,3}+")
    assert not POSSESSIVE.search(r"(?>(?:X\d++)*)")
