"""Tool tables of LinuxCNC: the tools of a machine by number.

    T1 P1 Z0.511 D0.125 ;1/8 end mill

A line holds words, a letter and a number each, in any order; T (the tool) and P (its pocket) must
be there, each tool once. A remark follows `;`. Lines without words are skipped. Format: LinuxCNC's
manual, "Tool Table Format". Lengths are in the machine's units, which the file does not name. Of
the words, only the tool's number and its diameter are used here."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

from msgspec import Struct

from camtool.errors import OptionError

WORDS = "TPXYZABCUVWDIJQ"
"""Letters of the words: tool, pocket, offsets of nine axes, diameter, front and back angle of a
turning tool, orientation."""

_WORD = re.compile(r"([A-Za-z])([+-]?(?:\d+(?:\.\d*)?|\.\d+))")
_WHOLE = re.compile(r"\d+")


class TableTool(Struct, frozen=True):
    """A line of the tool table: the `number` of the tool; its `diameter` in the table's unit, None
    without a D; the `remark`; the number of the `line`."""

    number: int
    diameter: float | None
    remark: str
    line: int


def read_tool_table(text: str, file: str) -> dict[int, TableTool]:
    """Return the tools of a table by number, in the order of its lines.

    OptionError, with file and line, for words that are malformed, repeated, missing or out of
    range."""
    tools: dict[int, TableTool] = {}
    for row, line in enumerate(text.split("\n"), start=1):
        words, _, remark = line.partition(";")
        if not words.strip():
            continue
        try:
            tool = _tool(dict(_words(words)), remark.strip(), row)
            if tool.number in tools:
                raise OptionError(
                    f"tool {tool.number} stands in line {tools[tool.number].line} already",
                    mend="give each tool once",
                )
        except OptionError as error:
            error.file, error.where = file, f"line {row}"
            raise
        tools[tool.number] = tool
    return tools


def _words(text: str) -> Iterator[tuple[str, str]]:
    """Yield letter and number of each word of a line; OptionError for anything else, and for a
    letter that comes twice."""
    letters_seen: set[str] = set()
    for word in text.split():
        match = _WORD.fullmatch(word)
        letter = match[1].upper() if match else ""
        if match is None or letter not in WORDS:
            raise OptionError(
                f"{word!r} is no word of a tool table", mend="write it like T1 P1 Z0.511 D0.125"
            )
        if letter in letters_seen:
            raise OptionError(f"the word {letter} comes twice", mend="give each word once")
        letters_seen.add(letter)
        yield letter, match[2]


def _tool(words: dict[str, str], remark: str, line: int) -> TableTool:
    number, _ = (_whole_number(words, letter) for letter in "TP")
    diameter = float(words["D"]) if "D" in words else None
    if diameter is not None and not 0.0 <= diameter < math.inf:
        raise OptionError(f"D{diameter:g} is no diameter", mend="give a D of 0 or more")
    return TableTool(number, diameter, remark, line)


def _whole_number(words: dict[str, str], letter: str) -> int:
    """Return the number of the word with this letter; OptionError if it is missing or not
    whole."""
    if letter not in words:
        raise OptionError(
            f"the word {letter} is missing", mend=f"give every tool a T and a P, such as {letter}1"
        )
    text = words[letter]
    if not _WHOLE.fullmatch(text):
        raise OptionError(f"{letter}{text} is no whole number", mend=f"write it like {letter}1")
    return int(text)
