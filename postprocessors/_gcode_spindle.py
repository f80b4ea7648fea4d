"""Reading what is no motion: spindle, tools, stops, coolant."""

from __future__ import annotations

import math
from typing import Final

from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind

from ._gcode_notes import ReadNotes
from ._gcode_rules import M_CODES, M, Rules
from ._gcode_words import Block

SPINDLE: Final = {
    M.SPINDLE_CW: Kind.SPINDLE_CW,
    M.SPINDLE_CCW: Kind.SPINDLE_CCW,
    M.SPINDLE_OFF: Kind.SPINDLE_OFF,
}


class MachineWords:
    """S, T and M words in, rows out; knows the speed, the tool and whether the end came."""

    def __init__(self, path: ToolpathBuilder, rules: Rules, notes: ReadNotes) -> None:
        self.ended = False
        self._path = path
        self._rules = rules
        self._notes = notes
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
        self._turn(block, codes, said=speed is not None)
        if any(M_CODES[code] == "coolant" for code in codes):
            self._notes.coolant.append(block.index)

    def stop(self, block: Block, codes: list[int]) -> None:
        """Behind the block's motion: M2 and M30 end the program; M0 and M1 wait."""
        for code in codes:
            if code in (M.END, M.END_AND_REWIND):
                self._path.event(Kind.END)
                self.ended = True
            elif M_CODES[code] == "stop" and not self._changed:
                self._notes.pauses.append(block.index)

    def _turn(self, block: Block, codes: list[int], *, said: bool) -> None:
        """The spindle's words; a speed alone tells the running spindle."""
        turn = next((SPINDLE[M(code)] for code in codes if code in SPINDLE), None)
        if turn == Kind.SPINDLE_OFF:
            self._spindle = None
            self._path.event(turn)
        elif turn is not None:
            if self._speed is None:
                self._notes.speedless.append(block.index)
            self._spindle = turn
            self._path.event(turn, self._speed)
        elif said and self._spindle is not None:
            self._path.event(self._spindle, self._speed)

    def _change(self, block: Block) -> None:
        """M6 stops the spindle; after a pause the tool is the one that was asked for."""
        if self._tool is None:
            block.fail_at("M", "a tool change before a T word was said")
        self._path.event(Kind.TOOL_CHANGE, float(self._tool))
        if self._rules.tools == "change":
            self._spindle = None
        else:
            self._tool = None

    def _number_of_tool(self, block: Block, value: float) -> int:
        if not (0.0 <= value <= self._rules.most_tool and value == math.floor(value)):
            block.fail_at("T", f"T takes a whole number from 0 to {self._rules.most_tool}")
        return int(value)
