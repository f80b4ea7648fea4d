"""A job file to fill in: what `camtool job new` writes from the layers of a drawing.

One operation for each layer, or for each colour when there is one layer: drilled where it holds
small circles and points alone, engraved where every path is open or its name says so, else a
profile. What is larger comes later, so that parts are cut free last. Every other key stands there
as a comment, with an example.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePath
from typing import TYPE_CHECKING

import numpy as np

from camtool.geometry.facts import drawing_extents
from camtool.geometry.measure import extents
from camtool.jobs.keys import OPERATION, PLACE, TOOL, WHOLE, Key
from camtool.planning.drill import circle_of

if TYPE_CHECKING:
    from camtool.geometry.drawing import Drawing
    from camtool.geometry.polylines import Polyline, Polylines
    from camtool.machine.model import Machine

SMALL_HOLE = 0.1
"""Circles up to this part of the drawing's longer side are taken for holes to drill."""

ENGRAVED = ("engrav", "etch", "scribe")
"""A layer with one of these in its name is engraved."""

TOOL_NAME = "tool"
_ORDER = ("drill", "engrave", "profile")
_WIDTH = 36
_SURROGATES = range(0xD800, 0xE000)


@dataclass(frozen=True)
class _Group:
    """Paths and marks that one operation takes: the rows of both, and the pattern for them."""

    name: str
    key: str
    paths: tuple[int, ...]
    marks: tuple[int, ...]


def job_template(drawing: Drawing, machine: Machine | None = None) -> str:
    """TOML text of a job for the drawing; for `machine`, when it is known, with its numbers."""
    (left, right), (low, high) = drawing_extents(drawing).tolist()
    size = (right - left, high - low)
    groups = sorted(_groups(drawing), key=lambda group: _extent(drawing, group))
    operations = sorted(
        (_operation(drawing, group, max(size)) for group in groups),
        key=lambda operation: _ORDER.index(operation[0]),
    )
    lines = [
        *_head(drawing, size, machine),
        *_comments(WHOLE),
        "",
        "[place]",
        _row('origin = "lower-left"', PLACE["origin"].help),
        *_comments(PLACE),
        "",
        "# [stock]                           # its top is Z0; the corner is its lower left one",
        '# corner = ["0mm", "0mm"]',
        f'# size = ["{size[0]:.6g}mm", "{size[1]:.6g}mm"]',
        '# thickness = "1mm"',
        '# spoilboard = "0.5mm"',
        "",
        f"[tools.{TOOL_NAME}]",
        _row('diameter = "0mm"', TOOL["diameter"].help),
        *_comments(TOOL),
    ]
    for _, text in operations:
        lines += ["", *text]
    return "\n".join(lines) + "\n"


def _head(drawing: Drawing, size: tuple[float, float], machine: Machine | None) -> Iterator[str]:
    name = _commented(PurePath(drawing.file).name)
    target = machine.target.name if machine else "NAME"
    yield f"# How {name} is cut: {size[0]:.6g} by {size[1]:.6g} mm, {_counted(drawing.paths)}"
    yield "# Take the # away from what you need. docs/jobs.md explains every key."
    yield f"# camtool post DRAWING --target {target} --job THIS-FILE"
    if machine is not None:
        travel = [axis.travel_mm for axis in (machine.axes.x, machine.axes.y)]
        yield "#"
        yield (
            f"# {target}: feed {machine.feed.default_mm_min:g} mm/min,"
            f" depth {machine.defaults.cut_depth_mm:g} mm,"
            f" safe_z {machine.defaults.safe_z_mm:g} mm by default"
        )
        if travel[0] is not None and travel[1] is not None:
            yield f"# {target}: travel {travel[0]:g} by {travel[1]:g} mm"
            if size[0] > travel[0] or size[1] > travel[1]:
                yield f'# The drawing is larger: fit = "{travel[0]:g}x{travel[1]:g}mm" in [place]'
    yield ""


def _groups(drawing: Drawing) -> list[_Group]:
    """By layer, names that differ in case alone together; by colour when there is one layer."""
    layers = _by(drawing.layers, [mark.layer for mark in drawing.marks], "layers")
    colours = _by(drawing.colours, [mark.colour for mark in drawing.marks], "colours")
    return colours if len(layers) == 1 and len(colours) > 1 else layers


def _by(names: Sequence[str], of_marks: Sequence[str], key: str) -> list[_Group]:
    groups: dict[str, tuple[str, list[int], list[int]]] = {}
    for row, name in enumerate(names):
        groups.setdefault(name.casefold(), (name, [], []))[1].append(row)
    for row, name in enumerate(of_marks):
        groups.setdefault(name.casefold(), (name, [], []))[2].append(row)
    return [_Group(name, key, tuple(rows), tuple(marks)) for name, rows, marks in groups.values()]


def _extent(drawing: Drawing, group: _Group) -> float:
    """The size of the group, mm; larger groups come after the ones within them."""
    lines = drawing.paths.select(group.paths)
    return float(np.ptp(extents(lines), axis=1).sum()) if len(lines) else 0.0


def _operation(drawing: Drawing, group: _Group, size_mm: float) -> tuple[str, list[str]]:
    """Kind and lines of the operation for a group."""
    lines = drawing.paths.select(group.paths)
    small = all(_is_hole(path, SMALL_HOLE * size_mm) for path in lines)
    engraved = any(word in group.name.casefold() for word in ENGRAVED)
    on_line = engraved or not lines.closed.any()
    kind = "drill" if small else "engrave" if on_line else "profile"
    marks = f", {len(group.marks)} points" if group.marks else ""
    text = [
        "[[operations]]",
        f"name = {quoted(group.name or f'no {group.key[:-1]}')}",
        f'kind = "{kind}"',
        _row(f"{group.key} = [{quoted(pattern_of(group.name))}]", f"{_counted(lines)}{marks}"),
        f'tool = "{TOOL_NAME}"',
    ]
    if marks and kind != "drill":
        text.append("# The points are not cut by this: they need an operation of the kind drill.")
    known = {name: key for name, key in OPERATION.items() if kind in key.kinds}
    return kind, [*text, *_comments(known)]


def _is_hole(path: Polyline, largest_mm: float) -> bool:
    circle = circle_of(path)
    return circle is not None and circle[1] <= largest_mm


def _counted(lines: Polylines) -> str:
    closed = np.count_nonzero(lines.closed)
    return f"{closed} closed and {len(lines.closed) - closed} open paths"


def _comments(keys: Mapping[str, Key]) -> list[str]:
    """Keys with their examples, commented out, and the words that each may be."""
    return [
        _row(f"# {name} = {key.example}", f"{key.help} {', '.join(key.value.choices)}".rstrip())
        for name, key in keys.items()
        if key.example
    ]


def _row(text: str, remark: str) -> str:
    return f"{text:<{_WIDTH}}# {remark}" if remark else text


def _commented(text: str) -> str:
    """Text for a comment: one line, and nothing that TOML refuses there."""
    return "".join(char if char.isprintable() else " " for char in text)


def pattern_of(name: str) -> str:
    """The pattern that matches this name alone (in any case)."""
    return "".join(f"[{char}]" if char in "*?[" else char for char in name)


def quoted(text: str) -> str:
    """A TOML string of any text. Halves of surrogate pairs, which no TOML can hold, become "?"."""
    return '"' + "".join(map(_escaped, text)) + '"'


def _escaped(char: str) -> str:
    code = ord(char)
    if code in _SURROGATES:
        return "?"
    if char in '"\\':
        return f"\\{char}"
    if char.isprintable():
        return char
    return f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"
