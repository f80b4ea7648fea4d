"""Checks of a machine file that describes a dialect: what contradicts itself, and what its own
reader would not take.

Each complaint names the key and what to do. Templates are checked as texts first, then head, foot
and events are read by the dialect's own reader."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from typing import Final, NoReturn

from camtool.errors import MachineError, ProgramError
from camtool.patterns import guess
from camtool.toolpath.moves import Kind, Toolpath

from ..gcode.dialect import UNIT_GUARD, feed_decimals
from .cycles import KINDS, cycle_code, cycles_of
from .dialect import (
    CYCLE_FIELDS,
    EVENT_FIELDS,
    MAX_RADIUS_SWEEP_DEG,
    PROGRAM_FIELDS,
    IsoDialect,
    IsoMachine,
)
from .lines import EVENT_KEYS, EventPattern, event_patterns, with_modes
from .read import EVENTS, GROUPS, contradiction_of, read_program

SAFE_CHARACTERS: Final = "._+:/=-"
"""Characters that no controller obeys within a comment."""

ACTIVE_SIGNS: Final = "!?~%\\"
"""Signs that some controllers obey wherever they stand."""

_WORD: Final = re.compile(r"(?<![A-Za-z0-9_=])([A-Z])(\{\w+\}|[+-]?[0-9.]+)")
_FIELD: Final = re.compile(r"\{(\w*)\}")
_REMARK: Final = re.compile(r"[();]")


def check_machine(machine: IsoMachine) -> None:
    """Raise MachineError for the first fault of a machine file."""
    _Check(machine).all()


class _Check:
    """The checks of one machine."""

    def __init__(self, machine: IsoMachine) -> None:
        self._machine = machine
        self._dialect: IsoDialect = machine.dialect

    def all(self) -> None:
        """Run all checks, those of numbers first."""
        feed_decimals(self._machine)
        self._check_numbers()
        self._check_rapids()
        self._check_arcs()
        self._check_comments()
        self._check_lines()
        self._check_templates()
        self._check_needs()
        self._check_cycles()
        self._check_apart()
        self._check_never()
        self._check_as_read()

    def _fail(self, key: str, message: str, mend: str) -> NoReturn:
        table, _, name = f"dialect.{key}".rpartition(".")
        raise MachineError(
            message,
            file=self._machine.target.name,
            where=f"table [{table}], key {name}",
            mend=mend,
        )

    # Numbers

    def _check_numbers(self) -> None:
        words = self._dialect.words
        if len(set(words.whole_letters)) != len(words.whole_letters):
            self._fail("words.whole_letters", "a letter twice", "name each letter once")
        if words.whole_letters and words.point == "needed":
            self._fail(
                "words.point",
                f"a number of {words.whole_letters} without a point counts units of the last "
                'decimal, and "needed" leaves points out',
                'use point = "always" or "never"',
            )
        missing = [letter for letter in self._letters() if letter not in words.whole_letters]
        if words.point == "never" and missing:
            self._fail(
                "words.point",
                f"without points, nothing says the decimals of {' '.join(missing)}",
                f'add them: whole_letters = "{words.whole_letters}{"".join(missing)}"',
            )
        if words.point == "never" and "F" in words.whole_letters:
            self._fail(
                "words.whole_letters",
                'F is written as a plain number where point = "never"',
                "leave F out",
            )
        unit_mm = self._dialect.last_decimal_mm
        if self._dialect.arcs.difference_mm <= 1.5 * unit_mm * (1.0 + UNIT_GUARD):
            self._fail(
                "arcs.difference_mm",
                f"{self._dialect.arcs.difference_mm:g} mm is hardly more than the last decimal is "
                f"worth, {unit_mm:g} mm: rounding alone makes the radii of an arc differ by that",
                f"use {2.0 * unit_mm:g}, or more decimals",
            )

    def _check_rapids(self) -> None:
        feeds = self._dialect.feeds
        if feeds.rapids != "programmed":
            return
        if feeds.mode != "per-minute":
            self._fail(
                "feeds.rapids", "rapids at F need a feed per minute", 'use mode = "per-minute"'
            )
        if not math.isfinite(self._machine.rapid_mm_min):
            self._fail(
                "feeds.rapids",
                "nothing says how fast a rapid is",
                "give limits.rapid_mm_min, or the highest rates of the axes",
            )

    def _letters(self) -> str:
        """Return the address letters under which the writer outputs lengths."""
        letters = "XYZ"
        form = self._dialect.arcs.form
        letters += {"radius": "R", "chords": ""}.get(form, "IJ")
        if self._dialect.cycles.use:
            templates = " ".join(getattr(self._dialect.cycles, kind) for kind in KINDS)
            more_letters = re.findall(r"([A-Z])\{[xyzrq]\}", templates)
            letters += "".join(letter for letter in more_letters if letter not in letters)
        return letters

    def _check_arcs(self) -> None:
        arcs = self._dialect.arcs
        if arcs.form == "radius":
            if arcs.full_circles == "whole":
                self._fail(
                    "arcs.full_circles",
                    "no R says a full circle, whose ends are the same",
                    'use full_circles = "halves"',
                )
            if arcs.sweep_deg > MAX_RADIUS_SWEEP_DEG:
                self._fail(
                    "arcs.max_sweep_deg",
                    f"an arc of {arcs.sweep_deg:g}° by R depends on how R is rounded",
                    f"use {MAX_RADIUS_SWEEP_DEG:g} or less",
                )
        if arcs.full_circles == "whole" and arcs.sweep_deg < 360.0 and arcs.form != "chords":
            self._fail(
                "arcs.full_circles",
                f"a full circle turns by more than max_sweep_deg, {arcs.sweep_deg:g}",
                'use full_circles = "halves"',
            )
        if arcs.min_radius_mm >= arcs.max_radius_mm:
            self._fail(
                "arcs.min_radius_mm",
                f"{arcs.min_radius_mm:g} mm is not below max_radius_mm, {arcs.max_radius_mm:g} mm",
                'for no arcs at all use form = "chords"',
            )

    # Comments and lines

    def _check_comments(self) -> None:
        comments = self._dialect.comments
        active = [sign for sign in comments.characters if sign not in SAFE_CHARACTERS]
        if active:
            nest = any(sign in "();" for sign in active)
            self._fail(
                "comments.characters",
                f"{active[0]!r} "
                + (
                    "would end a comment, or nest one"
                    if nest
                    else "may be obeyed by a controller, or is no plain text"
                ),
                f"choose from {SAFE_CHARACTERS}",
            )
        if comments.style in comments.reads or len(set(comments.reads)) < len(comments.reads):
            self._fail("comments.reads", "a style twice", "name each style once")

    def _check_lines(self) -> None:
        lines = self._dialect.lines
        if lines.numbers and lines.first > lines.highest:
            self._fail(
                "lines.first",
                f"{lines.first} is above lines.highest, {lines.highest}",
                "begin with a lower number",
            )
        if lines.numbers and len(str(lines.highest)) < lines.digits:
            self._fail(
                "lines.digits",
                f"{lines.digits} digits, but no number is above {lines.highest}",
                "use fewer digits, or a higher lines.highest",
            )
        longest = self._dialect.comments.max_chars + len(self._dialect.events.message) + 4
        shows = self._dialect.comments.style != "none" or self._dialect.events.message
        if shows and longest > lines.max_chars:
            self._fail(
                "comments.max_chars",
                f"a comment of {self._dialect.comments.max_chars} characters does not fit into a "
                f"line of {lines.max_chars}",
                f"use {max(lines.max_chars - longest + self._dialect.comments.max_chars, 8)}",
            )

    # Templates

    def _templates(self) -> Iterator[tuple[str, str, Sequence[str]]]:
        """Yield the key of each template, its text, and the fields that it may have."""
        dialect = self._dialect
        for key in ("head", "foot"):
            for template in getattr(dialect.program, key):
                yield f"program.{key}", template, PROGRAM_FIELDS
        for key in EVENT_KEYS:
            for template in getattr(dialect.events, key):
                yield f"events.{key}", template, EVENT_FIELDS.get(key, ())
        for key, fields in CYCLE_FIELDS.items():
            if getattr(dialect.cycles, key):
                yield f"cycles.{key}", getattr(dialect.cycles, key), fields
        if dialect.events.message:
            yield "events.message", dialect.events.message, EVENT_FIELDS["message"]

    def _check_templates(self) -> None:
        for key, template, fields in self._templates():
            self._check_text(key, template, fields)
            if key != "events.message":
                self._check_words(key, template)

    def _check_text(self, key: str, template: str, fields: Sequence[str]) -> None:
        if not template.isascii() or not template.isprintable() or not template.strip():
            self._fail(key, f"{template!r} is no line of plain text", "use printable ASCII")
        signs = [sign for sign in ACTIVE_SIGNS if sign in template]
        if signs:
            self._fail(key, f"{signs[0]!r} in {template!r} may be obeyed anywhere", "leave it out")
        names = _FIELD.findall(template)
        if re.search(r"[{}]", _FIELD.sub("", template)):
            self._fail(key, f"a brace alone in {template!r}", "write fields such as {tool}")
        for name in names:
            if name not in fields:
                field_list = ", ".join(f"{{{each}}}" for each in fields) or "none"
                self._fail(
                    key,
                    f"the field {{{name}}} has no value here",
                    f"{guess(name, fields)}known fields: {field_list}",
                )
        if len(set(names)) < len(names):
            self._fail(key, f"a field twice in {template!r}", "write each field once")
        if key == "events.message":
            self._check_message(template)
            return
        if _REMARK.search(template):
            self._fail(
                key,
                f"a comment in {template!r}",
                "comments.show says what comments a program has; leave it out",
            )
        if not _FIELD.sub("", template).strip() and not set(names) <= {"units", "feeds"}:
            self._fail(key, f"{template!r} is nothing but a field", "add its word")

    def _check_message(self, template: str) -> None:
        before, field, behind = template.partition("{text}")
        if not field:
            self._fail("events.message", "a message without {text}", "such as (MSG,{text})")
        opened = before.count("(") - before.count(")")
        fits = (opened, behind.count(")"), behind.count("(")) in ((0, 0, 0), (1, 1, 0))
        if not fits or before.count("(") > 1:
            self._fail(
                "events.message",
                f"the comment of {template!r} nests, or does not end",
                "such as (MSG,{text})",
            )

    def _check_words(self, key: str, template: str) -> None:
        """Refuse a template in which a word stands twice."""
        letters, groups = set[str](), set[str]()
        for letter, number in _WORD.findall(template):
            if letter == "M" or (number.startswith("{") and letter == "G"):
                continue
            if letter == "G":
                group = GROUPS.get(round(float(number) * 10.0), number)
                if group in groups:
                    self._fail(
                        key,
                        f"{template!r} has two words of the group {group}",
                        "write them in two blocks",
                    )
                groups.add(group)
            elif letter in letters:
                self._fail(key, f"{template!r} has the word {letter} twice", "remove one")
            letters.add(letter)

    def _check_needs(self) -> None:
        """Refuse a dialect that lacks words for what the machine has."""
        dialect, machine = self._dialect, self._machine
        events = dialect.events
        scaled = [
            (key, name)
            for key in ("spindle_cw", "spindle_ccw")
            for template in getattr(events, key)
            for name in ("percent", "pwm")
            if f"{{{name}}}" in template
        ]
        if scaled and machine.spindle.max_rpm is None:
            key, name = scaled[0]
            self._fail(
                f"events.{key}",
                f"{{{name}}} is a part of spindle.max_rpm, which is not given",
                "give spindle.max_rpm, or use {rpm}",
            )
        names = set(_FIELD.findall(" ".join((*events.spindle_cw, *events.spindle_ccw))))
        if len(names) > 1:
            self._fail(
                "events.spindle_cw",
                f"speeds as {' and '.join(sorted(names))}: the reader could not tell them apart",
                "say both directions alike",
            )
        for kind in machine.coolant.kinds:
            if not getattr(events, kind) or not events.coolant_off:
                key = kind if not getattr(events, kind) else "coolant_off"
                self._fail(
                    f"events.{key}",
                    f"the machine has {kind} coolant, but no block switches it",
                    f"give the block, or coolant.{kind} = false",
                )
        for key in ("dwell", "tool_change"):
            templates = getattr(events, key)
            names_found = set(_FIELD.findall(" ".join(templates)))
            if templates and len(names_found) != 1:
                self._fail(
                    f"events.{key}",
                    f"{len(names_found)} fields in its blocks, where one is needed",
                    f"write one of {', '.join(f'{{{name}}}' for name in EVENT_FIELDS[key])}",
                )

    # Cycles

    def _check_cycles(self) -> None:
        cycles = self._dialect.cycles
        if cycles.use and not cycles.drill:
            self._fail(
                "cycles.drill",
                "holes are to be written as cycles, but there is no template for the plainest",
                'such as "G98 G81 X{x} Y{y} Z{z} R{r} F{f}", or use = false',
            )
        if cycles.use and self._dialect.feeds.mode == "inverse-time":
            self._fail(
                "cycles.use",
                "a cycle has no single time of which F could be the inverse",
                "use = false",
            )
        if cycles.use and not cycles.end:
            self._fail("cycles.end", "nothing ends a cycle", 'such as end = "G80"')
        codes = dict[int, str]()
        for kind in KINDS:
            template: str = getattr(cycles, kind)
            if not template:
                continue
            code = cycle_code(template)
            if code is None:
                self._fail(
                    f"cycles.{kind}",
                    f"no code from G73 to G89 in {template!r}",
                    "the reader knows a cycle by it",
                )
            if code in codes:
                self._fail(
                    f"cycles.{kind}",
                    f"G{code // 10} is {codes[code]} already",
                    "each cycle has a code of its own",
                )
            codes[code] = kind
            letters = cycles_of(self._dialect)[code].letters
            needed = {"x", "y", "z", "r", "f", *({"q"} if kind in ("peck", "chip") else ())}
            missing = sorted(needed - set(letters.values()))
            if kind == "dwell" and not {"s", "ms"} & set(letters.values()):
                missing.append("s")
            if missing:
                self._fail(
                    f"cycles.{kind}",
                    f"{template!r} lacks {', '.join(f'{{{name}}}' for name in missing)}, each "
                    "behind a letter",
                    "add it",
                )
            own = {"x": "X", "y": "Y", "f": "F"}
            wrong = [name for letter, name in letters.items() if own.get(name, letter) != letter]
            if wrong:
                self._fail(
                    f"cycles.{kind}",
                    f"{{{wrong[0]}}} behind another letter than {own[wrong[0]]}",
                    f"write {own[wrong[0]]}{{{wrong[0]}}}",
                )

    # Events with equal blocks, and signs that must not appear

    def _check_apart(self) -> None:
        """Refuse two events with the same blocks: the reader could not tell them apart."""
        keys_of_blocks = dict[tuple[str, ...], str]()
        for each in event_patterns(self._dialect):
            blocks = tuple(pattern.pattern for pattern in each.lines)
            if blocks in keys_of_blocks and keys_of_blocks[blocks] != each.key:
                self._fail(
                    f"events.{each.key}",
                    f"its blocks are those of {keys_of_blocks[blocks]} as well",
                    "say them apart, or leave out the one that the machine has not",
                )
            keys_of_blocks[blocks] = each.key

    def _check_never(self) -> None:
        program = self._dialect.program
        both = [code for code in program.never if code in program.passed_over]
        if both:
            self._fail(
                "program.passed_over",
                f"{both[0]} is passed over, and must never appear",
                "decide for one",
            )
        own_codes = ["G0", "G1", *(() if self._dialect.arcs.form == "chords" else ("G2", "G3"))]
        own_codes += [program.end] if program.end else []
        for code in own_codes:
            if code in program.never:
                self._fail(
                    "program.never", f"{code} is a word that every program has", "take it out"
                )
        for key, template, _ in self._templates():
            filled = with_modes(template, self._dialect)
            for letter, number in _WORD.findall(filled):
                if letter in "GM" and not number.startswith("{"):
                    code = f"{letter}{float(number):g}"
                    if code in program.never:
                        self._fail(
                            key, f"{code} is one of program.never", "take it out of one of them"
                        )

    # As the reader takes it

    def _check_as_read(self) -> None:
        """Refuse a head or foot that the reader would not accept, that cuts, or that ends the
        program."""
        dialect = self._dialect
        for key in ("head", "foot"):
            templates = getattr(dialect.program, key)
            lines = [with_modes(each, dialect).replace("{number}", "1") for each in templates]
            if not lines:
                continue
            path = self._read(f"program.{key}", [*lines, dialect.program.end or "G0"])
            if path.is_feed.any():
                self._fail(f"program.{key}", "its blocks cut", "only rapids and switches")
            if key == "head":
                self._check_modes(lines)
            ends = path.block[path.kind == Kind.END].tolist()
            if len(ends) and ends[0] < len([line for line in lines if line[:1] != "O"]):
                self._fail(f"program.{key}", "its blocks end the program", "camtool does that")
        for each in event_patterns(dialect):
            self._check_event(each)

    def _check_modes(self, lines: Sequence[str]) -> None:
        """Refuse a head that sets other modes than those in which programs are written."""
        complaint = contradiction_of(self._data(lines), self._machine)
        if complaint:
            self._fail(
                "program.head",
                f"its blocks contradict the dialect: {complaint}",
                "write {units} and {feeds}, which follow it, G90 and G17",
            )

    def _data(self, lines: Sequence[str]) -> bytes:
        end = {"lf": "\n", "crlf": "\r\n", "cr": "\r"}[self._dialect.lines.end]
        return "".join(f"{line}{end}" for line in lines).encode()

    def _check_event(self, each: EventPattern) -> None:
        """Refuse an event if its blocks in the machine file are read back as another event."""
        templates: tuple[str, ...] = getattr(self._dialect.events, each.key)
        if len(each.fields) != len(_FIELD.findall(" ".join(templates))):
            return  # the variant without a speed
        lines = [_FIELD.sub("1.", template) for template in templates]
        lines = [re.sub(r"1\.(?=\D*$)", "1.", line) for line in lines]
        path = self._read(f"events.{each.key}", lines)
        wanted_kind = EVENTS[each.key]
        if path.kind.tolist() != [wanted_kind]:
            names = ", ".join(Kind(kind).name for kind in path.kind.tolist()) or "nothing"
            self._fail(
                f"events.{each.key}",
                f"its blocks are read as {names}, not as {wanted_kind.name}",
                "say it apart from other events",
            )

    def _read(self, key: str, lines: Sequence[str]) -> Toolpath:
        try:
            return read_program(self._data(lines), self._machine)
        except ProgramError as error:
            self._fail(key, f"{error.message} ({error.where})", error.mend)
