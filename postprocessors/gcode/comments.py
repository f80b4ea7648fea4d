"""The comments of grbl and linuxcnc programs: header, operations, tools to mount, contours,
messages.

Every line is made by `comment`, so that no name from a drawing or a job can end a comment or be
obeyed in one. Lines of several parts are broken between these where they would become too long."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np

from camtool.arrays import Floats, Ints
from camtool.errors import PostError
from camtool.machine.model import Machine
from camtool.toolpath.moves import Kind, Toolpath, toolpath_extents
from camtool.toolpath.touching import untouched_place
from camtool.toolpath.wanted import TOOL_SHAPES, OperationNote, Operations, ToolNote
from camtool.version import __version__

from .dialect import UNITS, GcodeDialect, Unit
from .format import COMMENT_CHARS, NumberStyle, comment, format_column

MAKER = "camtool "
"""First word of the heading of a program."""

HEADING_LINES = 20
"""Most lines in which the heading is looked for: a machine's own start may stand before it."""

Lines = Callable[[int], str]
"""The text of the k-th line."""


def header(
    toolpath: Toolpath, machine: Machine, dialect: GcodeDialect, axes: Sequence[str] = "XYZ"
) -> list[str]:
    """Return the comments at the head of a program: its maker, machine, drawing, set-up, units and
    extents. Toolpath and dialect are in the program's own units; `axes` are the letters of X, Y
    and Z."""
    if dialect.comments == "none":
        return []
    style, unit = NumberStyle(dialect.decimals), UNITS[dialect.units].name
    bounds = [
        f"{axis} {' to '.join(format_column(reach, style))}"
        for axis, reach in zip(axes, toolpath_extents(toolpath), strict=True)
        if axis
    ]
    zero = " ".join(f"{axis}0" for axis in sorted(axes) if axis)
    origin = [toolpath.made_from, f"settings {machine.short_digest}"] if toolpath.made_from else []
    lines = [
        f"{MAKER}{__version__} for {machine.target.name}: {machine.target.title}",
        *origin,
        *pack(toolpath.setup),
        f"{unit} and {unit}/min - part zero at {zero}",
        *bounds,
    ]
    return [comment(line) for line in lines]


def lacks_heading(data: bytes) -> bool:
    """Return True if a program does not begin with the heading that `header` writes."""
    heading = f"({MAKER}".encode()
    return not any(line.startswith(heading) for line in data[:4096].splitlines()[:HEADING_LINES])


def comments(
    toolpath: Toolpath,
    of_row: Ints,
    dialect: GcodeDialect,
    message: str,
    mounted: Mapping[int, Sequence[str]],
    seconds: Floats | None = None,
) -> tuple[Ints, Lines]:
    """Return all comments but the header: the index (from 0) of the block that each stands before
    (C,), ascending, and a function that gives the text of the k-th.

    `of_row` (B,): the toolpath row of each block; `message`: the text that a comment for the
    operator begins with; `mounted`: what the operator is told at the rows where a tool is changed
    by hand; `seconds` (N,): how long the controller takes for each row, where that is known."""
    no_rows = np.empty(0, dtype=np.int64)
    begins, tells = no_rows, np.flatnonzero(toolpath.kind == Kind.MESSAGE)
    if dialect.comments == "contours":
        motions = np.flatnonzero(toolpath.is_motion)
        named = toolpath.source[motions]
        begins = motions[(np.diff(named, prepend=-1) != 0) & (named >= 0)]
    own_comments: list[tuple[int, str]] = []
    if dialect.comments in ("contours", "operations") and toolpath.operations is not None:
        unit = UNITS[dialect.units]
        own_comments += _of_operations(toolpath, toolpath.operations, unit, seconds)
    own_comments += [
        (row, f"({message}{comment(line)[1:]}") for row, lines in mounted.items() for line in lines
    ]
    own_comments.sort(key=lambda one: one[0])
    rows = np.concatenate(
        [np.array([row for row, _ in own_comments], dtype=np.int64), begins, tells]
    )
    order = np.argsort(rows, kind="stable")
    # The comments of a row that was left out stand before the next block that is sent.
    blocks = np.searchsorted(np.maximum.accumulate(of_row), rows[order])

    def text(k: int) -> str:
        entry = int(order[k])
        if entry < len(own_comments):
            return own_comments[entry][1]
        row = int(rows[entry])
        if toolpath.kind[row] == Kind.MESSAGE:
            return _message(toolpath, row, message)
        return comment(toolpath.text(row))

    return np.minimum(blocks, len(of_row) - 1), text


def _message(toolpath: Toolpath, row: int, message: str) -> str:
    """Return a message to the operator as a comment."""
    index = toolpath.value[row]
    if not (0 <= index < len(toolpath.texts)):
        raise PostError("a message without its text", where=toolpath.place(row))
    return f"({message}{comment(toolpath.texts[int(index)])[1:]}"


def _of_operations(
    toolpath: Toolpath, operations: Operations, unit: Unit, seconds: Floats | None
) -> Iterator[tuple[int, str]]:
    """Yield (row, comment) for each operation: what it does, at the row where it begins. `seconds`
    (N,): how long the controller takes for each row; None: only the cuts are timed, at their
    feeds."""
    template = "takes {}"
    if seconds is None:
        seconds, template = _feed_seconds(toolpath) * unit.mm, "cuts {} at these feeds"
    count, ends = len(operations.notes), [*operations.begin[1:].tolist(), len(toolpath)]
    begins = operations.begin.tolist()
    total_s = np.concatenate([[0.0], np.cumsum(seconds)])
    for number, (note, low, high) in enumerate(
        zip(operations.notes, begins, ends, strict=True), 1
    ):
        if low == high:
            continue
        title = f"operation {number} of {count}" if count > 1 else "operation"
        speed = [] if note.spindle_rpm is None else [f"{note.spindle_rpm:g} rev/min"]
        # Rows before the first operation are its own, as in the report.
        taken_s = total_s[high] - total_s[0 if number == 1 else low]
        for line in (
            f"{title}: {note.name or note.kind}",
            *pack([tool_words(note.tool, unit), *speed]),
            *pack([*_depth_words(note, unit), template.format(duration(float(taken_s)))]),
        ):
            yield low, comment(line)


def _depth_words(note: OperationNote, unit: Unit) -> Iterator[str]:
    if note.pitch_mm is not None:
        yield f"pitch {_length(note.pitch_mm, unit)}"
        return
    depth_text = f"{_length(note.depth_mm, unit)} deep"
    if note.passes is not None and note.passes > 1:
        depth_text += f" in {note.passes} passes"
    if note.depth_mm == 0.0:
        yield f"feed {note.feed_mm_min / unit.mm:.5g} {unit.name}/min"
        return
    yield depth_text if note.peck_mm is None else f"{depth_text} by {_length(note.peck_mm, unit)}"
    feed = "" if note.drills else f"feed {note.feed_mm_min / unit.mm:.5g} "
    yield f"{feed}plunge {note.plunge_mm_min / unit.mm:.5g} {unit.name}/min"


def _length(length_mm: float, unit: Unit) -> str:
    return f"{length_mm / unit.mm:.4g} {unit.name}"


def tool_words(tool: ToolNote, unit: Unit) -> str:
    """Return the tool's number, name, shape and diameter as text, as far as they are known."""
    number = "" if tool.number is None else f" {tool.number}"
    shape = TOOL_SHAPES.get(tool.kind, tool.kind)
    name = "" if tool.name.casefold() in shape.casefold() else f" {tool.name}:"
    size = f"{shape} {_length(tool.diameter_mm, unit)}" if tool.diameter_mm else "of no width"
    tip = "" if tool.tip_angle_rad is None else f" {math.degrees(tool.tip_angle_rad):.4g} deg"
    return f"tool{number}{name} {size}{tip}" if number or name else f"tool: {size}{tip}"


def mounting_messages(toolpath: Toolpath, row: int, unit: Unit) -> list[str]:
    """Return the messages to the operator at a tool change by hand; lengths of the toolpath are in
    `unit`."""
    tool = ToolNote(int(toolpath.value[row]))
    operations = toolpath.operations
    if operations is not None:
        later = int(np.searchsorted(operations.begin, row, side="right")) - 1
        note = operations.notes[max(later, 0)].tool
        tool = note if note.number == tool.number else tool
    mounted_tool = tool_words(tool, unit) if tool.diameter_mm else f"tool {tool.number}"
    place, tip = untouched_place(toolpath, row, unit.mm), f"Z {toolpath.end[row, 2]:.4g}"
    if place is None:
        where = "zero Z again"
    else:
        where = f"zero Z on top of the stock at X{place[0]:.4g} Y{place[1]:.4g}"
    return [
        f"stop: mount {mounted_tool}",
        f"{where} - not cut yet" if place else where,
        f"or set its tip to {tip} {unit.name} here - then start",
    ]


def pack(parts: Sequence[str]) -> Iterator[str]:
    """Yield lines of parts joined with dashes, with as many parts on a line as fit into a
    comment."""
    if not parts:
        return
    line = ""
    for part in parts:
        longer = f"{line} - {part}" if line else part
        if line and len(longer) > COMMENT_CHARS:
            yield line
            longer = part
        line = longer
    yield line


def duration(seconds: float) -> str:
    """Return a time in words, rounded to the second.

    >>> duration(3725.4)
    '1 h 2 min 5 s'
    >>> duration(0.3)
    'less than 1 s'
    """
    total_s = round(seconds)
    if total_s == 0:
        return "less than 1 s"
    parts = ((total_s // 3600, "h"), (total_s // 60 % 60, "min"), (total_s % 60, "s"))
    return " ".join(f"{count} {unit}" for count, unit in parts if count)


def _feed_seconds(toolpath: Toolpath) -> Floats:
    """Return (N,) seconds that each row cuts if it has its programmed feed from end to end, 0 for
    rapids and events. Lengths of the toolpath are in mm."""

    def seconds(part: Toolpath) -> Floats:
        begin = part.starts
        flat = np.hypot(*(part.end - begin)[:, :2].T)
        arcs = np.flatnonzero(part.is_arc)
        radius = np.hypot(*(begin[arcs, :2] - part.centre[arcs]).T)
        flat[arcs] = radius * np.abs(part.sweeps_of(arcs))
        length = np.hypot(flat, part.end[:, 2] - begin[:, 2])
        return np.where(part.is_feed, 60.0 * length / np.where(part.is_feed, part.feed, 1.0), 0.0)

    return toolpath.by_parts(seconds)
