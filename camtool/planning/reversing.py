"""Fewer reversals while cutting: contours cut as runs in which no axis reverses.

Each change of an axis's direction makes its slide cross the backlash, costs a compensation, and
leaves an error where it happens. The PIC thesis saw parts fail above 16 of them (L3052-3057,
L3207-3211) and saved them by machining in mirror halves (L2816-2841). So each contour is divided
where an axis reverses (`Division`), the runs are cut in the directions that leave the smaller
error, and every run is approached so that its axes are engaged (`Approaches`): all reversals
happen in the air.

A contour stays in one piece where the job asks for what only a whole one can have: leads, tabs,
a ramp, a start by rule or by hand. Of the others of those, only the start is chosen. What cuts
climb or conventionally keeps its direction, divided or not.

    path ──parts_of──▶ parts of one direction in x and one in y ──reversals_along──▶ reversals
    parts, reversals ──▶ places where it may be divided ──▶ the cheapest division ──▶ pieces"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import cached_property
from itertools import chain, pairwise

import numpy as np
from msgspec import Struct, field

from camtool.arrays import Floats, Ints, distinct
from camtool.findings import Finding
from camtool.geometry.distance import point_to_segment
from camtool.geometry.measure import point_at, segment_lengths
from camtool.geometry.polylines import POSITION_EPS_MM, Polyline, Segments, reverse
from camtool.kernels.play import play_limits
from camtool.machine.model import Axis, Machine, PlayCells, SlideStart
from camtool.planning.findings import (
    PLAY_NOT_KNOWN_TO_SAVE,
    REVERSALS_IN_AIR,
    REVERSALS_IN_AIR_NOT,
)
from camtool.planning.items import Contour, CutRun, Fixed, Item, Items
from camtool.planning.job import Operation
from camtool.planning.paths import flat_path
from camtool.records import replace
from camtool.units import UM_PER_MM

ALIKE_MM = 1e-4
"""Predicted errors that differ by less are equal: a tenth of a micrometre, below a step."""

SAMPLES = 9
"""Number of points of each part that are shifted by the error, to find their distance from the
path: on a quarter of a circle the greatest distance is then found within 0.5 %."""

APPROACH_MARGIN_MM = 0.05
"""An approach is longer by this much than the backlash that compensation leaves, because backlash
varies over a table (on the PIC machine by 14 µm in X and 28 µm in Y, L2370-2373)."""

REVERSAL_STEPS = 0.5
"""An axis has reversed when it has come back by this much of a coded step, as in the simulation of
controllers that follow paths."""


class _Sums(Struct):
    """Sums over all contours: the runs, the reversals while cutting, and the greatest predicted
    error."""

    runs: int = 0
    reversals: int = 0
    error_mm: float = 0.0

    def add(self, runs: int, reversals: int, error_mm: float) -> None:
        """Add the figures of one contour."""
        self.runs += runs
        self.reversals += reversals
        self.error_mm = max(self.error_mm, error_mm)


class _Counts(Struct):
    """The figures before and after the division; `whole`: the reasons why contours were not
    divided, with the names of these contours."""

    before: _Sums = field(default_factory=_Sums)
    after: _Sums = field(default_factory=_Sums)
    whole: dict[str, list[str]] = field(default_factory=dict)


def fewer_reversals(items: Items, machine: Machine) -> tuple[Items, tuple[Finding, ...]]:
    """Replace contours by runs in which no axis reverses while cutting, in the order of the
    contours; return all items, and findings that compare the figures before and after. `Fixed`
    items stay.

    An axis without backlash and compensation may reverse anywhere. The runs of a contour together
    are the contour: they meet exactly, keep its name, source and setting, and know the whole path
    as their `outline`. If neither axis has backlash or compensation nothing is changed, and the
    finding is `PLAY_NOT_KNOWN`."""
    residual = residuals(machine)
    if not any(each.matters for each in residual):
        return items, (PLAY_NOT_KNOWN_TO_SAVE(where="axes x, y", machine=machine.target.name),)
    counts = _Counts()
    items_made: list[Item] = []
    for item in items:
        if isinstance(item, Fixed):
            items_made.append(item)
        else:
            items_made.extend(_runs_of(item, machine, residual, counts))
    return tuple(items_made), tuple(_findings(counts))


def _runs_of(
    contour: Contour, machine: Machine, residual: tuple[Residual, Residual], counts: _Counts
) -> list[Item]:
    parts = parts_of(contour.path)
    reversals = _reversals(parts, machine, residual)
    division = Division.of(
        parts, reversals, residual, either_direction=not _keeps_direction(contour)
    )
    closed, levels = contour.path.closed, len(contour.setting.levels_mm)
    count, error_mm = len(reversals[0]) + len(reversals[1]), drawn_error_mm(division)
    at_start = count - sum(each.count_within(len(parts)) for each in reversals)
    runs = 1 if closed or contour.reversible else levels
    counts.before.add(runs, count * levels - at_start, error_mm)
    reason = _stays_whole(contour.setting.operation)
    if not count and (closed or reason):
        counts.after.add(runs, 0, error_mm)
        return [contour]
    if not reason:
        pieces = division.pieces()
        counts.after.add(len(pieces) * levels, 0, max(piece.error_mm for piece in pieces))
        return [
            _run_of_contour(contour, parts.subpath(piece.first, piece.last), piece.backward)
            for piece in pieces
        ]
    counts.whole.setdefault(reason, []).append(contour.name)
    if closed and contour.setting.operation.start == "nearest":
        contour, at_start = _begun_at_reversals(contour, parts, reversals)
    counts.after.add(runs, count * levels - at_start, error_mm)
    return [contour]


def _reversals(
    parts: Parts, machine: Machine, residual: tuple[Residual, Residual]
) -> tuple[AxisReversals, AxisReversals]:
    x, y = (
        reversals_along(parts.places[:, index], parts.path.closed, least_reversal_mm(axis))
        if residual[index].matters
        else no_reversals(len(parts))
        for index, axis in enumerate((machine.axes.x, machine.axes.y))
    )
    return x, y


def _keeps_direction(contour: Contour) -> bool:
    """Return True if the contour must keep its direction, since the job sets climb or conventional
    and the contour has a wall."""
    operation = contour.setting.operation
    wide = operation.tool.diameter_mm > 0.0 and contour.material_left is not None
    return operation.direction != "drawn" and wide


def may_divide(operation: Operation) -> bool:
    """Return True if contours of this operation may be divided into several runs."""
    return not _stays_whole(operation)


def _stays_whole(operation: Operation) -> str:
    """Return the reason why contours of this operation are not divided, "" if they may be."""
    if operation.tabs is not None:
        return "tabs are counted along whole contours"
    if operation.lead_in.kind != "none" or operation.lead_out.kind != "none":
        return "each run would need leads of its own"
    if operation.entry.kind != "plunge":
        return "the way down along the contour would reverse in each run"
    if operation.start != "nearest":
        return "the job says where contours start"
    return ""


def _run_of_contour(contour: Contour, path: Polyline, backward: bool) -> Contour:
    """Return a run of a contour; a run that is the whole of an open contour gets no `outline`."""
    material_left = contour.material_left
    return replace(
        contour,
        path=reverse(path) if backward else path,
        reversible=False,
        starts=np.empty(0, dtype=np.int64),
        material_left=material_left if material_left is None else material_left != backward,
        outline=contour.path if contour.path.closed else contour.outline,
    )


def _begun_at_reversals(
    contour: Contour, parts: Parts, reversals: tuple[AxisReversals, AxisReversals]
) -> tuple[Contour, int]:
    """Return the closed contour with only those starts at which the most reversals fall into the
    air (before and after the cut), and the number of these reversals: at most one of X and one of
    Y."""
    count = len(parts)
    if len(contour.starts):
        places = np.flatnonzero(parts.begin == 0.0)[contour.starts]
    else:
        ends = [np.append(each.first, each.last) for each in reversals]
        places = distinct(np.concatenate(ends) % count)
    if len(places) == 0:
        return contour, 0
    held_axes = [
        ((places[:, None] - each.first) % count <= each.last - each.first).any(axis=1)
        for each in reversals
    ]
    saved = held_axes[0].astype(np.int64) + held_axes[1]
    best = saved == saved.max()
    if len(contour.starts):
        return replace(contour, starts=contour.starts[best]), int(saved.max())
    path, starts = parts.with_vertices(places[best])
    return replace(contour, path=path, starts=starts), int(saved.max())


def _findings(counts: _Counts) -> Iterator[Finding]:
    before, after = counts.before, counts.after
    if before.reversals:
        yield REVERSALS_IN_AIR(
            measured=after.reversals,
            limit=before.reversals,
            runs_before=before.runs,
            runs_after=after.runs,
            after_um=after.error_mm * UM_PER_MM,
            before_um=before.error_mm * UM_PER_MM,
        )
    for reason, names in counts.whole.items():
        yield REVERSALS_IN_AIR_NOT(where=names[0], measured=len(names), reason=reason)


class RunPiece(Struct, frozen=True):
    """A piece from place `first` to place `last` of the parts (beyond their number on a closed
    path), cut from its end to its start if `backward`. Its greatest predicted error, mm; its error
    for the axes driven in their worse direction, mm; and the sum of its parts' errors times their
    lengths, mm²."""

    first: int
    last: int
    backward: bool
    error_mm: float
    spread_mm: float
    weight_mm2: float


class Division(Struct, frozen=True, eq=False):
    """A path to be divided into runs in which no axis reverses, each in the direction that errs
    less: its parts, the reversals of both axes along them, the residual errors of both axes;
    `either_direction`: pieces may be cut backward.

    On the PIC machine a contour cut in one go showed errors that vanished when it was cut as two
    halves, both from one point («maquinado en espejo», L2816-2841, L3200-3202): each half drives
    each axis in one direction only, so that the backlash stays taken up. Here every contour
    becomes such runs.

    The path must be divided somewhere on the span of each reversal; one place may serve both axes
    (the corner of a square). Only the ends of spans need to be tried. Of all divisions the one
    with the smallest greatest error is taken; then with the fewest runs; then that which drives
    the axes in one direction throughout, as far as it can, so that the error is the same all over
    the part; then with the smallest error over its length: two passes of dynamic programming along
    the path."""

    parts: Parts
    reversals: tuple[AxisReversals, AxisReversals]
    residual: tuple[Residual, Residual]
    errors: Floats
    lengths: Floats
    either_direction: bool

    @classmethod
    def of(
        cls,
        parts: Parts,
        reversals: tuple[AxisReversals, AxisReversals],
        residual: tuple[Residual, Residual],
        *,
        either_direction: bool,
    ) -> Division:
        """Return the division of a path with these parts and reversals, with the predicted errors
        of all parts computed."""
        lengths = segment_lengths(parts.segments)
        return cls(
            parts, reversals, residual, part_errors(parts, residual), lengths, either_direction
        )

    def pieces(self) -> list[RunPiece]:
        """Return the runs into which the path is divided, in its order; together they are the
        path."""
        if not self.parts.path.closed:
            return _cheapest(self, 0)[1]
        reversals = [(t.first, t.last) for t in self.reversals if len(t)]
        if not reversals:
            return _cheapest(self, 0)[1]
        first, last = (np.concatenate(column) for column in zip(*reversals, strict=True))
        shortest = int((last - first).argmin())
        begins = _division_places(self, int(first[shortest]), int(last[shortest]))
        return min((_cheapest(self, begin) for begin in begins), key=lambda each: each[0])[1]

    def variants(self, first: int, last: int) -> list[RunPiece]:
        """Return the piece between two places in each direction in which it may be cut; no axis
        may reverse between them."""
        directions = (1, -1) if self.either_direction else (1,)
        return [self._piece(first, last, direction) for direction in directions]

    def _piece(self, first: int, last: int, direction: int) -> RunPiece:
        index = np.arange(first, last) % len(self.parts)
        columns, spread_mm = [], 0.0
        for reversals, residual in zip(self.reversals, self.residual, strict=True):
            # An axis that stands still was approached in its better direction.
            sense = direction * int(np.sign(reversals.sense[index].sum())) or residual.better
            columns.append(int(sense > 0))
            if sense != residual.better:
                spread_mm += abs(residual.plus_mm - residual.minus_mm)
        errors = self.errors[index, columns[0], columns[1]]
        weight = float(errors @ self.lengths[index])
        return RunPiece(first, last, direction < 0, float(errors.max()), spread_mm, weight)


def part_errors(parts: Parts, residual: tuple[Residual, Residual]) -> Floats:
    """Return (A, 2, 2) mm: the predicted distance of each part's cut from the path, with X driven
    towards −, + (second index) and Y towards −, + (third index). Points of the part, moved by the
    residual errors, are compared with the part and its two neighbours; elsewhere the path may pass
    nearer, where it is as fine as the errors."""
    count, segments = len(parts), parts.segments
    rows = np.repeat(np.arange(count), SAMPLES)
    points = point_at(segments, rows, np.tile(np.linspace(0.0, 1.0, SAMPLES), count))
    near_rows = [rows, rows - 1, rows + 1]
    near_rows = [row % count if parts.path.closed else row.clip(0, count - 1) for row in near_rows]
    errors = np.zeros((count, 2, 2))
    for i, x in enumerate((residual[0].minus_mm, residual[0].plus_mm)):
        for j, y in enumerate((residual[1].minus_mm, residual[1].plus_mm)):
            if x or y:
                shifted = points + np.array([x, y])
                distances = np.min(
                    [point_to_segment(shifted, segments[row]) for row in near_rows], axis=0
                )
                errors[:, i, j] = distances.reshape(count, SAMPLES).max(axis=1)
    return errors


def drawn_error_mm(division: Division) -> float:
    """Return the greatest predicted error, mm, if the path is cut as drawn, in one go."""
    columns = []
    for axis, reversals in enumerate(division.reversals):
        sense, better = reversals.sense, division.residual[axis].better
        # An axis that stands still stays where it was driven to last.
        last = np.maximum.accumulate(np.where(sense != 0, np.arange(len(sense)), -1))
        is_held_high = np.where(last >= 0, sense[last], better)
        columns.append((is_held_high > 0).astype(np.int64))
    rows = np.arange(len(division.parts))
    return float(division.errors[rows, columns[0], columns[1]].max())


Cost = tuple[int, float, float]
"""Number of pieces, the sum of their spreads, and the sum of their errors times lengths."""


def _cheapest(division: Division, begin: int) -> tuple[tuple[int, Cost], list[RunPiece]]:
    """Return the best division of the path from place `begin` once round (or to the end): its
    greatest error in units of ALIKE_MM together with its cost, and its pieces."""
    places = _division_places(division, begin, begin + len(division.parts))
    pieces = list(_possible_pieces(division, places))
    greatest = [0.0] + [np.inf] * (len(places) - 1)
    for i, j, piece in pieces:
        greatest[j] = min(greatest[j], max(greatest[i], piece.error_mm))
    best: list[Cost] = [(0, 0.0, 0.0)] + [(len(places), 0.0, 0.0)] * (len(places) - 1)
    arrivals: list[tuple[int, RunPiece] | None] = [None] * len(places)
    for i, j, piece in pieces:
        count, spread, weight = best[i]
        cost = count + 1, spread + piece.spread_mm, weight + piece.weight_mm2
        if piece.error_mm <= greatest[-1] + ALIKE_MM and cost < best[j]:
            best[j], arrivals[j] = cost, (i, piece)
    return (round(greatest[-1] / ALIKE_MM), best[-1]), _trace_back(arrivals)


def _trace_back(arrivals: Sequence[tuple[int, RunPiece] | None]) -> list[RunPiece]:
    pieces: list[RunPiece] = []
    step = arrivals[-1]
    while step is not None:
        pieces.append(step[1])
        step = arrivals[step[0]]
    return pieces[::-1]


def _possible_pieces(division: Division, places: list[int]) -> Iterator[tuple[int, int, RunPiece]]:
    """Yield (i, j, piece) for pieces from places[i] to places[j] in all permitted directions, in
    the order of i. Each ends no later than the first reversal that begins after its start."""
    reach = _reaches(division, np.array(places, dtype=np.int64))
    for i, first in enumerate(places):
        for j in range(i + 1, len(places)):
            if places[j] > reach[i]:
                break
            for piece in division.variants(first, places[j]):
                yield i, j, piece


def _reaches(division: Division, places: Ints) -> Floats:
    """Return (P,) the farthest place that a piece from each of the places can reach without a
    reversal; inf if there is none ahead."""
    count = len(division.parts)
    laps = np.arange(3 if division.parts.path.closed else 1) * count
    first = np.concatenate([(t.first + laps[:, None]).ravel() for t in division.reversals])
    last = np.concatenate([(t.last + laps[:, None]).ravel() for t in division.reversals])
    order = np.argsort(first, kind="stable")
    # Of all reversals that begin after a place, the one that ends first.
    soonest = np.minimum.accumulate(np.append(last[order], np.inf)[::-1])[::-1]
    return np.asarray(soonest[np.searchsorted(first[order], places, side="right")])


def _division_places(division: Division, begin: int, end: int) -> list[int]:
    """Return the places from `begin` to `end` at which a path may be divided: these two, the ends
    of all spans of reversals, and where an axis of an open path begins or ends to move."""
    count, places = len(division.parts), {begin, end}
    for reversals in division.reversals:
        places.update(reversals.first.tolist(), reversals.last.tolist(), reversals.moves or ())
    if division.parts.path.closed:
        places |= {place + count for place in places} | {place + 2 * count for place in places}
    return sorted(place for place in places if begin <= place <= end)


class Parts(Struct, frozen=True, eq=False, dict=True):
    """A path as A parts in its order, each a line, or an arc within one quadrant: arcs are split
    where their tangent lies along an axis. Part i goes from place i to place i + 1 of `places`
    (A+1, 2) mm (the last is the first when closed), and is the share `begin` to `end` (A,) of the
    segment `row` (A,) of the path."""

    path: Polyline
    row: Ints
    begin: Floats
    end: Floats
    places: Floats

    def __len__(self) -> int:
        return len(self.row)

    @cached_property
    def segments(self) -> Segments:
        """The parts as lines and arcs, A rows."""
        sweep = Segments.of(self.path).sweep[self.row]
        bulge = np.tan(0.25 * sweep * (self.end - self.begin))
        return Segments.between(self.places[:-1], self.places[1:], bulge)

    def subpath(self, first: int, last: int) -> Polyline:
        """Return the open path from place `first` to place `last`; on a closed path, places beyond
        A go on round.

        Parts of one segment are joined again."""
        index = np.arange(first, last) % len(self)
        row, count = self.row[index], len(index)
        is_new = np.ones(count, dtype=np.bool_)
        is_new[1:] = (row[1:] != row[:-1]) | (self.begin[index[1:]] != self.end[index[:-1]])
        head = np.flatnonzero(is_new)
        tail = np.append(head[1:], count) - 1
        share = self.end[index[tail]] - self.begin[index[head]]
        bulge = np.append(_bulges(self.path, row[head], share), 0.0)
        places = self.places[np.append(index[head], index[-1] + 1)]
        return Polyline(np.column_stack([places, bulge]))

    def with_vertices(self, places: Ints) -> tuple[Polyline, Ints]:
        """Return the closed path with vertices added at these places, and the indices of these
        vertices."""
        keep = np.union1d(np.flatnonzero(self.begin == 0.0), places)
        last = np.append(keep[1:], len(self)) - 1
        bulge = _bulges(self.path, self.row[keep], self.end[last] - self.begin[keep])
        path = Polyline(np.column_stack([self.places[keep], bulge]), closed=True)
        return path, np.searchsorted(keep, places)


def _bulges(path: Polyline, row: Ints, share: Floats) -> Floats:
    """Return the bulges of shares of segments (shares (K, 2) of rows (K,)); a whole segment keeps
    its bulge to the last bit."""
    bulge = path.vertices[row, 2]
    return np.asarray(np.where(share == 1.0, bulge, np.tan(np.arctan(bulge) * share)))


def parts_of(path: Polyline) -> Parts:
    """Return the path as parts, with its arcs split where their tangents lie along an axis.

    The tangent of an arc turns from chord direction − sweep/2 to chord direction + sweep/2; it
    lies along an axis at the multiples of 90° between, of which |sweep| ≤ 180° has three at most.
    No part is shorter than `POSITION_EPS_MM`."""
    segments = Segments.of(path)
    quarter = 0.5 * np.pi
    chord, sweep = segments.end - segments.start, segments.sweep
    first = np.arctan2(chord[:, 1], chord[:, 0]) - 0.5 * sweep
    lowest = np.ceil(np.minimum(first, first + sweep) / quarter)
    tangents = (lowest[:, None] + np.arange(3.0)) * quarter
    total_sweep = np.where(segments.is_arc, sweep, 1.0)
    share = (tangents - first[:, None]) / total_sweep[:, None]
    min_share = (POSITION_EPS_MM / segment_lengths(segments))[:, None]
    inner = segments.is_arc[:, None] & (share > min_share) & (share < 1.0 - min_share)
    arc, tangent_index = np.nonzero(inner)
    row = np.concatenate([np.arange(len(segments)), arc])
    begin = np.concatenate([np.zeros(len(segments)), share[arc, tangent_index]])
    order = np.lexsort([begin, row])
    row, begin = row[order], begin[order]
    at_end = np.append(row[1:] != row[:-1], True)
    end = np.where(at_end, 1.0, np.append(begin[1:], 1.0))
    places = np.where((begin == 0.0)[:, None], segments.start[row], point_at(segments, row, begin))
    return Parts(path, row, begin, end, np.concatenate([places, path.end[None, :]]))


class AxisReversals(Struct, frozen=True, eq=False):
    """Reversals of one axis along A parts.

    The positions of the axis are a list of values, and it reverses at its highest and lowest ones.
    What comes back by less than a least distance is no reversal: the controller may never see it.
    A reversal is not a point but a span: a line across the axis lies on the extreme as a whole,
    and whether it belongs to the motion before or after is free.

    `sense` (A,): the direction ±1 in which the axis is driven on each part; 0 on the spans of
    reversals, before the first motion and after the last one. `first`, `last` (T,): the places at
    the two ends of each span; `last` goes on beyond A where the span of a closed path holds its
    first place. `moves`: the places between which the axis of an open path moves at all; None for
    a closed one, and where it never moves."""

    sense: Ints
    first: Ints
    last: Ints
    moves: tuple[int, int] | None = None

    def __len__(self) -> int:
        return len(self.first)

    def count_within(self, count: int) -> int:
        """Return the number of reversals within the first `count` parts; those at the start of a
        closed path do not count."""
        return int(((self.first > 0) & (self.last < count)).sum())


def no_reversals(count: int) -> AxisReversals:
    """Return an AxisReversals without reversals along `count` parts, for an axis that never moves
    or does not matter."""
    no_parts = np.empty(0, dtype=np.int64)
    return AxisReversals(np.zeros(count, dtype=np.int64), no_parts, no_parts)


def reversals_along(values: Floats, closed: bool, least_mm: float) -> AxisReversals:
    """Return the reversals of at least `least_mm` in `values` (A + 1,), the positions of one axis,
    mm."""
    count = len(values) - 1
    # A closed path is begun at its highest value, which is a reversal if there are any.
    begin = int(values[:-1].argmax()) if closed else 0
    path_values = np.append(np.roll(values[:-1], -begin), values[begin]) if closed else values
    values_mm = path_values.tolist()
    extremes = _extremes(values_mm, least_mm)
    if not extremes:
        return no_reversals(count)
    if closed:
        extremes[0], extremes[-1] = 0, count
    sense = np.zeros(count, dtype=np.int64)
    for one, other in pairwise(extremes):
        sense[one:other] = 1 if path_values[other] > path_values[one] else -1
    flats = [_flat(values_mm, extreme, closed, least_mm) for extreme in extremes]
    for low, high in flats:
        sense[np.arange(low, high) % count] = 0
    turning = np.array(flats[1:] if closed else flats[1:-1], dtype=np.int64).reshape(-1, 2)
    if not closed:
        return AxisReversals(sense, turning[:, 0], turning[:, 1], (flats[0][1], flats[-1][0]))
    turning += begin
    turning -= np.where(turning[:, :1] >= count, count, 0)
    return AxisReversals(np.roll(sense, begin), turning[:, 0], turning[:, 1])


def _extremes(values: list[float], least_mm: float) -> list[int]:
    """Return the places where the motion begins, reverses, and ends at its extreme; [] if it is
    shorter than `least_mm` throughout."""
    low = high = furthest = sense = 0
    extremes: list[int] = []
    for place, value in enumerate(values):
        if sense == 0:
            low = place if value < values[low] else low
            high = place if value > values[high] else high
            if values[high] - values[low] >= least_mm:
                extremes, furthest = [min(low, high)], place
                sense = 1 if place == high else -1
        elif (value - values[furthest]) * sense > 0.0:
            furthest = place
        elif (values[furthest] - value) * sense >= least_mm:
            extremes.append(furthest)
            furthest, sense = place, -sense
    return [*extremes, furthest] if extremes else []


def _flat(values: list[float], extreme: int, closed: bool, least_mm: float) -> tuple[int, int]:
    """Return the places before and after `extreme` up to which the values stay within `least_mm`
    of it; on a closed path they may lie before 0 or beyond its end."""
    count = len(values) - 1
    low = high = extreme
    while (closed or low > 0) and abs(values[(low - 1) % count] - values[extreme]) < least_mm:
        low -= 1
    while (closed or high < count) and abs(
        values[(high + 1) % count if closed else high + 1] - values[extreme]
    ) < least_mm:
        high += 1
    return low, high


class Approaches:
    """Points from which the tool comes, so that no axis has backlash left to cross when a cut
    begins.

    The tool goes down where it last moved to in XY. If each axis came there in the direction in
    which the cut first drives it, and over more than its backlash, its slide is engaged from the
    first step of the cut on, and the controller has nothing to compensate. An axis that the cut
    does not drive comes in the direction that leaves the smaller error: always the same one, so
    that holes and lines along the other axis keep their distances. All of this happens above the
    stock.

    It is asked run by run, with nothing between them but the moves up, across and down (a tool
    change needs a fresh one): an axis that still stands engaged from the run before goes straight
    to the start. Backlash is the largest of all regions."""

    def __init__(self, machine: Machine) -> None:
        self._drives = [
            _Drive(axis, residual)
            for axis, residual in zip(
                axes_with_largest_backlash(machine), residuals(machine), strict=True
            )
        ]

    def __call__(self, run: CutRun) -> tuple[float, float] | None:
        """Return the place (x, y), mm, to which the tool goes first at safe z. None: straight to
        the first point of the run, as always if neither axis has backlash or compensation.

        The place lies beside the run, nearer than the backlash and `APPROACH_MARGIN_MM` on each
        axis. Nothing keeps it within the travel: a nearer one would not do, and the toolpath that
        holds it is checked as a whole."""
        path = flat_path(run.vertices)
        places = run.vertices[:1, :2] if path is None else parts_of(path).places
        x, y = (
            drive.approach_from(places[:, index].tolist())
            for index, drive in enumerate(self._drives)
        )
        return None if (x, y) == (places[0, 0], places[0, 1]) else (x, y)


class _Drive:
    """An axis in motion: its position, the direction ±1 of its last move, and where that move
    began."""

    def __init__(self, axis: Axis, residual: Residual) -> None:
        self._residual = residual
        self._least_mm, self._need_mm = least_reversal_mm(axis), approach_mm(axis)
        self._at = self._since = math.nan
        self._sense = 0

    def approach_from(self, values: list[float]) -> float:
        """Return the position, mm, from which the axis must come to a run that takes it through
        these values; the first value if any position will do. The state of the drive is then that
        after the run."""
        start, sense = values[0], self._first_sense(values)
        engaged_from = self._since if sense == self._sense else self._at
        engaged = (start - self._at) * sense >= 0.0 and (
            start - engaged_from
        ) * sense >= self._need_mm
        come = start
        if self._residual.matters and not engaged:
            come = start - sense * self._need_mm
        for value in (come, *values):
            self._go(value)
        return come

    def _first_sense(self, values: list[float]) -> int:
        """Return the direction ±1 in which a run first drives the axis; the one with the smaller
        error if the run does not drive it."""
        if len(values) == 1:
            return self._residual.better
        sense = reversals_along(np.array(values), False, self._least_mm).sense
        moving = np.flatnonzero(sense)
        return int(sense[moving[0]]) if len(moving) else self._residual.better

    def _go(self, value: float) -> None:
        step = value - self._at
        if not step * self._sense >= 0.0:
            self._since, self._sense = self._at, 1 if step > 0.0 else -1
        self._at = value


def approach_mm(axis: Axis) -> float:
    """Return the distance, mm, over which an axis must be driven in one direction until its slide
    surely follows: the backlash that compensation leaves, and a margin."""
    return max(axis.backlash_mm - axis.compensation_mm, 0.0) + APPROACH_MARGIN_MM


def least_reversal_mm(axis: Axis) -> float:
    """Return the least distance, mm, that counts as a reversal of an axis."""
    return REVERSAL_STEPS * axis.coded_step_mm


class Residual(Struct, frozen=True):
    """Backlash that compensation leaves over on one axis: the error of its slide in mm when
    driven towards − and towards +; `matters`: there is backlash or compensation; `better`: the
    direction ±1 of the smaller error (where both are alike, the one in which the axis is engaged
    at first).

    An axis that has been driven in one direction for longer than its backlash stands at a fixed
    distance from where the controller believes it to be. With the backlash operator of
    `camtool.kernels.play`, low ≤ slide − motor ≤ high, and c added at each reversal from the
    direction engaged at first:

        in the first direction:   motor = position,       in the other one:   motor = position ∓ c,
        driven towards +:         slide = motor + low,    towards −:          slide = motor + high.

    The difference of the two is |backlash − c|. Compensation as exact as the backlash would leave
    none;
    the PIC machine's leaves 11.5 µm in X and 9.5 µm in Y (docs/decisions/0005-play.md)."""

    minus_mm: float
    plus_mm: float
    matters: bool
    better: int

    def error_mm(self, sense: int) -> float:
        """Return the error when driven towards `sense` ±1."""
        return self.plus_mm if sense > 0 else self.minus_mm


def backlashes_mm(axis: Axis, cells: PlayCells | None) -> tuple[float, ...]:
    """Return the backlash of an axis in each region of the table, mm."""
    return (axis.backlash_mm,) if cells is None else tuple(chain.from_iterable(cells.play_mm))


def axes_with_largest_backlash(machine: Machine) -> tuple[Axis, Axis]:
    """Return X and Y, each with the largest backlash of all regions."""
    x, y, _ = (
        replace(axis, backlash_mm=max(backlashes_mm(axis, cells)))
        for axis, cells in zip(machine.axes, machine.play_map.used, strict=True)
    )
    return x, y


def residuals(machine: Machine) -> tuple[Residual, Residual]:
    """Return the residuals of X and Y, each from the region where compensation leaves most. The
    division of a contour then depends only on its shape, not on its place, and no region leaves
    more than is reported."""
    x, y, _ = (
        max(
            (
                residual(replace(axis, backlash_mm=play), machine.controller)
                for play in backlashes_mm(axis, cells)
            ),
            key=lambda one: abs(one.plus_mm - one.minus_mm),
        )
        for axis, cells in zip(machine.axes, machine.play_map.used, strict=True)
    )
    return x, y


def residual(axis: Axis, controller: SlideStart) -> Residual:
    """Return the residual of one axis of a machine with this controller."""
    first = 1 if controller.start_direction == "+" else -1
    low, high = play_limits(axis.backlash_mm, controller.start_play, first)
    errors = {1: low, -1: high}
    errors[-first] -= first * axis.compensation_mm
    better = first if abs(errors[first]) <= abs(errors[-first]) else -first
    matters = axis.backlash_mm > 0.0 or axis.compensation_mm > 0.0
    return Residual(errors[-1], errors[1], matters, better)
