"""Writing grbl and linuxcnc: a Toolpath to modal blocks of words.

    rows ──checked──▶ units, arcs mended ──▶ rows to send ──modal──▶ blocks, comments between them

Coordinates, feeds and motion words are said when they change; an arc always says X Y I J. The
first move in XY says both, and so does the first after homing: the real tool may then stand
anywhere. Comment lines and `%` are lines, but no blocks.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version

import msgspec
import numpy as np

from camtool.errors import PostError
from camtool.findings import Code, Finding, Severity
from camtool.machine.model import Machine
from camtool.toolpath.extents import toolpath_extents
from camtool.toolpath.moves import Kind, PathMode, Toolpath
from camtool.toolpath.program import Program

from ._gcode_arcs import ArcCounts, arcs_of
from ._gcode_checks import check, feed_units, place
from ._gcode_events import Events, EventWords, events_of
from ._gcode_format import NumberStyle, comment, first_too_long, say_column, say_number
from ._gcode_modal_rows import Sent, block_texts, sent_rows
from ._gcode_options import GcodeDialect, feed_decimals


@dataclass(frozen=True, eq=False)
class Style:
    """A dialect's own part of a program.

    `header`: its first blocks; `event`: the block of an event; `message`: what a comment for the
    operator begins with; `frame`: the line around the program that is no block (%), or "";
    `path_mode`: the block that asks for a path mode, `own_mode`: that of rows that ask for none.
    """

    dialect: GcodeDialect
    header: tuple[str, ...]
    event: EventWords
    message: str = ""
    frame: str = ""
    path_mode: Callable[[PathMode], str] | None = None
    own_mode: PathMode | None = None


def write_program(toolpath: Toolpath, machine: Machine, style: Style) -> Program:
    """The program of a toolpath; PostError names the move that cannot be said or done."""
    dialect = style.dialect
    check(toolpath, machine)
    feeds, feed_note = feed_units(toolpath, machine)
    arcs = arcs_of(toolpath, dialect)
    events = events_of(toolpath, style.event)
    sent = sent_rows(toolpath, arcs, feeds)
    texts = block_texts(sent, dialect, feed_decimals(machine))
    first_mode, changes = _path_modes(toolpath, sent, style)
    blocks, of_row = _in_order(sent, texts, events, changes)
    header = (*style.header, *first_mode)
    footer = _footer(toolpath, events, dialect)
    ended = len(toolpath) > 0 and toolpath.kind[-1] == Kind.END
    of_row = [*[-1] * len(header), *of_row, *[-1] * len(footer)]
    of_row[-1] = len(toolpath) - 1 if ended else -1
    blocks = [*header, *blocks, *footer]
    if dialect.block_numbers:
        blocks = [f"N{index} {block}" for index, block in enumerate(blocks, 1)]
    lines = [
        *_header(toolpath, machine, dialect),
        *_with_comments(toolpath, blocks, of_row, style),
    ]
    if style.frame:
        lines = [style.frame, *lines, style.frame]
    _check_length(lines, dialect)
    return Program(
        data="".join(f"{line}\n" for line in lines).encode("ascii"),
        extension=machine.target.extension,
        target=machine.target.name,
        row_of_block=np.array(of_row, dtype=np.int64),
        findings=(
            *([feed_note] if feed_note else []),
            *_arc_findings(toolpath, arcs.counts, sent.dropped),
            *_rounded(toolpath, events.rounded),
        ),
    )


def _path_modes(
    toolpath: Toolpath, sent: Sent, style: Style
) -> tuple[tuple[str, ...], dict[int, str]]:
    """The path mode to begin with, and the blocks that change it, by the place among the rows
    that are sent; none for dialects that know no such thing."""
    if style.path_mode is None or style.own_mode is None:
        return (), {}
    said = [style.path_mode(mode) for mode in (*toolpath.modes, style.own_mode)]
    moving = np.flatnonzero(sent.is_motion)
    asked = toolpath.mode[sent.row[moving]]
    if len(asked) == 0:
        return (said[-1],), {}
    turns = np.flatnonzero(np.diff(asked)) + 1
    return (said[asked[0]],), {int(moving[k]): said[asked[k]] for k in turns.tolist()}


def _in_order(
    sent: Sent, texts: list[str], events: Events, modes: dict[int, str]
) -> tuple[list[str], list[int]]:
    """Blocks of motions and events, with changes of the path mode before them, and the row of
    each."""
    blocks, rows = [], []
    motions = iter(texts)
    pairs = zip(sent.is_motion.tolist(), sent.row.tolist(), strict=True)
    for at, (is_motion, row) in enumerate(pairs):
        if at in modes:
            blocks.append(modes[at])
            rows.append(-1)
        block = next(motions) if is_motion else events.blocks.get(row, "")
        if block:
            blocks.append(block)
            rows.append(row)
    return blocks, rows


def _footer(toolpath: Toolpath, events: Events, dialect: GcodeDialect) -> list[str]:
    """Out of the material (below Z 0) to the highest Z, spindle off, end: only what is missing."""
    heights = np.append(toolpath.end[:, 2], toolpath.start[2])
    last = float(toolpath.end[-1, 2]) if len(toolpath) else 0.0
    retract = dialect.retract and last < 0.0
    style = NumberStyle(dialect.decimals, strip=dialect.strip_zeros)
    return [
        *([f"G0 Z{say_number(float(heights.max()), style)}"] if retract else []),
        *(["M5"] if events.spindle_on else []),
        dialect.program_end,
    ]


def _header(toolpath: Toolpath, machine: Machine, dialect: GcodeDialect) -> list[str]:
    """Comment lines: the tool, machine, drawing and units, and how far the program reaches."""
    if dialect.comments == "none":
        return []
    style = NumberStyle(dialect.decimals)
    bounds = [
        f"{axis} {' to '.join(say_column(reach, style))}"
        for axis, reach in zip("XYZ", toolpath_extents(toolpath), strict=True)
    ]
    made = [toolpath.made_from, f"settings {_digest(machine)}"] if toolpath.made_from else []
    lines = [
        f"camtool {version('camtool')} for {machine.target.name}: {machine.target.title}",
        *made,
        "mm and mm/min - part zero at X0 Y0 Z0",
        *bounds,
    ]
    return [comment(line) for line in lines]


def _digest(machine: Machine) -> str:
    """Eight signs that change with any value of the machine."""
    return hashlib.sha256(msgspec.json.encode(machine)).hexdigest()[:8]


def _with_comments(
    toolpath: Toolpath, blocks: list[str], of_row: list[int], style: Style
) -> list[str]:
    """The blocks with messages, and the name of each contour, on lines of their own before."""
    wanted: dict[int, list[str]] = {}
    if style.dialect.comments == "contours":
        motions = np.flatnonzero(toolpath.is_motion)
        named = toolpath.source[motions]
        begins = (np.diff(named, prepend=-1) != 0) & (named >= 0)
        for row in motions[begins].tolist():
            wanted.setdefault(row, []).append(comment(toolpath.text(row)))
    for row in np.flatnonzero(toolpath.kind == Kind.MESSAGE).tolist():
        wanted.setdefault(row, []).append(_message(toolpath, row, style))
    if not wanted:
        return blocks
    # A row that was left out hands its comments to the next block that is sent.
    waiting = sorted(wanted)
    lines: list[str] = []
    following = 0
    for index, (block, row) in enumerate(zip(blocks, of_row, strict=True)):
        last = index == len(blocks) - 1
        while following < len(waiting) and (waiting[following] <= row or last):
            lines += wanted[waiting[following]]
            following += 1
        lines.append(block)
    return lines


def _message(toolpath: Toolpath, row: int, style: Style) -> str:
    """A message to the operator as a comment."""
    index = toolpath.value[row]
    if not (0 <= index < len(toolpath.texts)):
        raise PostError("a message without its text", where=place(toolpath, row))
    text = comment(toolpath.texts[int(index)])
    return f"({style.message}{text[1:]}"


def _check_length(lines: list[str], dialect: GcodeDialect) -> None:
    """PostError for a line that the controller's buffer does not take."""
    index = first_too_long(lines, dialect.line_chars)
    if index >= 0:
        raise PostError(
            f"a line of {len(lines[index])} characters, the controller takes {dialect.line_chars}",
            where=f"line {index + 1}",
            mend="use fewer decimals, or no block numbers",
        )


def _arc_findings(toolpath: Toolpath, counts: ArcCounts, dropped: int) -> list[Finding]:
    found = []
    if mended := counts.recentred + counts.split + counts.lines:
        found.append(
            Finding(
                Code.ARC_MENDED,
                Severity.INFO,
                f"{mended} arcs would not have passed the controller's rule with their rounded "
                f"numbers: {counts.recentred} were re-centred, {counts.split} split in two, "
                f"{counts.lines} written as lines",
                where=place(toolpath, counts.first),
                measured=float(mended),
                unit="arcs",
            )
        )
    if collapsed := dropped + counts.flat:
        found.append(
            Finding(
                Code.MOVE_COLLAPSED,
                Severity.INFO,
                f"{dropped} moves of less than the last decimal were left out, "
                f"{counts.flat} arcs flatter than half of it became lines",
                measured=float(collapsed),
                unit="moves",
            )
        )
    return found


def _rounded(toolpath: Toolpath, rows: tuple[int, ...]) -> list[Finding]:
    if not rows:
        return []
    return [
        Finding(
            Code.VALUE_ROUNDED,
            Severity.INFO,
            f"{len(rows)} dwells or spindle speeds were rounded to three decimals",
            where=place(toolpath, rows[0]),
        )
    ]
