"""Names matched without regard to case by the wildcards `*`, `?` and `[…]`, and suggestions for
misspelt names."""

from __future__ import annotations

import re
from collections.abc import Iterable
from fnmatch import translate


def matches(patterns: Iterable[str], name: str) -> bool:
    """True if any of the patterns matches the whole name."""
    folded = name.casefold()
    return any(re.fullmatch(translate(pattern.casefold()), folded) for pattern in patterns)


def guess(word: str, known: Iterable[str]) -> str:
    """Return "did you mean NAME? " with the most similar known name, "" if none is similar."""
    from difflib import get_close_matches

    folded = {name.casefold(): name for name in known}
    near = get_close_matches(word.casefold(), folded, n=1)
    return f"did you mean {folded[near[0]]}? " if near else ""
