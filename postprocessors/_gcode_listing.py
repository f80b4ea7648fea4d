"""Which lines of RS274-like text are blocks: those with a word besides their number."""

from __future__ import annotations

import re
from typing import Final

from camtool.toolpath.program import Listing

_LINE_END: Final = re.compile(r"\r\n|\n|\r")
_NO_WORDS: Final = re.compile(r"\([^()]*\)|;.*|[ \t%]")
_NUMBER: Final = re.compile(r"[Nn]\d+(?:\.\d*)?")


def listing(data: bytes) -> Listing:
    """The blocks of a program that its reader takes, each as its line stands in the file."""
    lines = _LINE_END.split(data.decode("latin-1"))
    return Listing(tuple(line.strip() for line in lines if _has_words(line)))


def _has_words(line: str) -> bool:
    words = _NO_WORDS.sub("", line)
    return bool(_NUMBER.sub("", words, count=1) if words[:1] in "Nn" else words)
