"""Names matched without regard to case by the wildcards `*`, `?` and `[…]`, and suggestions for
misspelt names."""

from __future__ import annotations

import re
from collections.abc import Iterable
from fnmatch import translate
from functools import lru_cache


def matches(patterns: Iterable[str], name: str) -> bool:
    """Return True if any of the patterns matches the whole name."""
    names, wild = _compiled(tuple(patterns))
    folded = name.casefold()
    return folded in names or any(each.fullmatch(folded) for each in wild)


@lru_cache(maxsize=64)
def _compiled(patterns: tuple[str, ...]) -> tuple[frozenset[str], tuple[re.Pattern[str], ...]]:
    """Return the patterns without wildcards as casefolded names, and the others as regular
    expressions; a job may name thousands of entities."""
    folded = [pattern.casefold() for pattern in patterns]
    wild = [pattern for pattern in folded if any(char in pattern for char in "*?[")]
    return frozenset(folded).difference(wild), tuple(re.compile(translate(each)) for each in wild)


def guess(word: str, known_names: Iterable[str]) -> str:
    """Return "did you mean NAME? " with the most similar known name, "" if none is similar."""
    from difflib import get_close_matches

    folded = {name.casefold(): name for name in known_names}
    near_names = get_close_matches(word.casefold(), folded, n=1)
    return f"did you mean {folded[near_names[0]]}? " if near_names else ""
