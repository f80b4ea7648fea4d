"""A job file to fill in: what `camtool job new` writes from the layers of a drawing.

One operation for each layer, or for each colour when there is one layer: drilled where it holds
small circles and points alone, engraved where every path is open or its name says so, else a
profile; what is open, closed, text or a point gets an operation of its own. Where the tool is
known, holes, inner and outer contours do, too. What is larger comes later, so that parts are cut
free last. Every other key stands there as a comment, with an example.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import PurePath
from typing import TYPE_CHECKING

import numpy as np
from msgspec import Struct

from camtool.arrays import Ints
from camtool.geometry.drawing import is_text
from camtool.geometry.facts import drawing_extents
from camtool.geometry.measure import extents, path_lengths
from camtool.jobs.keys import OPERATION, PLACE, TOOL, WHOLE, is_known
from camtool.keys import Key
from camtool.planning.holes import HOLE_SIZE_MM, circle_of
from camtool.planning.job import Operation, Stock
from camtool.planning.sides import CONTINUOUS, Traits
from camtool.records import replace
from camtool.tables import toml_string

if TYPE_CHECKING:
    from camtool.geometry.drawing import Drawing
    from camtool.geometry.polylines import Polyline, Polylines
    from camtool.machine.model import Machine

SMALL_HOLE = 0.1
"""Circles up to this part of the drawing's longer side are taken for holes to drill."""

ENGRAVED = ("engrav", "etch", "scribe")
"""A layer with one of these in its name is engraved."""

BREAKTHROUGH_MM = 0.3
"""Through cuts are proposed to go so far below the stock."""

MOST_TABS = 4
"""So many tabs are proposed for an outline."""

TEXT_MM = 0.2
"""Text is proposed to be engraved so deep."""

LEAST_TAB_MM = 0.5
"""Lower tabs than this are not proposed."""

TOOL_NAME = "tool"
_ORDER = ("drill", "engrave", "bore", "profile")
_WIDTH = 36


class _Group(Struct, frozen=True):
    """Paths and marks that one operation takes: the rows of both, and the pattern for them."""

    name: str
    key: str
    paths: tuple[int, ...]
    marks: tuple[int, ...]

    @property
    def called(self) -> str:
        """Its name, or that it has none."""
        return self.name or f"no {self.key[:-1]}"


class Proposal(Struct, frozen=True):
    """What is known of the cut, mm, 0 where it is not: the tool's diameter, the stock's
    thickness. `tool`: its name in a library, and the materials that it has presets for, which say
    how deep passes are; `material`: the one of them that is cut, where that is said."""

    tool_mm: float = 0.0
    thickness_mm: float = 0.0
    tool: str = ""
    materials: tuple[str, ...] = ()
    material: str = ""

    @property
    def breakthrough_mm(self) -> float:
        """A little into what the stock lies on; 0 without a thickness."""
        if not self.thickness_mm:
            return 0.0
        return min(BREAKTHROUGH_MM, Stock(self.thickness_mm).through_mm)


def _materials(proposal: Proposal) -> Iterator[str]:
    """What is cut, and as comments what else it may be."""
    for name in proposal.materials:
        said = name == proposal.material
        yield _row(f"{'' if said else '# '}material = {toml_string(name)}", "as --material")


def job_template(
    drawing: Drawing, machine: Machine | None = None, proposal: Proposal | None = None
) -> str:
    """TOML text of a job for the drawing; for `machine`, when it is known, with its numbers. With
    a proposal of tool and stock, contours are told apart by what they are."""
    proposal = proposal or Proposal()
    (left, right), (low, high) = drawing_extents(drawing).tolist()
    size = (right - left, high - low)
    groups = sorted(_groups(drawing), key=lambda group: _extent(drawing, group))
    parts = [
        (group, part) for group in groups for part in _parts(drawing, group, max(size), proposal)
    ]
    parts.sort(key=lambda each: _ORDER.index(each[1].kind))
    lines = [
        *_head(drawing, size, machine),
        *_comments(WHOLE),
        *_materials(proposal),
        "",
        "[place]",
        _row('origin = "lower-left"', PLACE["origin"].help),
        *_comments(PLACE),
        "",
        *_stock(size, proposal),
        "",
    ]
    if not proposal.tool:
        lines += [
            f"[tools.{TOOL_NAME}]",
            _row(f'diameter = "{proposal.tool_mm:.6g}mm"', TOOL["diameter"].help),
            *_comments(TOOL),
        ]
    names = set[str]()
    for group, part in parts:
        number = next(n for n in itertools.count(1) if _numbered(part.name, n) not in names)
        part = replace(part, name=_numbered(part.name, number))
        names.add(part.name)
        lines += ["", *_text(drawing, group, part, proposal)]
    return "\n".join(lines) + "\n"


def _stock(size: tuple[float, float], proposal: Proposal) -> Iterator[str]:
    known = bool(proposal.thickness_mm)
    thickness = f"{proposal.thickness_mm:.6g}" if known else "1"
    remark = "its top is Z0; the corner is its lower left one"
    yield _row("[stock]" if known else "# [stock]", remark)
    yield '# corner = ["0mm", "0mm"]'
    yield f'# size = ["{size[0]:.6g}mm", "{size[1]:.6g}mm"]'
    yield f'{"" if known else "# "}thickness = "{thickness}mm"'
    yield '# spoilboard = "0.5mm"'


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


class _Part(Struct, frozen=True):
    """What one operation cuts of a group: what it selects of it, and how."""

    name: str
    kind: str
    rows: tuple[int, ...]
    marks: int = 0
    keys: tuple[tuple[str, str, str], ...] = ()
    """Keys that it has, as TOML text, each with a remark."""


def _parts(drawing: Drawing, group: _Group, size_mm: float, proposal: Proposal) -> list[_Part]:
    """The operations that a group is cut by."""
    lines, marks = drawing.paths, len(group.marks)
    is_letter = [is_text(drawing.sources[row]) for row in group.paths]
    text = tuple(row for row, yes in zip(group.paths, is_letter, strict=True) if yes)
    if text:
        rest = tuple(row for row, yes in zip(group.paths, is_letter, strict=True) if not yes)
        keys = (
            ("select", '["text"]', ""),
            ("depth", f'"{TEXT_MM:g}mm"', "a V bit makes finer letters"),
        )
        letters = _Part(f"{group.called} text", "engrave", text, 0, keys)
        if not rest and not marks:
            return [letters]
        others = _parts(drawing, replace(group, paths=rest), size_mm, proposal)
        return [letters, *(_without_text(part) for part in others)]
    rows = np.array(group.paths, dtype=np.int64)
    closed = lines.closed[rows]
    small = all(_is_hole(lines[row], SMALL_HOLE * size_mm) for row in group.paths)
    if any(word in group.name.casefold() for word in ENGRAVED) or (len(rows) and not closed.any()):
        return [_Part(group.called, "engrave", group.paths, marks)]
    if small and not proposal.tool_mm:
        return [_Part(group.called, "drill", group.paths, marks)]
    found = []
    if marks:
        select = (("select", '["point"]', ""),) if len(rows) else ()
        found.append(_Part(f"{group.called} points", "drill", (), marks, select))
    if not closed.all():
        open_ = tuple(rows[~closed].tolist())
        select = (("select", '["open"]', ""),)
        found.append(_Part(f"{group.called} open", "engrave", open_, 0, select))
    contours = rows[closed]
    if not proposal.tool_mm:
        select = () if closed.all() else (("select", '["closed"]', ""),)
        found.append(_Part(group.called, "profile", tuple(contours.tolist()), 0, select))
        return found
    return found + _cut_parts(drawing, group, contours, proposal)


def _without_text(part: _Part) -> _Part:
    """The part, which selects no text."""
    said = {key: value for key, value, _ in part.keys}.get("select")
    if said == '["point"]':
        return part
    words = "" if said is None else f"{said[1:-1]}, "
    keys = (("select", f'[{words}"not text"]', ""), *(k for k in part.keys if k[0] != "select"))
    return replace(part, keys=keys)


def _cut_parts(drawing: Drawing, group: _Group, contours: Ints, proposal: Proposal) -> list[_Part]:
    """Closed contours for a tool of known diameter: circles within parts are drilled where they
    fit the tool and bored where they are wider, other contours within parts are cut
    on their inside, and the outer ones last, with tabs."""
    lines, tool = drawing.paths, proposal.tool_mm
    continuous = [kind.casefold() in CONTINUOUS for kind in drawing.line_types]
    edges = np.array(continuous, dtype=np.bool_)
    own = drawing.nesting.among(np.arange(len(lines)))
    traits = Traits(own, drawing.sources, edges)
    mine = np.zeros(len(lines), dtype=np.bool_)
    mine[contours] = True

    def taken(*words: str) -> Ints:
        return np.flatnonzero(traits.selected(Operation(select=words), mine))

    found: list[_Part] = []
    keys: tuple[tuple[str, str, str], ...]
    round_ = {row: circle_of(lines[row]) for row in taken("inner", "circle").tolist()}
    circles = {row: circle[1] for row, circle in round_.items() if circle}
    fits = [row for row, wide in circles.items() if abs(wide - tool) <= HOLE_SIZE_MM]
    wider = [row for row, wide in circles.items() if wide > tool + HOLE_SIZE_MM]
    words = '["inner", "circle"]'
    if fits:
        size = f'"{tool - HOLE_SIZE_MM:.6g}..{tool + HOLE_SIZE_MM:.6g}mm"'
        keys = (("select", words, ""), ("select_size", size, "as wide as the tool"))
        found.append(_Part(f"{group.called} drilled", "drill", tuple(fits), 0, keys))
    if wider:
        keys = (
            ("select", words, ""),
            ("select_size", f'"{tool + HOLE_SIZE_MM:.6g}mm.."', "wider than the tool"),
            ("entry", '"helix:3deg"', "how steeply it goes down"),
        )
        found.append(_Part(f"{group.called} holes", "bore", tuple(wider), 0, keys))
    inner = taken("inner", "not circle")
    if len(inner):
        keys = (("select", '["inner", "not circle"]', ""), ("entry", '"ramp:3deg"', ""))
        found.append(_Part(f"{group.called} inner", "profile", tuple(inner.tolist()), 0, keys))
    outer = taken("outer")
    if len(outer):
        keys = (("select", '["outer"]', ""), ("entry", '"ramp:3deg"', ""))
        if proposal.thickness_mm:
            # Tabs are measured from the full depth of the cut, which is below the stock.
            height = min(max(proposal.thickness_mm / 3.0, LEAST_TAB_MM), proposal.thickness_mm)
            height += proposal.breakthrough_mm
            count = _tabs_for(lines.select(outer.tolist()), tool)
            tabs = f'"{count}:{2.0 * tool:.3g}mm:{height:.3g}mm"'
            if count:
                keys = (*keys, ("tabs", tabs, "so that it stays where it is; cut them by hand"))
        found.append(_Part(f"{group.called} outer", "profile", tuple(outer.tolist()), 0, keys))
    return found


def _tabs_for(outlines: Polylines, tool_mm: float) -> int:
    """How many tabs of twice the tool's diameter each of these outlines has room for, at most
    MOST_TABS: they leave it at least as much as they take."""
    shortest = float(path_lengths(outlines).min()) + math.pi * tool_mm
    return min(MOST_TABS, int(0.5 * shortest / (3.0 * tool_mm)))


def _numbered(name: str, number: int) -> str:
    """A name for what has been called so before."""
    return name if number == 1 else f"{name} ({number})"


def _text(drawing: Drawing, group: _Group, part: _Part, proposal: Proposal) -> list[str]:
    """The lines of the operation for a part of a group."""
    lines = drawing.paths.select(part.rows)
    marks = f", {part.marks} points" if part.marks else ""
    text = [
        "[[operations]]",
        f"name = {toml_string(part.name)}",
        f'kind = "{part.kind}"',
        _row(
            f"{group.key} = [{toml_string(pattern_of(group.name))}]", f"{_counted(lines)}{marks}"
        ),
        *(_row(f"{key} = {value}", remark) for key, value, remark in part.keys),
        f"tool = {toml_string(proposal.tool or TOOL_NAME)}",
    ]
    if part.kind in ("profile", "bore") and proposal.tool_mm:
        text.append(_row('direction = "climb"', OPERATION["direction"].help))
    if proposal.breakthrough_mm and is_known("breakthrough", part.kind):
        through = f'breakthrough = "{proposal.breakthrough_mm:.6g}mm"'
        text.append(_row(through, "through the stock, and so far into the board below"))
        if part.kind == "profile" and proposal.tool_mm and not proposal.materials:
            text.append(f'step_down = "{0.5 * proposal.tool_mm:.3g}mm"')
    if marks and part.kind != "drill":
        text.append("# The points are not cut by this: they need an operation of the kind drill.")
    given = {key for key, _, _ in part.keys} | {line.split(" = ")[0] for line in text}
    if "breakthrough" in given:
        given.add("depth")
    known = {
        name: key
        for name, key in OPERATION.items()
        if is_known(name, part.kind) and name not in given
    }
    return [*text, *_comments(known)]


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
