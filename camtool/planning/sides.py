"""What an operation takes of a drawing, and its sides: what is part and what is hole.

An operation takes what is on its layers and in its colours, and of that what it selects by what
it is: closed or open, outer or inner by the nesting of all closed edges of the file, circles,
sizes and areas in the part, names of entities.

Sides follow from the nesting of the whole drawing, whatever an operation takes of it. A closed
contour that lies in an even number of others is the rim of a part, which stays; one that lies in
an odd number is the rim of a hole. All closed contours of the file are nested, those of other
operations and those that are not cut too, or a window cut by itself would be taken for a part.
Not every contour bounds material, though. These do not count:

- what is only engraved or carved, for the part goes on beneath it;
- the pocket or bore of another operation that is less deep than the cut: what is drawn within it
  goes through its floor (a counterbore and its bore);
- of what is not cut: what has a line type of its own, as centre lines, hidden edges and pitch
  circles have; what is on a layer of `Job.frames`; and what runs along a contour that is cut."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cached_property

import numpy as np
from msgspec import Struct, field

from camtool.arrays import Bools, Floats, Ints, distinct
from camtool.errors import OptionError
from camtool.geometry.boxes import box_pairs
from camtool.geometry.distance import nearest
from camtool.geometry.drawing import Drawing, Mark, is_text
from camtool.geometry.measure import path_extents, signed_areas
from camtool.geometry.nesting import Nesting
from camtool.geometry.polylines import Polyline, Polylines, Segments
from camtool.patterns import matches
from camtool.planning.holes import circle_of
from camtool.planning.items import Chosen
from camtool.planning.job import Job, Operation
from camtool.planning.naming import range_words
from camtool.planning.paths import midpoints

SAME_CONTOUR_MM = 0.01
"""An uncut contour that runs this near along one that is cut is the same contour drawn again."""

SIZE_SHARE = 1e-6
"""Sizes may exceed the ends of a range by this part of these, by rounding."""

CONTINUOUS = ("", "continuous", "bylayer", "byblock")
"""Line types of edges that are seen."""


class Seen(Struct, frozen=True, eq=False):
    """The sides of all contours (of `Sides.lines`) as one operation sees them.

    `rim` (M,): the contour is the edge of a part, so that its inside stays. `holder` (M,): the
    smallest contour around it, −1 if none. `by_uncut` (M,): it would be the other side without the
    contours that are not cut; `by_frames` (M,): with those that count as frames. `bounds` (M,):
    the contour bounds material."""

    rim: Bools
    holder: Ints
    by_uncut: Bools
    by_frames: Bools
    bounds: Bools


class Sides(Struct, eq=False, dict=True):
    """The M contours of a placed drawing and their sides; contours that were not chosen come after
    those that were. `names`: layer and source of each. `takes` (K, M): the mask of what each of
    the `operations` takes of them; `cuts` (K, M): the same, but for a bore only the circles. Masks
    (M,): `worked`, what any operation cuts along or clears; `edges`, what is drawn as a visible
    edge; `framed`, what is on the layer of a frame. `default_depth_mm`: the depth of operations
    that give none."""

    nesting: Nesting
    names: tuple[str, ...]
    operations: tuple[Operation, ...]
    takes: Bools
    cuts: Bools
    worked: Bools
    edges: Bools
    framed: Bools
    default_depth_mm: float
    _known: dict[bytes, Seen] = field(default_factory=dict)

    @classmethod
    def of(cls, placed_drawing: Drawing, job: Job, default_depth_mm: float) -> Sides:
        """Return the sides of a drawing in the work frame, cut by this job."""
        unchosen, lines = placed_drawing.unchosen, placed_drawing.nesting.lines
        takes = np.zeros((len(job.operations), len(lines)), dtype=np.bool_)
        names = list(zip(placed_drawing.layers, placed_drawing.colours, strict=True))
        for number, operation in enumerate(job.operations):
            takes_by_name = {name: operation.takes(*name) for name in set(names)}
            takes[number, : len(names)] = [takes_by_name[name] for name in names]
        layers = (*placed_drawing.layers, *unchosen.layers)
        types = (*placed_drawing.line_types, *unchosen.line_types)
        sources = (*placed_drawing.sources, *unchosen.sources)
        sheet = {layer for layer in set(layers) if matches(job.frames, layer)}
        edges = np.array([kind.casefold() in CONTINUOUS for kind in types], dtype=np.bool_)
        framed = np.array([layer in sheet for layer in layers], dtype=np.bool_)
        if any(operation.selects for operation in job.operations):
            traits = Traits(placed_drawing.nesting, sources, edges & ~framed)
            for number, operation in enumerate(job.operations):
                takes[number] = traits.selected(operation, takes[number])
        # Bores take circles alone, whatever else is on their layers.
        makers = [operation.contract.cuts != "at" for operation in job.operations]
        cuts = takes.copy()
        for number, operation in enumerate(job.operations):
            if operation.contract.takes == "circles":
                cuts[number] &= circles(lines, takes[number])
        return cls(
            nesting=placed_drawing.nesting,
            names=tuple(
                f"{layer}/{source}" for layer, source in zip(layers, sources, strict=True)
            ),
            operations=job.operations,
            takes=takes,
            cuts=cuts,
            worked=np.asarray(cuts[makers].any(axis=0)),
            edges=edges,
            framed=framed,
            default_depth_mm=default_depth_mm,
        )

    @property
    def lines(self) -> Polylines:
        """The M contours."""
        return self.nesting.lines

    @cached_property
    def uncut(self) -> Bools:
        """(M,) the closed contours that bound material though they are not cut."""
        return np.asarray(self._idle & ~self.framed)

    @cached_property
    def frames(self) -> Bools:
        """(M,) the uncut closed contours on layers of frames, which bound nothing for that."""
        return np.asarray(self._idle & self.framed)

    @cached_property
    def _idle(self) -> Bools:
        idle = np.asarray(self.lines.closed & self.edges & ~self.worked)
        return np.asarray(idle & ~_is_repeated(self.lines, self.worked, idle))

    def taken_by(self, operation: Operation) -> Bools:
        """Return the mask (M,) of contours that one of the operations takes."""
        return np.asarray(self.takes[self.operations.index(operation)])

    def cut_by(self, operation: Operation) -> Bools:
        """Return the mask (M,) of contours that one of the operations takes and cuts."""
        return np.asarray(self.cuts[self.operations.index(operation)])

    def seen_by(self, operation: Operation) -> Seen:
        """Return the sides of all contours for a profile of this operation."""
        depth = self._depth(operation)
        cut = self._taken(
            each.contract.runs_beside or (each.contract.clears and self._depth(each) >= depth)
            for each in self.operations
        )
        bounds = cut | self.uncut
        key = bounds.tobytes()
        if key not in self._known:
            levels = self.nesting.levels_by(bounds)
            rim = levels.depth % 2 == 0
            less = self._rim(cut) if self.uncut.any() else rim
            more_rim = self._rim(bounds | self.frames) if self.frames.any() else rim
            self._known[key] = Seen(rim, levels.parent, less != rim, more_rim != rim, bounds)
        return self._known[key]

    def sided(self) -> Bools:
        """Return the mask (M,) of contours that a profile follows on one side, so that the other
        side stays."""
        return self._taken(map(runs_beside, self.operations))

    def kept_from(self, pocket: Operation) -> Bools:
        """Return the mask (M,) of contours whose inside must stay when `pocket` is cut: those that
        profiles at most as deep as the pocket cut out."""
        is_kept = np.zeros(len(self.lines), dtype=np.bool_)
        for number, each in enumerate(self.operations):
            if runs_beside(each) and self._depth(each) <= self._depth(pocket):
                is_kept |= self.takes[number] & self.lines.closed & self.holds(each)
        return is_kept

    def holds(self, profile: Operation) -> Bools:
        """Return the mask (M,) of contours whose inside stays if this profile runs beside them."""
        if profile.side == "auto":
            return self.seen_by(profile).rim
        return np.full(len(self.lines), profile.side == "outside")

    @cached_property
    def beyond_mm(self) -> Floats:
        """(M, 2) how far profiles cut beyond contours, mm: where what is without them stays, and
        where what is within them stays."""
        amounts = np.zeros((len(self.lines), 2))
        for number, each in enumerate(self.operations):
            if each.beyond_mm and runs_beside(each):
                rows = np.flatnonzero(self.cuts[number] & self.lines.closed)
                np.maximum.at(amounts, (rows, self.holds(each)[rows].astype(int)), each.beyond_mm)
        return amounts

    def _rim(self, bounds: Bools) -> Bools:
        return np.asarray(self.nesting.levels_by(bounds).depth % 2 == 0)

    def _taken(self, is_chosen: Iterable[bool]) -> Bools:
        """Return the mask (M,) of closed contours that any operation in the mask
        `is_chosen` cuts."""
        return np.asarray(self.lines.closed & self.cuts[list(is_chosen)].any(axis=0))

    def _depth(self, operation: Operation) -> float:
        return self.default_depth_mm if operation.depth_mm is None else operation.depth_mm

    def why(self, operation: Operation, row: int) -> str:
        """Return the reason, in a few words, why an operation's tool runs on this side of a
        contour."""
        if not self.lines.closed[row]:
            return "it is open"
        if operation.side != "auto":
            return "the job says so"
        if not runs_beside(operation):
            return "the tool has no width"
        seen_sides = self.seen_by(operation)
        holder = int(seen_sides.holder[row])
        frame = " except what is on the layer of a frame" if seen_sides.by_frames[row] else ""
        if holder < 0:
            return f"nothing is around it{frame}"
        uncut = ", which is not cut" if self.uncut[holder] else ""
        holder_kind = "hole" if seen_sides.rim[row] else "part"
        return f"within the {holder_kind} {self.names[holder]}{uncut}{frame}"


class Traits:
    """Traits of M paths, each computed when an operation first asks for it. `edges` (M,): the
    paths by whose nesting outer and inner ones are told."""

    def __init__(self, nesting: Nesting, sources: tuple[str, ...], edges: Bools) -> None:
        self._nesting, self._sources, self._edges = nesting, sources, edges
        self._lines = nesting.lines

    def selected(self, operation: Operation, rows: Bools) -> Bools:
        """Return the mask (M,) of the paths in the mask `rows` that the operation selects."""
        rows = rows.copy()
        for word in operation.select:
            rows &= self._are(word, rows)
        if operation.size_mm is not None:
            rows &= _is_within(
                np.ptp(path_extents(self._lines), axis=2).max(axis=1), operation.size_mm
            )
        if operation.area_mm2 is not None:
            areas = np.where(self._lines.closed, np.abs(signed_areas(self._lines)), np.nan)
            rows &= _is_within(areas, operation.area_mm2)
        if operation.entities:
            for row in np.flatnonzero(rows).tolist():
                rows[row] = is_named(operation, self._sources[row])
        return rows

    def _are(self, word: str, rows: Bools) -> Bools:
        """Return the mask (M,) of paths of which a word of `select` is true; only those in the
        mask `rows` are of interest."""
        closed = self._lines.closed
        if word in ("circle", "not circle"):
            is_circle = circles(self._lines, rows)
            return is_circle if word == "circle" else ~is_circle
        if word in ("text", "not text"):
            text = np.array([is_text(source) for source in self._sources], dtype=np.bool_)
            return text if word == "text" else ~text
        if word == "point":
            return np.zeros(len(rows), dtype=np.bool_)
        if word in ("outer", "inner"):
            return np.asarray(closed & (self._depth % 2 == (word == "inner")))
        return np.asarray(closed if word == "closed" else ~closed)

    @cached_property
    def _depth(self) -> Ints:
        """(M,) in how many closed edges each path lies."""
        return self._nesting.levels_by(self._edges).depth


def circles(lines: Polylines, rows: Bools) -> Bools:
    """Return the mask (M,) of paths in the mask `rows` (M,) that are full circles."""
    is_circle = np.zeros(len(rows), dtype=np.bool_)
    for row in np.flatnonzero(rows & lines.closed).tolist():
        is_circle[row] = circle_of(lines[row]) is not None
    return is_circle


def _is_within(sizes: Floats, limits: tuple[float, float]) -> Bools:
    """Return the mask (M,) of sizes within a range, its ends included; NaN is in none."""
    low, high = limits
    return np.asarray((sizes >= low * (1.0 - SIZE_SHARE)) & (sizes <= high * (1.0 + SIZE_SHARE)))


def is_named(operation: Operation, source: str) -> bool:
    """Return True if an operation takes the entity of this name, such as "CIRCLE 2F": by the whole
    name, or by the part after the kind (the handle, or the id)."""
    names = [source, source.partition(" ")[2]]
    return not operation.entities or any(matches(operation.entities, name) for name in names)


def takes_mark(operation: Operation, mark: Mark) -> bool:
    """Return True if an operation takes a single point. A point has no size, and the only word of
    `select` that is true of it is "point"."""
    if operation.size_mm is not None or operation.area_mm2 is not None:
        return False
    if operation.select and operation.select != ("point",):
        return False
    return operation.takes(mark.layer, mark.colour) and is_named(operation, mark.source)


def _selection(operation: Operation) -> str:
    """Return text on what an operation selects."""
    words = list(dict.fromkeys(operation.select))
    for key, limits, unit in (
        ("size", operation.size_mm, "mm"),
        ("area", operation.area_mm2, "mm²"),
    ):
        if limits is not None:
            words.append(f"of {key} {range_words(limits)} {unit}")
    if operation.entities:
        words.append(f"named {' or '.join(operation.entities)}")
    return " and ".join(words)


def runs_beside(operation: Operation) -> bool:
    """Return True if an operation runs beside its closed contours rather than on them."""
    if not operation.contract.runs_beside or operation.side == "on":
        return False
    return operation.away_mm > 0.0


def _is_repeated(lines: Polylines, cut: Bools, idle: Bools) -> Bools:
    """Return the mask (M,) of uncut closed contours (`idle`) that coincide with one that is cut,
    or with an earlier uncut one."""
    is_repeat = np.zeros(len(lines), dtype=np.bool_)
    other_rows = np.flatnonzero((cut & lines.closed) | idle)
    idle_rows = np.flatnonzero(idle)
    if len(idle_rows) == 0:
        return is_repeat
    boxes = path_extents(lines)
    corners = np.concatenate([boxes[:, :, 0], boxes[:, :, 0]], axis=1)  # as boxes of no size
    for one, other in box_pairs(corners[idle_rows], corners[other_rows], reach_mm=SAME_CONTOUR_MM):
        k, row = idle_rows[one], other_rows[other]
        is_alike = np.abs(boxes[k] - boxes[row]).max(axis=(1, 2)) <= SAME_CONTOUR_MM
        is_alike &= cut[row] | (row < k)
        for each, along in zip(k[is_alike].tolist(), row[is_alike].tolist(), strict=True):
            is_repeat[each] = is_repeat[each] or _runs_along(lines[each], lines[along])
    return is_repeat


def _runs_along(path: Polyline, other: Polyline) -> bool:
    segments = Segments.of(path)
    points = np.concatenate([segments.start, midpoints(segments)])
    return bool((nearest(points, Segments.of(other)).distance <= SAME_CONTOUR_MM).all())


def regions_of(nesting: Nesting, rim: Bools) -> Iterator[Bools]:
    """Yield masks of closed contours that bound one region together: first those whose side by
    nesting agrees with `rim` (True for the edge of a part), then those for which it is reversed
    because of contours that were not chosen, and then the others by nesting depth and side."""
    is_open = np.ones(len(rim), dtype=np.bool_)
    for even in (True, False):
        region = is_open.copy()
        while region.any():
            rows = np.flatnonzero(region)
            depth = nesting.among(rows).levels.depth
            wrong = ((depth % 2 == 0) == even) != rim[rows]
            if not wrong.any():
                yield region
                break
            region[rows[wrong]] = False
        is_open &= ~region
    depth = nesting.levels.depth
    for level in distinct(depth[is_open]).tolist():
        for is_rim in (True, False):
            region = is_open & (depth == level) & (rim == is_rim)
            if region.any():
                yield region


def choose(drawing: Drawing, operation: Operation, sides: Sides) -> Chosen:
    """Return what an operation takes of a drawing in the work frame, with the sides of that
    drawing.

    OptionError, which lists what there is, if the drawing is not empty but the operation takes
    nothing of it."""
    index = np.flatnonzero(sides.taken_by(operation)).tolist()
    marks = [mark for mark in drawing.marks if takes_mark(operation, mark)]
    is_owed = operation.contract.takes_drawn
    if is_owed and not (index or marks) and (len(drawing.paths) or drawing.marks):
        raise _nothing_selected(drawing, operation)
    return Chosen(
        nesting=sides.nesting.among(np.array(index, dtype=np.int64)),
        source=np.array(index, dtype=np.int64),
        names=tuple(sides.names[i] for i in index),
        points=np.array([mark.at_mm for mark in marks], dtype=np.float64).reshape(len(marks), 2),
        point_names=tuple(f"{mark.layer}/{mark.source}" for mark in marks),
        rim=_rim(operation, sides, index),
        file=drawing.file,
    )


def _rim(operation: Operation, sides: Sides, index: list[int]) -> Bools:
    """Return the mask (M,) of the chosen paths that are edges of parts, for a profile, which needs
    it. For nets the edges of copper: an area of its own, whatever outline lies around it."""
    if operation.contract.frees_nets:
        levels = sides.nesting.among(np.array(index, dtype=np.int64)).levels
        return np.asarray(levels.depth % 2 == 0)
    if operation.side == "auto" and runs_beside(operation):
        return sides.seen_by(operation).rim[index]
    return np.full(len(index), operation.side == "outside")


def _nothing_selected(drawing: Drawing, operation: Operation) -> OptionError:
    marks = drawing.marks
    layers = sorted({*drawing.layers, *(mark.layer for mark in marks)})
    colours = sorted({*drawing.colours, *(mark.colour for mark in marks)} - {""})
    conditions = [f"the layers {', '.join(operation.layers)}"] if operation.layers else []
    conditions += [f"the colours {', '.join(operation.colours)}"] if operation.colours else []
    if operation.selects:
        place = f" on {' and '.join(conditions)}" if conditions else ""
        return OptionError(
            f"nothing{place} is {_selection(operation)}",
            file=drawing.file,
            where=f"operation {operation.name!r}" if operation.name else "",
            mend="camtool check says what there is",
        )
    contents = f"the drawing has: {', '.join(layers)}"
    if operation.colours:
        contents += f"; colours {', '.join(colours) or 'none'}"
    return OptionError(
        f"no path lies on {' and '.join(conditions)}",
        file=drawing.file,
        where=f"operation {operation.name!r}" if operation.name else "",
        mend=contents,
    )
