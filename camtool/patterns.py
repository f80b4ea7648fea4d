"""Patterns of names: `*`, `?` and `[…]`, in any case, as CAD has names; and guesses which name was
meant."""

from __future__ import annotations

import re
from collections.abc import Iterable
from fnmatch import translate


def matches(patterns: Iterable[str], name: str) -> bool:
    """Whether any of the patterns matches the whole name."""
    folded = name.casefold()
    return any(re.fullmatch(translate(pattern.casefold()), folded) for pattern in patterns)


def guess(word: str, known: Iterable[str]) -> str:
    """ "did you mean NAME? " with the known name that is most similar; "" when none is similar."""
    from difflib import get_close_matches

    folded = {name.casefold(): name for name in known}
    near = get_close_matches(word.casefold(), folded, n=1)
    return f"did you mean {folded[near[0]]}? " if near else ""
