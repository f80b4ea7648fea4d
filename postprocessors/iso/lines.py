"""Reading: the lines of a program as a machine file says them, and its templates as patterns.

A *block* is a line with something besides comments, a block number, % and the number of the
program. Its text keeps the columns of the file's own line: what is left out became blanks."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Final, NoReturn

from msgspec import Struct

from camtool import bounds
from camtool.errors import ProgramError

from ..gcode.blocks import ProgramLines, check_ascii
from ..gcode.faults import LineFault
from .dialect import SPEED_SCALES, IsoDialect, IsoMachine

NUMBER: Final = r"[+-]?(?:\d+\.?\d*|\.\d+)"

_PARENTHESES: Final = re.compile(r"\([^()]*\)")
_PROGRAM_NUMBER: Final = re.compile(r"\s*[O:]\d+\s*")
_BLOCK_NUMBER: Final = re.compile(r"\s*[Nn]\d+")
_FIELD: Final = re.compile(r"\\\{(\w+)\\\}")


class Block(Struct, frozen=True):
    """A block: its index and line, both from 0, and its text without comments and number."""

    index: int
    line: int
    text: str

    @property
    def packed(self) -> str:
        """The text without blanks."""
        return "".join(self.text.split())


class OperatorMessage(Struct, frozen=True):
    """A line that tells the operator something, before the block of this index."""

    index: int
    text: str


def items_of(data: bytes, machine: IsoMachine) -> Iterator[Block | OperatorMessage]:
    """Yield the blocks and messages of a program; ProgramError at the first line that is
    neither."""
    bounds.check_count(max(data.count(b"\n"), data.count(b"\r")), "line")
    check_ascii(data)
    dialect: IsoDialect = machine.dialect
    lines, message = ProgramLines(data), _message_pattern(dialect)
    index = 0
    for number in range(lines.count):
        raw = lines.text(number)
        if len(raw) > dialect.lines.max_chars:
            limit = dialect.lines.max_chars
            fail(
                LineFault(f"the line has more than {limit} characters", limit, "shorten it"),
                index,
                number,
            )
        message_match = None if message is None else message.fullmatch(raw.strip())
        if message_match is not None:
            yield OperatorMessage(index, message_match[1].strip())
            continue
        try:
            text = _without_comments(raw, dialect)
        except LineFault as fault:
            fail(fault, index, number)
        if text.strip() == "%" and dialect.program.frame:
            continue
        number_match = _BLOCK_NUMBER.match(text)
        if number_match:
            text = " " * number_match.end() + text[number_match.end() :]
        if text.strip() and not _PROGRAM_NUMBER.fullmatch(text):
            yield Block(index, number, text)
            index += 1


def fail(fault: LineFault, index: int, line: int) -> NoReturn:
    """Raise ProgramError for a fault in this line and block."""
    column = fault.at + 1 if isinstance(fault.at, int) else 1
    where = f"block {index + 1}, line {line + 1}, column {column}"
    raise ProgramError(fault.message, where=where, mend=fault.mend) from None


def _without_comments(raw: str, dialect: IsoDialect) -> str:
    """Return a line with blanks in place of its comments."""
    styles = dialect.comments.styles_read
    text = raw
    if "parentheses" in styles and "(" in text:
        semicolon = text.find(";") if "semicolon" in styles else -1
        if semicolon < 0 or semicolon > text.find("("):
            text = _PARENTHESES.sub(lambda comment: " " * len(comment[0]), text)
    if "semicolon" in styles and ";" in text:
        semicolon = text.find(";")
        text = text[:semicolon] + " " * (len(text) - semicolon)
    for sign in "()":
        at = text.find(sign)
        if at >= 0 and "parentheses" in styles:
            nested = raw.count("(") > 1 and sign == "("
            message = "a comment within a comment" if nested else "a comment that does not end"
            if sign == ")":
                message = "a comment ends that has not begun"
            raise LineFault(message, at, "write comments as ( … ), none within another")
    return text


def _message_pattern(dialect: IsoDialect) -> re.Pattern[str] | None:
    """Return the pattern of messages; None where messages look like comments."""
    template = dialect.events.message
    if "".join(template.replace("{text}", "").split()) in ("", "()", ";"):
        return None
    before, _, behind = template.partition("{text}")
    # The text may be empty, and its blanks gone with the end of the line.
    return re.compile(rf"{re.escape(before.strip())}\s*(.*?)\s*{re.escape(behind.strip())}")


# Templates as patterns.


class EventPattern(Struct, frozen=True):
    """The blocks of an event: patterns of their texts without blanks, and for each field of them
    its name and the letter before it."""

    key: str
    lines: tuple[re.Pattern[str], ...]
    fields: tuple[tuple[str, str], ...]

    def values(self, texts: Sequence[str]) -> list[str] | None:
        """Return the texts of the template's fields, in order; None if these blocks do not match
        the template."""
        found_values = list[str]()
        for pattern, text in zip(self.lines, texts, strict=True):
            match = pattern.fullmatch(text)
            if match is None:
                return None
            found_values += match.groups()
        return found_values


def pattern_of(template: str) -> tuple[re.Pattern[str], list[tuple[str, str]]]:
    """Return the pattern of a template, without blanks, and its fields."""
    packed = "".join(template.split())
    fields = [
        (field[2], field[1] or "")
        for field in re.finditer(r"((?<![A-Za-z0-9_=])[A-Z])?\{(\w+)\}", _with_gaps(template))
    ]
    return re.compile(_FIELD.sub(lambda _: f"({NUMBER})", re.escape(packed))), fields


def _with_gaps(template: str) -> str:
    """Return a template with a blank before each letter that follows a field or a number."""
    return re.sub(r"(?<=[0-9}])(?=[A-Z])", " ", template)


def event_patterns(dialect: IsoDialect) -> list[EventPattern]:
    """Return the patterns of all events: those of more blocks first, then those with fewer
    fields."""
    patterns = []
    for key in EVENT_KEYS:
        templates: tuple[str, ...] = getattr(dialect.events, key)
        for variant in _variants(key, templates):
            compiled = [pattern_of(template) for template in variant]
            fields = tuple(field for _, own in compiled for field in own)
            patterns.append(EventPattern(key, tuple(one for one, _ in compiled), fields))
    patterns.sort(key=lambda each: (-len(each.lines), len(each.fields)))
    return patterns


EVENT_KEYS: Final = (
    "spindle_cw",
    "spindle_ccw",
    "spindle_off",
    "mist",
    "flood",
    "coolant_off",
    "dwell",
    "tool_change",
    "home_xy",
    "home_z",
)


def _variants(key: str, templates: Sequence[str]) -> Iterator[Sequence[str]]:
    """Yield the blocks of an event; for a spindle also those in which its speed is not given."""
    if not templates:
        return
    yield templates
    if key.startswith("spindle_c") and any("{" in template for template in templates):
        silent = [
            re.sub(r"(?<![A-Za-z0-9_=])[A-Z]\{\w+\}\s?", "", each).strip() for each in templates
        ]
        if any(silent) and not any("{" in each for each in silent):
            yield [each for each in silent if each]


FEED_MODES: Final = {"per-minute": "G94", "per-revolution": "G95", "inverse-time": "G93"}


def with_modes(template: str, dialect: IsoDialect) -> str:
    """Return a template of the head or foot with its modes filled in; the program's number remains
    a field."""
    template = template.replace("{units}", dialect.unit.word)
    return template.replace("{feeds}", FEED_MODES[dialect.feeds.mode])


def speed_field(dialect: IsoDialect) -> tuple[str, float | None]:
    """Return the field that gives the spindle's speed, and its value at `spindle.max_rpm`."""
    templates = " ".join((*dialect.events.spindle_cw, *dialect.events.spindle_ccw))
    for name, scale in SPEED_SCALES.items():
        if f"{{{name}}}" in templates:
            return name, scale
    return "rpm", None
