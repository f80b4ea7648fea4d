"""Writing pic-mmh: a Toolpath to the blocks that this controller decodes.

Everything that can be refused by its numbers alone is refused before the first block is made
(`numbers.py`). Then the rows are followed one by one, together with the controller's own
step position: a block is sent only when it moves that position, and every arc is planned from it
(`arcs.py`), so that it ends where the next row begins.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, NoReturn

import numpy as np

from camtool.arrays import Floats
from camtool.errors import PostError
from camtool.findings import Finding
from camtool.toolpath.lower import Lowered, arcs_to_lines, helices_to_steps, slope_step_mm
from camtool.toolpath.moves import Kind, Toolpath
from camtool.toolpath.program import Program

from .arcs import (
    LEAST_RADIUS_STEPS,
    LINE_SAGITTA,
    Arc,
    Landing,
    chord_ends,
    expected_turn_rad,
    hits,
    land,
    turned_rad,
    unwrapped_rad,
)
from .dialect import PicMmhMachine
from .findings import (
    ARC_MENDED,
    ARC_MENDED_FLAT,
    BLOCK_TOO_LONG,
    BLOCK_TOO_LONG_PERHAPS,
    MOVE_COLLAPSED,
    MOVE_SPLIT,
    VALUE_ROUNDED,
)
from .numbers import FORMATS, Grid, check_motion, event_words, far_arcs, numbers_of

WORD: Final = {Kind.RAPID: "G00", Kind.LINE: "G01", Kind.ARC_CW: "G02", Kind.ARC_CCW: "G03"}

BUFFER_CHARS: Final = 35
"""Characters of the thesis's buffer (L1740-1742), which cannot have taken its own sample block."""

XY = tuple[int, int]


def write_program(toolpath: Toolpath, machine: PicMmhMachine) -> Program:
    """The program of a toolpath; PostError names the move that cannot be written or done."""
    writer = _Writer(toolpath, machine)
    writer.run()
    return Program.of_lines(writer.blocks, machine, writer.rows, writer.findings())


def _refuse_chords(where: str) -> NoReturn:
    """PostError for an arc that passes where no coordinate can be written."""
    raise PostError(
        "an arc that has to be written as lines leaves the five digits of a coordinate",
        where=where,
        mend="keep every coordinate within ±99.999 mm",
    )


class _Writer:
    """The rows followed once; `units` and `steps` are where the controller stands (x, y, z)."""

    def __init__(self, toolpath: Toolpath, machine: PicMmhMachine) -> None:
        dialect = machine.dialect
        self.blocks: list[str] = []
        self.rows: list[int] = []
        self._machine = machine
        self._dialect = dialect
        self._format = FORMATS[dialect.form]
        self._wanted = toolpath
        self._changes = Changes()
        check_motion(toolpath, machine)
        # Refuses by the numbers of the rows that were given, before these are lowered.
        given = numbers_of(toolpath, machine, dialect)
        self._feed_finding = given.feed_finding
        lowered = self._lowered(given.grids[0])
        self._toolpath, self._row = lowered.toolpath, lowered.row.tolist()
        self._numbers = numbers_of(lowered.toolpath, machine, dialect)
        self._split = np.bincount(lowered.row, minlength=len(toolpath)) > 1
        self._units = [0, 0, 0]
        self._steps = [0, 0, 0]
        self._starts = lowered.toolpath.starts[:, :2]

    def _lowered(self, grid: Grid) -> Lowered:
        """Arcs whose centre cannot be written as lines, slopes as steps; `Changes` counts both."""
        toolpath, changes = self._wanted, self._changes
        far = far_arcs(toolpath, self._machine, self._dialect)
        changes.far = int(far.sum())
        changes.far_place = toolpath.place(int(far.argmax())) if changes.far else ""
        straight = arcs_to_lines(toolpath, far, LINE_SAGITTA * grid.resolution_mm)
        changes.split_step_mm = slope_step_mm(self._machine)
        stepped = helices_to_steps(straight.toolpath, changes.split_step_mm)
        steps = np.bincount(stepped.row, minlength=len(straight.toolpath)) > 1
        slopes = np.unique(straight.row[steps & straight.toolpath.is_feed])
        changes.split = len(slopes)
        changes.split_place = toolpath.place(int(slopes[0])) if changes.split else ""
        lowered = stepped.after(straight)
        beyond = ~grid.fits(lowered.toolpath.end[:, :2]).all(axis=1)
        if beyond.any():
            _refuse_chords(toolpath.place(int(lowered.row[beyond.argmax()])))
        return lowered

    @property
    def _grid(self) -> Grid:
        """X and Y are alike wherever arcs and their lines are concerned."""
        return self._numbers.grids[0]

    def run(self) -> None:
        """Make all blocks."""
        kinds = [Kind(kind) for kind in self._toolpath.kind.tolist()]
        # A program read back begins with the SET_ZERO of its own header.
        first = 1 if kinds[:1] == [Kind.SET_ZERO] else 0
        self._send("G54;", first - 1)
        self._send("G90;", -1)
        last = len(kinds) - 1 if kinds[-1:] == [Kind.END] else len(kinds)
        for row in range(first, last):
            kind = kinds[row]
            if kind <= Kind.ARC_CCW:
                self._motion(row, kind)
            else:
                self._event(row, kind)
        self._send("M30;", last if last < len(kinds) else -1)

    def findings(self) -> Iterator[Finding]:
        """What was changed, one finding for each kind."""
        if self._feed_finding:
            yield self._feed_finding
        yield from self._changes.findings(self._grid.step_mm * 1000.0)
        yield from too_long(self.blocks, self._dialect.buffer_chars)

    def _place(self, row: int) -> str:
        """The given row that a row of the lowered toolpath came from."""
        return self._wanted.place(self._row[row])

    def _send(self, block: str, row: int) -> None:
        self.blocks.append(block)
        self.rows.append(self._row[row] if row >= 0 else -1)

    def _motion(self, row: int, kind: Kind) -> None:
        """A block that moves XY or Z: no row moves both."""
        x, y, z = self._numbers.end_steps[row]
        if z != self._steps[2]:
            self._send_z(row, kind)
        elif kind >= Kind.ARC_CW:
            self._arc(row, kind)
        elif [x, y] != self._steps[:2]:
            self._send_xy(row, WORD[kind], self._numbers.end_units[row], (x, y))
        elif not self._split[self._row[row]]:  # parts of slopes and of far arcs may be small
            self._changes.dropped += 1

    def _send_z(self, row: int, kind: Kind) -> None:
        word = "G00" if kind == Kind.RAPID else "G01"
        self._units[2] = self._numbers.end_units[row][2]
        self._steps[2] = self._numbers.end_steps[row][2]
        self._send(f"{word}Z{self._format(self._units[2])}{self._numbers.feed_words[row]};", row)

    def _send_xy(self, row: int, word: str, units: list[int], steps: XY, centre: str = "") -> None:
        say = self._format
        feed = self._numbers.feed_words[row]
        self._units[:2] = units[:2]
        self._steps[:2] = steps
        self._send(f"{word}X{say(units[0])}Y{say(units[1])}{centre}{feed};", row)

    def _arc(self, row: int, kind: Kind) -> None:
        """An arc block that ends, and the line that is left; lines when it is too small."""
        arc = self._in_steps(row, kind)
        sweep = self._numbers.sweeps[row]
        if arc.start == arc.end and arc.sweep_rad <= math.pi:
            self._changes.dropped += 1  # as an arc it would become a full circle
            return
        landing = land(arc, self._grid) if arc.radius >= LEAST_RADIUS_STEPS else None
        units = self._end_units(row, arc, landing) if landing else None
        if landing is None or units is None:
            self._changes.arcs_as_lines += 1
            self._lines(row, self._starts[row], sweep)
            return
        i, j = self._numbers.centre_units[row]
        centre = f"I{self._format(i)}J{self._format(j)}"
        steps = (landing.at[0] + arc.centre[0], landing.at[1] + arc.centre[1])
        self._send_xy(row, WORD[kind], units, steps, centre)
        self._check_end(row, arc, landing)
        if landing.at != arc.end:
            self._mend(row, arc, landing)

    def _in_steps(self, row: int, kind: Kind) -> Arc:
        """The arc as this controller will take it from where it stands."""
        cx, cy = self._numbers.centre_steps[row]
        ex, ey, _ = self._numbers.end_steps[row]
        x, y = self._steps[0] - cx, self._steps[1] - cy
        return Arc(
            start=(x, y),
            end=(ex - cx, ey - cy),
            centre=(cx, cy),
            clockwise=kind == Kind.ARC_CW,
            sweep_rad=abs(self._numbers.sweeps[row]),
        )

    def _end_units(self, row: int, arc: Arc, landing: Landing) -> list[int] | None:
        """The units of the landing; None when a reader would take the block for another
        arc: short arcs can turn into almost full circles by the rounding of their numbers."""
        if landing.at == arc.start:
            units = self._units[:2]  # the very numbers of the start, so that it reads as full
        elif landing.at == arc.end:
            units = self._numbers.end_units[row][:2]
        else:
            steps = np.array(landing.at) + np.array(arc.centre)
            units = self._grid.nearest_units(steps).tolist()
        start, end, centre = (
            np.array(point, dtype=np.float64)
            for point in (self._units[:2], units, self._numbers.centre_units[row])
        )
        read = turned_rad(start, end, centre, arc.clockwise)
        meant = unwrapped_rad(read, expected_turn_rad(landing, arc.radius))
        return units if read == meant else None

    def _check_end(self, row: int, arc: Arc, landing: Landing) -> None:
        """The numbers just sent, taken as the controller takes them, must end the arc."""
        x, y = self._grid.steps(np.array(self._units[:2])).tolist()
        at = (x - arc.centre[0], y - arc.centre[1])
        if hits(arc, at, landing.iteration, landing.iteration) != landing.iteration:
            raise PostError(
                "internal fault: the arc as written would not end where it was planned to",
                where=self._place(row),
            )

    def _mend(self, row: int, arc: Arc, landing: Landing) -> None:
        """The rest of an arc that was left at its landing."""
        at = (np.array(landing.at) + np.array(arc.centre)) * self._grid.step_mm
        turn = turned_rad(self._starts[row], at, self._toolpath.centre[row], arc.clockwise)
        turn = unwrapped_rad(turn, expected_turn_rad(landing, arc.radius))
        left = max(0.0, arc.sweep_rad - turn)
        rest = math.dist(landing.at, arc.end) * self._grid.step_mm * 1000.0
        self._changes.mended += 1
        if rest > self._changes.remainder_um:
            self._changes.remainder_um = rest
            self._changes.remainder_place = self._place(row)
        self._lines(row, at, -left if arc.clockwise else left)

    def _lines(self, row: int, start: Floats, sweep_rad: float) -> None:
        """Lines along an arc from `start` (2,) mm to the end of the row."""
        grid = self._grid
        sagitta = LINE_SAGITTA * grid.resolution_mm
        ends = chord_ends(start, self._toolpath.centre[row], sweep_rad, sagitta)
        if not grid.fits(ends[:-1]).all():
            _refuse_chords(self._place(row))
        units = [*grid.units(ends[:-1]).tolist(), self._numbers.end_units[row][:2]]
        for point in units:
            x, y = grid.steps(np.array(point)).tolist()
            if [x, y] != self._steps[:2]:
                self._send_xy(row, "G01", point, (x, y))

    def _event(self, row: int, kind: Kind) -> None:
        """Events of the dialect; messages have no word in it and are not sent."""
        if kind == Kind.END:
            raise PostError("moves follow the end of the program", where=self._place(row))
        if kind == Kind.HOME_XY:
            self._send("G28X0Y0;", row)
            self._home((0, 1))
        elif kind == Kind.HOME_Z:
            self._send("G28Z0;", row)
            self._home((2,))
        elif kind == Kind.SET_ZERO:
            if any(self._steps):
                raise PostError(
                    "part zero can only be set at part zero",
                    where=self._place(row),
                    mend="set it first, before any move",
                )
            self._send("G54;", row)
        elif kind != Kind.MESSAGE:
            blocks, rounded = event_words(self._wanted, self._row[row])
            for block in blocks:
                self._send(block, row)
            if rounded:
                self._changes.rounded += 1
                self._changes.rounded_place = self._changes.rounded_place or self._place(row)
        if self._numbers.end_steps[row] != self._steps:
            raise PostError(
                f"a {kind.name} cannot end at another place than where the controller stands then",
                where=self._place(row),
                mend="give the row the position of the tool (machine zero after homing)",
            )

    def _home(self, axes: tuple[int, ...]) -> None:
        """The controller now stands at machine zero in these axes."""
        for axis in axes:
            grid = self._numbers.grids[axis]
            zero = np.array([self._machine.controller.machine_zero_mm[axis]])
            self._units[axis] = int(grid.units(zero)[0])
            self._steps[axis] = int(grid.steps(grid.units(zero))[0])


@dataclass
class Changes:
    """What one run of the writer changed, counted; places name the first of each kind."""

    dropped: int = 0
    """Moves of less than a step."""
    arcs_as_lines: int = 0
    split: int = 0
    split_place: str = ""
    split_step_mm: float = 0.0
    far: int = 0
    """Arcs whose centre the dialect cannot represent."""
    far_place: str = ""
    mended: int = 0
    remainder_um: float = 0.0
    remainder_place: str = ""
    rounded: int = 0
    rounded_place: str = ""

    def findings(self, step_um: float) -> Iterator[Finding]:
        """One finding for each count that is not 0."""
        if self.split:
            yield MOVE_SPLIT(where=self.split_place, measured=self.split_step_mm, count=self.split)
        if collapsed := self.dropped + self.arcs_as_lines:
            yield MOVE_COLLAPSED(measured=collapsed, dropped=self.dropped, arcs=self.arcs_as_lines)
        if self.far:
            yield ARC_MENDED_FLAT(where=self.far_place, measured=self.far)
        if self.mended:
            yield ARC_MENDED(
                where=self.remainder_place,
                measured=self.remainder_um,
                count=self.mended,
                steps=self.remainder_um / step_um,
            )
        if self.rounded:
            yield VALUE_ROUNDED(where=self.rounded_place, count=self.rounded)


def too_long(blocks: list[str], buffer_chars: int | None) -> Iterator[Finding]:
    """One BLOCK_TOO_LONG finding when blocks do not fit the controller's buffer: a remark where
    it is that of the thesis, which contradicts itself, and a warning where the user knows it."""
    lengths = [len(block) for block in blocks]
    limit = BUFFER_CHARS if buffer_chars is None else buffer_chars
    if count := sum(length > limit for length in lengths):
        longest = max(lengths)
        yield (BLOCK_TOO_LONG_PERHAPS if buffer_chars is None else BLOCK_TOO_LONG)(
            where=f"block {lengths.index(longest) + 1}", measured=longest, limit=limit, count=count
        )
