"""The state of the interpreter: the modes in force, the position, the tools, and what was noted.

Numbers are in the units of the program, as LinuxCNC has them; `Canon` makes rows in mm of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Final

from msgspec import Struct, field

from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind

from ..gcode.faults import LineFault
from ..gcode.part_moves import PLANES
from .canon import Canon
from .dialect import LinuxcncDialect, LinuxcncMachine, ToolTableEntry
from .flow import Call
from .lines import LinuxcncBlock
from .parameters import Parameters

if TYPE_CHECKING:
    from .compensation import Compensation

MM_PER_INCH: Final = 25.4


class Mounted(Struct, frozen=True):
    """Tool state from a `row` of the path and a `block` on: the tool in the spindle, the length in
    force, and the tool's own length in the tool table (None: not known), mm. `measured`: true if
    the last code about lengths was about this tool."""

    row: int
    block: int
    tool: int
    length_mm: float
    own_mm: float | None
    measured: bool


class InterpreterNotes(Struct):
    """Blocks (index from 0) at which something was ignored or assumed."""

    coolant: list[int] = field(default_factory=list)
    pauses: list[int] = field(default_factory=list)
    outputs: list[int] = field(default_factory=list)
    inputs: list[int] = field(default_factory=list)
    speedless: list[int] = field(default_factory=list)
    tapping: list[int] = field(default_factory=list)
    swapped: list[int] = field(default_factory=list)
    begins_again: bool = False
    axes: dict[str, int] = field(default_factory=dict)
    frames: dict[str, int] = field(default_factory=dict)
    homes: dict[str, int] = field(default_factory=dict)
    mounted: list[Mounted] = field(default_factory=list)
    feeds: Callable[[int, float], None] = lambda block, feed: None


class Series(Struct):
    """Values that canned cycles keep from block to block: the height at which the first of them
    began (None: no cycle has begun), and the words R, P, Q, I, J, K and the depth."""

    height: float | None = None
    words: dict[str, float] = field(default_factory=dict)


class InterpreterState:
    """The modes, the position, and the moves and events that follow from them."""

    given: Parameters

    def __init__(
        self, machine: LinuxcncMachine, path: ToolpathBuilder, notes: InterpreterNotes
    ) -> None:
        dialect: LinuxcncDialect = machine.dialect
        self.notes = notes
        self.block_index = 0
        self.ended = False
        self.effort = 0
        """Lines that the block counts as beyond one, where it takes as long."""
        self.most_lines = dialect.most_lines
        self.motion: int | None = None
        """The motion in force, tenfold; None: none yet."""
        self.position = [0.0, 0.0, 0.0]
        """X, Y, Z of the controlled point."""
        self.others = dict.fromkeys("abc", 0.0)
        self.plane = 170
        self.absolute = True
        self.absolute_centres = False
        self.feed_mm = 0.0
        """The F word in force, mm a minute (G95: a turn)."""
        self.feed_mode = 940
        self.to_r = True
        self.diameters = False
        self.spindle: Kind | None = None
        self.speed = 0.0
        is_lathe = machine.spindle.turns == "work"
        self.canon = Canon(path, dialect.arc_full_turn_rad, is_lathe=is_lathe)
        self.calls: list[Call] = [Call()]
        """The calls that are under way, the program itself first: flow's own."""
        self.read_sub: Callable[[int], Iterator[LinuxcncBlock]] = lambda number: iter(())
        """Yields the blocks of a sub, which are not carried out."""
        self._dialect = dialect
        self._machine = machine
        self._cools = bool(machine.coolant.kinds)
        self._user_mm = MM_PER_INCH if dialect.linear_units == "in" else 1.0
        """Length of the unit of parameters, mm."""
        self._said_speed = False
        self._tools = {int(number): tool for number, tool in dialect.tools.items()}
        self._tool: int | None = None
        self._loaded = 0
        self._changed = False
        self._tool_offset = [0.0, 0.0, 0.0]
        self._frame = 1
        self._origin = [0.0, 0.0, 0.0]
        self._rotation = 0.0
        self._axis_offset = [0.0, 0.0, 0.0]
        self._arc_refused = False
        self._tolerances = (0.0, 0.0)
        self._control = 640
        self._mist = self._flood = False
        self._spindle_mode = 970
        self._spline: list[tuple[float, float, float]] = []
        self._order = 3
        self._leaving = (0.0, 0.0)
        self.series: Series | None = None
        self._compensation: Compensation | None = None
        self._first_frame: int | None = None
        self._placed: set[int] = set()
        """Frames whose place on the machine is known."""
        self._set_here: set[int] = set()
        """Frames that the program has placed from where it stood."""
        self._homed: set[int] = set()
        self._waited = 0
        """So many moves are surely done."""

    # Parts that only some programs need

    @property
    def compensation(self) -> Compensation:
        """Cutter compensation."""
        if self._compensation is None:
            from .compensation import Compensation

            self._compensation = Compensation(self.canon)
        return self._compensation

    @property
    def _compensates(self) -> bool:
        return self._compensation is not None and self._compensation.side != 0

    @property
    def reads_columns(self) -> bool:
        """True if blocks of plain moves may now be read by columns."""
        return (
            self.motion in (None, 0, 10, 20, 30, 800)
            and self.plane == 170
            and self.absolute
            and not self.absolute_centres
            and self.feed_mode == 940
            and not self.diameters
            and not self._compensates
            and not self._arc_refused
            and self.canon.is_part_frame
        )

    def continue_from(
        self, motion: int | None, feed: float, position: tuple[float, float, float], *, moves: bool
    ) -> None:
        """Adopt motion, feed (mm/min) and position (mm) after plain blocks that were read by
        columns."""
        mm = self.canon.mm
        self.motion = self.motion if motion is None else motion
        self.feed_mm = feed
        x, y, z = position
        self.position[:] = x / mm, y / mm, z / mm
        if moves:
            self.canon.moved = True
            if self._first_frame is None:
                self._first_frame = self._frame
        if self.series is not None:
            self.series.height = None

    def end_of_file(self) -> None:
        """Drop the move that still waits for its end: at the % that ends a program LinuxCNC never
        makes it."""
        self.canon.queue.clear()

    def turn(self, kind: Kind) -> None:
        """Set the spindle's direction, or stop it."""
        if kind == Kind.SPINDLE_OFF:
            self.spindle = None
            self.canon.event(kind)
            return
        if not self._said_speed:
            self.notes.speedless.append(self.block_index)
        self.spindle = kind
        self.canon.event(kind, self.speed if self._said_speed else None)

    def dwell(self, seconds: float) -> None:
        """Add a dwell."""
        self.canon.event(Kind.DWELL, seconds)

    def come_to_rest(self) -> None:
        """Add a stop where a move is under way, so that the change that follows takes effect after
        it."""
        if self.canon.moves > self._waited:
            self.dwell(0.0)
        self._waited = self.canon.moves

    def _tool_of(self, number: int, letter: str) -> ToolTableEntry:
        """Return a tool of the table; without a table, any tool, about which nothing is known."""
        if number == 0:
            return ToolTableEntry()
        tool = self._tools.get(number)
        if tool is None:
            if self._dialect.tools:
                mend = f"add it: [dialect.tools.{number}]"
                raise LineFault(f"tool {number} is not in the tool table", letter, mend)
            return ToolTableEntry()
        return tool

    def _load(self, number: int) -> None:
        self._loaded, self._changed = number, True
        tool = self._tool_of(number, "t")
        values = [float(number), *tool.offset_mm, *(0.0,) * 6, tool.diameter_mm or 0.0]
        lengths = [values[0], *(value / self._user_mm for value in values[1:])]
        for index, value in enumerate(lengths, 5400):
            self.given.set_numbered(index, value)
        self._note_length(measured=False)

    def _note_length(self, *, measured: bool) -> None:
        tool = self._tools.get(self._loaded)
        length = self._tool_offset[2] * self.canon.mm
        own_length = None if tool is None else tool.length_mm
        row = len(self.canon.path)
        self.notes.mounted.append(
            Mounted(row, self.block_index, self._loaded, length, own_length, measured)
        )

    def _not_while_compensating(self, action: str) -> None:
        if self._compensates:
            raise LineFault(f"{action} while the cutter's radius is compensated")

    def go(self, kind: Kind, axes: tuple[int, int, int], place: list[float]) -> None:
        """Add a straight move to a place given in the axis order of a plane."""
        target = [0.0, 0.0, 0.0]
        for axis, value in zip(axes, place, strict=True):
            target[axis] = value
        (self.canon.rapid if kind == Kind.RAPID else self.canon.line)(*target)

    def _begin(self) -> list[float]:
        """Return the programmed position from which the next move begins; with compensation, the
        cutter itself is beside it."""
        compensation = self._compensation
        if compensation is not None and compensation.active and not compensation.first:
            target = [0.0, 0.0, 0.0]
            for axis, value in zip(PLANES[self.plane], compensation.programmed, strict=True):
                target[axis] = value
            return target
        return list(self.position)

    def _flat(self, place: list[float] | None = None) -> list[float]:
        """Return a place, or the position, in the axis order of the plane."""
        source = self.position if place is None else place
        return [source[axis] for axis in PLANES[self.plane]]

    def _put(self, flat: list[float]) -> None:
        for axis, value in zip(PLANES[self.plane], flat, strict=True):
            self.position[axis] = value
