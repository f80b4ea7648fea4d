"""A job file to fill in: what `camtool job new` writes from the layers of a drawing.

Of each layer (of each colour when there is one layer) the kinds of operation take what they
propose to cut, one after the other: engraving what is text or open, or has a name that says so;
drilling points and small circles; boring circles wider than the tool; profiles the rest. What is
larger comes later, so that parts are cut free last. Every other key stands there as a comment,
with an example.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from pathlib import PurePath
from typing import TYPE_CHECKING

import numpy as np
from msgspec import Struct

from camtool.geometry.facts import drawing_extents
from camtool.geometry.measure import extents
from camtool.jobs.keys import OPERATION, PLACE, TOOL, WHOLE, is_known
from camtool.keys import Key
from camtool.planning.job import Operation, Stock
from camtool.planning.kinds import function_of, installed_kinds, kind_named
from camtool.planning.sides import CONTINUOUS, Traits
from camtool.records import replace
from camtool.tables import toml_string

if TYPE_CHECKING:
    from camtool.geometry.drawing import Drawing
    from camtool.geometry.polylines import Polylines
    from camtool.machine.model import Machine

BREAKTHROUGH_MM = 0.3
"""Through cuts are proposed to go so far below the stock."""

TOOL_NAME = "tool"
CUTTING_ORDER = ("over", "at", "along", "within", "beside")
"""Operations by where they cut: what frees parts comes last."""

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
    """The known sizes of the cut, mm, 0 where it is not: the tool's diameter, the stock's
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
    """Yield the row of the material that is cut, and those of the others as comments."""
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
    parts.sort(key=lambda each: CUTTING_ORDER.index(kind_named(each[1].kind).cuts))
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


class Part(Struct, frozen=True):
    """An operation that a kind proposes: its name, what it takes of a group (rows of the drawing's
    paths, and how many single points), and keys as TOML text, each with a remark. `excludes`: the
    word by which the other operations of the group leave these paths out."""

    name: str
    kind: str
    rows: tuple[int, ...]
    marks: int = 0
    keys: tuple[tuple[str, str, str], ...] = ()
    excludes: str = ""


class Remaining(Struct, frozen=True):
    """The part of a group that no operation takes yet: paths (rows of the drawing's), and how many
    single points. `name`: that of the layer or colour; `title`: the same for names of operations.
    `size_mm`: the longer side of the drawing. `is_divided`: operations before take other paths of
    the group, so that those that follow have to select."""

    drawing: Drawing
    name: str
    title: str
    rows: tuple[int, ...]
    marks: int
    size_mm: float
    proposal: Proposal
    is_divided: bool = False

    @property
    def contours(self) -> tuple[int, ...]:
        """Rows of the closed paths."""
        return tuple(row for row in self.rows if self.drawing.paths.closed[row])

    def contours_that_are(self, *words: str) -> tuple[int, ...]:
        """Rows of the closed paths of which all these words of `select` are true."""
        drawing = self.drawing
        continuous = [kind.casefold() in CONTINUOUS for kind in drawing.line_types]
        edges = np.array(continuous, dtype=np.bool_)
        every = drawing.nesting.among(np.arange(len(drawing.paths)))
        rows = np.zeros(len(drawing.paths), dtype=np.bool_)
        rows[list(self.contours)] = True
        selected = Traits(every, drawing.sources, edges).selected(Operation(select=words), rows)
        return tuple(np.flatnonzero(selected).tolist())

    def without(self, parts: Sequence[Part]) -> Remaining:
        """Return the paths and points that are left when these operations have taken theirs."""
        taken = {row for part in parts for row in part.rows}
        return replace(
            self,
            rows=tuple(row for row in self.rows if row not in taken),
            marks=self.marks - sum(part.marks for part in parts),
            is_divided=self.is_divided or any(part.rows and not part.excludes for part in parts),
        )


def _parts(drawing: Drawing, group: _Group, size_mm: float, proposal: Proposal) -> list[Part]:
    """The operations that a group is cut by, as the kinds propose them one after the other."""
    rows, marks = group.paths, len(group.marks)
    left = Remaining(drawing, group.name, group.called, rows, marks, size_mm, proposal)
    proposing = [kind for kind in installed_kinds().values() if kind.propose]
    found: list[Part] = []
    for kind in sorted(proposing, key=lambda kind: (kind.proposal_rank, kind.name)):
        if left.rows or left.marks:
            made: list[Part] = function_of(kind.propose)(left)
            found += made
            left = left.without(made)
    excluded = [part.excludes for part in found if part.excludes]
    return [part if part.excludes else _excluding(part, excluded) for part in found]


def _excluding(part: Part, words: Sequence[str]) -> Part:
    """The part, which selects what these words too are true of."""
    said = {key: value for key, value, _ in part.keys}.get("select")
    if not words or said == '["point"]':
        return part
    before = "" if said is None else f"{said[1:-1]}, "
    more = ", ".join(toml_string(word) for word in words)
    keys = (("select", f"[{before}{more}]", ""), *(k for k in part.keys if k[0] != "select"))
    return replace(part, keys=keys)


def _numbered(name: str, number: int) -> str:
    """A name for what has been called so before."""
    return name if number == 1 else f"{name} ({number})"


def _text(drawing: Drawing, group: _Group, part: Part, proposal: Proposal) -> list[str]:
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
    contract = kind_named(part.kind)
    if contract.leaves_walls and proposal.tool_mm:
        text.append(_row('direction = "climb"', OPERATION["direction"].help))
    if proposal.breakthrough_mm and is_known("breakthrough", part.kind):
        through = f'breakthrough = "{proposal.breakthrough_mm:.6g}mm"'
        text.append(_row(through, "through the stock, and so far into the board below"))
        if contract.runs_beside and proposal.tool_mm and not proposal.materials:
            text.append(f'step_down = "{0.5 * proposal.tool_mm:.3g}mm"')
    if marks and contract.takes != "holes":
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
