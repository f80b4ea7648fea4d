"""Reading a dialect that a machine file describes, as its controller would take it.

Blocks that are those of an event, by the templates of the file, are that event. All others are
rows of words, and mean what ISO 6983 and its relatives agree on; a word that neither the standard
part nor the file knows is an error with its column.

    lines   text to blocks, and templates as patterns
    cycles  holes"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import Final

import numpy as np
from msgspec import Struct

from camtool.errors import ProgramError
from camtool.findings import Finding
from camtool.records import replace
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath
from camtool.toolpath.program import Listing

from ..gcode.faults import LineFault
from ..gcode.findings import NEVER_READ, SPINDLE_SPEED_NOT_SAID, WORDS_PASSED_OVER_PAUSE
from ..gcode.part_moves import PLANES, PartMoves, turn_of
from ..gcode.plain_moves import FastFeeds
from .cycles import CycleWords, HoleMoves, cycles_of, run_hole
from .dialect import FEED_LETTER, FULL_TURN_RAD, LENGTH_LETTERS, IsoDialect, IsoMachine
from .findings import NOT_SIMULATED_CHORDS, WORDS_PASSED_OVER_CODES, WORDS_PASSED_OVER_OFFSETS
from .lines import (
    NUMBER,
    Block,
    EventPattern,
    OperatorMessage,
    event_patterns,
    fail,
    items_of,
    pattern_of,
    speed_field,
    with_modes,
)

_WORD: Final = re.compile(rf"[ \t]*([A-Za-z])[ \t]*({NUMBER})")
_PLAIN: Final = re.compile(r"(?:G0*[0-3])?(?:[XYZIJKRF][-+.\d]+)*", re.IGNORECASE)

RAPID, LINE, ARC_CW, ARC_CCW, NO_MOTION = 0, 10, 20, 30, 800

GROUPS: Final = {
    **dict.fromkeys((0, 10, 20, 30, 730, 800, *range(810, 900, 10)), "motion"),
    **dict.fromkeys((170, 180, 190), "plane"),
    **dict.fromkeys((200, 210), "units"),
    **dict.fromkeys((400, 410, 420), "radius of the tool"),
    **dict.fromkeys((430, 440, 490), "length of the tool"),
    **dict.fromkeys((540, 550, 560, 570, 580, 590), "frame"),
    **dict.fromkeys((90, 610, 611, 640), "path"),
    **dict.fromkeys((900, 910), "distance"),
    **dict.fromkeys((901, 911), "distance of centres"),
    **dict.fromkeys((930, 940, 950), "feed mode"),
    **dict.fromkeys((980, 990), "return of cycles"),
    **dict.fromkeys((40, 280, 300, 530), "once"),
}
"""Groups of G codes, tenfold: a block has one of each."""

SPINDLE: Final = {3: Kind.SPINDLE_CW, 4: Kind.SPINDLE_CCW, 5: Kind.SPINDLE_OFF}
COOLANT: Final = {7: Kind.COOLANT_MIST, 8: Kind.COOLANT_FLOOD, 9: Kind.COOLANT_OFF}
KNOWN_M: Final = (0, 1, 2, 30, *SPINDLE, 6, *COOLANT)

EVENTS: Final = {
    "spindle_cw": Kind.SPINDLE_CW,
    "spindle_ccw": Kind.SPINDLE_CCW,
    "spindle_off": Kind.SPINDLE_OFF,
    "mist": Kind.COOLANT_MIST,
    "flood": Kind.COOLANT_FLOOD,
    "coolant_off": Kind.COOLANT_OFF,
    "dwell": Kind.DWELL,
    "tool_change": Kind.TOOL_CHANGE,
    "home_xy": Kind.HOME_XY,
    "home_z": Kind.HOME_Z,
}

ONCE: Final = "ABCDEFHIJKLPQRSTUVWXYZ"
"""Letters of which a block has one."""

SEMICIRCLE_GUARD: Final = 1e-6
"""Part of R by which half a chord may exceed it, by rounding alone, beside the last decimal."""

Point = tuple[float, float, float]


def read_program(data: bytes, machine: IsoMachine) -> Toolpath:
    """Return the moves of a program; ProgramError with block, line and column for data that are no
    program."""
    return _Reader(machine).read(data)


def contradiction_of(data: bytes, machine: IsoMachine) -> str:
    """Return the first mode that these blocks leave in contradiction to the dialect's own words,
    as text; "" if there is none."""
    reader = _Reader(machine)
    before = replace(reader._modes)
    reader.read(data)
    modes = reader._modes
    complaints = {
        "the units": modes.inches != before.inches,
        "the mode of feeds": modes.feed_mode != before.feed_mode,
        "relative coordinates": not modes.absolute,
        "how centres are said": modes.arc_absolute != before.arc_absolute,
        "another plane than XY": reader._moves.plane != 170,
    }
    return next((words for words, is_wrong in complaints.items() if is_wrong), "")


def listing_of(data: bytes, machine: IsoMachine) -> Listing:
    """Return the blocks of a program, counted as `read_program` does."""
    blocks = (item for item in items_of(data, machine) if isinstance(item, Block))
    return Listing(tuple(block.text.strip() for block in blocks))


class _Word(Struct, frozen=True):
    """A word: its letter, number, the text of it, and its column from 0."""

    letter: str
    value: float
    text: str
    at: int

    @property
    def code(self) -> str:
        """The word as the machine file names codes: G1, M30, G91.1."""
        return f"{self.letter}{self.value:g}"


class _Modes(Struct):
    """Modal state, which holds from block to block."""

    motion: int | None = None
    absolute: bool = True
    arc_absolute: bool = False
    inches: bool = False
    feed_mode: int = 940
    feed: float = 0.0
    speed: float = math.nan
    spindle: int = 5
    tool: int | None = None
    frame: int = 540
    returns_high: bool = True
    cycle: CycleWords | None = None


class _Reader:
    """Reads one program."""

    def __init__(self, machine: IsoMachine) -> None:
        dialect: IsoDialect = machine.dialect
        self._machine, self._dialect = machine, dialect
        self.path = ToolpathBuilder()
        self._moves = PartMoves(self.path, FULL_TURN_RAD)
        self._modes = _Modes(
            arc_absolute=dialect.arcs.form == "centre",
            inches=dialect.program.units == "in",
            feed_mode={"per-minute": 940, "per-revolution": 950, "inverse-time": 930}[
                dialect.feeds.mode
            ],
        )
        self._events = event_patterns(dialect)
        self._first_lines = [each.lines[0] for each in self._events]
        self._fixed = [
            pattern_of(with_modes(template, dialect))[0]
            for template in (*dialect.program.head, *dialect.program.foot)
        ]
        self._cycles = cycles_of(dialect)
        self._speed_name, self._speed_scale = speed_field(dialect)
        self._dwell_letters = {
            letter: 1.0 if name == "s" else 0.001
            for template in dialect.events.dwell
            for name, letter in pattern_of(template)[1]
        }
        self._shift = [0.0, 0.0, 0.0]
        self._fast = FastFeeds(machine.max_feed_mm_min)
        self._zero = machine.controller.machine_zero_mm
        self._ended = False
        self._after_end = self._pauses = self._offsets = 0
        self._speed_not_said = False
        self._passed: dict[str, int] = {}
        self._blocks: list[Block] = []

    # The program as a whole

    def read(self, data: bytes) -> Toolpath:
        """Read the program and return its moves, which hold the findings on it."""
        items = list(items_of(data, self._machine))
        if not any(isinstance(item, Block) for item in items):
            raise ProgramError("the program is empty", mend="a program has blocks such as G0 X1")
        k = 0
        while k < len(items):
            item = items[k]
            if isinstance(item, OperatorMessage):
                self.path.block = item.index
                if not self._ended:
                    self.path.message(item.text)
                k += 1
                continue
            if self._ended:
                self._after_end += 1
                k += 1
                continue
            self.path.block = item.index
            try:
                k += self._event(items, k) or self._block(item)
            except LineFault as fault:
                fail(fault, item.index, item.line)
        return self.path.finish(self._findings())

    def _findings(self) -> Iterator[Finding]:
        yield from self._fast.findings()
        if self._passed:
            words = ", ".join(sorted(self._passed))
            yield WORDS_PASSED_OVER_CODES(count=sum(self._passed.values()), words=words)
        if self._offsets:
            yield WORDS_PASSED_OVER_OFFSETS(count=self._offsets)
        if self._pauses:
            yield WORDS_PASSED_OVER_PAUSE(count=self._pauses)
        if self._speed_not_said:
            yield SPINDLE_SPEED_NOT_SAID()
        if self._after_end:
            yield NEVER_READ(measured=self._after_end)
        if self._moves.chords:
            yield NOT_SIMULATED_CHORDS(measured=self._moves.chords)

    # Events

    def _event(self, items: list[Block | OperatorMessage], k: int) -> int:
        """Read the blocks of an event from item k on, and return their number; 0 where no event
        begins."""
        first = items[k]
        assert isinstance(first, Block)
        packed = first.packed
        if _PLAIN.fullmatch(packed):
            return 0
        for each, pattern in zip(self._events, self._first_lines, strict=True):
            if pattern.fullmatch(packed) is None:
                continue
            upcoming = items[k : k + len(each.lines)]
            blocks = [item.packed for item in upcoming if isinstance(item, Block)]
            values = each.values(blocks) if len(blocks) == len(each.lines) else None
            if values is not None and _agree(each, values):
                self._refuse_never(upcoming)
                self._add_event(each, values)
                return len(each.lines)
        return 0

    def _refuse_never(self, blocks: list[Block | OperatorMessage]) -> None:
        for block in blocks:
            if isinstance(block, Block) and _is_row_of_words(block.text):
                self._words(block)

    def _add_event(self, event: EventPattern, texts: list[str]) -> None:
        """Add the row of an event whose fields have these texts."""
        kind, modes = EVENTS[event.key], self._modes
        values = {
            name: self._number(letter, text)
            for (name, letter), text in zip(event.fields, texts, strict=True)
        }
        if kind == Kind.TOOL_CHANGE:
            modes.tool = int(values.get("tool", modes.tool or 0))
            self.path.event(kind, modes.tool)
        elif kind == Kind.DWELL:
            self.path.event(kind, values["s"] if "s" in values else values["ms"] / 1000.0)
        elif kind in (Kind.SPINDLE_CW, Kind.SPINDLE_CCW):
            if values:
                modes.speed = self._speed(next(iter(values.values())))
            modes.spindle = 3 if kind == Kind.SPINDLE_CW else 4
            self._switch_spindle()
        elif kind in (Kind.HOME_XY, Kind.HOME_Z):
            self._home("Z" if kind == Kind.HOME_Z else "XY")
        else:
            if kind == Kind.SPINDLE_OFF:
                modes.spindle = 5
            self.path.event(kind)

    def _speed(self, value: float) -> float:
        """Return a spindle speed as the program gives it, in rev/min."""
        if self._speed_scale is None:
            return value
        return value / self._speed_scale * (self._machine.spindle.max_rpm or math.nan)

    def _switch_spindle(self) -> None:
        """Add the row of the spindle's current direction and speed."""
        modes = self._modes
        kind = SPINDLE[modes.spindle]
        if kind == Kind.SPINDLE_OFF:
            self.path.event(kind)
            return
        self._speed_not_said |= math.isnan(modes.speed)
        self.path.event(kind, modes.speed)

    # Words

    def _number(self, letter: str, text: str) -> float:
        """Return the value of a number, which may count units of the last decimal."""
        value = float(text)
        if "." in text or not letter or letter not in self._dialect.words.whole_letters:
            return value
        words = self._dialect.words
        decimals = words.inch_decimals if self._modes.inches else words.decimals
        return value / 10.0**decimals

    def _words(self, block: Block) -> list[_Word]:
        """Return the words of a block; LineFault where it is not a row of words."""
        words, at = list[_Word](), 0
        text = block.text.rstrip()
        while at < len(text):
            match = _WORD.match(text, at)
            if match is None:
                place = at + len(text[at:]) - len(text[at:].lstrip())
                raise LineFault(_explain(text[place:]), place, "words are a letter and a number")
            letter = match[1].upper()
            value = self._number(letter, match[2])
            words.append(_Word(letter, value, match[2], match.start(1)))
            at = match.end()
        for word in words:
            if word.code in self._dialect.program.never:
                raise LineFault(
                    f"{word.code} must not appear in a program of this machine",
                    word.at,
                    "take it out, or out of dialect.program.never",
                )
        return words

    def _block(self, block: Block) -> int:
        """Execute a block of words; return the number of blocks read, 1."""
        is_fixed = any(pattern.fullmatch(block.packed) for pattern in self._fixed)
        if is_fixed and not _is_row_of_words(block.text):
            return 1
        words = self._words(block)
        passed = [
            word
            for word in words
            if word.letter in "GM"
            and (word.code in self._dialect.program.passed_over or is_fixed)
            and not _is_known(word, self._cycles)
        ]
        if passed:
            for word in passed:
                if not is_fixed:
                    self._passed[word.code] = self._passed.get(word.code, 0) + 1
            # Words that belong to an unknown word have no known meaning either.
            words = [each for each in words if each.letter in "GM" and each not in passed]
        _Execution(self, block, words).run()
        return 1

    # Moves

    @property
    def position(self) -> Point:
        """The position of the tool in the coordinates of the program, mm."""
        x, y, z = (
            place - shift for place, shift in zip(self.path.position, self._shift, strict=True)
        )
        return x, y, z

    def to_part(self, place: Point) -> Point:
        """Return a place of the program's coordinates in the frame of the part."""
        x, y, z = (value + shift for value, shift in zip(place, self._shift, strict=True))
        return x, y, z

    def _home(self, axes: str) -> None:
        """Add the row that sends these axes to machine zero."""
        x, y, z = self.path.position
        zero = self._zero
        self._moves.moved = True
        if "Z" in axes:
            self.path.set_position(x, y, zero[2]).event(Kind.HOME_Z)
            z = zero[2]
        if "X" in axes and "Y" in axes:
            self.path.set_position(zero[0], zero[1], z).event(Kind.HOME_XY)
        elif "X" in axes or "Y" in axes:
            self._moves.rapid(zero[0] if "X" in axes else x, zero[1] if "Y" in axes else y, z)


class _Execution:
    """Execution of one block, in the order in which controllers execute its words."""

    def __init__(self, reader: _Reader, block: Block, words: list[_Word]) -> None:
        self._reader, self._block = reader, block
        self._modes, self._dialect = reader._modes, reader._dialect
        self._codes: dict[str, int] = {}
        self._g: dict[str, _Word] = {}
        self._m: list[int] = []
        self._values: dict[str, _Word] = {}
        self._used: set[str] = set()
        for word in words:
            self._sort(word)

    def _sort(self, word: _Word) -> None:
        """Put a word into the group of its kind."""
        if word.letter == "G":
            code = round(word.value * 10.0)
            group = GROUPS.get(code)
            if group is None or abs(word.value * 10.0 - code) > 1e-9:
                raise self._unknown(word)
            if group in self._codes:
                raise LineFault(
                    f"{word.code} beside {self._g[group].code}: both are of the group {group}",
                    word.at,
                    "write them in two blocks",
                )
            self._codes[group], self._g[group] = code, word
        elif word.letter == "M":
            if word.value not in KNOWN_M:
                raise self._unknown(word)
            self._m.append(int(word.value))
        elif word.letter in self._values:
            raise LineFault(f"{word.letter} twice in a block", word.at, "remove one")
        elif word.letter in ONCE:
            self._values[word.letter] = word
        else:
            raise LineFault(f"the letter {word.letter} is no word here", word.at, "remove it")

    def _unknown(self, word: _Word) -> LineFault:
        return LineFault(
            f"{word.code} is no word of this dialect",
            word.at,
            f'remove it; if it moves nothing: dialect.program.passed_over = ["{word.code}"]',
        )

    def run(self) -> None:
        """Execute the block."""
        modes, reader, codes = self._modes, self._reader, self._codes
        if "feed mode" in codes:
            modes.feed_mode, modes.feed = codes["feed mode"], 0.0
        if "units" in codes:
            modes.inches = codes["units"] == 200
        self._take_feed()
        self._take_speed()
        if "T" in self._values:
            modes.tool = int(self._take("T"))
        if 6 in self._m:
            reader.path.event(Kind.TOOL_CHANGE, modes.tool or 0)
        self._switch()
        self._set_modes()
        single_code = codes.get("once")
        if single_code == 40:
            self._dwell()
        elif single_code in (280, 300):
            self._go_home()
        else:
            self._move()
        for code in self._m:
            reader._pauses += code in (0, 1)
            if code in (2, 30):
                reader.path.event(Kind.END)
                reader._ended = True
        unused_words = [word for letter, word in self._values.items() if letter not in self._used]
        if unused_words:
            raise LineFault(
                f"{unused_words[0].letter} has nothing to do in this block",
                unused_words[0].at,
                "remove it",
            )

    def _take(self, letter: str) -> float:
        self._used.add(letter)
        return self._values[letter].value

    def _length(self, letter: str) -> float:
        """Return the number of a word in mm."""
        return self._take(letter) * (25.4 if self._modes.inches else 1.0)

    def _take_feed(self) -> None:
        modes = self._modes
        if FEED_LETTER not in self._values:
            if modes.feed_mode == 930:
                modes.feed = 0.0
            return
        value = self._take(FEED_LETTER)
        if value <= 0.0:
            raise LineFault("a feed that is not above 0", self._values[FEED_LETTER].at)
        scale = 25.4 if modes.inches and modes.feed_mode != 930 else 1.0
        modes.feed = value * scale

    def _take_speed(self) -> None:
        modes, reader = self._modes, self._reader
        if "S" in self._values:
            modes.speed = reader._speed(self._take("S"))
            is_same = not any(code in SPINDLE for code in self._m)
            if is_same and modes.spindle != 5:
                reader._switch_spindle()

    def _switch(self) -> None:
        modes, reader = self._modes, self._reader
        for code in self._m:
            if code in SPINDLE:
                modes.spindle = code
                reader._switch_spindle()
            elif code in COOLANT:
                reader.path.event(COOLANT[code])

    def _set_modes(self) -> None:
        modes, codes, reader = self._modes, self._codes, self._reader
        if "plane" in codes:
            reader._moves.plane = codes["plane"]
        if codes.get("radius of the tool", 400) != 400:
            raise LineFault(
                "the radius of the tool is not counted",
                self._g["radius of the tool"].at,
                "write the path of the tool's centre",
            )
        if codes.get("length of the tool", 490) != 490:
            reader._offsets += 1
        for letter in "HD":
            if letter in self._values:
                self._used.add(letter)
        if "frame" in codes and codes["frame"] != modes.frame:
            self._set_frame(codes["frame"])
        if "distance" in codes:
            modes.absolute = codes["distance"] == 900
        if "distance of centres" in codes:
            modes.arc_absolute = codes["distance of centres"] == 901
        if "return of cycles" in codes:
            modes.returns_high = codes["return of cycles"] == 980

    def _set_frame(self, code: int) -> None:
        """Select another work frame; the one selected before the first move is the part's."""
        modes, reader, places = self._modes, self._reader, self._dialect.work_offsets_mm
        if reader._moves.moved:
            names = [f"G{each // 10}" for each in (modes.frame, code)]
            old, new = (places.get(name) for name in names)  # type: ignore[call-overload]
            if old is None or new is None:
                raise LineFault(
                    f"{names[1]} behind {names[0]}, whose places only the controller knows",
                    self._g["frame"].at,
                    "give both in dialect.work_offsets_mm",
                )
            reader._shift = [
                shift + b - a for shift, a, b in zip(reader._shift, old, new, strict=True)
            ]
        modes.frame = code

    def _dwell(self) -> None:
        letters = self._reader._dwell_letters
        letters_given = [letter for letter in letters if letter in self._values]
        if not letters_given:
            raise LineFault(
                "G4 without its time",
                self._g["once"].at,
                f"this dialect says it as {' '.join(self._dialect.events.dwell) or 'nothing'}",
            )
        seconds = self._take(letters_given[0]) * letters[letters_given[0]]
        if seconds < 0.0:
            raise LineFault("a dwell below 0", self._values[letters_given[0]].at)
        self._reader.path.event(Kind.DWELL, seconds)

    def _axes(self) -> str:
        return "".join(axis for axis in "XYZ" if axis in self._values)

    def _target(self) -> Point:
        """Return the place to which the axis words lead, in the coordinates of the program."""
        place = list(self._reader.position)
        for k, axis in enumerate("XYZ"):
            if axis in self._values:
                value = self._length(axis)
                place[k] = value if self._modes.absolute else place[k] + value
        return place[0], place[1], place[2]

    def _go_home(self) -> None:
        """Execute G28: go to machine zero by way of a point."""
        reader, axes = self._reader, self._axes()
        if axes:
            via = self._target()
            if any(abs(a - b) > 1e-9 for a, b in zip(via, reader.position, strict=True)):
                reader._moves.rapid(*reader.to_part(via))
        reader._home(axes or "XYZ")

    def _move(self) -> None:
        modes, reader, axes = self._modes, self._reader, self._axes()
        if "motion" in self._codes:
            modes.motion = self._codes["motion"]
            if modes.motion not in (RAPID, LINE, ARC_CW, ARC_CCW, NO_MOTION):
                self._begin_cycle(modes.motion)
        motion = modes.motion
        if self._codes.get("once") == 530:
            self._go_in_machine_frame(axes)
            return
        offsets = [letter for letter in "IJKR" if letter in self._values]
        if motion is not None and motion > ARC_CCW and motion != NO_MOTION:
            if axes:
                self._hole(motion)
            return
        if not axes and not (motion in (ARC_CW, ARC_CCW) and offsets):
            return
        if motion is None or motion == NO_MOTION:
            raise LineFault(
                "no motion is in force", self._values[axes[0]].at, "write G0, G1, G2 or G3"
            )
        target = self._target()
        if motion == RAPID:
            reader._moves.rapid(*reader.to_part(target))
            return
        if modes.feed <= 0.0:
            raise LineFault("no feed", None, "write F")
        if motion == LINE:
            self._set_feed(math.dist(target, reader.position))
            reader._moves.line(*reader.to_part(target))
            return
        self._arc(target, ccw=motion == ARC_CCW)

    def _set_feed(self, length_mm: float) -> None:
        """Set the feed of the next move, of `length_mm`, in mm/min, by the mode of feeds."""
        modes, reader = self._modes, self._reader
        feed = modes.feed
        if modes.feed_mode == 930:
            feed *= length_mm
        elif modes.feed_mode == 950:
            if modes.spindle == 5 or not modes.speed > 0.0:
                raise LineFault("a feed per revolution while the spindle stands", None)
            feed *= modes.speed
        if feed <= 0.0:
            raise LineFault("a cut of no length", None, "leave it out")
        if feed != reader._moves.feed:
            reader._fast.note(self._block.index, np.array([feed]))
        reader._moves.feed = feed

    def _go_in_machine_frame(self, axes: str) -> None:
        """Execute G53: go to coordinates of the machine frame."""
        reader = self._reader
        values = {axis: self._length(axis) for axis in axes}
        place = list(reader.path.position)
        for k, axis in enumerate("XYZ"):
            if axis in values:
                place[k] = reader._zero[k] + values[axis]
        if not any(values.values()) and axes in ("Z", "XY"):
            reader._home(axes)
        elif axes:
            if self._modes.motion not in (RAPID, LINE):
                raise LineFault("G53 without G0 or G1", self._g["once"].at)
            reader._moves.rapid(place[0], place[1], place[2])

    # Arcs

    def _arc(self, target: Point, *, ccw: bool) -> None:
        rules, reader = self._dialect.arcs, self._reader
        at = self._g["motion"].at if "motion" in self._g else 0
        if rules.form == "chords":
            raise LineFault("this dialect has no arcs", at, "write lines, or give dialect.arcs")
        axes = PLANES[reader._moves.plane]
        begin, end = ([place[axis] for axis in axes] for place in (reader.position, target))
        is_helix = abs(end[2] - begin[2]) > 0.0
        if is_helix and not rules.helices:
            raise LineFault("an arc that changes its height: this dialect has no helices", at)
        if "R" in self._values:
            centre = self._centre_by_radius(begin, end, ccw=ccw)
        else:
            centre = self._centre_by_offsets(begin, axes)
        r1 = math.hypot(begin[0] - centre[0], begin[1] - centre[1])
        r2 = math.hypot(end[0] - centre[0], end[1] - centre[1])
        if r1 == 0.0:
            raise LineFault("an arc of no radius", at)
        if abs(r1 - r2) > rules.difference_mm:
            raise LineFault(
                f"the arc's radii at start and end differ by {abs(r1 - r2):.4g} mm, the controller"
                f" takes {rules.difference_mm:g}",
                at,
                "check its end and centre",
            )
        if begin[:2] == end[:2] and rules.full_circles != "whole":
            raise LineFault("a full circle, which this dialect says as two arcs", at)
        sweep = turn_of((begin[0], begin[1]), (end[0], end[1]), centre)
        sweep = math.fmod((sweep if ccw else -sweep) + 2.0 * math.pi, 2.0 * math.pi)
        sweep = 2.0 * math.pi if begin[:2] == end[:2] else sweep
        self._set_feed(math.hypot(r1 * sweep, end[2] - begin[2]))
        shift = [reader._shift[axis] for axis in axes]
        reader._moves.arc(
            [value + own for value, own in zip(end, shift, strict=True)],
            (centre[0] + shift[0], centre[1] + shift[1]),
            1 if ccw else -1,
        )

    def _centre_by_offsets(
        self, begin: list[float], axes: tuple[int, int, int]
    ) -> tuple[float, float]:
        letters = ["IJK"[axis] for axis in axes[:2]]
        if not any(letter in self._values for letter in letters):
            raise LineFault(
                "an arc without its centre", None, f"write {letters[0]} and {letters[1]}, or R"
            )
        for letter in "IJK":
            if letter in self._values and letter not in letters:
                raise LineFault(f"{letter} is no centre in this plane", self._values[letter].at)
        if self._modes.arc_absolute:
            missing = [letter for letter in letters if letter not in self._values]
            if missing:
                raise LineFault(f"an arc without {missing[0]}", None, "write both of its centre")
            return self._length(letters[0]), self._length(letters[1])
        first, second = (
            self._length(letter) if letter in self._values else 0.0 for letter in letters
        )
        return begin[0] + first, begin[1] + second

    def _centre_by_radius(
        self, begin: list[float], end: list[float], *, ccw: bool
    ) -> tuple[float, float]:
        at = self._values["R"].at
        if any(letter in self._values for letter in "IJK"):
            raise LineFault("R beside a centre", at, "write one of them")
        radius = self._length("R")
        chord = math.hypot(end[0] - begin[0], end[1] - begin[1])
        if chord == 0.0:
            raise LineFault("a full circle has no R", at, "write its centre, or two arcs")
        square = radius * radius - chord * chord / 4.0
        slack = self._dialect.last_decimal_mm + SEMICIRCLE_GUARD * abs(radius)
        if chord / 2.0 > abs(radius) + slack:
            raise LineFault(
                f"R {abs(radius):g} mm is less than half the way to the end, {chord / 2.0:.4g} mm",
                at,
            )
        height = math.sqrt(max(square, 0.0))
        if (radius > 0.0) != ccw:
            height = -height
        x, y = (end[0] - begin[0]) / chord, (end[1] - begin[1]) / chord
        return ((begin[0] + end[0]) / 2.0 - y * height, (begin[1] + end[1]) / 2.0 + x * height)

    # Cycles

    def _begin_cycle(self, code: int) -> None:
        cycle = self._reader._cycles.get(code)
        if cycle is None:
            raise LineFault(
                f"G{code // 10} is a cycle without a template in this dialect",
                self._g["motion"].at,
                "give dialect.cycles, or write its moves",
            )
        self._modes.cycle = CycleWords(cycle.kind, cycle.letters, {})

    def _hole(self, code: int) -> None:
        """Execute a block of the cycle in force: update its values and drill one hole."""
        modes, reader, cycle = self._modes, self._reader, self._modes.cycle
        assert cycle is not None
        if reader._moves.plane != 170:
            raise LineFault("a cycle in another plane than XY", None, "write G17")
        if not modes.absolute:
            raise LineFault("a cycle with relative places", None, "write G90 before it")
        for letter in list(self._values):
            name = cycle.letters.get(letter)
            if name in ("z", "r", "q"):
                cycle.values[name] = self._length(letter)
            elif name in ("s", "ms"):
                factor = 1.0 if name == "s" else 0.001
                cycle.values["s"] = self._take(letter) * factor
        missing = [name for name in ("z", "r") if name not in cycle.values]
        if missing or ("q" in cycle.letters.values() and not cycle.values.get("q", 0.0) > 0.0):
            name = missing[0] if missing else "q"
            letter = next(each for each, own in cycle.letters.items() if own == name)
            raise LineFault(f"a cycle without {letter}", None, f"write {letter}")
        if modes.feed <= 0.0:
            raise LineFault("no feed", None, "write F")
        if modes.feed_mode == 930:
            raise LineFault("a cycle with the inverse of a time", None, "write G94")
        self._set_feed(1.0)
        x, y = (
            self._length(axis) if axis in self._values else reader.position[k]
            for k, axis in enumerate("XY")
        )
        if cycle.values["z"] > cycle.values["r"]:
            raise LineFault("a cycle whose bottom is above R", None, "check Z and R")
        hole = HoleMoves(
            reader._moves, reader._shift, self._dialect.cycles, returns_high=modes.returns_high
        )
        run_hole(hole, cycle, (x, y), reader.position[2])


def _agree(event: EventPattern, texts: list[str]) -> bool:
    """Return True if fields with the same name, such as the tool and its length, have the same
    text."""
    pairs = {(name, text) for (name, _), text in zip(event.fields, texts, strict=True)}
    return len(pairs) == len({name for name, _ in pairs})


def _is_known(word: _Word, cycles: dict[int, CycleWords]) -> bool:
    """Return True if a code has a meaning by itself."""
    if word.letter == "M":
        return word.value in KNOWN_M
    code = round(word.value * 10.0)
    if GROUPS.get(code) == "motion" and code >= 730 and code != NO_MOTION:
        return code in cycles
    return code in GROUPS


def _is_row_of_words(text: str) -> bool:
    return re.fullmatch(rf"(?:{_WORD.pattern})*[ \t]*", text) is not None


def _explain(text: str) -> str:
    """Return the reason why no word begins here."""
    sign = text[:1]
    signs = {
        "#": "a parameter, which this dialect has not",
        "[": "an expression, which this dialect has not",
        "/": "a block that a switch may leave out",
        ",": "a decimal comma",
        "(": "a comment, which this dialect does not write so",
        ";": "a comment, which this dialect does not write so",
        "%": "a %, which frames no program here",
    }
    if sign in signs:
        return signs[sign]
    if sign.isalpha():
        return f"no number behind {sign}"
    return f"{text[:32]!r} is no word"


assert set(LENGTH_LETTERS) <= set(ONCE)
