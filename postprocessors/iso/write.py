"""Writing a dialect that a machine file describes: what it has of its own beside `gcode/write.py`.

    rows ──lowered──▶ what its arcs can say ──units──▶ words by columns, templates filled in

A template's fields become numbers as the words of the dialect are written. Where a speed is not
known, the words that have it are left out."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Final

import numpy as np

from camtool.arrays import Bools, Codes, Floats, Ints
from camtool.bounds import refuse_too_long
from camtool.findings import Finding
from camtool.records import replace
from camtool.toolpath.lower import LoweredToolpath, arcs_to_lines, arcs_within
from camtool.toolpath.moves import Kind, Toolpath, mounted_before
from camtool.toolpath.program import Program
from camtool.toolpath.refusals import refuse
from camtool.toolpath.words import WordColumn, texts_of

from ..gcode.arcs import arcs_of
from ..gcode.checks import check, feed_units
from ..gcode.comments import comments, header, mounting_messages
from ..gcode.cycles import CYCLE, CycleHole, holes_of
from ..gcode.dialect import UNITS, feed_decimals
from ..gcode.findings import EVENT_LEFT_OUT_TOOL
from ..gcode.format import check_length, units_of
from ..gcode.write import (
    VALUE,
    BlockOrder,
    Event,
    LineNumbers,
    Sent,
    arc_findings,
    changes_of,
    events_of,
    first_change,
    in_units,
    rounding_findings,
    sent_rows,
    tool_number,
)
from .dialect import SPEED_SCALES, IsoDialect, IsoMachine
from .findings import ARC_MENDED_AS_LINES
from .planners import seconds_of

_MESSAGE: Final = "MSG,"
"""Marks a line for the operator until it gets the dialect's own form: no comment has a comma."""

_FIELD: Final = re.compile(r"(?P<letter>(?<![A-Za-z0-9_])[A-Z])?\{(?P<name>\w+)\}")
_UNNAMED_LINE: Final = re.compile(r"[O:]\d")
"""A line of the head that names the program, and is no block."""

_FEED_CODES: Final = {"per-minute": "G94", "per-revolution": "G95", "inverse-time": "G93"}

_EVENT_KEYS: Final = {
    Kind.SPINDLE_CW: "spindle_cw",
    Kind.SPINDLE_CCW: "spindle_ccw",
    Kind.SPINDLE_OFF: "spindle_off",
    Kind.COOLANT_MIST: "mist",
    Kind.COOLANT_FLOOD: "flood",
    Kind.COOLANT_OFF: "coolant_off",
    Kind.DWELL: "dwell",
    Kind.TOOL_CHANGE: "tool_change",
    Kind.HOME_XY: "home_xy",
    Kind.HOME_Z: "home_z",
}


def write_program(toolpath: Toolpath, machine: IsoMachine) -> Program:
    """Return the program of a toolpath; PostError names the move that cannot be written or
    done."""
    check(toolpath, machine)
    form = TextForm(machine)
    dialect, unit = machine.dialect, machine.dialect.unit
    seconds = seconds_of(toolpath, machine)
    lowered, line_findings = _lowered(toolpath, machine)
    path = lowered.toolpath
    feeds, feed_findings = _feeds(path, machine)
    path, gcode = in_units(path, dialect.gcode, unit)
    arcs = arcs_of(path, gcode)
    words = _EventWords(machine, form)
    events = events_of(path, words.blocks)
    holes = _holes(path, dialect)
    if holes:
        blocks = {**events.blocks, **_cycle_blocks(holes, feeds, machine, form)}
        events = replace(events, blocks=blocks)
    unmoved = first_change(path, events) if _measures_lengths(dialect) else 0
    sent = sent_rows(path, arcs, feeds, events.changes, holes, unmoved)
    if dialect.words.coordinates == "all":
        sent.written[sent.is_motion] = True
    head, frame_lines = _head(form, dialect)
    order = BlockOrder(sent.is_motion)
    order.add(0, head)
    for index, row in sent.event_rows(events):
        order.add(index, events.blocks[row], row)
    footer = _footer(path, form, dialect, spindle_on=events.spindle_on)
    has_end = bool(dialect.program.end) and len(path) > 0 and path.kind[-1] == Kind.END
    order.add(len(sent.row), footer[:-1])
    order.add(len(sent.row), footer[-1:], len(path) - 1 if has_end else -1)
    of_row = order.rows(sent.row)

    def mounted(row: int) -> Sequence[str]:
        is_asked = dialect.events.mount_messages
        return mounting_messages(path, row, UNITS[dialect.program.units]) if is_asked else ()

    tells = {row: mounted(row) for row in events.changes}
    given_s = None if seconds is None else _shared(seconds, lowered.row)
    remarks = comments(path, of_row, gcode, _MESSAGE, tells, given_s)
    frame = [dialect.program.frame] if dialect.program.frame else []
    remark = _Remarks(dialect)
    first_lines = [
        *frame,
        *frame_lines,
        *filter(None, map(remark.line, header(path, machine, gcode))),
    ]
    refuse_too_long(len(first_lines) + len(of_row) + len(remarks[0]) + len(frame), "line")
    body = order.text(
        _columns(sent, path, machine, form),
        remarks[0],
        lambda k: remark.line(remarks[1](k)),
        numbers=_line_numbers(dialect),
        blanks=dialect.words.blanks,
    )
    lines = ["".join(f"{line}\n" for line in part) for part in (first_lines, frame)]
    data = lines[0].encode("ascii") + body + lines[1].encode("ascii")
    max_chars = dialect.lines.max_chars
    check_length(data, max_chars, "line", "raise lines.max_chars, or use shorter texts")
    ends = {"lf": b"\n", "crlf": b"\r\n", "cr": b"\r"}
    data = data.replace(b"\n", ends[dialect.lines.end])
    own_rows = np.where(of_row >= 0, lowered.row[of_row], -1) if len(path) else of_row
    return Program.of_text(
        data,
        machine,
        own_rows,
        (
            *line_findings,
            *feed_findings,
            *arc_findings(path, arcs.counts, sent.dropped),
            *rounding_findings(path, events.rounded),
            *_mounted_by_hand(toolpath, dialect),
        ),
    )


# What its arcs can say.


def _lowered(toolpath: Toolpath, machine: IsoMachine) -> tuple[LoweredToolpath, list[Finding]]:
    """Return the toolpath with arcs that the dialect does not have as lines, and with long arcs in
    parts."""
    rules = machine.dialect.arcs
    same = LoweredToolpath(toolpath, np.arange(len(toolpath)))
    is_arc = toolpath.is_arc
    if not is_arc.any():
        return same, []
    as_lines = is_arc & (rules.form == "chords")
    if not rules.helices:
        as_lines |= is_arc & (toolpath.end[:, 2] != toolpath.starts[:, 2])
    lowered, findings = same, list[Finding]()
    if as_lines.any():
        tolerance = machine.defaults.fit_tolerance_mm
        lowered = arcs_to_lines(toolpath, as_lines, tolerance)
        findings.append(
            ARC_MENDED_AS_LINES(
                where=toolpath.place(int(as_lines.argmax())),
                measured=int(as_lines.sum()),
                tolerance=tolerance,
            )
        )
    if rules.sweep_deg < 360.0:
        shorter = arcs_within(lowered.toolpath, math.radians(rules.sweep_deg))
        lowered = shorter.after(lowered)
    return lowered, findings


def _shared(seconds: Floats, row: Ints) -> Floats:
    """Return (M,) seconds of the rows that replace those of `seconds`: each row's time in equal
    shares among its replacements, whose `row` (M,) names it."""
    counts = np.bincount(row, minlength=len(seconds))
    return np.asarray((seconds / np.maximum(counts, 1))[row])


# Numbers.


class TextForm:
    """Writes numbers as the words of a dialect."""

    def __init__(self, machine: IsoMachine) -> None:
        dialect = machine.dialect
        self._words = dialect.words
        self.number = dialect.program.number
        self.modes = {"{units}": dialect.unit.word, "{feeds}": _FEED_CODES[dialect.feeds.mode]}
        self.decimals = dialect.words.decimals + dialect.unit.more_decimals
        self.feed_decimals = {
            "per-minute": feed_decimals(machine) + dialect.unit.more_decimals
        }.get(dialect.feeds.mode, dialect.feeds.decimals)

    def length(self, letter: str, units: Ints, written: Bools) -> WordColumn:
        """Return the words of a length letter; `units` count its last decimal."""
        words = self._words
        if words.point == "never" and letter in words.whole_letters:
            return WordColumn(letter, units, written, plus=words.plus_sign)
        return self._column(
            letter,
            units,
            written,
            self.decimals,
            strips=not words.trailing_zeros,
            plus=words.plus_sign,
        )

    def feed(self, units: Ints, written: Bools) -> WordColumn:
        """Return the F words; `units` count their last decimal."""
        return self._column("F", units, written, self.feed_decimals)

    def code(self, kind: Codes, written: Bools) -> WordColumn:
        """Return the words G0 to G3."""
        return WordColumn("G", kind, written, digits=self._words.code_digits)

    def _column(
        self,
        letter: str,
        units: Ints,
        written: Bools,
        decimals: int,
        *,
        strips: bool = True,
        plus: bool = False,
    ) -> WordColumn:
        words = self._words
        return WordColumn(
            letter,
            units,
            written,
            decimals,
            kept=0 if strips else None,
            digits=1 if words.leading_zero else 0,
            plus=plus,
            bare_point=words.point == "always" and letter in f"{words.whole_letters}XYZIJKRQF",
        )

    def lengths(self, letter: str, values: Floats) -> list[str]:
        """Return lengths (K,) as the texts of their numbers."""
        every = np.ones(len(values), dtype=np.bool_)
        return _texts(self.length(letter, units_of(values, self.decimals), every))

    def value(self, letter: str, value: float) -> str:
        """Return the text of a number that is no length: a time, a speed, a percentage."""
        words = self._words
        if words.point == "never" and letter and letter in words.whole_letters:
            units = units_of(np.array([value]), self.decimals)
            return _texts(WordColumn(letter, units, np.ones(1, dtype=np.bool_)))[0]
        units = units_of(np.array([value]), VALUE.decimals)
        column = WordColumn(
            letter,
            units,
            np.ones(1, dtype=np.bool_),
            VALUE.decimals,
            kept=0,
            bare_point=bool(letter) and letter in words.whole_letters,
        )
        return _texts(column)[0]

    def frame_line(self, template: str) -> str:
        """Return a line of the head or foot with its fields filled in."""
        for field, text in self.modes.items():
            template = template.replace(field, text)
        return template.replace("{number}", f"{self.number:04}")

    def fill(self, template: str, values: Mapping[str, Callable[[str], str]]) -> str:
        """Return a template with its fields replaced by the texts that `values` give; each is
        called with the letter before its field."""
        return _FIELD.sub(
            lambda field: f"{field['letter'] or ''}{values[field['name']](field['letter'] or '')}",
            template,
        )


def _texts(column: WordColumn) -> list[str]:
    """Return the numbers of a column of words, without their letter."""
    lines = texts_of([column]).data.decode("ascii").splitlines()
    return [line.removeprefix(column.letter) for line in lines]


def _columns(sent: Sent, path: Toolpath, machine: IsoMachine, form: TextForm) -> list[WordColumn]:
    """Return the words of all motions among the rows, one column for each letter."""
    dialect, motion = machine.dialect, sent.is_motion
    rows = np.flatnonzero(motion)
    turns = np.zeros(len(motion), dtype=np.bool_)
    turns[rows] = np.diff(sent.kind[rows], prepend=-1) != 0
    turns |= sent.forget & motion
    if dialect.words.motion == "all":
        turns = motion
    is_arc = motion & (sent.kind >= Kind.ARC_CW)
    is_cut = motion & (sent.kind >= Kind.LINE)
    feed_values = sent.feed
    if dialect.feeds.mode == "inverse-time":
        feed_values = _inverse_times(sent, path, machine, form)
        fed = is_cut
    else:
        at_feed = is_cut
        if dialect.feeds.rapids == "programmed":
            at_feed, scale = motion, 10.0**form.feed_decimals / dialect.unit.mm
            rapid = math.floor(machine.rapid_mm_min * scale + 1e-6)
            feed_values = np.where(sent.kind == Kind.RAPID, rapid, feed_values)
        fed = motion & changes_of(feed_values, at_feed | (sent.kind == CYCLE))
        fed = at_feed if dialect.words.feed == "all" else fed
    return [
        form.code(sent.kind, turns),
        *(form.length(axis, sent.end[:, k], sent.written[:, k]) for k, axis in enumerate("XYZ")),
        *_centre_words(sent, path, is_arc, dialect, form),
        form.feed(feed_values, fed),
    ]


def _centre_words(
    sent: Sent, path: Toolpath, is_arc: Bools, dialect: IsoDialect, form: TextForm
) -> Iterator[WordColumn]:
    """Yield the columns of words that give the centres of arcs."""
    if not is_arc.any():
        return
    if dialect.arcs.form == "radius":
        radius = np.rint(np.hypot(*sent.offset.T)).astype(np.int64)
        yield form.length("R", radius, is_arc)
        return
    centre = sent.offset
    if dialect.arcs.form == "centre":
        start = units_of(path.start, form.decimals)[None, :2]
        centre = centre + np.concatenate([start, sent.end[:-1, :2]])
    for k, letter in enumerate("IJ"):
        yield form.length(letter, centre[:, k], is_arc)


# Feeds.


def _feeds(path: Toolpath, machine: IsoMachine) -> tuple[Ints, list[Finding]]:
    """Return the feeds (N,) in whole units of the F word, 0 where there is none; and the findings
    on rounding. With inverse time, feeds are per minute here, and `_inverse_times` makes the
    words."""
    feeds = machine.dialect.feeds
    if feeds.mode == "inverse-time":
        return np.where(path.is_feed, 1, 0).astype(np.int64), []
    if feeds.mode == "per-minute":
        return feed_units(path, machine, machine.dialect.unit)
    rpm = _speeds(path)
    with np.errstate(invalid="ignore", divide="ignore"):
        refuse(
            path,
            path.is_feed & ~(rpm > 0.0),
            "a feed per revolution while the spindle stands or its speed is not known",
            "give spindle speeds, or --set dialect.feeds.mode=per-minute",
        )
        scale = 10.0**feeds.decimals / machine.dialect.unit.mm
        units = np.floor(np.where(path.is_feed, path.feed / rpm, 0.0) * scale + 1e-6)
    _refuse_none(path, path.is_feed & (units < 1.0))
    return units.astype(np.int64), []


def _refuse_none(path: Toolpath, is_bad: Bools) -> None:
    refuse(
        path,
        is_bad,
        lambda row: f"a feed of {path.feed[row]:g} mm/min becomes 0 in an F word",
        "raise the feed, or --set dialect.feeds.decimals",
    )


def _speeds(path: Toolpath) -> Floats:
    """Return (N,) rev/min of the spindle at each row; 0 where it stands."""
    kinds = (Kind.SPINDLE_CW, Kind.SPINDLE_CCW, Kind.SPINDLE_OFF)
    switched = np.isin(path.kind, kinds)
    values = np.where(path.kind == Kind.SPINDLE_OFF, 0.0, path.value)
    latest = np.maximum.accumulate(np.where(switched, np.arange(1, len(path) + 1), 0))
    return np.asarray(np.concatenate([[0.0], values])[latest])


def _inverse_times(sent: Sent, path: Toolpath, machine: IsoMachine, form: TextForm) -> Ints:
    """Return (M,) the inverse time of each cut, its feed divided by its length, 1/min, in units of
    the F word."""
    unit = 10.0**-form.decimals
    start = np.concatenate([units_of(path.start, form.decimals)[None, :], sent.end[:-1]])
    travel = (sent.end - start) * unit
    flat = np.hypot(travel[:, 0], travel[:, 1])
    arcs = np.flatnonzero(sent.is_motion & (sent.kind >= Kind.ARC_CW))
    out = -sent.offset[arcs] * unit
    to = out + travel[arcs, :2]
    cross = out[:, 0] * to[:, 1] - out[:, 1] * to[:, 0]
    sign = np.where(sent.kind[arcs] == Kind.ARC_CW, -1.0, 1.0)
    sweep = np.mod(sign * np.arctan2(cross, (out * to).sum(axis=1)), 2.0 * np.pi)
    sweep = np.where(~travel[arcs, :2].any(axis=1) | (sweep == 0.0), 2.0 * np.pi, sweep)
    flat[arcs] = np.hypot(*out.T) * sweep
    length = np.hypot(flat, travel[:, 2])
    feed = path.feed[sent.row] / machine.dialect.unit.mm
    is_cut = sent.is_motion & (sent.kind >= Kind.LINE)
    with np.errstate(divide="ignore", invalid="ignore"):
        value = np.where(is_cut & (length > 0.0), feed / length, 0.0)
    units = np.rint(value * 10.0**form.feed_decimals)
    bad = np.zeros(len(path), dtype=np.bool_)
    bad[sent.row[is_cut & (units < 1.0)]] = True
    _refuse_none(path, bad)
    return units.astype(np.int64)


# Events and what stands around the moves.


class _EventWords:
    """Writes the blocks of events."""

    def __init__(self, machine: IsoMachine, form: TextForm) -> None:
        self._machine, self._form = machine, form
        self._events = machine.dialect.events

    def blocks(self, event: Event) -> Sequence[str]:
        """Return the blocks of an event; PostError for an event that the dialect cannot
        express."""
        key = _EVENT_KEYS.get(event.kind)
        if key is None:
            raise event.refuse(f"a {event.kind.name} has no block in this dialect")
        if event.kind == Kind.TOOL_CHANGE:
            by_hand = self._events.first_tool == "by-hand" or not self._events.tool_change
            if event.mounted_before and by_hand:
                return ()
        templates: tuple[str, ...] = getattr(self._events, key)
        if not templates:
            raise event.refuse(
                f"a {event.kind.name} has no block in this dialect",
                f"give dialect.events.{key} in the machine file"
                + (", or write a program for each tool (--split tool)" if "tool" in key else ""),
            )
        if event.kind == Kind.TOOL_CHANGE:
            number = tool_number(event)
            if number > self._events.max_tool:
                raise event.refuse(f"the highest tool number is {self._events.max_tool}")
            return [self._form.fill(each, {"tool": lambda _: str(number)}) for each in templates]
        if event.kind == Kind.DWELL:
            self._check_value(event)
            return [self._filled(each, _times(event.value, self._form)) for each in templates]
        if event.kind in (Kind.SPINDLE_CW, Kind.SPINDLE_CCW):
            return self._spindle(event, templates)
        return templates

    def _filled(self, template: str, values: Mapping[str, Callable[[str], str]]) -> str:
        return self._form.fill(template, values)

    def _check_value(self, event: Event) -> None:
        if not (math.isfinite(event.value) and event.value >= 0.0):
            raise event.refuse(f"a {event.kind.name} without a value of 0 or more")

    def _spindle(self, event: Event, templates: Sequence[str]) -> list[str]:
        """Return the blocks that start the spindle; without a known speed, words that contain it
        are left out."""
        if math.isnan(event.value):
            blocks_without = [_without_fields(template) for template in templates]
            if any("{" in template for template in blocks_without):
                raise event.refuse(
                    "the spindle's speed is not known, and the dialect cannot leave it out",
                    "give a speed",
                )
            return [template for template in blocks_without if template]
        self._check_value(event)
        max_rpm = self._machine.spindle.max_rpm or math.nan

        def said(scale: float | None) -> Callable[[str], str]:
            if scale is None:
                value = round(event.value, self._events.rpm_decimals)
            else:
                value = event.value / max_rpm * scale
            return lambda letter: self._form.value(letter, value)

        values = {name: said(scale) for name, scale in SPEED_SCALES.items() if scale is None}
        if any("{percent}" in each or "{pwm}" in each for each in templates):
            values = {name: said(scale) for name, scale in SPEED_SCALES.items()}
        return [self._filled(template, values) for template in templates]


def _times(seconds: float, form: TextForm) -> Mapping[str, Callable[[str], str]]:
    return {
        "s": lambda letter: form.value(letter, seconds),
        "ms": lambda letter: form.value(letter, float(round(seconds * 1000.0))),
    }


def _without_fields(template: str) -> str:
    """Return a template without the words that contain a field."""
    return re.sub(r"(?<![A-Za-z0-9_=])[A-Z]\{\w+\} ?", "", template).strip()


def _head(form: TextForm, dialect: IsoDialect) -> tuple[list[str], list[str]]:
    """Return the blocks of the head, and those of its lines that are no blocks."""
    lines = [form.frame_line(template) for template in dialect.program.head]
    names = [line for line in lines if _UNNAMED_LINE.match(line)]
    return [line for line in lines if not _UNNAMED_LINE.match(line)], names


def _footer(path: Toolpath, form: TextForm, dialect: IsoDialect, *, spindle_on: bool) -> list[str]:
    """Return the last lines of a program: retract out of the material (from below Z 0) to the
    highest Z, spindle off, foot, end."""
    program = dialect.program
    heights = np.append(path.end[:, 2], path.start[2])
    last = float(path.end[-1, 2]) if len(path) else 0.0
    lines = list[str]()
    if program.retract and last < 0.0:
        every, blank = np.ones(1, dtype=np.bool_), " " if dialect.words.blanks else ""
        top = form.lengths("Z", heights.max(keepdims=True))[0]
        code = texts_of([form.code(np.zeros(1, dtype=np.int8), every)]).data.decode().strip()
        lines.append(f"{code}{blank}Z{top}")
    off = dialect.events.spindle_off
    foot = [form.frame_line(each) for each in program.foot]
    if spindle_on and not set(off) <= set(foot):
        lines += off
    return [*lines, *foot, *([program.end] if program.end else [])]


def _measures_lengths(dialect: IsoDialect) -> bool:
    """Return True if a tool's length is in force from its change on."""
    return dialect.events.first_tool == "program" and any(
        "G43" in template for template in dialect.events.tool_change
    )


def _mounted_by_hand(toolpath: Toolpath, dialect: IsoDialect) -> Iterator[Finding]:
    """Yield a finding if the program does not name the first tool."""
    events = dialect.events
    by_hand = events.first_tool == "by-hand" or not events.tool_change
    if by_hand and mounted_before(toolpath).any():
        yield EVENT_LEFT_OUT_TOOL()


def _line_numbers(dialect: IsoDialect) -> LineNumbers | None:
    lines = dialect.lines
    if not lines.numbers:
        return None
    return LineNumbers(lines.first, lines.step, lines.digits, lines.highest)


# Comments.


class _Remarks:
    """Writes comments in the dialect's form; "" for those that it cannot have."""

    def __init__(self, dialect: IsoDialect) -> None:
        comments = dialect.comments
        self._comments, self._message = comments, dialect.events.message
        self._unsafe = re.compile(f"[^A-Za-z0-9 {re.escape(comments.characters)}]")

    def line(self, comment: str) -> str:
        """Return a comment, given in parentheses, in the dialect's style; as a message where it
        begins with a message's mark."""
        text = comment[1:-1]
        is_message = text.startswith(_MESSAGE)
        text = self._unsafe.sub("_", text.removeprefix(_MESSAGE))
        text = text[: self._comments.max_chars].strip()
        text = text.upper() if self._comments.upper_case else text
        if is_message and self._message:
            return self._message.replace("{text}", text)
        style = self._comments.style
        if style == "none":
            return ""
        return f"({text})" if style == "parentheses" else f"; {text}"


# Cycles.


def _holes(path: Toolpath, dialect: IsoDialect) -> list[CycleHole]:
    """Return the holes for which the dialect has a cycle."""
    if not dialect.cycles.use:
        return []
    return [hole for hole in holes_of(path) if _template(hole, dialect)]


def _template(hole: CycleHole, dialect: IsoDialect) -> str:
    cycles = dialect.cycles
    if hole.bite is not None:
        return cycles.peck if cycles.pecks_as == "peck" else cycles.chip
    return cycles.drill if hole.dwell_s is None else cycles.dwell


def _constant(text: str) -> Callable[[str], str]:
    return lambda _: text


def _cycle_blocks(
    holes: Sequence[CycleHole], feeds: Ints, machine: IsoMachine, form: TextForm
) -> dict[int, Sequence[str]]:
    """Return the blocks of each hole, by its first row at a feed. Consecutive holes of equal
    depth, height and peck share one cycle with several places."""
    cycles = machine.dialect.cycles
    unit = 10.0**-form.decimals
    bites = np.array([hole.bite or 0.0 for hole in holes])
    cut = feeds[[hole.cut for hole in holes]]
    texts = {
        "x": form.lengths("X", np.array([hole.at[0] for hole in holes])),
        "y": form.lengths("Y", np.array([hole.at[1] for hole in holes])),
        "z": form.lengths("Z", np.array([hole.bottom for hole in holes])),
        "r": form.lengths("R", np.array([hole.height for hole in holes])),
        "q": form.lengths("Q", np.maximum(np.floor(bites / unit + 1e-6), 1.0) * unit),
        "f": _texts(form.feed(cut, np.ones(len(cut), dtype=np.bool_))),
    }
    blocks: dict[int, Sequence[str]] = {}
    for k, hole in enumerate(holes):
        values = dict(_times(hole.dwell_s or 0.0, form))
        values |= {name: _constant(texts[name][k]) for name in texts}
        before = holes[k - 1] if k and holes[k - 1].last + 1 == hole.first else None
        alike = before is not None and before.words == hole.words and cut[k - 1] == cut[k]
        template = cycles.again if alike and cycles.again else _template(hole, machine.dialect)
        goes_on = k + 1 < len(holes) and holes[k + 1].first == hole.last + 1
        end = [] if goes_on or not cycles.end else [cycles.end]
        blocks[hole.cut] = [form.fill(template, values), *end]
    return blocks
