"""The lines of RS274/NGC: text to words, which are compiled once and read as often as their line
is executed.

    line = Line(text)             closed: small letters, no blanks, comments as they stand
    block = line.block(given)     its words with their numbers, in modal groups

The expressions of a line are compiled by `expressions`, where it has any. A line that begins with
an O word (or M98, M99) is flow's own, and none of these words."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Final

from msgspec import Struct

from ..gcode.faults import LineFault
from .expressions import Scanner, check_index, whole_number
from .parameters import READ_ONLY

if TYPE_CHECKING:
    from .expressions import Value
    from .parameters import Parameters

# Modal groups of G words (interp_array.cc), by the tenfold code; the names are ours.

G_GROUPS: Final[Mapping[int, str]] = {
    **dict.fromkeys((0, 10, 20, 30, 50, 51, 52, 330, 331, 382, 383, 384, 385), "motion"),
    **dict.fromkeys((700, 710, 711, 712, 720, 721, 722, 730, 740, 760, 800), "motion"),
    **dict.fromkeys(range(810, 900, 10), "motion"),
    **dict.fromkeys((40, 53, 100, 280, 281, 300, 301, 520, 530, 920), "one block"),
    **dict.fromkeys((170, 171, 180, 181, 190, 191), "plane"),
    **dict.fromkeys((900, 910), "distance"),
    **dict.fromkeys((901, 911), "arc distance"),
    **dict.fromkeys((930, 940, 950), "feed mode"),
    **dict.fromkeys((200, 210), "units"),
    **dict.fromkeys((400, 410, 411, 420, 421), "cutter radius"),
    **dict.fromkeys((430, 431, 432, 490), "tool length"),
    **dict.fromkeys((980, 990), "return mode"),
    **dict.fromkeys((*range(540, 600, 10), 591, 592, 593), "work frame"),
    **dict.fromkeys((610, 611, 640), "path"),
    **dict.fromkeys((960, 970), "spindle mode"),
    **dict.fromkeys((70, 80), "lathe diameter"),
    **dict.fromkeys((921, 922, 923), "axis offsets"),
}

M_GROUPS: Final[Mapping[int, str]] = {
    **dict.fromkeys((0, 1, 2, 30, 60, 99), "stop"),
    **dict.fromkeys(range(62, 69), "input and output"),
    **dict.fromkeys((6, 61), "tool"),
    **dict.fromkeys((3, 4, 5, 19, 70, 71, 72, 73), "spindle"),
    **dict.fromkeys((7, 8, 9), "coolant"),
    **dict.fromkeys((48, 49, 50, 51, 52, 53), "override"),
    **dict.fromkeys(range(100, 200), "user"),
}

MAX_M_WORDS: Final = 4
"""M words of one block (MAX_EMS)."""

TENTHS: Final = 1e-3
"""Largest difference of a G word, tenfold, from its code: G5.10001 is G5.1."""

AXES: Final = "xyzabc"
"""U, V and W are unknown to a machine that does not have them."""

RELATIVE: Final = "uw"
"""Words of X and Z from where the contour of a lathe cycle stands, and of nothing else."""

WHOLE_WORDS: Final = "hlt"
"""Words whose numbers are whole."""

NEVER_NEGATIVE: Final = {"f": "a feed", "s": "a speed", "t": "a tool", "l": "a count"}

_WORDS: Final = frozenset("abcdefghijklmpqrstuwxyz$@^")
_NUMBER: Final = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?![0-9.])")
_BLOCK_NUMBER: Final = re.compile(r"n[0-9]+(?:\.[0-9]+)?")
_BLANKS: Final = str.maketrans("", "", " \t\r")
_FLOW: Final = re.compile(r"o|m9[89](?![0-9.])")
_MESSAGES: Final = {
    "$": "a command of the controller itself",
    ",": "a decimal comma",
    "%": "a %, which is no word and frames no program here",
    "=": "an assignment without its parameter",
}


def close_up(text: str) -> str:
    """Return the line as LinuxCNC reads it: without blanks and in small letters, except in
    comments."""
    if "(" not in text and ";" not in text:
        return text.translate(_BLANKS).lower()
    parts: list[str] = []
    position = 0
    while position < len(text):
        begin = next((k for k in range(position, len(text)) if text[k] in "(;"), len(text))
        parts.append(text[position:begin].translate(_BLANKS).lower())
        if begin == len(text):
            break
        if text[begin] == ";":
            parts.append(text[begin:])
            break
        end = text.find(")", begin)
        inner = text.find("(", begin + 1)
        if 0 <= inner < (end if end >= 0 else len(text)) or end < 0:
            raise LineFault(
                "a comment that is nested or not closed",
                len("".join(parts)),
                "write one ( and one ) for each comment",
            )
        parts.append(text[begin : end + 1])
        position = end + 1
    return "".join(parts)


def column_of(text: str, place: int) -> int:
    """Return the column, from 1, of a place in the closed-up text of a line."""
    signs, column, comment = 0, 1, ""
    for column, sign in enumerate(text, 1):
        blank = not comment and sign in " \t\r"
        if signs == place and not blank:
            return column
        if not comment and sign in "(;":
            comment = ")" if sign == "(" else "end"
        elif sign == comment:
            comment = ""
        signs += not blank
    return column + (signs <= place and bool(text))


class LinuxcncBlock(Struct, frozen=True):
    """Words of a line: numbers by letter, G codes (tenfold) and M codes by group, the last
    comment, and the parameters that it sets."""

    words: dict[str, float]
    g: dict[str, int]
    m: dict[str, int]
    comment: str | None
    settings: tuple[tuple[int | str, float], ...] = ()


class Item(Struct, frozen=True):
    """A word or a setting of a line: `letter` ("#" for a setting), its number, and where it
    stands; `name`: the parameter that is set."""

    letter: str
    value: Any
    at: int
    name: Any = None


class ParsedLine:
    """Scanned line. `delete`: it begins with /; `flow`: where its O word begins, None for a line
    of words; `begin`: where it begins behind / and N."""

    __slots__ = (
        *("_block", "_is_compiled", "_items", "begin", "comment", "delete", "flow", "text"),
        "word",
    )

    def __init__(self, raw: str) -> None:
        self.text = text = close_up(raw)
        self.delete = text[:1] == "/"
        place = 1 if self.delete else 0
        if text[place : place + 1] == "n":
            match = _BLOCK_NUMBER.match(text, place)
            if match is None:
                raise LineFault("no number after N", place + 1)
            place = match.end()
        self.begin = place
        self.flow = (
            place if text[place : place + 1] in ("o", "m") and _FLOW.match(text, place) else None
        )
        self.word: Any = None
        """Its O word, which flow has read."""
        self.comment: str | None = None
        self._items: list[Item] = []
        self._block: LinuxcncBlock | None = None
        self._is_compiled = False

    @property
    def is_block(self) -> bool:
        """True if the line has more than comments."""
        remainder = self.text[self.begin :]
        while remainder[:1] == "(":
            remainder = remainder[remainder.find(")") + 1 :]
        return bool(remainder) and remainder[0] != ";"

    def block(self, parameters: Parameters) -> LinuxcncBlock:
        """Return the words of the line with their values; LineFault where LinuxCNC would stop
        while it reads them."""
        if self._block is not None:
            return self._block
        if not self._is_compiled:
            self._compile()
            if all(isinstance(item.value, float) and item.letter != "#" for item in self._items):
                self._block = group_words(self._items, self.comment)
                return self._block
        return self._evaluate(parameters)

    def place(self, letter: str) -> int | None:
        """Return the column of the last word with this letter; None if there is none."""
        columns = [item.at for item in self._items if item.letter == letter]
        return columns[-1] if columns else None

    def _evaluate(self, parameters: Parameters) -> LinuxcncBlock:
        words: list[Item] = []
        settings: list[tuple[int | str, float]] = []
        for item in self._items:
            if item.letter != "#":
                value = item.value
                number = value if isinstance(value, float) else value(parameters)
                words.append(Item(item.letter, number, item.at))
                continue
            if isinstance(item.name, str):
                parameters.declare(item.name, item.at)
                name: int | str = item.name
            else:
                name = item.name(parameters)
            value = item.value
            settings.append((name, value if isinstance(value, float) else value(parameters)))
        block = group_words(words, self.comment)
        return LinuxcncBlock(block.words, block.g, block.m, block.comment, tuple(settings))

    def _compile(self) -> None:
        """Split the text into words, and compile their values."""
        text, position = self.text, self.begin
        while position < len(text):
            letter = text[position]
            if letter in _WORDS:
                match = _NUMBER.match(text, position + 1)
                if match is not None:
                    self._items.append(Item(letter, float(match[0]), position))
                    position = match.end()
                    continue
                value, end = _parse_value(text, position + 1, letter)
                self._items.append(Item(letter, value, position))
                position = end
            elif letter == "#":
                item, position = _parse_setting(text, position)
                self._items.append(item)
            elif letter == "(":
                end = text.find(")", position)
                self.comment = text[position + 1 : end]
                position = end + 1
            elif letter == ";":
                break
            elif letter == "[":
                raise LineFault("an expression without the letter of its word", position)
            elif letter == "/":
                raise LineFault("a / that does not begin its line", position)
            elif letter.isascii() and letter.isalpha():
                raise LineFault(f"the letter {letter.upper()} is no word here", position)
            else:
                message = _MESSAGES.get(letter, f"the sign {letter!r} belongs to no word")
                raise LineFault(message, position)
        self._is_compiled = True


def _parse_value(text: str, position: int, letter: str) -> tuple[Value, int]:
    """Parse a value that is not a plain number; return it and its end."""
    sign = text[position : position + 1]
    if not (sign.isalpha() or (sign and sign in "[#+-")):
        raise LineFault(f"no number after {letter.upper()}", position - 1)
    if letter == "$" and sign.isalpha():
        raise LineFault(_MESSAGES["$"], position - 1)

    scanner = Scanner(text, position)
    try:
        return scanner.value(), scanner.at
    except LineFault as fault:
        if fault.message == "no number" and fault.at == position:
            raise LineFault(f"no number after {letter.upper()}", position - 1) from None
        raise


def _parse_setting(text: str, position: int) -> tuple[Item, int]:
    """Parse #index=value or #<name>=value; return it and its end."""
    scanner = Scanner(text, position + 1)

    def settable(index: int) -> int:
        check_index(index, position)
        if index in READ_ONLY:
            raise LineFault(f"#{index} cannot be set", position)
        return index

    name: str | Callable[[Parameters], int]
    if text[position + 1 : position + 2] == "<":
        name = scanner.name()
    else:
        index = scanner.whole_number()
        if isinstance(index, int):
            fixed = settable(index)
            name = lambda parameters: fixed  # noqa: E731 - it is a value
        else:
            computed = index
            name = lambda parameters: settable(computed(parameters))  # noqa: E731
    if text[scanner.at : scanner.at + 1] != "=":
        raise LineFault("a parameter without =: only a word's number may be one", scanner.at)
    scanner.at += 1
    value = scanner.value()
    return Item("#", value, position, name), scanner.at


def group_words(items: list[Item], comment: str | None) -> LinuxcncBlock:
    """Split the words of one block into values by letter and codes by modal group; LineFault for a
    combination that LinuxCNC rejects."""
    words: dict[str, float] = {}
    g: dict[str, int] = {}
    m: dict[str, int] = {}
    for item in items:
        letter, value = item.letter, item.value
        if letter == "g":
            code = g_code(value, item.at)
            group = G_GROUPS[code]
            before = g.get(group)
            if before is not None and code == 800:
                continue  # G80 beside another motion word is ignored
            if before not in (None, 800):
                raise LineFault(f"two G words of one group ({group})", item.at)
            g[group] = code
        elif letter == "m":
            code = m_code(value, item.at)
            group = M_GROUPS[code]
            if group in m:
                raise LineFault(f"two M words of one group ({group})", item.at)
            m[group] = code
        else:
            if letter in words:
                raise LineFault(f"two {letter.upper()} words in one block", item.at)
            if letter in NEVER_NEGATIVE and value < 0.0:
                raise LineFault(f"{NEVER_NEGATIVE[letter]} below 0", item.at)
            if letter in WHOLE_WORDS:
                value = float(_whole_number(value, item.at))
                if letter == "h" and value < -1:
                    raise LineFault("a tool below 0", item.at)
            words[letter] = value
    if len(m) > MAX_M_WORDS:
        raise LineFault(f"more than {MAX_M_WORDS} M words", "m")
    return LinuxcncBlock(words, g, m, comment)


def g_code(value: float, column: int) -> int:
    """Return ten times the number of a G word, its code."""
    tenfold = 10.0 * value
    code = int(tenfold // 1)
    excess = tenfold - code
    if excess > 1.0 - TENTHS:
        code += 1
    elif excess > TENTHS:
        raise LineFault(f"the controller does not know G{value:g}", column)
    if code not in G_GROUPS:
        raise LineFault(f"the controller does not know G{value:g}", column)
    return code


def m_code(value: float, column: int) -> int:
    """Return the code of an M word."""
    try:
        code = _whole_number(value, column)
    except LineFault:
        code = -1
    if code not in M_GROUPS:
        raise LineFault(f"the controller does not know M{value:g}", column)
    return code


def _whole_number(value: float, column: int) -> int:
    if value == value // 1:
        return int(value)

    return whole_number(value, column)
