"""Reading grbl and linuxcnc: blocks of words to rows, with the modes that both know.

A block is decoded as RS274 orders it: modes and numbers first, then feed, spindle, tool, dwell,
and its motion last. What is a dialect's own stands in `Rules`: which G and M codes it
takes, which it takes and ignores, which cannot be simulated, and its rule for arcs. A word that
nothing uses is an error, and so are two words of one group: controllers refuse both.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from functools import partial
from typing import Final

import numpy as np

from camtool import bounds
from camtool.findings import Finding
from camtool.kernels import words
from camtool.machine.model import Machine
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, PathMode, Toolpath

from .blocks import Block, PlainBlocks
from .findings import (
    NEVER_READ,
    SPINDLE_SPEED_NOT_SAID,
    WORDS_PASSED_OVER_COOLANT,
    WORDS_PASSED_OVER_PAUSE,
)
from .plain_moves import KINDS, ArcRule, FastFeeds, PlainMoves, PlainState

Point = tuple[float, float]


MM_PER_INCH: Final = 25.4
"""Length of one unit of a coordinate under G20, mm."""

MOTION_GROUP: Final = "motion"

EXACT_PATH: Final = PathMode("exact-path")

NO_FEED: Final = "a feed move, and no feed yet"

TURNS_TOLERANCE: Final = 1e-3
"""Turns: a P that differs from a whole number by no more counts as that number (rs274 takes
2.001)."""

MOST_TURNS: Final = 10_000
"""Largest number of turns of an arc, each of which is a move."""

_TURN: Final = 2.0 * math.pi


class G(IntEnum):
    """G words that a reader acts on, tenfold: G91.1 is 911. Arcs are above LINE."""

    RAPID = 0
    LINE = 10
    ARC_CCW = 30
    DWELL = 40
    INCHES = 200
    TOOL_LENGTH = 430
    MACHINE_FRAME = 530
    FIRST_FRAME = 540
    EXACT_PATH = 610
    BLEND = 640
    NO_MOTION = 800
    DRILL = 810
    DRILL_DWELL = 820
    DRILL_PECK = 830
    ABSOLUTE = 900
    ABSOLUTE_CENTRES = 901
    TO_R = 990


class M(IntEnum):
    """M words that a reader acts on, tenfold."""

    PAUSE = 0
    END = 20
    SPINDLE_CW = 30
    SPINDLE_CCW = 40
    SPINDLE_OFF = 50
    CHANGE = 60
    MIST = 70
    FLOOD = 80
    COOLANT_OFF = 90
    END_AND_REWIND = 300


CYCLES: Final = (G.DRILL, G.DRILL_DWELL, G.DRILL_PECK)
"""Motions that drill a hole."""


@dataclass
class Cycle:
    """What cycles keep from block to block: the height at which the first of them began (None:
    none has), and the words Z, R, P and Q in the units of the program, which forgets them when it
    changes these."""

    begun_mm: float | None = None
    words: dict[str, float] = field(default_factory=dict)


M_CODES: Final = {
    0: "stop",
    10: "stop",
    20: "stop",
    300: "stop",
    30: "spindle",
    40: "spindle",
    50: "spindle",
    60: "tool",
    70: "coolant",
    80: "coolant",
    90: "coolant",
}
"""M words, tenfold, and their groups."""


@dataclass(frozen=True)
class Rules:
    """One dialect. Codes are tenfold: G91.1 is 911.

    `groups`: the G codes it takes and the group of each; two of a group in a block are an error.
    `refused`: codes ("G55", "M6") that the controller knows but that have no place in a program
    here, and why. `first_motion`: the motion mode before the first motion word (None: none).
    `arc_fault`: why radii r1 and r2 (mm, at start and end) are no arc, "" if they are.
    `sure_gap_mm`, `sure_radius_mm`: radii that are larger and differ by no more are an arc.
    `circle_without_end`: an arc that has only its centre is a full circle. `path_modes`: the
    group "path" sets how corners are met. `turns`: P is how many turns an arc begins.
    `pecked_mm`: how far above the hole that it has made a cycle of pecks comes back as a rapid.
    `forgets_feed`: G94 does, and G1 to G3 want a feed even where nothing moves.
    `ends_in_plane`: an arc must have X or Y. `feed_first`: a feed beside a change of units is in
    the units before. `m_codes`: the M codes it takes and the group of each.
    `tools`: "change" (M6), "pause" (M0 beside a T word), or "none"; T words go up to `most_tool`.
    """

    groups: Mapping[int, str]
    refused: Mapping[str, str]
    first_motion: int | None
    arc_fault: Callable[[float, float], str]
    full_turn_rad: float
    chord_slack_mm: float
    sure_gap_mm: float
    sure_radius_mm: float
    circle_without_end: bool = False
    path_modes: bool = False
    turns: bool = False
    ends_in_plane: bool = False
    feed_first: bool = False
    forgets_feed: bool = False
    pecked_mm: float = 0.0
    m_codes: Mapping[int, str] = field(default_factory=lambda: M_CODES)
    tools: str = "none"
    most_tool: int = 99_999

    @property
    def arc_rule(self) -> ArcRule:
        """Which arcs of plain blocks are surely taken."""
        return ArcRule(
            self.sure_gap_mm, self.sure_radius_mm, self.full_turn_rad, self.ends_in_plane
        )


class ModalReader:
    """Blocks in, rows out; knows the modes, the tool's position and whether the program ended."""

    def __init__(self, machine: Machine, rules: Rules) -> None:
        self.path = ToolpathBuilder()
        self.empty = True
        """Whether there has been no block yet."""
        self._rules = rules
        self._motion = rules.first_motion
        self._cycle = Cycle()
        self._to_r = True
        self._mm = 1.0
        self._absolute = True
        self._absolute_centres = False
        self._feed = 0.0
        self._frame: int = G.FIRST_FRAME
        self._moved = False
        self._codes: dict[tuple[str, str], int] = {}
        self._findings = ReadFindings(FastFeeds(machine.max_feed_mm_min))
        self._machine = MachineWords(
            self.path, rules, self._findings, cools=bool(machine.coolant.kinds)
        )
        self._zero = machine.controller.machine_zero_mm

    def block(self, block: Block) -> None:
        """Decode one block; ProgramError where the controller would refuse it."""
        self.empty = False
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

    def take(self, plain: PlainBlocks) -> int:
        """Decode plain blocks by columns, up to the first that is no move which the controller
        surely does, from any state: `block` decodes that one. How many were decoded."""
        if self._machine.ended or not self._absolute or self._absolute_centres:
            return 0
        moves = PlainMoves(plain, self._state(), self._rules.arc_rule)
        count = moves.count
        rows = moves.moving[:count]
        given, feeds = plain.has(words.F_WORD), moves.feed[:count]
        self._findings.fast.note(plain.first, np.where(given[:count], feeds, np.nan))
        if count:
            self.empty = False
            last = int(moves.motion[count - 1])
            self._motion = self._motion if last < 0 else last
            self._feed = float(feeds[-1])
        if rows.any():
            self._moved = True
            motion = moves.motion[:count][rows]
            self.path.moves(
                kind=KINDS[motion],
                end=moves.end[:count][rows],
                centre=np.where(motion[:, None] > G.LINE, moves.centre[:count][rows], np.nan),
                feed=np.where(motion >= G.LINE, feeds[rows], np.nan),
                block=plain.first + np.flatnonzero(rows),
            )
        return count

    def _state(self) -> PlainState:
        motion = -1 if self._motion is None or self._motion > G.ARC_CCW else self._motion
        return PlainState(motion, self._feed, self._mm, self.path.position)

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
            self._move(block, numbers, has_word=MOTION_GROUP in modes)

    def finish(self) -> Toolpath:
        """The rows, with the findings."""
        return self.path.finish(self._findings.findings())

    @property
    def ended(self) -> bool:
        """Whether the program has ended."""
        return self._machine.ended

    def unread(self, lines: list[int]) -> None:
        """Lines (from 1) behind the end, which no controller reads."""
        if lines:
            self._findings.behind_end = len(lines), lines[0]

    def message(self, text: str) -> None:
        """A comment that the operator is shown."""
        self.path.message(text)

    # Words

    def _code(self, letter: str, text: str, block: Block) -> int:
        """A G or M word's code, tenfold; ProgramError for an unknown code."""
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
        if modes.get(MOTION_GROUP, self._motion) != self._motion:
            self._cycle = Cycle(self._cycle.begun_mm if self._motion in CYCLES else None)
        self._motion = modes.get(MOTION_GROUP, self._motion)
        if "return mode" in modes:
            self._to_r = modes["return mode"] == G.TO_R
        if "units" in modes and self._mm != (MM_PER_INCH if modes["units"] == G.INCHES else 1.0):
            self._cycle.words.clear()
        if "units" in modes:
            self._mm = MM_PER_INCH if modes["units"] == G.INCHES else 1.0
        if "distance" in modes:
            self._absolute = modes["distance"] == G.ABSOLUTE
        if "arc distance" in modes:
            self._absolute_centres = modes["arc distance"] == G.ABSOLUTE_CENTRES
        if "path" in modes:
            self._set_path_mode(modes["path"], numbers)
        if modes.get("tool length") == G.TOOL_LENGTH:  # H is the tool
            numbers.pop("H", None)
        if "feed mode" in modes and self._rules.forgets_feed:
            self._feed = 0.0
        if "work frame" in modes:
            self._set_frame(block, modes["work frame"])

    def _set_path_mode(self, code: int, numbers: dict[str, float]) -> None:
        """G61, G61.1, and G64 with P, its tolerance, and Q, that of merging lines (P where it is
        missing): how the moves from this block on meet their corners. Below 0 they count as
        missing."""
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
            message = "the program changes to a work frame whose place only the controller knows"
            block.fail_at(
                "G", message, number=f"{frame // 10}", mend="write a program for each frame"
            )
        self._frame = frame

    def _set_feed(self, block: Block, feed: float) -> None:
        if feed <= 0.0:
            block.fail_at("F", "a feed that is not above 0")
        self._findings.fast.note(block.index, np.array([feed]))
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
        axes = {axis: numbers.pop(axis) for axis in "XYZ" if axis in numbers}
        kinds = {("X", "Y"): Kind.HOME_XY, ("Z",): Kind.HOME_Z}
        kind = kinds.get(tuple(axes))
        if self._motion != G.RAPID or kind is None or any(axes.values()):
            block.fail(
                "G53 moves to another place than machine zero, which is not simulated",
                mend="write G53 G0 X0 Y0 or G53 G0 Z0",
            )
        x, y, z = self.path.position
        zx, zy, zz = self._zero
        to = (zx, zy, z) if kind == Kind.HOME_XY else (x, y, zz)
        self.path.moved_to(*to).event(kind)

    # Motion

    def _move(self, block: Block, numbers: dict[str, float], *, has_word: bool) -> None:
        """Rapid, line or arc to the block's coordinates; `has_word`: it has a motion word."""
        if self._motion in CYCLES:
            self._drill(block, numbers, has_word=has_word)
            return
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
                block.fail("coordinates, but no motion word in force", mend="write G0 or G1")
        elif not axes and not self._is_circle(motion, numbers, has_word=has_word):
            if has_word and self._rules.forgets_feed and motion > G.RAPID and self._feed == 0.0:
                block.fail(NO_FEED, mend="write F first")
            if motion > G.LINE and has_word:
                block.fail("an arc without X or Y", mend="write X and Y of its end")
        elif motion == G.RAPID:
            self.path.rapid(*to)
        elif self._feed == 0.0:
            block.fail(NO_FEED, mend="write F first")
        elif motion == G.LINE:
            self.path.line(*to, feed=self._feed)
        elif self._rules.ends_in_plane and not flat:
            block.fail("an arc without X or Y: grbl's error 32", mend="write X or Y of its end")
        else:
            self._arc(block, motion == G.ARC_CCW, to, numbers)

    def _drill(self, block: Block, numbers: dict[str, float], *, has_word: bool) -> None:
        """G81, G82 and G83: the moves that LinuxCNC makes of them.

        Over the hole at the height of the block, down to R as a rapid, to Z at the feed (by Q with
        G83, out to R and back between; G82 waits), out to R or with G98 to where the cycles
        began. Z, R, P and Q hold until another motion word. Corners are met exactly.
        """
        if not any(axis in numbers for axis in "XYZ"):
            if has_word:
                block.fail("a cycle without X, Y or Z", mend="write the place of the hole")
            return
        if not self._absolute:
            block.fail("a cycle with G91, which is not read", mend="write G90")
        words = self._cycle.words
        asked = {"R": "the height R", "Z": "the depth Z"}
        asked |= {"P": "the dwell P"} if self._motion == G.DRILL_DWELL else {}
        asked |= {"Q": "the depth of a peck, Q"} if self._motion == G.DRILL_PECK else {}
        for letter, name in asked.items():
            if letter in numbers:
                words[letter] = numbers.pop(letter)
            if letter not in words:
                block.fail_at("G", f"a cycle without {name}", mend=f"write {letter}")
        x, y, z = self.path.position
        x = numbers.pop("X") * self._mm if "X" in numbers else x
        y = numbers.pop("Y") * self._mm if "Y" in numbers else y
        r, bottom = words["R"] * self._mm, words["Z"] * self._mm
        if r < bottom:
            block.fail(f"R {words['R']:g} lies below Z {words['Z']:g}", mend="write a higher R")
        if words.get("P", 0.0) < 0.0 or words.get("Q", 1.0) <= 0.0:
            block.fail("a dwell below 0 s, or a peck that is not above 0 mm")
        if self._feed == 0.0:
            block.fail(NO_FEED, mend="write F first")
        begun = self._cycle.begun_mm = z if self._cycle.begun_mm is None else self._cycle.begun_mm
        self._moved = True
        mode, self.path.mode = self.path.mode, EXACT_PATH
        if begun < r:
            self.path.rapid(z=r)
        over = r if begun < r else max(z, r if self._to_r else begun)
        self.path.rapid(x, y, over)
        if over != r:
            self.path.rapid(z=r)
        at = words["R"]  # in the program's units, as LinuxCNC counts
        while self._motion == G.DRILL_PECK and at - words["Q"] > words["Z"]:
            self._refuse_pecks(block)
            at -= words["Q"]
            self.path.line(z=at * self._mm, feed=self._feed).rapid(z=r)
            self.path.rapid(z=at * self._mm + self._rules.pecked_mm)
        self.path.line(z=bottom, feed=self._feed)
        if self._motion == G.DRILL_DWELL:
            self.path.event(Kind.DWELL, words["P"])
        self.path.rapid(z=r if self._to_r else max(begun, r))
        self.path.mode = mode

    def _refuse_pecks(self, block: Block) -> None:
        """ProgramError where the pecks of a cycle would be more moves than a program may have."""
        if len(self.path) >= bounds.MAX_MOVES:
            message = f"with its pecks the program has more than {bounds.MAX_MOVES} moves"
            block.fail_at("Q", message, mend="write a larger Q")

    def _is_circle(self, motion: int, numbers: dict[str, float], *, has_word: bool) -> bool:
        """Whether a block without X, Y and Z is a full circle about its I and J."""
        has_centre = "I" in numbers or "J" in numbers
        return self._rules.circle_without_end and motion > G.LINE and has_word and has_centre

    def _arc(self, block: Block, ccw: bool, to: list[float], numbers: dict[str, float]) -> None:
        """G2 and G3, by centre or by radius, flat or helical."""
        x, y, _ = self.path.position
        turns = self._turns(block, numbers.pop("P", 1.0)) if self._rules.turns else 1
        if "R" in numbers and ("I" in numbers or "J" in numbers):
            block.fail_at("R", "an arc with both R and a centre (I, J)")
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
        self._follow(to, centre, turns, ccw=ccw)

    def _follow(self, to: list[float], centre: Point, turns: int, *, ccw: bool) -> None:
        """The rows of an arc from where the tool stands, a helix where it rises or sinks.

        Whole turns come first, each with its share of the height. An arc so short that the
        controller takes it for a full circle is one, and a line to its end.
        """
        x, y, z = self.path.position
        start, end = (x, y), (to[0], to[1])
        turn = turn_of(start, end, centre)
        same = start == end
        full = same or abs(turn) <= self._rules.full_turn_rad
        sweep = _TURN if full else math.fmod((turn if ccw else -turn) + _TURN, _TURN)
        rise = (to[2] - z) / (_TURN * (turns - 1) + sweep)
        arc = partial(self.path.arc, centre=centre, ccw=ccw, feed=self._feed)
        for done in range(1, turns):
            arc(*start, z + rise * _TURN * done)
        arc(*(start if full else end), to[2])
        if full and not same:
            self.path.line(*end, feed=self._feed)

    def _turns(self, block: Block, value: float) -> int:
        """How many turns P begins: 2 is one whole turn and then the arc."""
        turns = round(min(value, MOST_TURNS + 1.0))
        if turns > MOST_TURNS:
            block.fail_at("P", f"an arc of more than {MOST_TURNS} turns")
        if abs(value - turns) > TURNS_TOLERANCE or turns < 1:
            block.fail_at("P", "the turns of an arc are a whole number from 1")
        if len(self.path) + turns > bounds.MAX_MOVES:
            message = (
                f"with the turns of this arc the program has more than {bounds.MAX_MOVES} moves"
            )
            block.fail_at("P", message, mend=bounds.SPLIT_PROGRAM)
        return turns

    def _centre(self, block: Block, start: Point, numbers: dict[str, float]) -> Point:
        """The centre that I and J give."""
        if "I" not in numbers and "J" not in numbers:
            block.fail("an arc without I, J or R", mend="write I and J of its centre, or R")
        if not self._absolute_centres:
            i, j = numbers.pop("I", 0.0) * self._mm, numbers.pop("J", 0.0) * self._mm
            return start[0] + i, start[1] + j
        if "I" not in numbers or "J" not in numbers:
            block.fail("with G90.1 an arc needs both I and J")
        return numbers.pop("I") * self._mm, numbers.pop("J") * self._mm


SPINDLE: Final = {
    M.SPINDLE_CW: Kind.SPINDLE_CW,
    M.SPINDLE_CCW: Kind.SPINDLE_CCW,
    M.SPINDLE_OFF: Kind.SPINDLE_OFF,
}

COOLANT: Final = {
    M.MIST: Kind.COOLANT_MIST,
    M.FLOOD: Kind.COOLANT_FLOOD,
    M.COOLANT_OFF: Kind.COOLANT_OFF,
}


class MachineWords:
    """S, T and M words in, rows out; knows the speed, the tool and whether the program ended."""

    def __init__(
        self, path: ToolpathBuilder, rules: Rules, notes: ReadFindings, *, cools: bool
    ) -> None:
        """`cools`: the machine has coolant, so that its words are rows."""
        self.ended = False
        self._path = path
        self._rules = rules
        self._findings = notes
        self._cools = cools
        self._speed: float | None = None
        self._spindle: Kind | None = None
        self._tool: int | None = None
        self._changed = False

    def read(self, block: Block, codes: list[int], numbers: dict[str, float]) -> None:
        """Tool, then spindle, in front of the block's motion; takes S and T out."""
        groups = [M_CODES[code] for code in codes]
        if len(set(groups)) != len(groups):
            block.fail_at("M", "two M words of one group")
        speed = numbers.pop("S", None)
        if speed is not None and speed < 0.0:
            block.fail_at("S", "a speed below 0")
        self._speed = self._speed if speed is None else speed
        if "T" in numbers:
            self._tool = self._number_of_tool(block, numbers.pop("T"))
        pauses = M.PAUSE in codes and self._rules.tools == "pause" and self._tool is not None
        self._changed = M.CHANGE in codes or pauses
        if self._changed:
            self._change(block)
        self._turn(block, codes, has_speed=speed is not None)
        cooling = [COOLANT[M(code)] for code in codes if code in COOLANT]
        if cooling and self._cools:
            self._path.event(cooling[0])
        elif cooling:
            self._findings.coolant.append(block.index)

    def stop(self, block: Block, codes: list[int]) -> None:
        """Behind the block's motion: M2 and M30 end the program; M0 and M1 wait."""
        for code in codes:
            if code in (M.END, M.END_AND_REWIND):
                self._path.event(Kind.END)
                self.ended = True
            elif M_CODES[code] == "stop" and not self._changed:
                self._findings.pauses.append(block.index)

    def _turn(self, block: Block, codes: list[int], *, has_speed: bool) -> None:
        """The spindle's words; a speed alone is for the running spindle."""
        turn = next((SPINDLE[M(code)] for code in codes if code in SPINDLE), None)
        if turn == Kind.SPINDLE_OFF:
            self._spindle = None
            self._path.event(turn)
        elif turn is not None:
            if self._speed is None:
                self._findings.speedless.append(block.index)
            self._spindle = turn
            self._path.event(turn, self._speed)
        elif has_speed and self._spindle is not None:
            self._path.event(self._spindle, self._speed)

    def _change(self, block: Block) -> None:
        """M6 stops the spindle; after a pause the tool is the one that was asked for."""
        if self._tool is None:
            block.fail_at("M", "a tool change before any T word")
        self._path.event(Kind.TOOL_CHANGE, float(self._tool))
        if self._rules.tools == "change":
            self._spindle = None
        else:
            self._tool = None

    def _number_of_tool(self, block: Block, value: float) -> int:
        if not (0.0 <= value <= self._rules.most_tool and value == math.floor(value)):
            block.fail_at("T", f"T takes a whole number from 0 to {self._rules.most_tool}")
        return int(value)


def centre_of_radius(
    start: Point, end: Point, radius: float, ccw: bool, slack_mm: float
) -> Point | str:
    """The centre of an arc given by its radius, or why there is none.

    With m the middle of the chord of length d, the centre lies √(R² − d²/4) beside it: on the left
    of the chord for a CCW arc of at most half a turn; a negative R asks for more than half a turn,
    whose centre is on the other side. Half the chord may exceed |R| by the slack.
    """
    dx, dy = end[0] - start[0], end[1] - start[1]
    chord = math.hypot(dx, dy)
    if chord == 0.0:
        return "an arc by its radius that ends where it starts has no centre"
    if chord / 2.0 - abs(radius) > slack_mm:
        return f"half the chord is {chord / 2.0:.4f} mm, more than the radius"
    aside = math.sqrt(max(0.0, radius * radius - chord * chord / 4.0))
    left = aside if ccw == (radius > 0.0) else -aside
    return (
        (start[0] + end[0]) / 2.0 - left * dy / chord,
        (start[1] + end[1]) / 2.0 + left * dx / chord,
    )


def turn_of(start: Point, end: Point, centre: Point) -> float:
    """How far an arc turns, rad, in (−π, π]: near 0 for the shortest and for the longest."""
    ox, oy = start[0] - centre[0], start[1] - centre[1]
    ex, ey = end[0] - centre[0], end[1] - centre[1]
    return math.atan2(ox * ey - oy * ex, ox * ex + oy * ey)


@dataclass
class ReadFindings:
    """Blocks (index from 0) of one run of a reader; `fast`: those with a feed above the limit."""

    fast: FastFeeds
    coolant: list[int] = field(default_factory=list)
    pauses: list[int] = field(default_factory=list)
    speedless: list[int] = field(default_factory=list)
    behind_end: tuple[int, int] | None = None
    """How many lines stand behind the end, and the first of them (from 1)."""

    def findings(self) -> Iterator[Finding]:
        """One finding of each kind."""
        yield from self.fast.findings()
        if self.speedless:
            yield SPINDLE_SPEED_NOT_SAID(where=f"block {self.speedless[0] + 1}")
        if self.behind_end:
            count, line = self.behind_end
            yield NEVER_READ(where=f"line {line}", measured=count)
        if self.coolant:
            where = f"block {self.coolant[0] + 1}"
            yield WORDS_PASSED_OVER_COOLANT(where=where, count=len(self.coolant))
        if self.pauses:
            where = f"block {self.pauses[0] + 1}"
            yield WORDS_PASSED_OVER_PAUSE(where=where, count=len(self.pauses))
