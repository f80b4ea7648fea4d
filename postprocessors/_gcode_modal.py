"""Reading grbl and linuxcnc: blocks of words to rows, with the modes that both know.

A block is decoded as RS274 orders it: modes and numbers first, then feed, spindle, tool, dwell,
and its motion last. What a dialect has of its own it says in `Rules`: which G and M codes it
takes, which it takes and ignores, which cannot be simulated, and its rule for arcs. A word that
nothing uses is an error, and so are two words of one group: controllers refuse both.
"""

from __future__ import annotations

import math
from typing import Final

from camtool.machine.model import Machine
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, PathMode, Toolpath

from ._gcode_circles import Circle, Way, centre_of_radius, follow
from ._gcode_notes import ReadNotes
from ._gcode_rules import G, Rules
from ._gcode_spindle import MachineWords
from ._gcode_words import Block

MM_PER_INCH: Final = 25.4
"""What one unit of a coordinate is under G20."""

FEED_GUARD: Final = 1e-9
"""Part of a feed: a feed above its limit by less is at the limit."""

MOTION_GROUP: Final = "motion"

NO_FEED: Final = "a feed move, and no feed yet"

TURNS_TOLERANCE: Final = 1e-3
"""Turns: a P beside a whole number by no more is that number (rs274 takes 2.001)."""

MOST_TURNS: Final = 10_000
"""Turns of an arc, each of which is a move."""


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
        self._frame: int = G.FIRST_FRAME
        self._moved = False
        self._codes: dict[tuple[str, str], int] = {}
        self._notes = ReadNotes(machine.max_feed_mm_min)
        self._machine = MachineWords(self.path, rules, self._notes)
        self._zero = machine.controller.machine_zero_mm

    def block(self, block: Block) -> None:
        """Decode one block; ProgramError where the controller would refuse it."""
        if self._machine.ended:
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
                    block.fail_at("G", f"two G words of one group ({group})", number=text)
                modes[group] = code
            elif letter == "M":
                m_codes.append(self._code("M", text, block))
            elif letter in numbers:
                block.fail_at(letter, f"two {letter} words in one block")
            else:
                numbers[letter] = float(text)
        self._carry_out(block, modes, m_codes, numbers)
        if numbers:
            letter = next(iter(numbers))
            block.fail_at(letter, f"nothing in the block uses the {letter} word")
        if m_codes:
            self._machine.stop(block, m_codes)

    def _carry_out(
        self, block: Block, modes: dict[str, int], m_codes: list[int], numbers: dict[str, float]
    ) -> None:
        """All but the end of the program, in RS274's order; takes out the numbers it uses."""
        feed = numbers.pop("F", None)
        before = self._mm
        if modes:
            self._set_modes(block, modes, numbers)
        if feed is not None:
            self._set_feed(block, feed * (before if self._rules.feed_first else self._mm))
        if m_codes or "S" in numbers or "T" in numbers:
            self._machine.read(block, m_codes, numbers)
        once = modes.get("one block")
        if once == G.DWELL:
            self._dwell(block, numbers)
        elif once == G.MACHINE_FRAME:
            self._home(block, numbers)
        elif numbers or MOTION_GROUP in modes:
            self._move(block, numbers, said=MOTION_GROUP in modes)

    def finish(self) -> Toolpath:
        """The rows, with what was noticed."""
        return self.path.finish(self._notes.findings())

    @property
    def ended(self) -> bool:
        """Whether the program's end came."""
        return self._machine.ended

    def unread(self, lines: list[int]) -> None:
        """Lines (from 1) behind the end, which no controller reads."""
        if lines:
            self._notes.behind_end = len(lines), lines[0]

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
            block.fail_at(letter, f"{name} {self._rules.refused[name]}", number=text)
        fits = code in (self._rules.groups if letter == "G" else self._rules.m_codes)
        if not (exact and fits):
            block.fail_at(letter, f"the controller does not know {letter}{text}", number=text)
        self._codes[letter, text] = code
        return code

    def _set_modes(self, block: Block, modes: dict[str, int], numbers: dict[str, float]) -> None:
        """Motion, units, distance and arc modes."""
        self._motion = modes.get(MOTION_GROUP, self._motion)
        if "units" in modes:
            self._mm = MM_PER_INCH if modes["units"] == G.INCHES else 1.0
        if "distance" in modes:
            self._absolute = modes["distance"] == G.ABSOLUTE
        if "arc distance" in modes:
            self._absolute_centres = modes["arc distance"] == G.ABSOLUTE_CENTRES
        if "path" in modes:
            self._set_path_mode(modes["path"], numbers)
        if modes.get("tool length") == G.TOOL_LENGTH:  # H tells of which tool
            numbers.pop("H", None)
        if "feed mode" in modes and self._rules.forgets_feed:
            self._feed = 0.0
        if "work frame" in modes:
            self._set_frame(block, modes["work frame"])

    def _set_path_mode(self, code: int, numbers: dict[str, float]) -> None:
        """G61, G61.1, and G64 with P, its tolerance, and Q, that of merging lines (P where it is
        not said): how the moves from this block on meet their corners. Below 0 they count as not
        said."""
        if not self._rules.path_modes:
            return
        if code != G.BLEND:
            self.path.mode = PathMode("exact-path" if code == G.EXACT_PATH else "exact-stop")
            return
        corner = max(numbers.pop("P", 0.0) * self._mm, 0.0)
        merging = numbers.pop("Q", -1.0) * self._mm
        self.path.mode = PathMode("blend", corner, corner if merging < 0.0 else merging)

    def _set_frame(self, block: Block, frame: int) -> None:
        """G54 to G59: whichever comes before the first move has its zero at part zero."""
        if self._moved and frame != self._frame:
            message = "another work frame, whose place only the controller knows"
            block.fail_at(
                "G", message, number=f"{frame // 10}", mend="write a program for each frame"
            )
        self._frame = frame

    def _set_feed(self, block: Block, feed: float) -> None:
        if feed <= 0.0:
            block.fail_at("F", "a feed that is not above 0")
        if feed > self._notes.max_feed_mm_min * (1.0 + FEED_GUARD):
            self._notes.fast.append((block.index, feed))
        self._feed = feed

    def _dwell(self, block: Block, numbers: dict[str, float]) -> None:
        """G4 P: seconds."""
        if "P" not in numbers:
            block.fail_at("G", "a dwell without P", mend="write G4 P1.5 for 1.5 s")
        seconds = numbers.pop("P")
        if seconds < 0.0:
            block.fail_at("P", "a dwell below 0 s")
        self.path.event(Kind.DWELL, seconds)

    def _home(self, block: Block, numbers: dict[str, float]) -> None:
        """G53 G0 X0 Y0 and G53 G0 Z0: to machine zero."""
        said = {axis: numbers.pop(axis) for axis in "XYZ" if axis in numbers}
        kinds = {("X", "Y"): Kind.HOME_XY, ("Z",): Kind.HOME_Z}
        kind = kinds.get(tuple(said))
        if self._motion != G.RAPID or kind is None or any(said.values()):
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
        flat = "X" in numbers or "Y" in numbers
        for at, axis in enumerate("XYZ"):
            if axis in numbers:
                axes = True
                value = numbers.pop(axis) * self._mm
                to[at] = value if self._absolute else to[at] + value
        self._moved = self._moved or axes
        motion = self._motion
        if motion is None or motion == G.NO_MOTION:
            if axes:
                block.fail("coordinates, and no motion word in force", mend="write G0 or G1")
        elif not axes and not self._is_circle(motion, numbers, said=said):
            if said and self._rules.forgets_feed and motion > G.RAPID and self._feed == 0.0:
                block.fail(NO_FEED, mend="say F first")
            if motion > G.LINE and said:
                block.fail("an arc without X or Y", mend="say where it ends")
        elif motion == G.RAPID:
            self.path.rapid(*to)
        elif self._feed == 0.0:
            block.fail(NO_FEED, mend="say F first")
        elif motion == G.LINE:
            self.path.line(*to, feed=self._feed)
        elif self._rules.ends_in_plane and not flat:
            block.fail("an arc without X or Y: grbl's error 32", mend="say where it ends in XY")
        else:
            self._arc(block, motion == G.ARC_CCW, to, numbers)

    def _is_circle(self, motion: int, numbers: dict[str, float], *, said: bool) -> bool:
        """Whether a block without X, Y and Z is a full circle about its I and J."""
        has_centre = "I" in numbers or "J" in numbers
        return self._rules.circle_without_end and motion > G.LINE and said and has_centre

    def _arc(self, block: Block, ccw: bool, to: list[float], numbers: dict[str, float]) -> None:
        """G2 and G3, by centre or by radius, flat or helical."""
        x, y, _ = self.path.position
        turns = self._turns(block, numbers.pop("P", 1.0)) if self._rules.turns else 1
        if "R" in numbers and ("I" in numbers or "J" in numbers):
            block.fail_at("R", "an arc by its radius and by its centre at once")
        if "R" in numbers:
            radius = numbers.pop("R") * self._mm
            fault = centre_of_radius(
                (x, y), (to[0], to[1]), radius, ccw, self._rules.chord_slack_mm
            )
            if isinstance(fault, str):
                block.fail_at("R", fault)
            centre = fault
        else:
            centre = self._centre(block, (x, y), numbers)
            r1, r2 = math.dist(centre, (x, y)), math.dist(centre, to[:2])
            if fault := self._rules.arc_fault(r1, r2):
                letter = "I" if any(word == "I" for word, _ in block.words) else "J"
                block.fail_at(letter, fault)
        circle = Circle((x, y), (to[0], to[1]), centre, ccw)
        follow(self.path, circle, to[2], Way(self._feed, self._rules.full_turn_rad, turns))

    def _turns(self, block: Block, value: float) -> int:
        """How many turns P begins: 2 is one whole turn and then the arc."""
        turns = round(min(value, MOST_TURNS + 1.0))
        if turns > MOST_TURNS:
            block.fail_at("P", f"an arc of more than {MOST_TURNS} turns")
        if abs(value - turns) > TURNS_TOLERANCE or turns < 1:
            block.fail_at("P", "the turns of an arc are a whole number from 1")
        return turns

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
