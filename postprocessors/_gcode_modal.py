"""Reading grbl and linuxcnc: blocks of words to rows, with the modes that both know.

A block is decoded as RS274 orders it: modes and numbers first, then feed, spindle, tool, dwell,
and its motion last. What a dialect has of its own it says in `Rules`: which G and M codes it
takes, which it takes and ignores, which cannot be simulated, and its rule for arcs. A word that
nothing uses is an error, and so are two words of one group: controllers refuse both.
"""

from __future__ import annotations

import math
from typing import Final, NoReturn

from camtool.machine.model import Machine
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath

from ._gcode_circles import Circle, centre_of_radius, follow
from ._gcode_notes import ReadNotes
from ._gcode_rules import (
    ABSOLUTE,
    ABSOLUTE_CENTRES,
    ARC_CCW,
    BLEND,
    DWELL,
    INCHES,
    LINE,
    M_CODES,
    MACHINE_FRAME,
    NO_MOTION,
    RAPID,
    Rules,
)
from ._gcode_words import Block

MM_PER_INCH: Final = 25.4
"""What one unit of a coordinate is under G20."""

FEED_GUARD: Final = 1e-9
"""Part of a feed: a feed above its limit by less is at the limit."""

SPINDLE: Final = {30: Kind.SPINDLE_CW, 40: Kind.SPINDLE_CCW, 50: Kind.SPINDLE_OFF}
MOTION_GROUP: Final = "motion"


class ModalReader:
    """Blocks in, rows out; knows the modes, where the tool stands and whether the end came."""

    def __init__(self, machine: Machine, rules: Rules) -> None:
        self.path = ToolpathBuilder()
        self._rules = rules
        self._motion = rules.first_motion
        self._mm = 1.0
        self._absolute = True
        self._absolute_centres = False
        self._feed = 0.0
        self._speed: float | None = None
        self._spindle: Kind | None = None
        self._tool: int | None = None
        self._ended = False
        self._codes: dict[tuple[str, str], int] = {}
        self._notes = ReadNotes(machine.max_feed_mm_min)
        self._zero = machine.controller.machine_zero_mm
        self._changed = False

    def block(self, block: Block) -> None:
        """Decode one block; ProgramError where the controller would refuse it."""
        if self._ended:
            block.fail("a block after the end of the program", mend="remove it")
        self.path.block = block.index
        numbers: dict[str, float] = {}
        modes: dict[str, int] = {}
        m_codes: list[int] = []
        for letter, text in block.words:
            if letter == "G":
                code = self._code("G", text, block)
                group = self._rules.groups[code]
                if group in modes:
                    self._fail(block, "G", text, f"two G words of one group ({group})")
                modes[group] = code
            elif letter == "M":
                m_codes.append(self._code("M", text, block))
            elif letter in numbers:
                self._fail(block, letter, text, f"two {letter} words in one block")
            else:
                numbers[letter] = float(text)
        self._carry_out(block, modes, m_codes, numbers)
        if numbers:
            letter = next(iter(numbers))
            self._fail(block, letter, None, f"nothing in the block uses the {letter} word")
        if m_codes:
            self._stop(m_codes)

    def _carry_out(
        self, block: Block, modes: dict[str, int], m_codes: list[int], numbers: dict[str, float]
    ) -> None:
        """All but the end of the program, in RS274's order; takes out the numbers it uses."""
        if modes:
            self._set_modes(block, modes, numbers)
        if "F" in numbers:
            self._set_feed(block, numbers.pop("F") * self._mm)
        if m_codes or "S" in numbers or "T" in numbers:
            self._changed = False
            self._machine_words(block, m_codes, numbers)
        once = modes.get("one block")
        if once == DWELL:
            self._dwell(block, numbers)
        elif once == MACHINE_FRAME:
            self._home(block, numbers)
        elif numbers or MOTION_GROUP in modes:
            self._move(block, numbers, said=MOTION_GROUP in modes)

    def finish(self) -> Toolpath:
        """The rows, with what was noticed."""
        return self.path.finish(self._notes.findings())

    def message(self, text: str) -> None:
        """A comment that the operator is shown."""
        self.path.message(text)

    # Words

    def _code(self, letter: str, text: str, block: Block) -> int:
        """A G or M word's code, tenfold; ProgramError for codes that cannot be."""
        known = self._codes.get((letter, text))
        if known is not None:
            return known
        value = float(text)
        code = round(value * 10.0) if value < 1000.0 else -1
        exact = code / 10.0 == value
        name = f"{letter}{value:g}"
        if exact and name in self._rules.refused:
            self._fail(block, letter, text, f"{name} {self._rules.refused[name]}")
        fits = code in self._rules.groups if letter == "G" else code in M_CODES
        if not (exact and fits):
            self._fail(block, letter, text, f"the controller does not know {letter}{text}")
        self._codes[letter, text] = code
        return code

    def _set_modes(self, block: Block, modes: dict[str, int], numbers: dict[str, float]) -> None:
        """Motion, units, distance and arc modes."""
        self._motion = modes.get(MOTION_GROUP, self._motion)
        if "units" in modes:
            mm = MM_PER_INCH if modes["units"] == INCHES else 1.0
            if mm != self._mm and "F" in numbers:
                message = "a feed beside a change of units"
                self._fail(block, "F", None, message, "say F in the next block")
            self._mm = mm
        if "distance" in modes:
            self._absolute = modes["distance"] == ABSOLUTE
        if "arc distance" in modes:
            self._absolute_centres = modes["arc distance"] == ABSOLUTE_CENTRES
        if modes.get("path") == BLEND:  # P is its tolerance, Q that of merging lines
            numbers.pop("P", None)
            numbers.pop("Q", None)

    def _set_feed(self, block: Block, feed: float) -> None:
        if feed <= 0.0:
            self._fail(block, "F", None, "a feed that is not above 0")
        if feed > self._notes.max_feed_mm_min * (1.0 + FEED_GUARD):
            self._notes.fast.append((block.index, feed))
        self._feed = feed

    def _machine_words(self, block: Block, codes: list[int], numbers: dict[str, float]) -> None:
        """Spindle and tool."""
        groups = [M_CODES[code] for code in codes if M_CODES[code] != "coolant"]
        if len(set(groups)) != len(groups):
            self._fail(block, "M", None, "two M words of one group")
        speed = numbers.pop("S", None)
        if speed is not None and speed < 0.0:
            self._fail(block, "S", None, "a speed below 0")
        self._speed = self._speed if speed is None else speed
        if "T" in numbers:
            self._tool = self._whole(block, "T", numbers.pop("T"))
        if 60 in codes or (0 in codes and self._rules.tools == "pause" and self._tool is not None):
            self._change_tool(block)
        turn = next((code for code in codes if code in SPINDLE), None)
        if turn is not None:
            self._spindle = None if turn == 50 else SPINDLE[turn]
            if self._spindle is not None and self._speed is None:
                self._fail(block, "M", None, "the spindle is started before an S word was said")
            self.path.event(SPINDLE[turn], self._speed if self._spindle is not None else None)
        elif speed is not None and self._spindle is not None:
            self.path.event(self._spindle, speed)
        if any(M_CODES[code] == "coolant" for code in codes):
            self._notes.coolant.append(block.index)

    def _change_tool(self, block: Block) -> None:
        if self._rules.tools == "none":
            self._fail(block, "M", None, "this controller knows no tool change")
        if self._tool is None:
            self._fail(block, "M", None, "a tool change before a T word was said")
        self.path.event(Kind.TOOL_CHANGE, float(self._tool))
        self._changed = True
        if self._rules.tools == "change" and self._spindle is not None:
            # M6 stops the spindle.
            self._spindle = None
        if self._rules.tools == "pause":
            self._tool = None

    def _stop(self, codes: list[int]) -> None:
        """M2 and M30 end the program; M0 and M1 wait for the operator."""
        for code in codes:
            if code in (20, 300):
                self.path.event(Kind.END)
                self._ended = True
            elif code in (0, 10) and not self._changed:
                self._notes.pauses.append(self.path.block)

    def _dwell(self, block: Block, numbers: dict[str, float]) -> None:
        """G4 P: seconds."""
        if "P" not in numbers:
            self._fail(block, "G", None, "a dwell without P", "write G4 P1.5 for 1.5 s")
        seconds = numbers.pop("P")
        if seconds < 0.0:
            self._fail(block, "P", None, "a dwell below 0 s")
        self.path.event(Kind.DWELL, seconds)

    def _home(self, block: Block, numbers: dict[str, float]) -> None:
        """G53 G0 X0 Y0 and G53 G0 Z0: to machine zero."""
        said = {axis: numbers.pop(axis) for axis in "XYZ" if axis in numbers}
        kinds = {("X", "Y"): Kind.HOME_XY, ("Z",): Kind.HOME_Z}
        kind = kinds.get(tuple(said))
        if self._motion != RAPID or kind is None or any(said.values()):
            block.fail(
                "of machine coordinates only homing can be simulated",
                mend="write G53 G0 X0 Y0 or G53 G0 Z0",
            )
        x, y, z = self.path.position
        zx, zy, zz = self._zero
        to = (zx, zy, z) if kind == Kind.HOME_XY else (x, y, zz)
        self.path.moved_to(*to).event(kind)

    # Motion

    def _move(self, block: Block, numbers: dict[str, float], *, said: bool) -> None:
        """Rapid, line or arc to the block's coordinates; `said`: by a motion word of its own."""
        x, y, z = self.path.position
        to = [x, y, z]
        axes = False
        for at, axis in enumerate("XYZ"):
            if axis in numbers:
                axes = True
                value = numbers.pop(axis) * self._mm
                to[at] = value if self._absolute else to[at] + value
        motion = self._motion
        if motion is None or motion == NO_MOTION:
            if axes:
                block.fail("coordinates, and no motion word in force", mend="write G0 or G1")
        elif not axes:
            if motion > LINE and said:
                block.fail("an arc without X or Y", mend="say where it ends")
        elif motion == RAPID:
            self.path.rapid(*to)
        elif self._feed == 0.0:
            block.fail("a feed move, and no feed yet", mend="say F first")
        elif motion == LINE:
            self.path.line(*to, feed=self._feed)
        else:
            self._arc(block, motion == ARC_CCW, to, numbers)

    def _arc(self, block: Block, ccw: bool, to: list[float], numbers: dict[str, float]) -> None:
        """G2 and G3, by centre or by radius, flat or helical."""
        x, y, _ = self.path.position
        if "R" in numbers and ("I" in numbers or "J" in numbers):
            self._fail(block, "R", None, "an arc by its radius and by its centre at once")
        if "R" in numbers:
            radius = numbers.pop("R") * self._mm
            fault = centre_of_radius(
                (x, y), (to[0], to[1]), radius, ccw, self._rules.chord_slack_mm
            )
            if isinstance(fault, str):
                self._fail(block, "R", None, fault)
            centre = fault
        else:
            centre = self._centre(block, (x, y), numbers)
            r1, r2 = math.dist(centre, (x, y)), math.dist(centre, to[:2])
            if fault := self._rules.arc_fault(r1, r2):
                letter = "I" if any(word == "I" for word, _ in block.words) else "J"
                self._fail(block, letter, None, fault)
        circle = Circle((x, y), (to[0], to[1]), centre, ccw)
        follow(self.path, circle, to[2], (self._feed, self._rules.full_turn_rad))

    def _centre(
        self, block: Block, start: tuple[float, float], numbers: dict[str, float]
    ) -> tuple[float, float]:
        """The centre that I and J say."""
        if "I" not in numbers and "J" not in numbers:
            block.fail("an arc without I, J or R", mend="say where its centre is")
        if not self._absolute_centres:
            i, j = numbers.pop("I", 0.0) * self._mm, numbers.pop("J", 0.0) * self._mm
            return start[0] + i, start[1] + j
        if "I" not in numbers or "J" not in numbers:
            block.fail("with G90.1 an arc needs both I and J")
        return numbers.pop("I") * self._mm, numbers.pop("J") * self._mm

    # Errors

    def _whole(self, block: Block, letter: str, value: float) -> int:
        if value < 0.0 or value != math.floor(value):
            self._fail(block, letter, None, f"{letter} takes a whole number from 0")
        return int(value)

    def _fail(
        self, block: Block, letter: str, text: str | None, message: str, mend: str = ""
    ) -> NoReturn:
        """ProgramError at the last word of that letter (and text)."""
        at = [
            index
            for index, (word, number) in enumerate(block.words)
            if word == letter and text in (None, number)
        ]
        block.fail(message, word=at[-1] if at else None, mend=mend)
