"""Patterns of names: `*`, `?` and `[…]`, the same in any case, as names are in CAD; and guesses
which name was meant."""

from __future__ import annotations

import re
from collections.abc import Iterable
from fnmatch import translate


def matches(patterns: Iterable[str], name: str) -> bool:
    """Whether any of the patterns is the whole name."""
    folded = name.casefold()
    return any(re.fullmatch(translate(pattern.casefold()), folded) for pattern in patterns)


def guess(word: str, known: Iterable[str]) -> str:
    """ "did you mean NAME? " for the known name that is most like the word; "" when none is."""
    from difflib import get_close_matches

    folded = {name.casefold(): name for name in known}
    near = get_close_matches(word.casefold(), folded, n=1)
    return f"did you mean {folded[near[0]]}? " if near else ""
