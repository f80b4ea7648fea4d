"""grbl 1.1's parser: what a line does, step by step as `gc_execute_line` takes it (gcode.c).

    1  the modes are copied   2  words are imported   3  all is checked   4  it is executed

So a line does all that it says or nothing, and stops with an error of grbl's own number
(doc/csv/error_codes_en_US.csv). Positions are those of the machine, in mm; the frame in force when
the program begins has its zero at 0."""

from __future__ import annotations

import math
import re
from typing import Final

from msgspec import Struct, field

from camtool.records import replace
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind

from ..gcode.faults import LineFault
from ..gcode.part_moves import PLANES, PartMoves, ProgramFrame
from .dialect import MAX_TOOL, GrblController, GrblDialect, GrblMachine

MM_PER_INCH: Final = 25.4

MAX_DIGITS: Final = 8
"""Further digits of a number count as 0 (MAX_INT_DIGITS)."""

MAX_CODE: Final = 1 << 31
"""Larger codes overflow the firmware's integers, which is undefined behaviour, so they are
refused. Of smaller ones it keeps eight bits, and sixteen of the decimals."""

MAX_LINE_NUMBER: Final = 10_000_000
"""Largest number of an N word (MAX_LINE_NUMBER)."""

MAX_FRAMES: Final = 6
"""G54 to G59 (N_COORDINATE_SYSTEM)."""

NUMBER: Final = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)")

WHY: Final = {
    1: "{}, where the letter of a word should be",
    2: "no number after {}",
    3: "a command of the controller itself, which no program may have",
    4: "{} below 0",
    16: "a jog with words that no jog has",
    20: "{} is unknown to grbl",
    21: "two words of one group ({})",
    22: "a feed move, and no feed yet",
    23: "{} is no whole number",
    24: "two commands that both use the coordinates",
    25: "two {} words in one block",
    26: "{} without coordinates",
    27: "N beyond 10000000",
    28: "{}",
    29: "a work frame beyond G59",
    30: "G53 without G0 or G1 in force",
    31: "coordinates, but no motion word in force",
    32: "an arc without a coordinate in its plane",
    33: "{}",
    34: "the radius is less than half the chord",
    35: "an arc without I, J or R in its plane",
    36: "nothing in the block uses the {} word",
    37: "G43.1 wants Z alone",
    38: "T beyond 255",
}
"""Meaning of grbl's error numbers."""

SIGNS: Final = {",": "a decimal comma", "#": "a parameter", "%": "a %", "[": "an expression"}
"""Signs that begin no word, and what they are elsewhere."""

NONE, NON_MODAL, MOTION, LENGTH = range(4)
"""Use of the coordinates of a block."""

PROBES: Final = 140
"""The motion of G38.2; those of G38.3 to G38.5 follow."""

MODAL: Final = {
    **{code: ("plane", code) for code in (17, 18, 19)},
    **{code: ("feed mode", code) for code in (93, 94)},
    **{code: ("units", code) for code in (20, 21)},
    40: ("cutter radius", 40),
    **{code: ("work frame", code - 54) for code in range(54, 60)},
}
"""G words that have no decimals, their groups, and what they set."""

NEVER_NEGATIVE: Final = {
    "F": "a feed",
    "N": "a number",
    "P": "a time",
    "T": "a tool",
    "S": "a speed",
}

VALUES: Final = frozenset("FIJKLNPRSTXYZ")

SPINDLE: Final = {3: Kind.SPINDLE_CW, 4: Kind.SPINDLE_CCW, 5: None}


def error(number: int, place: int | str | None, subject: str = "", mend: str = "") -> LineFault:
    """Return the fault of a line that grbl answers with this error number."""
    return LineFault(f"{WHY[number].format(subject)} (error:{number})", place, mend)


class ParserModes(Struct):
    """Modal state, which holds from line to line."""

    motion: int = 0
    plane: int = 17
    absolute: bool = True
    feed_mode: int = 94
    inches: bool = False
    frame: int = 0
    spindle: Kind | None = None
    mist: bool = False
    flood: bool = False


class GrblBlock(Struct):
    """The words of a line: numbers, the modes that result, the command of this line alone ("G4",
    "G92.1" …), the word that uses the coordinates, and the columns of the words."""

    modes: ParserModes
    numbers: dict[str, float] = field(default_factory=dict)
    groups: set[str] = field(default_factory=set)
    once: str = ""
    uses: int = NONE
    flow: int | None = None
    length: str = ""
    at: dict[str, int] = field(default_factory=dict)


class ParserNotes(Struct):
    """Blocks (index from 0) at which something was ignored or assumed."""

    coolant: list[int] = field(default_factory=list)
    pauses: list[int] = field(default_factory=list)
    speedless: list[int] = field(default_factory=list)
    jogs: list[int] = field(default_factory=list)
    frames: dict[str, int] = field(default_factory=dict)
    homes: dict[str, int] = field(default_factory=dict)
    feeds: list[tuple[int, float]] = field(default_factory=list)


class GrblParser:
    """State of the parser, which lines change."""

    def __init__(self, machine: GrblMachine, path: ToolpathBuilder, notes: ParserNotes) -> None:
        dialect: GrblDialect = machine.dialect
        self.modes = ParserModes()
        self.moves = PartMoves(path, dialect.arc_full_turn_rad)
        self.notes = notes
        self.index = 0
        """Index of the block."""
        self.ended = False
        self.position = [0.0, 0.0, 0.0]
        self.feed = 0.0
        """mm/min."""
        self._dialect = dialect
        self._path = path
        self._zero = machine.controller.machine_zero_mm
        self._coolant = machine.coolant
        self.laser = isinstance(machine.controller, GrblController) and (
            machine.controller.laser_mode
        )
        """Laser mode ($32): what stops the machine is other than with a spindle."""
        self._speed: float | None = None
        self._tool: int | None = None
        self._changes_tools = dialect.tool_change != "refuse"
        self._frames: dict[int, list[float]] = {}
        self._homes: dict[str, list[float]] = {}
        self._placed: set[int] = set()
        self._first_frame: int | None = None
        self._offset = [0.0, 0.0, 0.0]
        self._length = 0.0
        for frame, name in enumerate(("G54", "G55", "G56", "G57", "G58", "G59")):
            place = {str(key): each for key, each in dialect.work_offsets_mm.items()}.get(name)
            self._frames[frame] = [0.0, 0.0, 0.0] if place is None else self._machine(place)
            if place is not None:
                self._placed.add(frame)
        for home, place in dialect.homes_mm.items():
            self._homes[str(home)] = self._machine(place)
        self._use_frame()

    def _machine(self, place: tuple[float, float, float]) -> list[float]:
        """Return a place given in machine coordinates as a position of the parser."""
        return [a + b for a, b in zip(place, self._zero, strict=True)]

    @property
    def reads_columns(self) -> bool:
        """True if blocks of plain moves may now be read by columns."""
        modes = self.modes
        is_plain = modes.motion in (0, 1, 2, 3, 80) and modes.plane == 17 and modes.absolute
        shift = any(self._frames[modes.frame]) or any(self._offset) or self._length
        return is_plain and modes.feed_mode == 94 and not shift and self.moves.is_part_frame

    def continue_from(
        self, motion: int | None, feed: float, place: tuple[float, float, float]
    ) -> None:
        """Adopt motion, feed and position after plain blocks that were read by columns."""
        self.modes.motion = self.modes.motion if motion is None else motion
        self.feed = feed
        if place != tuple(self.position):
            self._note_motion()
        self.position[:] = place

    def rewind(self) -> None:
        """Reset most modes, as M2 and M30 do; units, feed and offsets stay (`gc_execute_line`)."""
        self.ended = False
        self.modes = ParserModes(motion=1, inches=self.modes.inches)
        self._use_frame()

    # Steps 1 and 2: the words

    def line(self, text: str) -> None:
        """Execute a line, which is in capitals without blanks and comments; LineFault where grbl
        refuses it."""
        jogs = text.startswith("$")
        if jogs and not text.startswith("$J="):
            raise error(3, 0, mend="send it before the program")
        block = GrblBlock(replace(self.modes))
        if jogs:
            block.modes.motion, block.modes.feed_mode = 1, 94
        position = 3 if jogs else 0
        while position < len(text):
            letter = text[position]
            if not "A" <= letter <= "Z":
                raise error(1, position, SIGNS.get(letter, repr(letter)))
            match = NUMBER.match(text, position + 1)
            if match is None:
                raise error(2, position, letter)
            self._word(block, letter, _number(match[0]), match[0], position)
            position = match.end()
        if any(axis in block.numbers for axis in "XYZ") and block.uses == NONE:
            block.uses = MOTION
        self._check_and_execute(block, jogs=jogs)

    def _word(self, block: GrblBlock, letter: str, value: float, digits: str, column: int) -> None:
        number = math.trunc(value) % 256 if abs(value) < MAX_CODE else 255
        hundredths = round(100.0 * (value - number)) % 65536
        name = f"{letter}{digits}"
        if letter == "G":
            group = self._g_word(block, number, hundredths, name, column)
            if group in block.groups:
                raise error(21, column, group)
            block.groups.add(group)
        elif letter == "M":
            if hundredths > 0:
                raise error(23, column, name)
            group = self._m_word(block, number, name, column)
            if group in block.groups:
                raise error(21, column, group)
            block.groups.add(group)
        else:
            if letter not in VALUES:
                raise error(20, column, f"the letter {letter}")
            if letter == "T" and value > MAX_TOOL:
                raise error(38, column)
            if letter in block.numbers:
                raise error(25, column, letter)
            if letter in NEVER_NEGATIVE and value < 0.0:
                raise error(4, column, NEVER_NEGATIVE[letter])
            if letter in "LT":
                value = float(number)
            block.numbers[letter] = float(math.trunc(value)) if letter == "N" else value
            block.at[letter] = column
            return
        block.at[letter] = column

    def _g_word(
        self, block: GrblBlock, number: int, hundredths: int, name: str, column: int
    ) -> str:
        """Store what a G word sets in the block, and return its modal group."""
        modes = block.modes
        if number in (10, 28, 30, 92) and hundredths == 0:
            self._use(block, NON_MODAL, column)
        if number in (28, 30, 92):
            if hundredths not in (0, 10):
                raise error(20, column, name)
            block.once = f"G{number}" + (".1" if hundredths else "")
            return "one block"
        if number == 38:
            self._use(block, MOTION, column)
            if hundredths not in (20, 30, 40, 50):
                raise error(20, column, name)
            return self._probe_word(block, hundredths, column)
        if number in (43, 49):
            self._use(block, LENGTH, column)
            if number == 43 and hundredths != 10:
                raise error(20, column, name)
            block.length = "set" if number == 43 else "cancel"
            return "tool length"
        if number in (90, 91) and hundredths:
            if hundredths != 10 or number == 90:
                raise error(20, column, name)
            return "arc distance"
        group, value = self._plain_g_word(block, number, name, column)
        if number == 61 and hundredths:
            raise error(20, column, name)
        if hundredths > 0:
            raise error(23, column, name)
        if group == "plane":
            modes.plane = value
        elif group == "distance":
            modes.absolute = value == 90
        elif group == "feed mode":
            modes.feed_mode = value
        elif group == "units":
            modes.inches = value == 20
        elif group == "work frame":
            modes.frame = value
        return group

    def _probe_word(self, block: GrblBlock, hundredths: int, column: int) -> str:
        """Store the probing motion of G38.2 to G38.5 in the block, and return the modal group."""
        raise LineFault("G38 probes, which cannot be simulated", column)

    def _plain_g_word(
        self, block: GrblBlock, number: int, name: str, column: int
    ) -> tuple[str, int]:
        """Return the modal group of a G word without decimals, and the value that it sets."""
        if number in (4, 10, 53):
            block.once = f"G{number}"
            return "one block", number
        if number in (0, 1, 2, 3, 80):
            if number != 80:
                self._use(block, MOTION, column)
            block.modes.motion = number
            return "motion", number
        if number in (90, 91):
            return "distance", number
        if number == 61:
            return "path", number
        if number not in MODAL:
            raise error(20, column, name)
        return MODAL[number]

    def _use(self, block: GrblBlock, use: int, column: int) -> None:
        if block.uses != NONE:
            raise error(24, column)
        block.uses = use

    def _m_word(self, block: GrblBlock, code: int, name: str, column: int) -> str:
        if code in (0, 1, 2, 30):
            block.flow = code
            return "stop"
        if code in SPINDLE:
            block.modes.spindle = SPINDLE[code]
            return "spindle"
        if code in (8, 9) or (code == 7 and self._coolant.mist):
            block.modes.mist = code == 7 or (block.modes.mist and code != 9)
            block.modes.flood = code == 8 or (block.modes.flood and code != 9)
            return "coolant"
        raise error(20, column, name)

    # Step 3: checks

    def _check_and_execute(self, block: GrblBlock, *, jogs: bool) -> None:
        numbers, modes = block.numbers, block.modes
        unused = set(numbers)
        if numbers.get("N", 0.0) > MAX_LINE_NUMBER:
            raise error(27, block.at["N"])
        mm = MM_PER_INCH if modes.inches else 1.0
        feed = self._feed_of(block, mm, jogs=jogs)
        if block.once == "G4":
            if "P" not in numbers:
                raise error(28, block.at["G"], "a dwell without P", "write G4 P1.5 for 1.5 s")
            unused.discard("P")
        words = self._words(block)
        axes = list(words)
        if block.length == "set" and axes != [2]:
            raise error(37, block.at["G"])
        target = self._target(block, words, unused)
        centre = None
        if modes.motion == 80:
            if axes:
                raise error(31, None, mend="write G0 or G1")
        elif block.uses == MOTION:
            if modes.motion == 0:
                block.uses = MOTION if axes else NONE
            else:
                if feed == 0.0:
                    raise error(22, None, mend="write F first")
                if modes.motion == 1:
                    block.uses = MOTION if axes else NONE
                elif modes.motion >= PROBES:
                    self._check_probe(target, axes)
                else:
                    centre = self._arc(block, target, axes, mm, unused)
        unused -= set("NF") if jogs else set("NFST")
        if block.uses != NONE:
            unused -= set("XYZ")
        if unused:
            letter = next(letter for letter in numbers if letter in unused)
            raise error(36, block.at[letter], letter)
        if jogs:
            self._jog(block, target, feed)
        else:
            self._execute(block, target, centre, feed)

    def _words(self, block: GrblBlock) -> dict[int, float]:
        """Return the coordinates of a block in mm, keyed by axis."""
        mm = MM_PER_INCH if block.modes.inches else 1.0
        coordinates = block.numbers
        return {k: coordinates[axis] * mm for k, axis in enumerate("XYZ") if axis in coordinates}

    def _check_probe(self, target: list[float], axes: list[int]) -> None:
        if not axes:
            raise error(26, None, "a probing move", "write a coordinate of its end")
        if target == self.position:
            raise error(33, None, "a probing move that ends where it starts")

    def _feed_of(self, block: GrblBlock, mm: float, *, jogs: bool) -> float:
        """Return the feed of the block: mm/min; with G93 the inverse of the move's duration,
        1/min."""
        numbers, modes = block.numbers, block.modes
        if jogs:
            if "F" not in numbers:
                raise error(22, None, mend="a jog wants F")
            return numbers["F"] * mm
        if modes.feed_mode == 93:
            if block.uses == MOTION and modes.motion not in (0, 80) and "F" not in numbers:
                raise error(22, None, mend="with G93 each move wants F")
            return numbers.get("F", 0.0)
        if self.modes.feed_mode == 94:
            return numbers["F"] * mm if "F" in numbers else self.feed
        return numbers.get("F", 0.0)  # the block that leaves G93, as it stands

    def _target(self, block: GrblBlock, words: dict[int, float], unused: set[str]) -> list[float]:
        """Return the end of the block's move, mm on the machine."""
        if block.once == "G10":
            self._check_g10(block, words)
            unused -= {"L", "P"}
        if block.once == "G92" and not words:
            raise error(26, block.at["G"], "G92")
        if block.once == "G53" and block.modes.motion not in (0, 1):
            raise error(30, block.at["G"])
        target = list(self.position)
        if block.once in ("G10", "G92") or block.uses == LENGTH:
            return target
        frame = self._frames[block.modes.frame]
        for k, value in words.items():
            if block.once == "G53":
                target[k] = value + self._zero[k]
            elif block.modes.absolute:
                length = self._length if k == 2 else 0.0
                target[k] = value + frame[k] + self._offset[k] + length
            else:
                target[k] = value + self.position[k]
        return target

    def _check_g10(self, block: GrblBlock, words: dict[int, float]) -> None:
        numbers, columns = block.numbers, block.at["G"]
        if not words:
            raise error(26, columns, "G10")
        if "P" not in numbers and "L" not in numbers:
            raise error(28, columns, "G10 without P or L")
        if math.trunc(numbers.get("P", 0.0)) > MAX_FRAMES:
            raise error(29, block.at["P"])
        if numbers.get("L") not in (2, 20) or (numbers["L"] == 2 and "R" in numbers):
            raise error(20, columns, f"G10 L{numbers.get('L', 0.0):g}")

    def _arc(
        self, block: GrblBlock, target: list[float], axes: list[int], mm: float, unused: set[str]
    ) -> tuple[float, float]:
        """Return the centre of an arc on the machine, in the axis order of its plane."""
        numbers, modes = block.numbers, block.modes
        first, second, _ = PLANES[modes.plane * 10]
        if not axes:
            raise error(26, None, "an arc", "write a coordinate of its end")
        if first not in axes and second not in axes:
            raise error(32, None, mend="write X or Y of its end" if first == 0 else "")
        x = target[first] - self.position[first]
        y = target[second] - self.position[second]
        if "R" in numbers:
            unused.discard("R")
            offset = self._by_radius(block, x, y, numbers["R"] * mm, target)
        else:
            names = "IJK"[first], "IJK"[second]
            if names[0] not in numbers and names[1] not in numbers:
                raise error(35, None, mend="write I and J of its centre, or R")
            unused -= set("IJK")
            offset = numbers.get(names[0], 0.0) * mm, numbers.get(names[1], 0.0) * mm
            letter = names[0] if names[0] in numbers else names[1]
            self._check_radii(offset, (x, y), block.at[letter])
        return self.position[first] + offset[0], self.position[second] + offset[1]

    def _by_radius(
        self, block: GrblBlock, x: float, y: float, radius: float, target: list[float]
    ) -> tuple[float, float]:
        """Return the offset of the centre of an arc given by its radius: on the left of the chord
        for a counter-clockwise arc of at most half a turn, on the other side for a negative R."""
        column = block.at["R"]
        if target == self.position:
            raise error(33, column, "an arc by its radius that ends where it starts")
        chord = math.hypot(x, y)
        inside = 4.0 * radius * radius - chord * chord
        if inside < 0.0:
            raise error(34, column)
        if chord == 0.0:
            message = "an arc by its radius that ends above where it starts: grbl finds no centre"
            raise LineFault(message, column)
        half_height = math.sqrt(inside) / chord
        if (block.modes.motion == 2) == (radius > 0.0):
            half_height = -half_height
        return 0.5 * (x - y * half_height), 0.5 * (y + x * half_height)

    def _check_radii(
        self, offset: tuple[float, float], end: tuple[float, float], column: int
    ) -> None:
        """Raise error 33 where the radii at both ends of an arc differ by more than grbl
        allows."""
        dialect = self._dialect
        r1, r2 = math.hypot(*offset), math.dist(end, offset)
        gap = abs(r1 - r2)
        wide = gap > dialect.arc_difference_mm and gap > dialect.arc_difference_part * r1
        if r1 <= dialect.arc_least_radius_mm or gap > dialect.arc_most_difference_mm or wide:
            raise error(
                33, column, f"the radius is {r1:.4f} mm at the start, {r2:.4f} mm at the end"
            )

    # Step 4: execution

    def _jog(self, block: GrblBlock, target: list[float], feed: float) -> None:
        """Add a jog: a line at a feed of its own, which changes no mode."""
        if block.groups - {"distance", "units", "one block"} or block.once not in ("", "G53"):
            raise error(16, block.at.get("G"))
        self.notes.jogs.append(self.index)
        if block.uses == NONE:  # a block begins with coordinates 0
            target = list(self._zero)
        elif feed == 0.0:
            raise error(22, None)
        self._go(Kind.LINE, target, feed)

    def _execute(
        self,
        block: GrblBlock,
        target: list[float],
        centre: tuple[float, float] | None,
        feed: float,
    ) -> None:
        numbers, modes = block.numbers, block.modes
        before = self.modes
        self.modes = modes
        self.feed = feed
        if "F" in numbers and modes.feed_mode == 94:
            self.notes.feeds.append((self.index, feed))
        self._spindle(block, before)
        if "T" in numbers:
            self._tool = int(numbers["T"])
        if "coolant" in block.groups:
            self._switch_coolant(before)
        if block.once == "G4":
            self._path.event(Kind.DWELL, numbers["P"])
        if block.uses == LENGTH:
            self._change_length(target_length(block, MM_PER_INCH if modes.inches else 1.0))
        if modes.frame != before.frame:
            self._change_frame()
        self._do_once(block, target)
        if block.uses == MOTION and modes.motion != 80 and block.once not in ("G28", "G30"):
            self._move(block, target, centre, feed)
        if block.flow is not None:
            self._stop(block.flow)

    def _come_to_rest(self) -> None:
        """Add a dwell of 0 s where grbl waits for its buffer to run empty
        (`protocol_buffer_synchronize`): the machine comes to rest, and nothing else happens."""
        self._path.event(Kind.DWELL, 0.0)

    def _spindle(self, block: GrblBlock, before: ParserModes) -> None:
        """Add the event of the spindle or laser, if it changes. In laser mode a change of power
        comes with the move of its block; in a block without motion grbl waits for rest and sets it
        at once."""
        speed = block.numbers.get("S", self._speed)
        has_changed = (speed or 0.0) != (self._speed or 0.0)
        self._speed = speed
        direction, has_word = block.modes.spindle, "spindle" in block.groups
        stays = direction is not None and direction == before.spindle and block.uses != MOTION
        if self.laser and stays and (has_changed or self._relights(block, before)):
            self._come_to_rest()
        if has_word and direction is None:
            self._path.event(Kind.SPINDLE_OFF)
        elif direction is not None and (has_word or has_changed):
            if speed is None:
                self.notes.speedless.append(self.index)
            self._path.event(direction, speed)

    @staticmethod
    def _relights(block: GrblBlock, before: ParserModes) -> bool:
        """Return True if a block without motion changes from cuts to rapids or back while a laser
        has constant power (M3): that switches the power."""
        cuts = (1, 2, 3)
        return before.spindle == Kind.SPINDLE_CW and (
            (before.motion in cuts) != (block.modes.motion in cuts)
        )

    def _switch_coolant(self, before: ParserModes) -> None:
        kind, new_kind = _coolant_kind(before), _coolant_kind(self.modes)
        has_changed = (before.mist, before.flood) != (self.modes.mist, self.modes.flood)
        if not self._coolant.kinds:
            self.notes.coolant.append(self.index)
        else:
            self._path.event(new_kind)
        if has_changed and (kind == new_kind or not self._coolant.kinds):
            self._come_to_rest()

    def _change_length(self, length: float) -> None:
        if length != self._length:
            self._come_to_rest()
        self._length = length
        self._use_frame()

    def _use_frame(self) -> None:
        """Apply the frame in force to the moves that follow; coordinates are those of the tool
        tip."""
        frame = self._frames[self.modes.frame]
        x, y, z = (a + b for a, b in zip(frame, self._offset, strict=True))
        self.moves.set_frame(ProgramFrame((x, y, z)))

    def _change_frame(self) -> None:
        self._come_to_rest()
        self._use_frame()
        frame = self.modes.frame
        is_known = {self._first_frame, frame} <= self._placed
        if self._first_frame not in (None, frame) and not is_known:
            self.notes.frames.setdefault(f"G{54 + frame}", self.index)

    def _do_once(self, block: GrblBlock, target: list[float]) -> None:
        words, action = self._words(block), block.once
        if action in ("G10", "G28.1", "G30.1", "G92", "G92.1"):  # it writes to its memory
            self._come_to_rest()
        if action == "G10":
            self._set_frame(block, words)
        elif action in ("G28", "G30"):
            self._go_home(action, words, target)
        elif action in ("G28.1", "G30.1"):
            self._homes[action[:3]] = list(self.position)
        elif action == "G92":
            frame = self._frames[self.modes.frame]
            for k, value in words.items():
                length = self._length if k == 2 else 0.0
                self._offset[k] = self.position[k] - frame[k] - value - length
            self._use_frame()
        elif action == "G92.1":
            self._offset = [0.0, 0.0, 0.0]
            self._use_frame()

    def _set_frame(self, block: GrblBlock, words: dict[int, float]) -> None:
        """Execute G10: L2 sets the zero of a frame on the machine; L20 sets it so that the tool
        has these coordinates."""
        number = math.trunc(block.numbers.get("P", 0.0))
        frame = number - 1 if number > 0 else self.modes.frame
        place = self._frames[frame]
        from_here = block.numbers["L"] == 20
        for k, value in words.items():
            length = self._length if k == 2 else 0.0
            if from_here:
                place[k] = self.position[k] - self._offset[k] - value - length
            else:
                place[k] = value + self._zero[k]
        if len(words) == len(place):
            self._placed.add(frame)
            if from_here and self._first_frame is not None:
                self._placed.add(self._first_frame)
        self._use_frame()

    def _go_home(self, action: str, words: dict[int, float], target: list[float]) -> None:
        """Execute G28 or G30: move by way of the block's coordinates to the stored place, in the
        axes that are named."""
        home = self._home_of(action)
        if words:
            self._go(Kind.RAPID, target, 0.0)
            home = [home[k] if k in words else target[k] for k in range(3)]
        self._go(Kind.RAPID, home, 0.0)

    def _home_of(self, action: str) -> list[float]:
        """Return the stored place of G28 or G30, mm on the machine."""
        if action not in self._homes:
            self.notes.homes.setdefault(action, self.index)
        return list(self._homes.get(action, self._zero))

    def _move(
        self,
        block: GrblBlock,
        target: list[float],
        centre: tuple[float, float] | None,
        feed: float,
    ) -> None:
        motion = block.modes.motion
        if motion == 0 and block.once == "G53" and self._try_homing(block, target):
            return
        if motion < 2 or centre is None:
            if block.modes.feed_mode == 93:
                feed *= math.dist(target, self.position)
            self._go(Kind.LINE if motion else Kind.RAPID, target, feed)
            return
        self._note_motion()
        axes = PLANES[block.modes.plane * 10]
        moves = self.moves
        shift = self._shift()
        end = [target[axis] - shift[axis] for axis in axes]
        middle = centre[0] - shift[axes[0]], centre[1] - shift[axes[1]]
        if block.modes.feed_mode == 93:
            feed *= self._arc_length(axes, target, centre, ccw=motion == 3)
        moves.plane, moves.feed = block.modes.plane * 10, feed
        moves.arc(end, middle, 1 if motion == 3 else -1)
        self.position[:] = target

    def _arc_length(
        self,
        axes: tuple[int, int, int],
        target: list[float],
        centre: tuple[float, float],
        *,
        ccw: bool,
    ) -> float:
        start_arm = self.position[axes[0]] - centre[0], self.position[axes[1]] - centre[1]
        end_arm = target[axes[0]] - centre[0], target[axes[1]] - centre[1]
        turn = math.atan2(
            start_arm[0] * end_arm[1] - start_arm[1] * end_arm[0],
            start_arm[0] * end_arm[0] + start_arm[1] * end_arm[1],
        )
        turn = turn if ccw else -turn
        if turn <= self._dialect.arc_full_turn_rad:
            turn += 2.0 * math.pi
        rise = target[axes[2]] - self.position[axes[2]]
        return math.hypot(math.hypot(*start_arm) * turn, rise)

    def _try_homing(self, block: GrblBlock, target: list[float]) -> bool:
        """Add the machine's homing event for a G53 G0 to machine zero; return True if the block is
        one."""
        named = tuple(axis for axis in "XYZ" if axis in block.numbers)
        kind = {("X", "Y"): Kind.HOME_XY, ("Z",): Kind.HOME_Z}.get(named)
        if kind is None or any(block.numbers[axis] for axis in named):
            return False
        self._note_motion()
        x, y, z = (a - b for a, b in zip(target, self._shift(), strict=True))
        self._path.set_position(*self.moves.to_part(x, y, z)).event(kind)
        self.position[:] = target
        return True

    def _shift(self) -> list[float]:
        """Return the zero of the program's coordinates on the machine, mm, for the tip of the
        tool."""
        frame = self._frames[self.modes.frame]
        shift = [a + b for a, b in zip(frame, self._offset, strict=True)]
        shift[2] += self._length
        return shift

    def _go(self, kind: Kind, target: list[float], feed: float) -> None:
        self._note_motion()
        x, y, z = (a - b for a, b in zip(target, self._shift(), strict=True))
        self.moves.feed = feed
        (self.moves.rapid if kind == Kind.RAPID else self.moves.line)(x, y, z)
        self.position[:] = target

    def _note_motion(self) -> None:
        if self._first_frame is None:
            self._first_frame = self.modes.frame
            if any(self._zero):
                self._placed.add(self.modes.frame)

    def _stop(self, code: int) -> None:
        if code in (2, 30):
            self._path.event(Kind.END)
            self.ended = True
        elif code == 0 and self._tool is not None and self._changes_tools:
            self._path.event(Kind.TOOL_CHANGE, float(self._tool))
            self._tool = None
        else:
            self.notes.pauses.append(self.index)
            if code == 0:
                self._come_to_rest()


def _coolant_kind(modes: ParserModes) -> Kind:
    if modes.flood:
        return Kind.COOLANT_FLOOD
    return Kind.COOLANT_MIST if modes.mist else Kind.COOLANT_OFF


def target_length(block: GrblBlock, mm: float) -> float:
    """Return the length of the tool that G43.1 or G49 sets, mm."""
    return block.numbers["Z"] * mm if block.length == "set" else 0.0


def _number(text: str) -> float:
    """Return the value of a number as grbl reads it: only its first eight digits count."""
    if len(text) <= MAX_DIGITS:
        return float(text)
    digits, digits_read = 0, []
    for sign in text:
        if sign.isdigit():
            digits += 1
            digits_read.append(sign if digits <= MAX_DIGITS else "0")
        else:
            digits_read.append(sign)
    return float("".join(digits_read))
