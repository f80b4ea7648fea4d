"""A job file to fill in: what `camtool job new` writes from the layers of a drawing.

Of each layer (of each colour when there is one layer) the kinds of operation take what they
propose to cut, one after the other, by `proposal_rank`:

    chamfer (countersinks) ▶ engrave ▶ drill ▶ bore ▶ pocket ▶ profile

Each says why, and names a tool of the library where another one than the job's is right. What is
larger comes later, so that parts are cut free last. Every other key stands there as a comment,
with an example. docs/jobs.md has the rules in a table."""

from __future__ import annotations

import itertools
import math
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import PurePath
from typing import TYPE_CHECKING

import numpy as np
from msgspec import Struct

from camtool.geometry.facts import drawing_extents
from camtool.geometry.measure import extents, path_extents
from camtool.geometry.turn import Box
from camtool.jobs.keys import OPERATION, PLACE, TOOL, WHOLE, is_known
from camtool.jobs.proposal import Proposal
from camtool.jobs.stepped import SteppedHoles, stepped_holes
from camtool.jobs.widths import crowded
from camtool.keys import Given, Key
from camtool.planning.holes import circle_of
from camtool.planning.job import Operation, Stock
from camtool.planning.kinds import SELECTING_KEYS, function_of, installed_kinds, kind_named
from camtool.planning.pins import Pin, pins_text, proposed_pins
from camtool.planning.sides import CONTINUOUS, Traits
from camtool.records import replace
from camtool.tables import toml_string

if TYPE_CHECKING:
    from camtool.geometry.drawing import Drawing
    from camtool.geometry.polylines import Polylines
    from camtool.machine.model import Machine

TOOL_NAME = "tool"

HABITS = {
    "countersink": ("countersink", "countersunk", "csk", "csink", "senk"),
    "engrave": ("engrav", "etch", "scribe", "mark", "score"),
    "drill": ("drill", "hole", "bore"),
    "pocket": ("pocket", "recess", "counterbore", "cbore"),
    "profile": ("cut", "outline", "profile"),
}
"""Beginnings of words in the names of layers, by the kind of operation (or "countersink") that
they suggest."""

COLOURS = {"#ff0000": "profile", "#0000ff": "engrave"}
"""Kinds of operation suggested by the colours of drawings for laser cutters: red is cut, blue
marks lines."""

_DEPTH = re.compile(r"(\d+(?:[.,]\d+)?)\s*mm\b|\b(?:d|depth|z)\s*=\s*-?(\d+(?:[.,]\d+)?)")
"""Depths in names of layers, mm."""

MAX_DEPTH_MM = 50.0
"""Larger numbers in names of layers are not taken for depths, if the stock is not known."""

CUTTING_ORDER = ("over", "at", "along", "within", "beside")
"""The order of operations by where they cut: those that cut parts free come last."""

_WIDTH = 36


class _Group(Struct, frozen=True):
    """Paths and marks of one layer or colour: its `name`, the `key` that selects it ("layers" or
    "colours"), and the rows of paths and marks."""

    name: str
    key: str
    paths: tuple[int, ...]
    marks: tuple[int, ...]

    @property
    def called(self) -> str:
        """Its name, or that it has none."""
        return self.name or f"no {self.key[:-1]}"


def _materials(proposal: Proposal) -> Iterator[str]:
    """Yield the line of the material that is cut, and the lines of the other materials as
    comments."""
    for name in proposal.materials:
        is_chosen = name == proposal.material
        yield _row(f"{'' if is_chosen else '# '}material = {toml_string(name)}", "as --material")


def proposed(drawing: Drawing, proposal: Proposal) -> list[Proposed]:
    """Return the operations proposed for a drawing, in the order of cutting, with unique names."""
    (left_x, right), (low, high) = drawing_extents(drawing).tolist()
    groups = sorted(_groups(drawing), key=lambda group: _extent(drawing, group))
    habits = {row: _habit(group.name) for group in groups for row in group.paths}
    steps = stepped_holes(drawing, proposal, habits)
    size = max(right - left_x, high - low)
    operations = [
        Proposed(group, part)
        for group in groups
        for part in _parts(drawing, group, size, proposal, steps)
    ]
    operations = [
        Proposed(each.group, _sided(drawing, each.part, operations)) for each in operations
    ]
    operations.sort(key=_turn)
    names = set[str]()
    for row, each in enumerate(operations):
        name = each.part.name
        number = next(n for n in itertools.count(1) if _numbered(name, n) not in names)
        operations[row] = Proposed(each.group, replace(each.part, name=_numbered(name, number)))
        names.add(operations[row].part.name)
    return operations


def _sided(drawing: Drawing, part: Part, operations: Sequence[Proposed]) -> Part:
    """Return the part with a key `side` if it is a profile within a contour that is only engraved.
    An engraved contour bounds no part, so the side must be stated: the one that the nesting in the
    drawing implies. Other parts are returned unchanged."""
    if not kind_named(part.kind).runs_beside or any(key == "side" for key, _, _ in part.keys):
        return part
    marked = {row for each in operations if each.part.kind == "engrave" for row in each.part.rows}
    levels = drawing.nesting.levels
    for row in part.rows:
        holder = int(levels.parent[row])
        while holder >= 0 and holder not in marked:
            holder = int(levels.parent[holder])
        if holder >= 0:
            side = "outside" if levels.depth[part.rows[0]] % 2 == 0 else "inside"
            side_key = ("side", f'"{side}"', "what is around it is only marked")
            return replace(part, keys=(*part.keys, side_key))
    return part


def _turn(each: Proposed) -> tuple[int, bool]:
    """Return the sort key of an operation in the order of cutting: what frees parts comes last,
    and edges are broken after engraving, for which the same V bit may be in the spindle."""
    kind = kind_named(each.part.kind)
    return CUTTING_ORDER.index("along" if kind.breaks_edges else kind.cuts), kind.breaks_edges


def job_template(
    drawing: Drawing,
    machine: Machine | None = None,
    proposal: Proposal | None = None,
    parts: Sequence[Proposed] | None = None,
    text: str = "",
) -> str:
    """Return the TOML text of a job for the drawing. `machine`: its defaults and travel are noted
    in the head; `proposal`: tools and stock; `parts`: the operations (None: those that `proposed`
    returns); `text`: the value of the key `text`, with which the drawing was read."""
    proposal = proposal or Proposal()
    (left_x, right), (low, high) = drawing_extents(drawing).tolist()
    size = (right - left_x, high - low)
    parts = proposed(drawing, proposal) if parts is None else parts
    lines = [
        *_head(drawing, size, machine),
        *_comments({name: key for name, key in WHOLE.items() if not (name == "text" and text)}),
        *([_row(f'text = "{text}"', WHOLE["text"].help)] if text else []),
        *_materials(proposal),
        "",
        "[place]",
        _row('origin = "lower-left"', PLACE["origin"].help),
        *_comments(PLACE),
        "",
        *_stock(size, proposal, parts),
        "",
    ]
    if not proposal.tool:
        lines += [
            f"[tools.{TOOL_NAME}]",
            _row(f'diameter = "{proposal.tool_mm:.6g}mm"', TOOL["diameter"].help),
            *_comments(TOOL),
        ]
    if proposal.flip:
        lines += ["", *_pins(proposal)]
    for each in parts:
        if each.part.is_left:
            lines += ["", f"# {_commented(f'{each.part.name} is not cut: {each.part.why}')}"]
        else:
            lines += ["", *_text(drawing, each.group, each.part, proposal)]
    if proposal.flip:
        cut = [each for each in parts if not each.part.is_left]
        lines += ["", *_setups(size, proposal, cut)]
    return "\n".join(lines) + "\n"


def _stock(
    size: tuple[float, float], proposal: Proposal, parts: Sequence[Proposed]
) -> Iterator[str]:
    """Yield the lines of `[stock]`; where a drill goes through, the spoilboard is as thick as its
    point needs."""
    is_known_thickness = bool(proposal.thickness_mm)
    thickness = f"{proposal.thickness_mm:.6g}" if is_known_thickness else "1"
    remark = "its top is Z0; the corner is its lower left one"
    yield _row("[stock]" if is_known_thickness else "# [stock]", remark)
    if proposal.flip:
        left, low, right, high = two_sided_stock(size, proposal)
        yield _row(f'corner = ["{left:g}mm", "{low:g}mm"]', "waste all round, with the pins in it")
        yield f'size = ["{right - left:.6g}mm", "{high - low:.6g}mm"]'
    else:
        yield '# corner = ["0mm", "0mm"]'
        yield f'# size = ["{size[0]:.6g}mm", "{size[1]:.6g}mm"]'
    yield f'{"" if is_known_thickness else "# "}thickness = "{thickness}mm"'
    points = {tool.name: tool.point_mm for tool in proposal.library}
    drilled = [points.get(each.part.tool, 0.0) for each in parts if each.part.kind == "drill"]
    depth = proposal.breakthrough_mm + max(drilled, default=0.0)
    if proposal.flip:
        point = proposal.pin_drill.point_mm if proposal.pin_drill else 0.0
        depth = max(depth, proposal.pin_depth_mm + point)
    if is_known_thickness and depth > Stock(proposal.thickness_mm).through_mm:
        board = math.ceil(10.0 * depth) / 10.0
        yield _row(f'spoilboard = "{board:g}mm"', "so deep go drills below it")
    else:
        yield '# spoilboard = "0.5mm"'


BACK = ("back", "bottom", "rear", "under")
"""Beginnings of words in the names of layers that are cut from the other face."""


def two_sided_stock(size: tuple[float, float], proposal: Proposal) -> Box:
    """Return the box of the stock for a part of this size that is turned over: the part and a
    margin of waste all round."""
    margin = proposal.margin_mm
    return -margin, -margin, size[0] + margin, size[1] + margin


def two_sided_pins(size: tuple[float, float], proposal: Proposal) -> tuple[Pin, Pin]:
    """Return the positions of the two alignment pins for a part of this size."""
    line = 0.5 * size[0 if proposal.flip == "y" else 1]
    stock, part = two_sided_stock(size, proposal), (0.0, 0.0, *size)
    flip = proposal.flip, line
    pins = proposed_pins(stock, part, flip, proposal.pin_mm, proposal.tool_mm)
    assert pins is not None, "the margin has room for them"
    return pins


def pin_words(drawing: Drawing, proposal: Proposal) -> str:
    """Return a sentence for the user: diameter and positions of the holes for the alignment pins,
    and how deep they go into the board."""
    (left, right), (low, high) = drawing_extents(drawing).tolist()
    pins = two_sided_pins((right - left, high - low), proposal)
    places = " and ".join(f"X{x:g} Y{y:g}" for x, y in pins)
    return (
        f"pins: holes of {proposal.pin_mm:g} mm at {places}, in the waste of the stock, drilled "
        f"{proposal.pin_depth_mm:g} mm into the board below it; turned over they meet again"
    )


def _pins(proposal: Proposal) -> Iterator[str]:
    """Yield the lines of the operation that drills the holes for the alignment pins."""
    drill = proposal.pin_drill
    name = drill.name if drill else proposal.tool or TOOL_NAME
    yield "# the pins of [[setups]] meet again when the part is turned over"
    yield "[[operations]]"
    yield 'name = "pins"'
    yield 'kind = "pins"'
    yield f"tool = {toml_string(name)}"
    through = f'breakthrough = "{proposal.pin_depth_mm:g}mm"'
    yield _row(through, "so far the pins stand in the board below")
    if drill is None:
        yield f'peck = "{0.5 * proposal.pin_mm:.3g}mm"'


def _setups(
    size: tuple[float, float], proposal: Proposal, parts: Sequence[Proposed]
) -> Iterator[str]:
    """Yield the lines of the two set-ups. The second face gets the operations whose layer names it
    (BACK) and those that cut the part free; the face as drawn gets all others."""
    first, second = ["pins"], list[str]()
    for each in parts:
        words = re.split(r"[^a-z]+", each.group.name.casefold())
        is_back = any(word.startswith(BACK) for word in words)
        (second if is_back or _frees(each.part) else first).append(each.part.name)
    if not second:  # without outlines the last operation frees most
        second.append(first.pop())
    for name, operations in (("top", first), ("bottom", second)):
        yield "[[setups]]"
        yield f'name = "{name}"'
        yield f"operations = [{', '.join(map(toml_string, operations))}]"
        if name == "top":
            yield ""
    sides = "left and right" if proposal.flip == "y" else "front and back"
    yield _row(f'flip = "{proposal.flip}"', f"turned over: {sides} change places")
    yield pins_text(two_sided_pins(size, proposal))
    yield _row('# flip_error = "0.05mm"', "how far the faces may lie beside each other")
    yield _row('# zero = "stock-lower-left"', "where X0 Y0 is then, if not where it was")


def _frees(part: Part) -> bool:
    """Return True if the operation cuts the outline of parts, and so frees them."""
    return part.kind == "profile" and not any('"inner"' in value for _, value, _ in part.keys)


def _head(drawing: Drawing, size: tuple[float, float], machine: Machine | None) -> Iterator[str]:
    name = _commented(PurePath(drawing.file).name)
    target = machine.target.name if machine else "NAME"
    yield f"# How {name} is cut: {size[0]:.6g} by {size[1]:.6g} mm, {_count_words(drawing.paths)}"
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
    """Return the paths and marks of the drawing by layer, or by colour if there is only one layer;
    names that differ only in case are one group."""
    layers = _groups_by(drawing.layers, [mark.layer for mark in drawing.marks], "layers")
    colours = _groups_by(drawing.colours, [mark.colour for mark in drawing.marks], "colours")
    return colours if len(layers) == 1 and len(colours) > 1 else layers


def _groups_by(names: Sequence[str], of_marks: Sequence[str], key: str) -> list[_Group]:
    groups: dict[str, tuple[str, list[int], list[int]]] = {}
    for row, name in enumerate(names):
        groups.setdefault(name.casefold(), (name, [], []))[1].append(row)
    for row, name in enumerate(of_marks):
        groups.setdefault(name.casefold(), (name, [], []))[2].append(row)
    return [_Group(name, key, tuple(rows), tuple(marks)) for name, rows, marks in groups.values()]


def _extent(drawing: Drawing, group: _Group) -> float:
    """Return the width plus the height of the group's paths, mm; groups are sorted by it, so that
    smaller ones within larger ones are cut first."""
    lines = drawing.paths.select(group.paths)
    return float(np.ptp(extents(lines), axis=1).sum()) if len(lines) else 0.0


class Part(Struct, frozen=True):
    """An operation that a kind proposes for a part of a group. `rows`: the drawing's paths that it
    takes; `marks`: the number of single points; `keys`: (name, TOML value, remark) of its keys;
    `excludes`: the word of `select` by which the other operations of the group leave these paths
    out; `tool`: name of a tool of the library, "" for the tool of the job; `why`: the reason in a
    few words, or "". `others`: other kinds that the drawing may have meant, where that is in
    doubt; `instead`: the operation of one of these kinds, if it takes other paths. `is_shared`:
    another operation takes its paths too. `is_left`: it is written as a comment and not cut unless
    asked for."""

    name: str
    kind: str
    rows: tuple[int, ...]
    marks: int = 0
    keys: tuple[tuple[str, str, str], ...] = ()
    excludes: str = ""
    tool: str = ""
    why: str = ""
    others: tuple[str, ...] = ()
    instead: Part | None = None
    is_shared: bool = False
    is_left: bool = False

    def in_doubt(self, instead: Part) -> Part:
        """Return the part with `instead` as the operation that may have been meant in its
        place."""
        return replace(self, others=(instead.kind,), instead=instead)

    def of_kind(self, kind: str) -> Part:
        """Return the part as another kind of operation, with the tool of the job; keys other than
        those that select paths are dropped."""
        if self.instead is not None and self.instead.kind == kind:
            return self.instead
        keys = tuple(key for key in self.keys if key[0] in SELECTING_KEYS)
        return replace(self, kind=kind, keys=keys, tool="", why="asked for", others=())


class Proposed(Struct, frozen=True):
    """A proposed operation, and the group from which it takes its paths."""

    group: _Group
    part: Part

    def cut(self) -> Proposed:
        """Return the operation as one that is cut (`is_left` False)."""
        return Proposed(self.group, replace(self.part, is_left=False))

    def of_kind(self, kind: str) -> Proposed:
        """Return the operation as another kind."""
        return Proposed(self.group, self.part.of_kind(kind))


class Remaining(Struct, frozen=True):
    """The part of a group that no proposed operation takes yet: `rows` of the drawing's paths, and
    the number of single points. `name`: that of the layer or colour; `title`: the same as a name
    for operations. `size_mm`: the longer side of the drawing; `steps`: the counterbores and
    countersinks of the drawing; `sunk`: the wider circles of the group's countersinks, which are
    cut together with their holes. `is_divided`: earlier operations take other paths of the group,
    so later ones need keys that select."""

    drawing: Drawing
    name: str
    title: str
    rows: tuple[int, ...]
    marks: int
    size_mm: float
    proposal: Proposal
    steps: SteppedHoles = SteppedHoles()
    sunk: tuple[int, ...] = ()
    is_divided: bool = False

    @property
    def habit(self) -> str:
        """The kind of operation that the name of the layer asks for, "" if it asks for none."""
        return _habit(self.name)

    @property
    def depth_mm(self) -> float | None:
        """The depth that the name of the layer says (`POCKET 2mm`, `d=3`), mm; None if it says
        none, and for holes, whose names say diameters."""
        match = _DEPTH.search(self.name.casefold())
        if match is None or self.habit in ("drill", "countersink"):
            return None
        depth = float(next(filter(None, match.groups())).replace(",", "."))
        return depth if 0.0 < depth <= (self.proposal.thickness_mm or MAX_DEPTH_MM) else None

    def crowded(self, width_mm: float) -> tuple[int, ...]:
        """Return the rows of closed paths beside or within which a tool of this width has
        no room."""
        crowded_rows = crowded(self.drawing, width_mm) - self.steps.rows
        return tuple(row for row in self.contours if row in crowded_rows)

    @property
    def branched(self) -> tuple[int, ...]:
        """Rows of the paths that meet at a branch, so that it is not clear what they enclose."""
        branched_rows = {path for branch in self.drawing.healing.branches for path in branch.paths}
        return tuple(row for row in self.rows if row in branched_rows)

    @property
    def holes(self) -> dict[int, float]:
        """Rows of the circles that are holes, with their diameters, mm: those within parts, or of
        a layer for holes, that hold nothing."""
        inner = self.contours if self.habit == "drill" else self.contours_that_are("inner")
        parents = set(self.drawing.nesting.levels.parent.tolist())
        empty = [row for row in inner if row not in parents]
        circles = {row: circle_of(self.drawing.paths[row]) for row in empty}
        return {row: circle[1] for row, circle in circles.items() if circle}

    @property
    def contours(self) -> tuple[int, ...]:
        """Rows of the closed paths."""
        return tuple(row for row in self.rows if self.drawing.paths.closed[row])

    def contours_that_are(self, *words: str) -> tuple[int, ...]:
        """Return the rows of closed paths that satisfy all these words of the key `select`."""
        drawing = self.drawing
        continuous = [kind.casefold() in CONTINUOUS for kind in drawing.line_types]
        edges = np.array(continuous, dtype=np.bool_)
        every = drawing.nesting.among(np.arange(len(drawing.paths)))
        rows = np.zeros(len(drawing.paths), dtype=np.bool_)
        rows[list(self.contours)] = True
        selected = Traits(every, drawing.sources, edges).selected(Operation(select=words), rows)
        return tuple(np.flatnonzero(selected).tolist())

    def without(self, parts: Sequence[Part]) -> Remaining:
        """Return what remains of the group after these operations have taken their paths and
        points."""
        parts = [part for part in parts if not part.is_shared]
        taken_rows = {row for part in parts for row in part.rows}
        return replace(
            self,
            rows=tuple(row for row in self.rows if row not in taken_rows),
            marks=self.marks - sum(part.marks for part in parts),
            is_divided=self.is_divided or any(part.rows and not part.excludes for part in parts),
        )


def _habit(name: str) -> str:
    """Return the kind of operation that the name of a layer, or its colour, suggests (a key of
    HABITS), or ""."""
    words = re.split(r"[^a-z]+", name.casefold())
    for kind, starts in HABITS.items():
        if any(word.startswith(start) for word in words for start in starts):
            return kind
    return COLOURS.get(name.casefold(), "")


def _parts(
    drawing: Drawing, group: _Group, size_mm: float, proposal: Proposal, steps: SteppedHoles
) -> list[Part]:
    """Return the operations for a group. The kinds propose in the order of their `proposal_rank`,
    each from what the kinds before it left."""
    sunk = tuple(row for row in group.paths if row in steps.sunk)
    rows, marks = tuple(row for row in group.paths if row not in sunk), len(group.marks)
    title = group.called
    remaining = Remaining(drawing, group.name, title, rows, marks, size_mm, proposal, steps, sunk)
    proposing = [kind for kind in installed_kinds().values() if kind.propose]
    parts_found: list[Part] = []
    for kind in sorted(proposing, key=lambda kind: (kind.proposal_rank, kind.name)):
        if remaining.rows or remaining.marks:
            proposed_parts: list[Part] = function_of(kind.propose)(remaining)
            parts_found += proposed_parts
            remaining = remaining.without(proposed_parts)
    excluded = [part.excludes for part in parts_found if part.excludes]
    parts_found = [part if part.excludes else _excluding(part, excluded) for part in parts_found]
    depth = remaining.depth_mm
    if depth is not None:
        depth_key = ("depth", f'"{depth:g}mm"', "as the layer is called")
        kept_keys = (
            [key for key in part.keys if key[0] not in ("depth", "tabs")] for part in parts_found
        )
        parts_found = [
            replace(part, keys=(*keys, depth_key)) if is_known("depth", part.kind) else part
            for part, keys in zip(parts_found, kept_keys, strict=True)
        ]
    return [_exact(drawing, group, part) for part in parts_found]


def _exact(drawing: Drawing, group: _Group, part: Part) -> Part:
    """Return the part with keys that select its paths exactly. If its words of `select` would take
    other paths of the group too, a range of sizes is added, or else the names of its entities
    (which still take all entities of the same name)."""
    if part.instead is not None:
        part = replace(part, instead=_exact(drawing, group, part.instead))
    own_words = {key: value for key, value, _ in part.keys if key in SELECTING_KEYS}
    rows = np.zeros(len(drawing.paths), dtype=np.bool_)
    rows[list(group.paths)] = True
    edges = np.array(
        [kind.casefold() in CONTINUOUS for kind in drawing.line_types], dtype=np.bool_
    )
    every = drawing.nesting.among(np.arange(len(rows)))
    traits = Traits(every, drawing.sources, edges)
    for extra_words in _narrower(drawing, part):
        words = {**own_words, **extra_words}
        fields = {
            OPERATION[key].field: OPERATION[key].read(Given(tomllib.loads(f"v={value}")["v"], key))
            for key, value in words.items()
        }
        taken_rows = np.flatnonzero(traits.selected(Operation(**fields), rows)).tolist()
        if taken_rows == sorted(part.rows):
            break
    added = [(key, value, "") for key, value in extra_words.items()]
    return replace(part, keys=(*(key for key in part.keys if key[0] not in extra_words), *added))


def _narrower(drawing: Drawing, part: Part) -> Iterator[dict[str, str]]:
    """Yield keys to add to the selection of a part, from the simplest: none, its range of sizes,
    the names of its entities."""
    yield {}
    if not part.rows:
        return
    lines = drawing.paths.select(part.rows)
    sizes = np.ptp(path_extents(lines), axis=2).max(axis=1)
    if not any(key == "select_size" for key, _, _ in part.keys):
        low, high = math.floor(1e3 * sizes.min()) / 1e3, math.ceil(1e3 * sizes.max()) / 1e3
        yield {"select_size": f'"{low:g}..{high:g}mm"'}
    names = dict.fromkeys(pattern_of(drawing.sources[row]) for row in part.rows)
    yield {"select_entities": f"[{', '.join(map(toml_string, names))}]"}


def _excluding(part: Part, words: Sequence[str]) -> Part:
    """Return the part with these words added to its key `select`, by which it leaves out the paths
    of other operations; parts that select only points are returned unchanged."""
    selection = {key: value for key, value, _ in part.keys}.get("select")
    if not words or selection == '["point"]':
        return part
    before = "" if selection is None else f"{selection[1:-1]}, "
    extra_words = ", ".join(toml_string(word) for word in words)
    keys = (
        ("select", f"[{before}{extra_words}]", ""),
        *(k for k in part.keys if k[0] != "select"),
    )
    return replace(part, keys=keys)


def _numbered(name: str, number: int) -> str:
    """Return the name for its first use, or "NAME (NUMBER)" for a later one."""
    return name if number == 1 else f"{name} ({number})"


def _text(drawing: Drawing, group: _Group, part: Part, proposal: Proposal) -> list[str]:
    """Return the lines of `[[operations]]` for a part of a group, with its unused keys as
    comments."""
    lines = drawing.paths.select(part.rows)
    marks = f", {part.marks} points" if part.marks else ""
    text = [
        *([f"# {_commented(part.why)}"] if part.why else []),
        "[[operations]]",
        f"name = {toml_string(part.name)}",
        f'kind = "{part.kind}"',
        _row(
            f"{group.key} = [{toml_string(pattern_of(group.name))}]",
            f"{_count_words(lines)}{marks}",
        ),
        *(_row(f"{key} = {value}", remark) for key, value, remark in part.keys),
        f"tool = {toml_string(part.tool or proposal.tool or TOOL_NAME)}",
    ]
    contract = kind_named(part.kind)
    if contract.leaves_walls and proposal.tool_mm:
        text.append(_row('direction = "climb"', OPERATION["direction"].help))
    keys = {key for key, _, _ in part.keys}
    is_through = is_known("breakthrough", part.kind) and "depth" not in keys
    if proposal.breakthrough_mm and is_through:
        through_row = f'breakthrough = "{proposal.breakthrough_mm:.6g}mm"'
        text.append(_row(through_row, "through the stock, and so far into the board below"))
        is_stepped = contract.leaves_walls and contract.descent == "passes"
        if is_stepped and proposal.tool_mm and not proposal.materials and not part.tool:
            text.append(f'step_down = "{0.5 * proposal.tool_mm:.3g}mm"')
    if marks and contract.takes != "holes":
        text.append("# The points are not cut by this: they need an operation of the kind drill.")
    given_keys = {key for key, _, _ in part.keys} | {line.split(" = ")[0] for line in text}
    if "breakthrough" in given_keys:
        given_keys.add("depth")
    known_values = {
        name: key
        for name, key in OPERATION.items()
        if is_known(name, part.kind) and name not in given_keys and key.only is None
    }
    return [*text, *_comments(known_values)]


def _count_words(lines: Polylines) -> str:
    closed = np.count_nonzero(lines.closed)
    return f"{closed} closed and {len(lines.closed) - closed} open paths"


def _comments(keys: Mapping[str, Key]) -> list[str]:
    """Return one commented line for each key, with its example, help text and possible words."""
    return [
        _row(f"# {name} = {key.example}", f"{key.help} {', '.join(key.value.choices)}".rstrip())
        for name, key in keys.items()
        if key.example
    ]


def _row(text: str, remark: str) -> str:
    return f"{text:<{_WIDTH}}# {remark}" if remark else text


def _commented(text: str) -> str:
    """Return the text made fit for a TOML comment: characters that cannot be printed become
    spaces."""
    return "".join(char if char.isprintable() else " " for char in text)


def pattern_of(name: str) -> str:
    """Return the pattern that matches this name alone, with its wildcards escaped."""
    return "".join(f"[{char}]" if char in "*?[" else char for char in name)
