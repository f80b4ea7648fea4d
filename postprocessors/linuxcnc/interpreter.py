"""The interpreter: what a block does, in LinuxCNC's order.

A block is carried out as LinuxCNC does it (execute_block, convert_m, convert_g): comment, spindle
and feed mode, F, S, T, M words, dwell, plane, units, cutter compensation, tool length, work frame,
path mode, distance modes, G10 and its kin, motion, stop.

    state  the modes      frames  where coordinates are      moves  straight, arcs, splines
    needs  what a block's words need                         modes  M70, and names that show modes
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from camtool.toolpath.moves import Kind, PathMode

from ..gcode.faults import LineFault
from .dialect import ToolTableEntry
from .frames import FRAMES, HOMES
from .lines import RELATIVE, LinuxcncBlock
from .moves import REFUSED, BlockMoves
from .needs import check, motion_of
from .state import MM_PER_INCH

SPINDLE: Final = {3: Kind.SPINDLE_CW, 4: Kind.SPINDLE_CCW}

OUTPUTS_AT_ONCE: Final = (64, 65, 68)
"""The machine comes to rest before these; the others go with the next move."""

INPUT_VALUE: Final = 5399
"""The parameter of what M66 has read."""


class Interpreter(BlockMoves):
    """Executes blocks."""

    def _names(self) -> dict[str, Callable[[], float]]:
        from .modes import names_of

        return names_of(self)

    def execute(self, block: LinuxcncBlock) -> None:
        """Execute a block; LineFault where LinuxCNC would refuse it."""
        for letter in RELATIVE:
            if letter in block.words:
                raise LineFault(f"the letter {letter.upper()} is no word here", letter)
        motion = motion_of(self, block)
        check(self, block, motion)
        self.set_parameters(block)
        words, g = block.words, block.g
        if block.comment:
            self._comment(block.comment)
        if "x" in words and g.get("lathe diameter", 70 if self.diameters else 80) == 70:
            words = {**words, "x": words["x"] / 2.0}
        if g or block.m or "f" in words or "s" in words or "t" in words:
            if "spindle mode" in g:
                self._spindle_mode = g["spindle mode"]
            if "feed mode" in g:
                self._set_feed_mode(g["feed mode"])
            if "f" in words and self.feed_mode != 930:
                self._set_feed(words["f"])
            if "s" in words:
                self._set_speed(words["s"], block)
            if "t" in words:
                self._select_tool(int(words["t"]))
            if block.m:
                self._m_words(block)
            if g:
                self._g_words(block, words)
        if motion is not None:
            self._move(motion, block, words)
        if "stop" in block.m:
            self._stop(block.m["stop"])

    def set_parameters(self, block: LinuxcncBlock) -> None:
        """Set the parameters that a block assigns."""
        for name, value in block.settings:
            if isinstance(name, str):
                self.given.set_named(name, value)
            else:
                self.given.set_numbered(name, value)

    # Comments, feed, speed, tools

    def _comment(self, text: str) -> None:
        lower_text = text.lstrip().lower()
        if lower_text.startswith("msg,"):
            self._message(text.lstrip()[4:])
        elif "," in lower_text:
            from .comments import obey_comment

            shown = obey_comment(text.lstrip(), self.given)
            if shown is not None:
                self._message(shown)

    def _message(self, text: str) -> None:
        shown = text.encode("latin-1", errors="replace").decode("utf-8", errors="replace")
        self.canon.path.message(shown.strip())

    def _set_feed_mode(self, code: int) -> None:
        self.feed_mode = code
        if code != 930:
            self.feed_mm = 0.0

    def _set_feed(self, value: float) -> None:
        self.feed_mm = value * self.canon.mm
        if self.feed_mode == 940 and value > 0.0:
            self.notes.feeds(self.block_index, self.feed_mm)

    def _set_speed(self, value: float, block: LinuxcncBlock) -> None:
        self.speed = value
        self._said_speed = True
        if self.spindle is not None and "spindle" not in block.m:
            self.canon.event(self.spindle, value)

    def _select_tool(self, number: int) -> None:
        self._tool_of(number, "t")
        self._tool = number

    def _change_tool(self) -> None:
        if self._tool is None:
            raise LineFault("a tool change before any T word", "m")
        if self._compensates:
            raise LineFault("a tool change while the cutter's radius is compensated", "m")
        self.spindle = None
        self._load(self._tool)
        self.canon.event(Kind.TOOL_CHANGE, float(self._tool))

    # M words

    def _m_words(self, block: LinuxcncBlock) -> None:
        m, words = block.m, block.words
        io = m.get("input and output")
        if io is not None:
            if io == 66:
                self._wait_for_input(words)
            else:
                needed = "p" if io < 66 else "e"
                if words.get(needed, -1.0) < 0.0:
                    raise LineFault(f"M{io} without {needed.upper()}", "m")
                self._not_while_compensating("an output")
                if io in OUTPUTS_AT_ONCE:
                    self.come_to_rest()
                self.notes.outputs.append(self.block_index)
        tool = m.get("tool")
        if tool == 6:
            self._change_tool()
        elif tool == 61:
            number = round(words.get("q", -1.0))
            if number < 0:
                raise LineFault("M61 without the Q of its tool", "m")
            self._load(number)
        spindle = m.get("spindle")
        if spindle is not None:
            self._spindle_word(spindle, block)
        coolant = m.get("coolant")
        if coolant is not None:
            self._coolant(coolant)
        if "override" in m:
            self._not_while_compensating("an override")
        if "user" in m:
            name = f"M{m['user']}"
            raise LineFault(f"{name} runs a program of the machine, which only it knows", "m")

    def _wait_for_input(self, words: dict[str, float]) -> None:
        """Execute M66: the input is assumed to come at once, and to be 0."""
        digital, analog = words.get("p", -1.0), words.get("e", -1.0)
        kind = round(words.get("l", 0.0))
        if "p" in words and "e" in words:
            raise LineFault("M66 with both P and E", "e", "an input is digital (P) or analog (E)")
        if max(round(digital), round(analog)) < 0:
            raise LineFault("M66 without P or E", "m", "write the number of the input")
        if kind > 0 and words.get("q", -1.0) <= 0.0:
            raise LineFault("M66 that waits (L above 0) without a time Q above 0", "m")
        if "e" in words and kind:
            raise LineFault("M66 E reads at once, and has no L but L0", "l")
        self._not_while_compensating("M66")
        self.come_to_rest()
        self.given.set_numbered(INPUT_VALUE, 0.0)
        self.notes.inputs.append(self.block_index)

    def _spindle_word(self, code: int, block: LinuxcncBlock) -> None:
        words = block.words
        if words.get("$", 0.0) not in (0.0, -1.0):
            raise LineFault("a spindle that the machine does not have", "$")
        if code in SPINDLE:
            self.turn(SPINDLE[code])
        elif code == 5:
            self.turn(Kind.SPINDLE_OFF)
        elif code == 19:
            if not 0.0 <= words.get("r", 0.0) <= 360.0 or round(words.get("p", 0.0)) not in (
                0,
                1,
                2,
            ):
                raise LineFault("M19 wants R from 0 to 360 and P from 0 to 2", "m")
            if words.get("q", 1.0) <= 0.0:
                raise LineFault("M19 with a Q that is not above 0", "q")
            self.spindle = None
        else:
            from .modes import obey

            obey(self, code, self.execute)

    def _coolant(self, code: int) -> None:
        self._mist = code == 7 or (self._mist and code != 9)
        self._flood = code == 8 or (self._flood and code != 9)
        kinds = {7: Kind.COOLANT_MIST, 8: Kind.COOLANT_FLOOD, 9: Kind.COOLANT_OFF}
        if self._cools:
            self.canon.event(kinds[code])
        else:
            self.come_to_rest()
            self.notes.coolant.append(self.block_index)

    def _stop(self, code: int) -> None:
        if self._compensates:
            self.compensation.settle(self._flat())
        self.canon.flush()
        if code in (2, 30, 99):
            self.canon.path.event(Kind.END)
            self.ended = True
            self.notes.begins_again = code == 99
        elif not self._changed or code == 60:
            self.notes.pauses.append(self.block_index)

    # G words

    def _g_words(self, block: LinuxcncBlock, words: dict[str, float]) -> None:
        """Execute all G words of a block except the motion."""
        g = block.g
        one_shot = g.get("one block")
        if one_shot == 40:
            self.dwell(words["p"])
        if "plane" in g:
            self._set_plane(g["plane"])
        if "units" in g:
            self._set_units(g["units"])
        if "lathe diameter" in g:
            self.diameters = g["lathe diameter"] == 70
        if "cutter radius" in g:
            self._set_compensation(g["cutter radius"], words)
        if "tool length" in g:
            self._set_length(g["tool length"], words)
        if "work frame" in g:
            self._choose_frame(FRAMES[g["work frame"]])
        if "path" in g:
            self._set_path(g["path"], words)
        if "distance" in g:
            self.absolute = g["distance"] == 900
        if "arc distance" in g:
            self.absolute_centres = g["arc distance"] == 901
        if "return mode" in g:
            self._not_while_compensating("G98 or G99")
            self.to_r = g["return mode"] == 990
        if one_shot is not None:
            self._once(one_shot, words, block.g)
        if "axis offsets" in g:
            self._end_offsets(g["axis offsets"])

    def _set_plane(self, code: int) -> None:
        if code in REFUSED:
            raise LineFault(f"G{code / 10:g} {REFUSED[code]}", "g")
        if self._compensates and (code != self.plane or code == 190):
            raise LineFault("another plane while the cutter's radius is compensated", "g")
        self.plane = self.canon.plane = code

    def _set_units(self, code: int) -> None:
        mm = MM_PER_INCH if code == 200 else 1.0
        if mm == self.canon.mm:
            return
        factor = self.canon.mm / mm
        self.canon.mm = mm
        for lengths in (self.position, self._origin, self._axis_offset, self._tool_offset):
            lengths[:] = [value * factor for value in lengths]
        if self._compensation is not None:
            self._compensation.scale(factor)
        self._tolerances = self._tolerances[0] * factor, self._tolerances[1] * factor

    def _set_path(self, code: int, words: dict[str, float]) -> None:
        """Execute G61, G61.1, or G64 with the tolerance P of corners and Q of merging lines (P
        where Q is missing). Values below 0 count as missing."""
        self._not_while_compensating("another path mode")
        self._control = code
        if code != 640:
            self.canon.path.mode = PathMode("exact-path" if code == 610 else "exact-stop")
            return
        corner, merging = max(words.get("p", 0.0), 0.0), words.get("q", -1.0)
        self._tolerances = corner, corner if merging < 0.0 else merging
        mm = self.canon.mm
        self.canon.path.mode = PathMode("blend", *(each * mm for each in self._tolerances))

    def _set_compensation(self, code: int, words: dict[str, float]) -> None:
        if code == 400:
            if self._compensation is not None and self.compensation.switch_off(self._flat()):
                self._put(self.compensation.programmed)
                self._arc_refused = True
            self.given.compensating = False
            return
        compensation = self.compensation
        if self.plane == 190:
            raise LineFault("cutter compensation in the plane of G19", "g")
        if compensation.side:
            raise LineFault("cutter compensation on, and it is on", "g", "write G40 first")
        orientation = 0
        if code in (411, 421):
            if "d" not in words:
                raise LineFault(f"G{code / 10:g} without D", "g", "write the tool's diameter")
            radius = words["d"] / 2.0
            if "l" in words:
                if self.plane != 180:
                    raise LineFault(f"the L of G{code / 10:g} wants the plane of G18", "l")
                orientation = int(words["l"])
        else:
            tool = self._tool_for_radius(words)
            assert tool.diameter_mm is not None
            radius, orientation = tool.diameter_mm / 2.0 / self.canon.mm, tool.orientation
            if self.plane != 180 and orientation not in (0, 9):
                raise LineFault("a lathe tool wants the plane of G18", "g")
        side = 1 if code in (410, 411) else -1
        compensation.side = side if radius >= 0.0 else -side
        compensation.radius = abs(radius)
        self.given.compensating = True
        self.canon.nose = _nose(orientation, compensation.radius)

    def _tool_for_radius(self, words: dict[str, float]) -> ToolTableEntry:
        number = self._loaded
        if "d" in words:
            number = int(words["d"] + 0.5)
            if abs(number - words["d"]) >= 1e-4 or number < 0:
                raise LineFault("the D of G41 and G42 is the number of a tool", "d")
        tool = self._tool_of(number, "d")
        if tool.diameter_mm is None:
            if number == 0:
                return ToolTableEntry(diameter_mm=0.0)
            raise LineFault(
                f"cutter compensation with tool {number}, whose diameter only the tool table "
                "knows",
                "g",
                "write G41.1 or G42.1 with D, or add it: "
                f"--set dialect.tools.{number}.diameter_mm=…",
            )
        return tool

    def _once(self, code: int, words: dict[str, float], g: Mapping[str, int]) -> None:
        if code == 100:
            self._g10(words)
        elif code in (280, 300):
            self._go_home(code, words, g)
        elif code in (281, 301):
            self._not_while_compensating("G28.1 or G30.1")
            place = [a + b for a, b in zip(self._on_machine(), self._tool_offset, strict=True)]
            self._store_place(HOMES[code], place)
            self._homed.add(HOMES[code])
        elif code in (520, 920):
            self._set_offsets(code, words)
        elif code == 53:
            self._end_spline()


def _nose(orientation: int, radius: float) -> tuple[float, float]:
    """Return the controlled point of a lathe tool, X and Z relative to the centre of its nose."""
    x = -radius if orientation in (1, 2, 6) else radius if orientation in (3, 4, 8) else 0.0
    z = -radius if orientation in (2, 3, 7) else radius if orientation in (1, 4, 5) else 0.0
    return x, z
