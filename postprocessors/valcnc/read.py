"""Reading valcnc as its firmware takes a block: blanks dropped, then the first X, Y, Z, I and J of
the block, wherever they stand (L1179, L1222-1226).

What the thesis does not describe (a missing word, Z along with X, a full
circle, an arc whose chord exceeds its diameter) is an error with block, line and column, unless an
option of `[dialect]` defines what happens."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final, NoReturn

import numpy as np
from msgspec import Struct

from camtool.arrays import Ints
from camtool.errors import ProgramError
from camtool.findings import Finding
from camtool.kernels import words
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath

from ..gcode.blocks import SURE_PART, Lexing, PlainBlocks, WordBlock, blocks_of, form_of
from .dialect import ValcncMachine, scales_of
from .findings import ARC_MISSES_END, COORDINATES_SCALED_READ

CODES: Final = ("00", "01", "02", "03")
PLAIN: Final = frozenset({"GXYZ", "GXYZIJ"})
"""Letters of a block as they mostly come; other orders are as good."""

MAX_UNITS: Final = 99_999.0

CHORD_GUARD: Final = 1e-9
"""Part of an arc's diameter: a chord longer by less is a diameter."""

NEARLY_DIAMETER: Final = 0.9
"""Part of an arc's diameter: for shorter chords the arcsine is as accurate as the numbers."""

SCALE_GUARD: Final = 1e-12
"""Part of a scale: X and Y whose scales differ by less have the same scale."""

Point = tuple[float, float, float]


def read_program(data: bytes, machine: ValcncMachine) -> Toolpath:
    """Return the moves of a program; ProgramError with block, line and column for data that are no
    program."""
    reader = _Reader(machine)
    reader.read(data)
    return reader.path.finish(reader.findings())


def read_block(data: bytes, machine: ValcncMachine, start: Point) -> tuple[Toolpath, Point]:
    """Return the moves of one block that begins at `start`, in the program's units, and where it
    ends. ProgramError for data that are no block."""
    reader = _Reader(machine, start)
    reader.read(data)
    return reader.path.finish(), reader.at


class _Missed(Struct):
    """Count of arcs whose end the controller's own angle misses, and the worst of them."""

    count: int = 0
    most_mm: float = 0.0
    where: str = ""


class _Reader:
    """Reads blocks and adds rows to the path, in mm."""

    def __init__(self, machine: ValcncMachine, start: Point = (0.0, 0.0, 0.0)) -> None:
        self._dialect = machine.dialect
        scale_x, scale_y, scale_z = scales_of(machine, self._dialect).tolist()
        self._scales = (scale_x, scale_y, scale_z)
        self._alike = abs(scale_x - scale_y) <= SCALE_GUARD * scale_x
        self._feed = machine.max_feed_mm_min
        self._step_mm = machine.axes.x.coded_step_mm
        self.at = start
        self._missed = _Missed()
        self.lexing = Lexing(
            letters="GXYZIJ", blanks="anywhere", line_chars=self._dialect.block_chars
        )
        self.path = ToolpathBuilder(start=self._mm(*start))
        self.blocks = 0

    def read(self, data: bytes) -> None:
        """Read all blocks into the path; ProgramError at the first line that is no block, and for
        a program without blocks."""
        for block in blocks_of(data, self.lexing, self.take):
            self.block(block)
        if not self.blocks:
            raise ProgramError(
                "the program is empty", mend="a program has blocks such as G00 X1 Y1 Z0"
            )

    def block(self, block: WordBlock) -> None:
        """Check one block and add its move to the path."""
        self.blocks += 1
        code, letters = block.words[0][1], "".join([letter for letter, _ in block.words])
        if letters not in PLAIN or code not in CODES or "\t" in block.text:
            self._check_words(block, letters)
        values = {letter: float(text) for letter, text in block.words[1:]}
        if not max(map(abs, values.values()), default=0.0) <= MAX_UNITS:
            word = next(
                word for word, value in enumerate(values.values(), 1) if abs(value) > MAX_UNITS
            )
            block.fail(f"a number beyond ±{MAX_UNITS:g}", word=word, mend="check the units")
        self.path.block = block.index
        if letters.startswith("GXYZ"):
            end = values["X"], values["Y"], values["Z"]
        else:
            end = self._end(block, values)
        if code in ("02", "03"):
            self._arc(block, code, values, end)
        else:
            self._line(block, code, values, end)
        self.at = end

    def take(self, blocks: PlainBlocks) -> int:
        """Decode the first plain blocks at once, as columns, and return how many were decoded.

        It stops at the first block for which `block` might return something else. A block is sure
        if it has all words of a line or an arc in their order and does not move Z together with X
        or Y, and if the ends of its arc are equally far from the centre, and nearer to each other
        than `NEARLY_DIAMETER`."""
        numbers, form = blocks.numbers, blocks.facts[:, words.FORM]
        line, arc = form == form_of("GXYZ"), form == form_of("GXYZIJ")
        kind = np.where(line | arc, numbers[:, words.G_WORD], 0.0).astype(np.int64)
        is_sure = (line & (kind <= Kind.LINE)) | (arc & (kind >= Kind.ARC_CW) & self._alike)
        is_sure &= blocks.facts[:, words.TWO_DIGITS] == 1
        ends, offset = (
            numbers[:, words.X_WORD : words.Z_WORD + 1],
            numbers[:, words.I_WORD :][:, :2],
        )
        is_sure &= (np.abs(ends) <= MAX_UNITS).all(axis=1)
        is_sure &= line | (np.abs(offset) <= MAX_UNITS).all(axis=1)
        start = np.concatenate([[self.at], ends[:-1]])
        travel = ends - start
        flat, has_z = (travel[:, :2] != 0.0).any(axis=1), travel[:, 2] != 0.0
        is_sure &= ~has_z | (line & (~flat | (self._dialect.z_order == "together")))
        radius, length = np.hypot(*offset.T), np.hypot(*travel[:, :2].T)
        spread = np.abs(radius - np.hypot(*(travel[:, :2] - offset).T)) / self._scales[0]
        fine = (length > 0.0) & (length <= SURE_PART * NEARLY_DIAMETER * 2.0 * radius)
        is_sure &= line | (fine & (spread <= SURE_PART * self._dialect.arc_spread_mm))
        count = len(is_sure) if is_sure.all() else int(is_sure.argmin())
        if count:
            self._send(blocks, kind, count)
        return count

    def _send(self, blocks: PlainBlocks, kind: Ints, count: int) -> None:
        """Add the moves of the first `count` blocks to the path."""
        numbers, kind = blocks.numbers[:count], kind[:count]
        end = numbers[:, words.X_WORD : words.Z_WORD + 1]
        self.at = end[-1, 0].item(), end[-1, 1].item(), end[-1, 2].item()
        end = end / self._scales + 0.0
        start = np.concatenate([[self.path.position], end[:-1]])[:, :2]
        arc = (kind >= Kind.ARC_CW)[:, None]
        offset = np.where(arc, numbers[:, words.I_WORD : words.J_WORD + 1], np.nan)
        self.blocks += count
        self.path.moves(
            kind=kind,
            end=end,
            centre=start + offset / self._scales[:2],
            feed=np.where(kind == Kind.RAPID, np.nan, self._feed),
            block=np.arange(blocks.first, blocks.first + count),
        )

    def _check_words(self, block: WordBlock, letters: str) -> None:
        """Raise ProgramError for an unknown code, a word that stands twice, and tabs."""
        first = "".join(block.words[0])
        if letters[0] != "G" or block.words[0][1] not in CODES:
            codes = " ".join(f"G{code}" for code in CODES)
            block.fail(
                f"{first} is not a code of this controller", mend=f"begin with one of {codes}"
            )
        if "\t" in block.text:
            block.fail("a tab: only spaces are dropped", mend="use spaces")
        for index, letter in enumerate(letters):
            if letter in letters[:index]:
                block.fail(
                    f"a second {letter}, which the controller ignores",
                    word=index,
                    mend="write one block a line",
                )

    def findings(self) -> Iterator[Finding]:
        """Yield a finding on the scale that was assumed, and one on arcs that the controller's
        angle does not lead to their end."""
        if not self._dialect.coord_scale_checked:
            yield COORDINATES_SCALED_READ(measured=self._dialect.coord_scale)
        if self._missed.count:
            yield ARC_MISSES_END(
                where=self._missed.where,
                measured=self._missed.most_mm,
                limit=self._step_mm,
                count=self._missed.count,
            )

    def _end(self, block: WordBlock, values: dict[str, float]) -> Point:
        """Return the end of the block's move, absolute and in units of the program (L1135)."""
        missing = [letter for letter in "XYZ" if letter not in values]
        if missing and self._dialect.missing_words == "refused":
            block.fail(
                f"no {missing[0]}: it is not known whether the axis then stays or goes to 0",
                mend="write X, Y and Z, or use --set dialect.missing_words=keep",
            )
        zero = self._dialect.missing_words == "zero"
        x, y, z = (
            values.get(letter, 0.0 if zero else old)
            for letter, old in zip("XYZ", self.at, strict=True)
        )
        return x, y, z

    def _mm(self, x: float, y: float, z: float) -> Point:
        a, b, c = self._scales
        return x / a + 0.0, y / b + 0.0, z / c + 0.0

    def _line(self, block: WordBlock, code: str, values: dict[str, float], end: Point) -> None:
        """Add a line to the path; two where the option moves Z before or after X and Y."""
        if "I" in values or "J" in values:
            word, letter = next((word, one) for word, one in enumerate(values, 1) if one in "IJ")
            block.fail(f"{letter} in a G{code}, which is no arc", word=word, mend="remove it")
        first = self._in_order(block, end)
        for point in (first, end) if first else (end,):
            x, y, z = self._mm(*point)
            if code == "00":
                self.path.rapid(x, y, z)
            else:
                self.path.line(x, y, z, feed=self._feed)

    def _in_order(self, block: WordBlock, end: Point) -> Point | None:
        """Return the corner between the part along Z and the part in XY; None if the move is one
        line."""
        old, order = self.at, self._dialect.z_order
        if end[:2] == old[:2] or end[2] == old[2] or order == "together":
            return None
        if order == "refused":
            letters = [letter for letter, _ in block.words]
            block.fail(
                "Z moves along with X or Y: it is not known which goes first",
                word=letters.index("Z") if "Z" in letters else None,
                mend="move them in two blocks, or use --set dialect.z_order=before",
            )
        return (*old[:2], end[2]) if order == "before" else (*end[:2], old[2])

    def _arc(self, block: WordBlock, code: str, values: dict[str, float], end: Point) -> None:
        """Add an arc to the path; Z moves by itself before or after it where the option says
        so."""
        if "I" not in values or "J" not in values:
            missing = "J" if "I" in values else "I"
            block.fail(f"an arc without {missing}", mend="give I and J from the start")
        if not self._alike:
            block.fail(
                "on axes of unequal steps this arc is an ellipse",
                mend="set axes.x.coded_step_mm and axes.y.coded_step_mm to one value",
            )
        i, j = values["I"], values["J"]
        self._check_arc(block, (i, j), end)
        x, y, z = self._mm(*end)
        old_x, old_y, _ = self.path.position
        centre = old_x + i / self._scales[0], old_y + j / self._scales[1]
        order = self._dialect.z_order
        if end[2] != self.at[2]:
            if order in ("refused", "together"):
                block.fail("Z moves along with an arc", mend="move Z in a block of its own")
            if order == "before":
                self.path.line(old_x, old_y, z, feed=self._feed)
        self.path.arc(x, y, centre=centre, ccw=code == "03", feed=self._feed)
        if end[2] != self.at[2] and order == "after":
            self.path.line(x, y, z, feed=self._feed)

    def _check_arc(self, block: WordBlock, offset: tuple[float, float], end: Point) -> None:
        """Raise ProgramError where the firmware's formulas (L1284-1326) have no value, or not
        nearly the right one; note arcs that its angle does not lead to their end."""
        i, j = offset
        radius = math.hypot(i, j)
        chord = end[0] - self.at[0], end[1] - self.at[1]
        other = math.hypot(chord[0] - i, chord[1] - j)
        if radius == 0.0:
            _fail_at_i(block, "an arc about its own start", "give I and J from the start")
        spread, max_spread = abs(radius - other) / self._scales[0], self._dialect.arc_spread_mm
        if spread > max_spread:
            message = f"the radii at the arc's start and end differ by {spread:.4g} mm"
            _fail_at_i(block, message, f"they may differ by {max_spread:g} mm")
        length = math.hypot(*chord)
        if length == 0.0:
            if self._dialect.full_circles == "refused":
                block.fail(
                    "an arc that ends where it starts: its angle is 0 by one formula, 360° by the "
                    "other",
                    mend="write it in parts, or use --set dialect.full_circles=whole",
                )
            return
        ratio = length / (2.0 * radius)
        if ratio > 1.0 + CHORD_GUARD:
            message = (
                "the arc's chord is longer than its diameter: the controller's arcsine has no "
            )
            _fail_at_i(block, f"{message}value", "write it in parts of 90°")
        if ratio > NEARLY_DIAMETER:
            self._note_miss(block, offset, chord)

    def _note_miss(
        self, block: WordBlock, offset: tuple[float, float], chord: tuple[float, float]
    ) -> None:
        """Compare the firmware's angle of an arc, 2·arcsin(C/2R) or 2π less it, with the angle
        between its two radii, and record the worst miss."""
        start_arm = -offset[0], -offset[1]
        end_arm = chord[0] - offset[0], chord[1] - offset[1]
        cross, dot = (
            start_arm[0] * end_arm[1] - start_arm[1] * end_arm[0],
            start_arm[0] * end_arm[0] + start_arm[1] * end_arm[1],
        )
        angle = abs(math.atan2(cross, dot))
        radius = math.hypot(*offset)
        computed_angle = 2.0 * math.asin(min(1.0, math.hypot(*chord) / (2.0 * radius)))
        miss_mm = abs(computed_angle - angle) * radius / self._scales[0]
        if miss_mm > self._step_mm:
            self._missed.count += 1
            if miss_mm > self._missed.most_mm:
                self._missed.most_mm = miss_mm
                self._missed.where = f"block {block.index + 1}"


def _fail_at_i(block: WordBlock, message: str, mend: str) -> NoReturn:
    """Raise ProgramError at the I word of an arc."""
    word = next(index for index, (letter, _) in enumerate(block.words) if letter == "I")
    block.fail(message, word=word, mend=mend)
