"""Patterns of names: `*`, `?` and `[…]`, the same in any case, as names are in CAD."""

from __future__ import annotations

import re
from collections.abc import Iterable
from fnmatch import translate


def matches(patterns: Iterable[str], name: str) -> bool:
    """Whether any of the patterns is the whole name."""
    folded = name.casefold()
    return any(re.fullmatch(translate(pattern.casefold()), folded) for pattern in patterns)
