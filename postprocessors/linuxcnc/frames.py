"""Work frames, offsets and lengths of tools: G10, G52, G53, G54 to G59.3, G92, G28, G43.

    machine = R(p + axis offset) + origin + tool offset

with p in the program, the axis offset of G92 and G52, the origin and the turn R of a work frame.
Frames and homes are stored in parameters, in the units of the machine."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Final

from camtool.toolpath.builder import ToolpathBuilder

from ..gcode.faults import LineFault
from ..gcode.part_moves import ProgramFrame, rotate
from .dialect import LinuxcncMachine, ToolTableEntry
from .lines import AXES
from .parameters import Parameters
from .state import InterpreterNotes, InterpreterState

FRAMES: Final = {**{540 + 10 * k: k + 1 for k in range(6)}, **{591 + k: k + 7 for k in range(3)}}
"""G54 to G59.3, tenfold, by number: the parameters of frame n begin at 5201 + 20 n."""

HOMES: Final = {280: 5161, 281: 5161, 300: 5181, 301: 5181}
"""The parameters of G28 and G30, and of G28.1 and G30.1, begin here."""

OFFSETS: Final = 5211
"""The parameters of G92 begin here, behind the one that says whether it is in force."""


class FrameCodes(InterpreterState, ABC):
    """Interpreter state with the codes that move its frame."""

    def __init__(
        self, machine: LinuxcncMachine, path: ToolpathBuilder, notes: InterpreterNotes
    ) -> None:
        super().__init__(machine, path, notes)
        self.given = Parameters(
            self._known_parameters(),
            self._names,
            lambda: [*self.position, *self.others.values(), 0.0, 0.0, 0.0],
        )
        self._use_frame(1)

    @abstractmethod
    def _names(self) -> dict[str, Callable[[], float]]:
        """Return the names by which expressions ask for the state."""

    def _known_parameters(self) -> dict[int, float]:
        """Return the parameters that the machine has stored, in its units: frames, homes,
        offsets."""
        zero = [-each for each in self._machine.controller.machine_zero_mm]
        stored: dict[int, float] = {5210: 0.0, 5220: 1.0}
        if any(zero):
            self._placed.add(1)
        offsets = {str(name): place for name, place in self._dialect.work_offsets_mm.items()}
        homes = {str(name): place for name, place in self._dialect.homes_mm.items()}
        starts = {f"G{code / 10:g}": 5201 + 20 * number for code, number in FRAMES.items()}
        for name, first in starts.items():
            place = list(offsets.get(name, ()))
            if place:
                self._placed.add((first - 5201) // 20)
            values = [*(place[:3] or zero), *(0.0,) * 6, place[3] if len(place) > 3 else 0.0]
            stored |= {first + k: value / self._user_mm for k, value in enumerate(values[:9])}
            stored[first + 9] = values[9]
        for name, first in (("G28", 5161), ("G30", 5181)):
            place = list(homes.get(name, ()))
            if place:
                self._homed.add(first)
            stored |= {
                first + k: value / self._user_mm
                for k, value in enumerate([*(place or (0.0,) * 3), *(0.0,) * 6])
            }
        stored |= dict.fromkeys(range(OFFSETS, OFFSETS + 9), 0.0)
        return stored | dict.fromkeys(range(5400, 5414), 0.0)

    def _stored_place(self, first: int) -> list[float]:
        """Return three lengths that are stored as parameters from `first` on, in units of the
        program."""
        factor = self._user_mm / self.canon.mm
        return [self.given.stored_value(first + k) * factor for k in range(3)]

    def _store_place(self, first: int, place: list[float]) -> None:
        factor = self.canon.mm / self._user_mm
        for k, value in enumerate(place):
            self.given.set_numbered(first + k, value * factor)

    def _use_frame(self, number: int) -> None:
        self._frame = number
        self.given.set_numbered(5220, float(number))
        self._origin = self._stored_place(5201 + 20 * number)
        self._rotation = self.given.stored_value(5210 + 20 * number)
        self._replace()

    def _replace(self) -> None:
        """Come to rest, and set the canon's frame to the one now in force."""
        self.come_to_rest()
        mm = self.canon.mm
        x, y, z = (each * mm for each in self._origin)
        dx, dy, dz = (each * mm for each in self._axis_offset)
        self.canon.set_frame(ProgramFrame((x, y, z), self._rotation, (dx, dy, dz)))

    def _on_machine(self) -> list[float]:
        """Return the position of the tool tip in machine coordinates; the tool's length does not
        count."""
        x, y, z = (a + b for a, b in zip(self.position, self._axis_offset, strict=True))
        x, y = rotate(x, y, self._rotation)
        return [a + b for a, b in zip((x, y, z), self._origin, strict=True)]

    def _in_frame(self, place: list[float]) -> list[float]:
        """Return a place on the machine in coordinates of the program."""
        x, y, z = (a - b for a, b in zip(place, self._origin, strict=True))
        x, y = rotate(x, y, -self._rotation)
        return [a - b for a, b in zip((x, y, z), self._axis_offset, strict=True)]

    def _choose_frame(self, number: int) -> None:
        self._not_while_compensating("another work frame")
        if number == self._frame:
            return
        machine_place = self._on_machine()
        self._use_frame(number)
        self.position[:] = self._in_frame(machine_place)
        is_known = {self._first_frame, number} <= self._placed or number in self._set_here
        if self._first_frame not in (None, number) and not is_known:
            self.notes.frames.setdefault(self._frame_name, self.block_index)

    @property
    def _frame_name(self) -> str:
        code = next(code for code, number in FRAMES.items() if number == self._frame)
        return f"G{code / 10:g}"

    def _set_offsets(self, code: int, words: dict[str, float]) -> None:
        """Execute G92, which gives the present position these coordinates, or G52, which moves
        zero by these lengths."""
        self._not_while_compensating("another offset")
        self.given.set_numbered(5210, 1.0)
        for k, axis in enumerate("xyz"):
            if axis not in words:
                continue
            place = self.position[k] + self._axis_offset[k]
            if code == 920:
                self.position[k], self._axis_offset[k] = words[axis], place - words[axis]
            else:
                self.position[k], self._axis_offset[k] = place - words[axis], words[axis]
        for axis in "abc":
            if axis in words:
                self.notes.axes.setdefault(axis.upper(), self.block_index)
                self.others[axis] = words[axis] if code == 920 else self.others[axis]
        self._store_place(OFFSETS, self._axis_offset)
        self._replace()

    def _end_offsets(self, code: int) -> None:
        """Execute G92.1 and G92.2, which remove the offsets, or G92.3, which restores the stored
        ones."""
        self._not_while_compensating("another offset")
        place = [a + b for a, b in zip(self.position, self._axis_offset, strict=True)]
        if code == 923:
            self.given.set_numbered(5210, 1.0)
            self._axis_offset = self._stored_place(OFFSETS)
        else:
            self.given.set_numbered(5210, 0.0)
            self._axis_offset = [0.0, 0.0, 0.0]
            if code == 921:
                self._store_place(OFFSETS, self._axis_offset)
        self.position[:] = [a - b for a, b in zip(place, self._axis_offset, strict=True)]
        self._replace()

    def _g10(self, words: dict[str, float]) -> None:
        kind = int(words["l"])
        if kind in (2, 20):
            self._g10_frame(kind, words)
        elif kind:
            self._g10_tool(kind, words)
        elif self._loaded:
            raise LineFault("G10 L0 while a tool is loaded", "g")

    def _g10_frame(self, kind: int, words: dict[str, float]) -> None:
        """Execute G10: L2 sets the zero of a frame, L20 sets it so that the tool has these
        coordinates."""
        if "i" in words or "j" in words:
            raise LineFault("I and J beside G10 L2", "i" if "i" in words else "j")
        number = int(words.get("p", -1.0) + 1e-4) or self._frame
        if self._compensates and number == self._frame:
            raise LineFault("another work frame while the cutter's radius is compensated", "g")
        first = 5201 + 20 * number
        machine_place, origin = self._on_machine(), self._stored_place(first)
        rotation = self.given.stored_value(first + 9)
        if kind == 20:
            if "r" in words:
                raise LineFault("R beside G10 L20", "r")
            self._place_here(number, words, machine_place, origin, rotation)
        else:
            rotation = words.get("r", rotation)
            self.given.set_numbered(first + 9, rotation)
            for k, axis in enumerate("xyz"):
                if axis in words:
                    origin[k] = words[axis]
            self._store_place(first, origin)
            if {"x", "y", "z"} <= set(words):
                self._placed.add(number)
        for axis in "abc":
            if axis in words:
                self.notes.axes.setdefault(axis.upper(), self.block_index)
        if number == self._frame:
            # As in LinuxCNC, the position is rotated here without its G92 offset.
            x, y = rotate(self.position[0], self.position[1], self._rotation)
            self.position[:] = [
                x + self._origin[0],
                y + self._origin[1],
                self.position[2] + self._origin[2],
            ]
            self._use_frame(number)
            x, y, z = (a - b for a, b in zip(self.position, self._origin, strict=True))
            x, y = rotate(x, y, -self._rotation)
            self.position[:] = x, y, z

    def _place_here(
        self,
        number: int,
        words: dict[str, float],
        machine_place: list[float],
        origin: list[float],
        rotation: float,
    ) -> None:
        x, y, z = (a - b for a, b in zip(machine_place, origin, strict=True))
        x, y = rotate(x, y, -rotation)
        if self.given.stored_value(5210):
            dx, dy, dz = self._stored_place(OFFSETS)
            x, y, z = x - dx, y - dy, z - dz
        old = rotate(x, y, rotation)
        new = rotate(words.get("x", x), words.get("y", y), rotation)
        place = [
            old[0] + origin[0] - new[0],
            old[1] + origin[1] - new[1],
            z + origin[2] - words.get("z", z),
        ]
        self._store_place(5201 + 20 * number, place)
        if number == self._frame:
            self.position[:2] = rotate(self.position[0], self.position[1], self._rotation)
            self._rotation = 0.0
        if {"x", "y", "z"} <= set(words):
            self._set_here.add(number)

    def _g10_tool(self, kind: int, words: dict[str, float]) -> None:
        """Execute G10: L1 sets the offsets of a tool, L10 and L11 set them so that its tip has
        these coordinates."""
        number = int(words["p"] + 0.5)
        tool = self._tool_of(number, "p")
        if not any(letter in words for letter in (*AXES, "r", "q", "i", "j")):
            raise LineFault(f"G10 L{kind} without what it sets", "g")
        mm = self.canon.mm
        offset = [each / mm for each in tool.offset_mm]
        if kind == 1:
            offset = [words.get(axis, old) for axis, old in zip("xyz", offset, strict=True)]
        else:
            offset = self._touch_off(kind, words, offset)
        orientation = tool.orientation
        if words.get("q", -1.0) != -1.0:
            orientation = int(words["q"] + 0.5)
            if abs(orientation - words["q"]) >= 1e-4 or orientation > 9:
                raise LineFault("the Q of G10 is the orientation of a tool, 0 to 9", "q")
        diameter = 2.0 * words["r"] * mm if "r" in words else tool.diameter_mm
        x, y, z = (each * mm for each in offset)
        self._tools[number] = ToolTableEntry(
            x_mm=x, y_mm=y, length_mm=z, diameter_mm=diameter, orientation=orientation
        )
        if number == self._loaded:
            self._load(number)

    def _touch_off(self, kind: int, words: dict[str, float], offset: list[float]) -> list[float]:
        """Return the offsets of a tool whose tip has these coordinates here, in the frame in force
        or (L11) in that of G59.3."""
        number = 9 if kind == 11 else self._frame
        first = 5201 + 20 * number
        rotation = self.given.stored_value(first + 9)
        tip_place = [a + b for a, b in zip(self._on_machine(), self._tool_offset, strict=True)]
        x, y, z = (a - b for a, b in zip(tip_place, self._stored_place(first), strict=True))
        x, y = rotate(x, y, -rotation)
        if self.given.stored_value(5210) and kind != 11:
            dx, dy, dz = self._stored_place(OFFSETS)
            x, y, z = x - dx, y - dy, z - dz
        ox, oy = rotate(offset[0], offset[1], -rotation)
        if "x" in words:
            ox = x - words["x"]
        if "y" in words:
            oy = y - words["y"]
        ox, oy = rotate(ox, oy, rotation)
        return [ox, oy, z - words["z"] if "z" in words else offset[2]]

    def _set_length(self, code: int, words: dict[str, float]) -> None:
        """Execute G43, G43.1, G43.2 or G49: set the offset of the tool tip, and the tip's
        coordinates by it."""
        self._not_while_compensating("another tool length")
        self.come_to_rest()
        new = [0.0, 0.0, 0.0]
        mm = self.canon.mm
        if code == 430:
            number = int(words["h"]) if "h" in words else self._loaded
            new = [each / mm for each in self._tool_of(number, "h").offset_mm]
        elif code == 431:
            new = [
                words.get(axis, old) for axis, old in zip("xyz", self._tool_offset, strict=True)
            ]
        elif code == 432:
            new = self._added_length(words)
        dx, dy, dz = (old - each for old, each in zip(self._tool_offset, new, strict=True))
        dx, dy = rotate(dx, dy, -self._rotation)
        self._shift_position(dx, dy, dz)
        self._tool_offset = new
        other = "h" in words and int(words["h"]) != self._loaded
        self._note_length(measured=code != 490 and not other)

    def _added_length(self, words: dict[str, float]) -> list[float]:
        axes = any(axis in words for axis in AXES)
        if ("h" in words) == axes:
            raise LineFault("G43.2 wants either H or axes", "g")
        added = [words.get(axis, 0.0) for axis in "xyz"]
        if "h" in words:
            tool = self._tool_of(int(words["h"]), "h")
            added = [each / self.canon.mm for each in tool.offset_mm]
        return [old + each for old, each in zip(self._tool_offset, added, strict=True)]

    def _shift_position(self, dx: float, dy: float, dz: float) -> None:
        x, y, z = self.position
        self.position[:] = x + dx, y + dy, z + dz
