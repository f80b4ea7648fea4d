"""The measured top of a blank, and toolpaths that follow it.

A `Surface` has heights at the nodes of a grid, in the work frame of the program: 0 is the stock
top that the program was made for. Between the nodes it is bilinear. `follow` adds its height to
each cut: lines are divided where the surface bends more than a tolerance, arcs are divided into
arcs (helices), and never become chords."""

from __future__ import annotations

import math

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints, distinct
from camtool.errors import InputError, OptionError, PostError
from camtool.toolpath.lower import MAX_PARTS
from camtool.toolpath.moves import Kind, PolarArcs, Toolpath, read_only

FORMAT = "camtool surface 1"
"""First line of a surface file."""

OUTSIDE_MM = 1e-6
"""Places within this distance of the grid count as on it."""

MAX_FILL_ROUNDS = 10_000
"""Largest number of rounds in which nodes that were not probed get the mean of their
neighbours."""

FILL_MM = 1e-7
"""The rounds end when no node changes by more than this."""

MIN_NODES = 2


class Surface(Struct, frozen=True, eq=False):
    """A measured surface: heights `z` (NY, NX) mm at the nodes `x` (NX,), `y` (NY,) mm, which
    ascend.

    ValueError when the shapes disagree or a height is not finite."""

    x: Floats
    y: Floats
    z: Floats

    def __post_init__(self) -> None:
        if self.z.shape != (len(self.y), len(self.x)) or min(self.z.shape) < MIN_NODES:
            raise ValueError(f"heights {self.z.shape} at {len(self.x)} × {len(self.y)} nodes")
        if not ((np.diff(self.x) > 0.0).all() and (np.diff(self.y) > 0.0).all()):
            raise ValueError("the nodes do not ascend")
        if not np.isfinite(self.z).all():
            raise ValueError("a height is not finite")

    @property
    def range_mm(self) -> tuple[float, float]:
        """Lowest and highest height, mm."""
        return float(self.z.min()), float(self.z.max())

    def covers(self, points: Floats) -> Bools:
        """Return the mask (K,) of the points (K, 2) on the grid."""
        low = np.array([self.x[0], self.y[0]]) - OUTSIDE_MM
        high = np.array([self.x[-1], self.y[-1]]) + OUTSIDE_MM
        return np.asarray(((points >= low) & (points <= high)).all(axis=1))

    def heights(self, points: Floats) -> Floats:
        """Return the heights (K,) mm at the points (K, 2); beside the grid those of its edge."""
        column, u = _cell(self.x, points[:, 0])
        row, v = _cell(self.y, points[:, 1])
        z = self.z
        low = z[row, column] * (1.0 - u) + z[row, column + 1] * u
        high = z[row + 1, column] * (1.0 - u) + z[row + 1, column + 1] * u
        return np.asarray(low * (1.0 - v) + high * v)


def _cell(nodes: Floats, values: Floats) -> tuple[Ints, Floats]:
    """Return the index of the grid cell of each value, and its place within the cell, 0 to 1;
    values beyond the grid count as on its edge."""
    cell = np.clip(np.searchsorted(nodes, values, side="right") - 1, 0, len(nodes) - 2)
    share = (values - nodes[cell]) / (nodes[cell + 1] - nodes[cell])
    return cell, np.clip(share, 0.0, 1.0)


def filled(x: Floats, y: Floats, z: Floats) -> Surface:
    """Return the surface with the nodes that were not probed (NaN) filled in smoothly.

    Each of them gets the mean of its four neighbours, found by iteration until nothing changes by
    more than FILL_MM. ValueError if no node was probed."""
    missing = np.isnan(z)
    if missing.all():
        raise ValueError("no node was probed")
    heights = np.where(missing, float(np.nanmean(z)), z)
    for _ in range(MAX_FILL_ROUNDS if missing.any() else 0):
        around = np.pad(heights, 1, mode="edge")
        mean = 0.25 * (around[:-2, 1:-1] + around[2:, 1:-1] + around[1:-1, :-2] + around[1:-1, 2:])
        change = np.where(missing, mean - heights, 0.0)
        heights = heights + change
        if float(np.abs(change).max()) <= FILL_MM:
            break
    return Surface(np.array(x), np.array(y), heights)


def text_of_surface(surface: Surface) -> str:
    """Return the surface as the text of a file: the first line, then a row of X, and for each Y a
    row of Y and the heights; mm, separated by commas."""
    rows = [f"# {FORMAT}: mm; a row of X, then for each Y its heights"]
    rows.append(",".join(["", *(f"{value:.6g}" for value in surface.x.tolist())]))
    for y, heights in zip(surface.y.tolist(), surface.z.tolist(), strict=True):
        rows.append(",".join([f"{y:.6g}", *(f"{value:.4f}" for value in heights)]))
    return "\n".join(rows) + "\n"


def surface_of_text(text: str, file: str) -> Surface:
    """Parse the text of a surface file; an empty height was not probed. InputError names file and
    line."""
    lines = [
        (number, line.strip())
        for number, line in enumerate(text.splitlines(), 1)
        if line.strip() and not line.startswith("#")
    ]
    if FORMAT not in text.split("\n", 1)[0] or len(lines) < 1 + MIN_NODES:
        raise InputError(
            "is no surface",
            file=file,
            mend=f"its first line is '# {FORMAT}'; camtool probe writes it",
        )
    rows = []
    for number, line in lines:
        try:
            rows.append([float(each) if each.strip() else math.nan for each in line.split(",")])
        except ValueError:
            raise InputError(
                "a number is missing or wrong", file=file, where=f"line {number}"
            ) from None
        if len(rows[-1]) != len(rows[0]):
            raise InputError(
                f"{len(rows[-1]) - 1} heights, and {len(rows[0]) - 1} places in X",
                file=file,
                where=f"line {number}",
            )
    table = np.array(rows)
    if np.isnan(table[0, 1:]).any() or np.isnan(table[1:, 0]).any() or np.isinf(table).any():
        raise InputError("a place of a node is missing, or a height is infinite", file=file)
    try:
        return filled(table[0, 1:], table[1:, 0], table[1:, 1:])
    except ValueError as error:
        raise InputError(str(error), file=file) from None


def follow(toolpath: Toolpath, surface: Surface, tolerance_mm: float) -> Toolpath:
    """Return the toolpath with the height of the surface added to all cuts, within `tolerance_mm`
    of it between their ends.

    Rapids are raised by the highest place of the surface, so that their clearance is kept over
    all of it. Arcs stay arcs, as helices whose height is linear in the angle. PostError for a cut
    beside the surface and for more than `MAX_PARTS` moves; OptionError for a tolerance that is
    not above 0."""
    if not (math.isfinite(tolerance_mm) and tolerance_mm > 0.0):
        raise OptionError(f"tolerance {tolerance_mm:g} mm is not above 0")
    cuts = np.flatnonzero(toolpath.is_feed)
    _refuse_beside(toolpath, surface, cuts)
    rows: list[Ints] = []
    ends: list[Floats] = []
    starts, sweeps = toolpath.starts, toolpath.sweeps()
    count, first = 0, 0
    for row in np.flatnonzero(_are_divided(toolpath, surface, tolerance_mm)).tolist():
        shares = _shares(toolpath, row, starts[row], float(sweeps[row]), surface, tolerance_mm)
        count += len(shares)
        if count > MAX_PARTS:
            raise PostError(
                f"the toolpath would become more than {MAX_PARTS} moves",
                where=toolpath.place(row),
                mend="use a wider tolerance",
            )
        rows += [np.arange(first, row), np.full(len(shares), row)]
        ends += [
            toolpath.end[first:row],
            _points(toolpath, row, starts[row], float(sweeps[row]), shares),
        ]
        first = row + 1
    rows.append(np.arange(first, len(toolpath)))
    ends.append(toolpath.end[first:])
    row_of, end = np.concatenate(rows), np.concatenate(ends)
    added = np.full(len(row_of), surface.range_mm[1])
    cut = toolpath.is_feed[row_of]
    added[cut] = surface.heights(end[cut, :2])
    # An event stands where the move before it has ended.
    moves = toolpath.is_motion[row_of]
    last = np.maximum.accumulate(np.where(moves, np.arange(len(row_of)), -1))
    added = np.where(last >= 0, added[np.maximum(last, 0)], 0.0)
    end = end + np.column_stack([np.zeros((len(end), 2)), added])
    return toolpath.picked(row_of, end=read_only(end))


def _refuse_beside(toolpath: Toolpath, surface: Surface, cuts: Ints) -> None:
    """Raise PostError for a cut that ends beside the surface."""
    uncovered = cuts[~surface.covers(toolpath.end[cuts, :2])]
    if len(uncovered):
        x, y, _ = toolpath.end[int(uncovered[0])].tolist()
        raise PostError(
            f"cuts at X{x:.3f} Y{y:.3f}, and the surface is known from X{surface.x[0]:g} "
            f"Y{surface.y[0]:g} to X{surface.x[-1]:g} Y{surface.y[-1]:g}",
            where=toolpath.place(int(uncovered[0])),
            mend="probe a larger area",
        )


def _points(toolpath: Toolpath, row: int, start: Floats, sweep: float, shares: Floats) -> Floats:
    """Return the points (K, 3) mm of a move at these shares of its length; the point of the last
    share is the exact end."""
    end = toolpath.end[row]
    points = start + shares[:, None] * (end - start)
    if sweep:
        arm = start[:2] - toolpath.centre[row]
        far = end[:2] - toolpath.centre[row]
        radius = math.hypot(*arm) + shares * (math.hypot(*far) - math.hypot(*arm))
        angle = math.atan2(arm[1], arm[0]) + shares * sweep
        points[:, :2] = toolpath.centre[row] + radius[:, None] * np.column_stack(
            [np.cos(angle), np.sin(angle)]
        )
    points[-1] = end
    return np.asarray(points)


def _shares(
    toolpath: Toolpath,
    row: int,
    start: Floats,
    sweep: float,
    surface: Surface,
    tolerance_mm: float,
) -> Floats:
    """Return the shares (K,) of a move, up to 1, at which its parts end.

    Parts end at the lines of the grid; between these the move is divided so often that the surface
    bends by no more than the tolerance within a part."""
    end = toolpath.end[row]
    centre = toolpath.centre[row] if sweep else None
    crossings = [np.array([0.0, 1.0])]
    for axis, nodes in ((0, surface.x), (1, surface.y)):
        crossings.append(_crossings(start, end, centre, sweep, axis, nodes))
    shares = distinct(np.concatenate(crossings))
    shares = np.concatenate([shares[:-1][np.diff(shares) > 1e-12], [1.0]])
    middle = _points(toolpath, row, start, sweep, np.append(0.5 * (shares[1:] + shares[:-1]), 1.0))
    radius = math.dist(start[:2], centre) if centre is not None else 0.0
    bend = _bends(surface, middle[:-1, :2], (end - start)[None, :2], sweep, radius)
    parts = np.maximum(
        np.ceil(np.diff(shares) * np.sqrt(bend / (8.0 * tolerance_mm)) - 1e-9), 1.0
    ).astype(np.int64)
    steps = [
        low + (high - low) * np.arange(1, count + 1) / count
        for low, high, count in zip(shares[:-1], shares[1:], parts.tolist(), strict=True)
    ]
    return np.concatenate(steps)


def _crossings(
    start: Floats, end: Floats, centre: Floats | None, sweep: float, axis: int, nodes: Floats
) -> Floats:
    """Return the shares of a move, within (0, 1), at which it crosses the grid lines of one axis,
    which stand at `nodes`."""
    if centre is None:
        change = float(end[axis] - start[axis])
        if change == 0.0:
            return np.empty(0)
        shares = (nodes - start[axis]) / change
    else:
        arm = start[:2] - centre
        radius = math.hypot(*arm)
        ratio = (nodes - centre[axis]) / radius
        ratio = ratio[np.abs(ratio) <= 1.0]
        angle = np.arccos(ratio) if axis == 0 else np.arcsin(ratio)
        both = np.concatenate([angle, -angle if axis == 0 else math.pi - angle])
        turn = np.mod(np.sign(sweep) * (both - math.atan2(arm[1], arm[0])), 2.0 * math.pi)
        shares = turn / abs(sweep)
    return np.asarray(shares[(shares > 0.0) & (shares < 1.0)])


def _are_divided(toolpath: Toolpath, surface: Surface, tolerance_mm: float) -> Bools:
    """Return the mask (N,) of the cuts that may have to be divided: those that leave the cell
    of the grid in which they begin, and those along which the surface bends by more than the
    tolerance."""
    starts, sweeps = toolpath.starts[:, :2], toolpath.sweeps()
    ends = toolpath.end[:, :2]
    is_arc = toolpath.is_arc
    radius = np.where(is_arc, np.hypot(*(starts - np.nan_to_num(toolpath.centre)).T), 0.0)
    low, high = np.minimum(starts, ends), np.maximum(starts, ends)
    around = np.nan_to_num(toolpath.centre)
    low = np.where(is_arc[:, None], around - radius[:, None], low)
    high = np.where(is_arc[:, None], around + radius[:, None], high)
    leaves = np.zeros(len(toolpath), dtype=np.bool_)
    for axis, nodes in ((0, surface.x), (1, surface.y)):
        leaves |= _cell(nodes, low[:, axis])[0] != _cell(nodes, high[:, axis])[0]
    bend = _bends(surface, ends, ends - starts, sweeps, radius)
    moves = (starts != ends).any(axis=1) | is_arc
    return np.asarray(toolpath.is_feed & moves & (leaves | (bend > 8.0 * tolerance_mm)))


def _bends(
    surface: Surface, points: Floats, step: Floats, sweep: Floats | float, radius: Floats | float
) -> Floats:
    """Return upper bounds (K,) mm of the second derivative of the height by the share of a move,
    for moves that lie in the cells of these points (K, 2) each: lines by `step` (K, 2), or arcs of
    a `radius` with a `sweep` that is not 0.

    In a cell the height is a + b·x + c·y + d·x·y. Along a line its second derivative is constant,
    2·d·dx·dy. Along an arc of radius r about a centre where the slope is g, the derivative by the
    angle is at most r·g + 2·r²·d, and g is at most the greatest slope of the cell and r·d."""
    column, _ = _cell(surface.x, points[:, 0])
    row, _ = _cell(surface.y, points[:, 1])
    width = surface.x[column + 1] - surface.x[column]
    height = surface.y[row + 1] - surface.y[row]
    z = surface.z
    low, high = z[row, column], z[row, column + 1]
    low_up, high_up = z[row + 1, column], z[row + 1, column + 1]
    twist = np.abs(high_up - low_up - high + low) / (width * height)
    slope = np.hypot(
        np.maximum(np.abs(high - low), np.abs(high_up - low_up)) / width,
        np.maximum(np.abs(low_up - low), np.abs(high_up - high)) / height,
    )
    along = 2.0 * twist * np.abs(step[:, 0] * step[:, 1])
    around = np.square(sweep) * (radius * slope + 3.0 * np.square(radius) * twist)
    return np.asarray(np.where(np.asarray(sweep) != 0.0, around, along))


# A toolpath against the surface that it follows; shares no code with `follow`.

CHECKED_SHARES = 16
"""Number of places of each cut that are compared with the surface."""

VERTICAL_MM = 1e-6
"""A cut shorter than this in the plane is vertical."""


class _Cuts:
    """The cuts of a toolpath with their places along their run, the cutting between two rapids:
    `begin` and `end` (C,) are the number of the run plus the share, 0 to 1, of its length in the
    plane."""

    def __init__(self, toolpath: Toolpath) -> None:
        toolpath = toolpath.first(toolpath.executed_rows)
        self.toolpath, self.rows = toolpath, np.flatnonzero(toolpath.is_feed)
        arcs = PolarArcs(toolpath, toolpath.is_arc & toolpath.is_feed)
        self._arcs, self._arc_of = arcs, np.full(len(toolpath), -1)
        self._arc_of[arcs.row] = np.arange(len(arcs.row))
        starts = toolpath.starts_of(self.rows)
        lengths = np.hypot(*(toolpath.end[self.rows] - starts)[:, :2].T)
        turning = self._arc_of[self.rows]
        radius = 0.5 * (arcs.radius + arcs.end_radius)
        lengths[turning >= 0] = (radius * np.abs(arcs.sweep))[turning[turning >= 0]]
        # A rapid without a length separates no runs: writers leave it out.
        is_move = (toolpath.starts != toolpath.end).any(axis=1)
        breaks = np.cumsum((toolpath.kind == Kind.RAPID) & is_move)[self.rows]
        _, self.run = np.unique(breaks, return_inverse=True)
        self.is_flat = lengths > VERTICAL_MM
        self.runs = int(self.run.max(initial=-1)) + 1
        totals = np.bincount(self.run, np.where(self.is_flat, lengths, 0.0), self.runs)
        shares = np.where(self.is_flat, lengths, 0.0) / np.maximum(totals, VERTICAL_MM)[self.run]
        ends = np.cumsum(shares)
        before = np.concatenate([[0.0], ends])[np.searchsorted(self.run, np.arange(self.runs))]
        self.end = self.run + np.clip(ends - before[self.run], 0.0, 1.0)
        self.begin = self.end - shares

    def points(self, cuts: Ints, share: Floats) -> Floats:
        """Compute the points (K, 3) mm of these cuts at `share` (K,) of their length."""
        rows = self.rows[cuts]
        starts = self.toolpath.starts_of(rows)
        points = starts + share[:, None] * (self.toolpath.end[rows] - starts)
        turning = self._arc_of[rows]
        is_arc = turning >= 0
        points[is_arc] = self._arcs.points(turning[is_arc], share[is_arc])
        return np.asarray(points)


def surface_error(flat: Toolpath, written: Toolpath, surface: Surface) -> tuple[float, int]:
    """Return the largest error in Z, mm, of `written`, which should be `flat` raised by the
    surface, and the row of `written` where it is.

    It is measured at many places of each cut; a place of `written` is compared with that place of
    `flat` which has come equally far in its run. PostError if the two have different numbers of
    runs."""
    plain, warped = _Cuts(flat), _Cuts(written)
    if plain.runs != warped.runs:
        raise PostError(
            f"the cuts of the program are {warped.runs} runs, and those that shall follow the "
            f"surface {plain.runs}"
        )
    worst, place = 0.0, 0
    cuts = np.flatnonzero(warped.is_flat)
    between = np.flatnonzero(plain.is_flat)
    for share in (np.arange(CHECKED_SHARES) + 0.5) / CHECKED_SHARES:
        at = warped.begin[cuts] + share * (warped.end - warped.begin)[cuts]
        index = np.minimum(np.searchsorted(plain.end[between], at), len(between) - 1)
        source = between[index]
        part = (at - plain.begin[source]) / (plain.end - plain.begin)[source]
        wanted_z = plain.points(source, np.clip(part, 0.0, 1.0))[:, 2]
        points = warped.points(cuts, np.full(len(cuts), share))
        errors = np.abs(points[:, 2] - wanted_z - surface.heights(points[:, :2]))
        if len(errors) and float(errors.max()) > worst:
            worst, place = float(errors.max()), int(warped.rows[cuts[int(errors.argmax())]])
    # Drilled holes have no length in the plane: the lowest place of each run is compared.
    lowest = [np.full(plain.runs, np.inf), np.full(warped.runs, np.inf)]
    for cuts_of, low in zip((plain, warped), lowest, strict=True):
        ends = cuts_of.toolpath.end[cuts_of.rows]
        raised = surface.heights(ends[:, :2]) if cuts_of is warped else 0.0
        np.minimum.at(low, cuts_of.run, ends[:, 2] - raised)
    errors = np.abs(lowest[0] - lowest[1])
    holes = ~np.isin(np.arange(plain.runs), warped.run[warped.is_flat])
    if holes.any() and float(errors[holes].max()) > worst:
        run = int(np.flatnonzero(holes)[int(errors[holes].argmax())])
        worst = float(errors[run])
        place = int(warped.rows[int(np.flatnonzero(warped.run == run)[0])])
    return worst, place
