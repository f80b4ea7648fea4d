"""A scene as columns of numbers, packed for the page.

All columns follow each other in one block of bytes, little-endian, each beginning at a multiple of
four: f4 (float), u1 (byte), or v1, v2, v3: integers as differences from the number one, two or
three before (the first ones from 0), each as 7 bits a byte, the lowest first, with the sign in the
lowest bit. Floats of 32 bits hold a place on a table of 8 m to 1 µm; integers may be counts of a
unit, with which the page multiplies them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.geometry.drawing import Drawing
from camtool.geometry.polylines import POSITION_EPS_MM, Segments
from camtool.kernels.stock import thinned as thinned_moves
from camtool.pictures.colours import BINS
from camtool.pictures.content import Content
from camtool.pictures.layers import LineGroup, Part
from camtool.pictures.scene import Playback, Scene, StockPair
from camtool.pictures.trace import ErrorTrace, bins_of, nearest_points
from camtool.stock.before import WHOLE
from camtool.stock.engagement import COARSE_RAD
from camtool.stock.heightmap import HeightMap, add_moves
from camtool.toolpath.moves import Kind, Toolpath
from camtool.units import UM_PER_MM


class CountColumn(Struct, frozen=True, eq=False):
    """A column of integers: counts of `unit`, of which `stride` after each other are one place."""

    counts: npt.NDArray[np.integer]
    unit: float = 1.0
    stride: int = 1


Columns = dict[str, npt.NDArray[np.generic] | CountColumn]

FLOAT, INT, BYTE = np.dtype("<f4"), np.dtype("<i4"), np.dtype("u1")

ALIGN_BYTES = 4
"""Every column begins at a multiple of this; browsers refuse others."""

MAX_NUMBER_BYTES = 7
"""Of an integer below 2**48: a unit of 0.1 µm is then enough for 28,000 km."""

GOAL_COUNTS = 32_000
"""Wanted heights are multiples of the thickness divided by this."""

SLIDE_UNIT_MM = 1e-4
"""Places of the slides are multiples of this."""

THIN_CELLS = 0.01
"""Slides are thinned until they lie this share of a cell of the page's grid beside the predicted
ones, or as far as these are known, where that is more."""


def columns_of(content: Content, run: Playback | None) -> Columns:
    """Return the columns that the page's script draws by functions of its own (moves, drawing,
    trace …); those that the scene lacks are empty."""
    scene = content.scene
    places = {
        "start_at": content.moves.starts,
        "bare_at": content.starts,
        "plunge_at": content.moves.plunges,
    }
    return {
        **_drawing(scene.drawing),
        **_moves(scene, run),
        **{name: points.astype(FLOAT) for name, points in places.items()},
        **_wanted_columns(scene.wanted if run is not None else None),
    }


def part_columns(name: str, part: Part) -> Columns:
    """Return the columns of a part of a layer, with names that begin with `name`: places of dots
    and texts, or ends of lines and arcs."""
    if not isinstance(part, LineGroup):
        return {f"{name}_at": np.array(part.places, dtype=FLOAT).reshape(-1, 2)}
    chains = part.chains
    sweep = np.concatenate([chain.sweep for chain in chains])
    centre = np.concatenate([chain.centre for chain in chains])
    return {
        **_arc_columns(name, sweep != 0.0, centre, sweep),
        f"{name}_from": np.concatenate([chain.points[:-1] for chain in chains]).astype(FLOAT),
        f"{name}_to": np.concatenate([chain.points[1:] for chain in chains]).astype(FLOAT),
    }


class StockBox(Struct, frozen=True):
    """The left, lower, right and upper edge of the stock, mm, the Z of its bottom, and how many
    heights its grid has along X and Y; the outermost stand on its edges."""

    box: tuple[float, float, float, float]
    bottom: float
    grid: tuple[int, int]


def height_columns(pair: StockPair | None, stock: StockBox | None) -> Columns:
    """Return the heights that the stock should have, and those that earlier set-ups have left.

    They are empty if they are not known, or nothing was cut before."""
    goal, heights_before = None, None
    if stock is not None and pair is not None:
        left, low, right, _ = stock.box
        across, upwards = stock.grid
        cell = (right - left) / (across - 1)
        corner = (left - 0.5 * cell, low - 0.5 * cell)
        uncut = HeightMap(np.zeros((upwards, across), dtype=np.float32), cell, corner)
        before = pair.before or WHOLE
        if before.above or before.below:
            heights_before = before.shown_in(uncut)
        if pair.wanted is not None:
            add_moves(uncut, pair.wanted)
            goal = before.shown_in(uncut)
    return {**_run_columns("goal", goal, stock), **_run_columns("begun", heights_before, stock)}


def _run_columns(name: str, heights: HeightMap | None, stock: StockBox | None) -> Columns:
    """Return heights as two columns: values, and how often each is repeated, row by row on the
    grid of the stock.

    A value counts shares of 1/GOAL_COUNTS of its thickness; both columns are empty without
    heights."""
    values, counts = np.empty(0, dtype=INT), np.empty(0, dtype=INT)
    if heights is not None and stock is not None:
        shares = np.rint(heights.heights.ravel() * (GOAL_COUNTS / -stock.bottom))
        rounded = np.maximum(shares, -GOAL_COUNTS).astype(INT)
        begins = np.concatenate([[0], np.flatnonzero(np.diff(rounded)) + 1])
        values = rounded[begins]
        counts = np.diff(np.append(begins, rounded.size)).astype(INT)
    return {f"{name}_height": values, f"{name}_count": counts}


def slide_columns(pair: StockPair | None, rows: int, cell_mm: float) -> Columns:
    """Return the moves of the tool tips that cut the stock, and how many of them each of the
    `rows` of the toolpath makes.

    Places are where the first move begins and where each one ends. Successive moves that bend by
    less than a share of `cell_mm` become one; there are MAX_POINTS at most, if need be coarser."""
    moves = None if pair is None else pair.moves
    if moves is None or not len(moves):
        no_counts = np.empty(0, dtype=INT)
        return {"slide_at": CountColumn(no_counts, SLIDE_UNIT_MM, 3), "slide_count": no_counts}
    kept_rows, near_mm = np.arange(len(moves)), max(moves.beside_mm, THIN_CELLS * cell_mm)
    while True:
        kept_rows = kept_rows[
            thinned_moves(moves.end[kept_rows], moves.row[kept_rows], moves.start[0], near_mm)
        ]
        if len(kept_rows) <= MAX_POINTS or near_mm > np.ptp(moves.end, axis=0).max():
            break
        near_mm *= COARSER
    places = np.concatenate([moves.start[:1], moves.end[kept_rows]])
    counts = np.rint(places / SLIDE_UNIT_MM).astype(np.int64)
    of_rows = np.bincount(moves.row[kept_rows], minlength=rows)
    return {"slide_at": CountColumn(counts, SLIDE_UNIT_MM, 3), "slide_count": of_rows.astype(INT)}


FINE_ENGAGED = 50_000
MAX_COARSER = 5.0
"""Engagements are within COARSE_RAD up to so many moves of tips, and within an angle that is wider
in proportion for more, by up to this factor: some 26 and 11 µs of processor time for each move."""

MAX_ENGAGED = 500_000
"""The engagement is not shown for programs with more moves of tips: it would take longer than
everything else."""

ENTRY_DEG = -1.0


def engagement_columns(pair: StockPair | None, toolpath: Toolpath | None) -> Columns:
    """Return the greatest engagement of the tool in each of N rows, degrees, entries left out.

    It is never below the true angle, and above it by no more than COARSE_RAD, or by more in large
    programs. It is ENTRY_DEG for rows that only enter, NaN where nothing is cut, and the column is
    empty where no tool is known."""
    result = np.full(0 if toolpath is None else len(toolpath), np.nan)
    if pair is None or toolpath is None or not len(pair.moves) or len(pair.moves) > MAX_ENGAGED:
        return {"move_engaged": result[:0].astype(FLOAT)}
    coarse_rad = COARSE_RAD * np.clip(len(pair.moves) / FINE_ENGAGED, 1.0, MAX_COARSER)
    judged = pair.engagement_by_row(toolpath, coarse_rad)
    cuts = judged.is_known & (np.nan_to_num(judged.bound_rad) > coarse_rad)
    if not cuts.any():
        return {"move_engaged": result[:0].astype(FLOAT)}
    result[judged.moves.row[cuts & judged.is_entry]] = ENTRY_DEG
    counts = np.flatnonzero(cuts & ~judged.is_entry)
    angles = np.degrees(judged.bound_rad[counts]).clip(max=180.0)
    np.fmax.at(result, judged.moves.row[counts], np.round(angles, 1))
    return {"move_engaged": result.astype(FLOAT)}


Named = dict[str, tuple[str, int, int] | tuple[str, int, int, float]]


def packed(columns: Columns) -> tuple[Named, bytes]:
    """Return all columns as bytes, and a table {name: (type, byte offset, count)} of them; a
    column of counts has its unit as well."""
    named: Named = {}
    parts: list[bytes] = []
    offset = 0
    for name, column in columns.items():
        if isinstance(column, np.ndarray) and column.dtype != INT:
            named[name] = (column.dtype.str.lstrip("<|"), offset, column.size)
            data = column.tobytes()
        else:
            counts = (
                column if isinstance(column, CountColumn) else CountColumn(column.astype(np.int64))
            )
            kind = f"v{counts.stride}"
            size = counts.counts.size
            named[name] = (
                (kind, offset, size) if counts.unit == 1.0 else (kind, offset, size, counts.unit)
            )
            data = stepped(counts.counts, counts.stride)
        data += bytes(-len(data) % ALIGN_BYTES)
        parts.append(data)
        offset += len(data)
    return named, b"".join(parts)


def stepped(numbers: npt.NDArray[np.integer], stride: int) -> bytes:
    """Return integers as differences from the number `stride` before, in as many bytes as each
    needs.

    A byte holds 7 bits, the lowest first; its highest bit says that more follow."""
    flat = numbers.ravel().astype(np.int64)
    steps = flat - np.concatenate([np.zeros(stride, dtype=np.int64), flat[:-stride]])[: len(flat)]
    zigzag = (steps << 1) ^ (steps >> 63)
    octets = np.zeros((len(zigzag), MAX_NUMBER_BYTES), dtype=BYTE)
    size = np.ones(len(zigzag), dtype=np.int64)
    for k in range(MAX_NUMBER_BYTES):
        octets[:, k] = zigzag & 0x7F
        zigzag = zigzag >> 7
        octets[:, k] |= np.where(zigzag > 0, 0x80, 0).astype(BYTE)
        size += zigzag > 0
    return octets[np.arange(MAX_NUMBER_BYTES) < size[:, None]].tobytes()


def drawing_layers(drawing: Drawing) -> list[str]:
    """Return the names of the drawing's layers, in the order of their first paths, then of their
    first marks."""
    return list(dict.fromkeys((*drawing.layers, *(mark.layer for mark in drawing.marks))))


def _drawing(drawing: Drawing | None) -> Columns:
    if drawing is None:
        zeros = np.empty(0)
        return {
            **_arc_columns("drawn", zeros.astype(np.bool_), zeros.reshape(0, 2), zeros),
            **{name: zeros.astype(FLOAT) for name in ("drawn_from", "drawn_to", "mark_at")},
            **{name: zeros.astype(INT) for name in ("drawn_path", "drawn_layer", "mark_layer")},
        }
    segments, names = Segments.of(drawing.paths), drawing_layers(drawing)
    number = {name: index for index, name in enumerate(names)}
    layer = np.array([number[name] for name in drawing.layers], dtype=INT)
    marks = drawing.marks
    return {
        **_arc_columns("drawn", segments.bulge != 0.0, segments.centre, segments.sweep),
        "drawn_from": segments.start.astype(FLOAT),
        "drawn_to": segments.end.astype(FLOAT),
        "drawn_path": segments.path.astype(INT),
        "drawn_layer": layer[segments.path] if len(layer) else np.empty(0, dtype=INT),
        "mark_at": np.array([mark.at_mm for mark in marks], dtype=FLOAT).reshape(-1, 2),
        "mark_layer": np.array([number[mark.layer] for mark in marks], dtype=INT),
    }


def _moves(scene: Scene, run: Playback | None) -> Columns:
    toolpath = scene.toolpath
    if toolpath is None or run is None:
        zeros = np.empty(0)
        floats = (
            *("move_start", "move_end", "feed_value", "move_seconds", "move_error"),
            "move_wide",
        )
        return {
            **_arc_columns("move", zeros.astype(np.bool_), zeros.reshape(0, 2), zeros),
            **{name: zeros.astype(FLOAT) for name in floats},
            **{name: zeros.astype(INT) for name in ("feed_count", "move_block", "move_source")},
            **{name: zeros.astype(BYTE) for name in ("move_kind", "move_sort")},
        }
    if len(run.seconds) != len(toolpath):
        raise ValueError("the playback is that of another toolpath")
    feed = toolpath.feed.astype(FLOAT)
    feeds = np.nan_to_num(feed, nan=-1.0)
    begins = np.flatnonzero(np.diff(feeds, prepend=np.inf))
    return {
        **_arc_columns("move", toolpath.is_arc, toolpath.centre, toolpath.sweeps()),
        "move_start": toolpath.start.astype(FLOAT),
        "move_end": toolpath.end.astype(FLOAT),
        "feed_value": feed[begins],
        "feed_count": np.diff(np.append(begins, len(feed))).astype(INT),
        "move_seconds": run.seconds.astype(FLOAT),
        "move_error": (run.error_mm * UM_PER_MM).astype(FLOAT),
        "move_block": toolpath.block.astype(INT),
        "move_source": toolpath.source.astype(INT),
        "move_kind": toolpath.kind.astype(BYTE),
        "move_wide": _wide(scene, toolpath),
        "move_sort": _sorts(toolpath),
    }


def _wide(scene: Scene, toolpath: Toolpath) -> npt.NDArray[np.generic]:
    """Return how far (N, 2) mm the tool cuts to each side at the start and the end of each feed;
    (0, 2) if that is the same all over.

    It changes with the depth of a tapered tool, and from tool to tool."""
    turns = scene.turns if scene.nose is None else ((0, scene.nose),)
    if not turns:
        return np.empty((0, 2), dtype=FLOAT)
    wide = np.zeros((len(toolpath), 2))
    ends = [row for row, _ in turns[1:]] + [len(toolpath)]
    for (begin, tool), end in zip(turns, ends, strict=True):
        rows = begin + np.flatnonzero(toolpath.is_feed[begin:end])
        depths: Floats = -np.column_stack([toolpath.starts_of(rows)[:, 2], toolpath.end[rows, 2]])
        # Ends of a feed above the stock cut nothing.
        for row, ends_mm in zip(rows.tolist(), depths.tolist(), strict=True):
            if max(ends_mm) > 0.0:
                wide[row] = [tool.radius_at(max(each, 0.0)) for each in ends_mm]
    return wide.astype(FLOAT)


def _sorts(toolpath: Toolpath) -> npt.NDArray[np.generic]:
    """Return the sort of each row: 0 rapids and events, 1 level feeds, 2 feeds that change Z."""
    if not len(toolpath):
        return np.empty(0, dtype=BYTE)
    rise = np.abs(toolpath.end[:, 2] - toolpath.starts[:, 2]) > POSITION_EPS_MM
    sorts = np.where(toolpath.kind == Kind.RAPID, 0, np.where(rise, 2, 1))
    return np.where(toolpath.is_motion, sorts, 0).astype(BYTE)


def _wanted_columns(wanted_path: Segments | None) -> Columns:
    """Return the wanted path: the end of each line or arc, and the begin of those that do not
    continue the one before."""
    if wanted_path is None or not len(wanted_path):
        zeros = np.empty(0)
        return {
            **_arc_columns("wanted", zeros.astype(np.bool_), zeros.reshape(0, 2), zeros),
            "wanted_to": zeros.astype(FLOAT),
            "wanted_begin": zeros.astype(FLOAT),
            "wanted_break": zeros.astype(INT),
        }
    is_break = np.hypot(*(wanted_path.start[1:] - wanted_path.end[:-1]).T) > POSITION_EPS_MM
    breaks = np.concatenate([[0], np.flatnonzero(is_break) + 1])
    return {
        **_arc_columns("wanted", wanted_path.bulge != 0.0, wanted_path.centre, wanted_path.sweep),
        "wanted_to": wanted_path.end.astype(FLOAT),
        "wanted_begin": wanted_path.start[breaks].astype(FLOAT),
        "wanted_break": breaks.astype(INT),
    }


def _arc_columns(name: str, is_arc: Bools, centre: Floats, sweep: Floats) -> Columns:
    """Return the indices of the rows that are arcs, and the centre x, y and sweep of each."""
    rows = np.flatnonzero(is_arc)
    bends = np.column_stack([centre[rows], sweep[rows]])
    return {f"{name}_arc": rows.astype(INT), f"{name}_bend": bends.astype(FLOAT)}


# The predicted path for the page: its points, their colours and their deviations.
#
# Of a point p of the slides and the nearest point q of the wanted path, the page holds p and p−q,
# and draws p + (N − 1)(p − q) for a deviation N times as large (see `camtool.pictures.trace`).

MAX_COUNTS = 4_000
"""Number of counts of the largest deviation: at a magnification of a thousand, it is exact to a
quarter of its true size."""


class Traced(Struct, frozen=True, eq=False):
    """The columns of the predicted path, the length of a count of their deviations (0 where the
    wanted path is unknown), and the deviations (W, 2) mm of the worst places."""

    columns: Columns
    count_mm: float
    worst_off: Floats


def traced_of(scene: Scene, run: Playback | None, top_um: float) -> Traced:
    """Return the predicted path of a scene, coloured by a map that ends at `top_um`.

    ValueError when the playback does not have a row for each of its points."""
    worst = np.array(scene.worst, dtype=np.float64).reshape(-1, 2)
    points, error, cutting = scene.trace_points, scene.trace_error_mm, scene.trace_cutting
    if points is None or error is None or cutting is None or run is None or not len(run.trace_row):
        zeros = np.empty(0)
        no_columns = _columns(zeros.reshape(0, 2), zeros.astype(np.int64), zeros, zeros, FINEST_MM)
        return Traced(no_columns, 0.0, np.zeros_like(worst))
    if len(run.trace_row) != len(points):
        raise ValueError("the playback does not have a row for each point of the trace")
    error_um = np.where(cutting, np.abs(error) * UM_PER_MM, 0.0)
    steps = bins_of(ErrorTrace(points, error_um, cutting, top_um))
    bins = np.concatenate([[BINS], np.where(steps < 0, BINS, steps)])
    largest_mm = float(error_um.max(initial=0.0)) / UM_PER_MM
    kept_rows = thinned(points, bins, largest_mm)
    # A cut begins at the point before its first one.
    drawn = (cutting | np.append(cutting[1:], False))[kept_rows]
    points, bins, row = points[kept_rows], bins[kept_rows], run.trace_row[kept_rows]
    offsets = _offsets(points, drawn, scene.wanted)
    largest = float(np.abs(offsets).max(initial=0.0))
    count_mm = largest / MAX_COUNTS if scene.wanted is not None and largest > 0.0 else 0.0
    counts = np.rint(offsets / count_mm) if count_mm else np.zeros_like(offsets)
    all_points = np.ones(len(worst), dtype=np.bool_)
    columns = _columns(points, bins, row, counts, finest_mm(largest_mm))
    return Traced(columns, count_mm, _offsets(worst, all_points, scene.wanted))


def _offsets(points: Floats, is_chosen: np.ndarray, wanted_path: Segments | None) -> Floats:
    """Return the vector (T, 2) mm from the nearest point of the wanted path to each chosen point;
    0 for the others."""
    offsets = np.zeros_like(points)
    if wanted_path is not None and len(wanted_path) and is_chosen.any():
        offsets[is_chosen] = points[is_chosen] - nearest_points(points[is_chosen], wanted_path)
    return offsets


def _columns(
    points: Floats, bins: Ints, row: Ints | Floats, counts: Floats, unit_mm: float
) -> Columns:
    places = np.rint(points / unit_mm).astype(np.int64)
    return {
        "trace_point": CountColumn(places, unit_mm, 2),
        "trace_bin": bins.astype(BYTE),
        "trace_row": row.astype(INT),
        "trace_off": CountColumn(counts.astype(INT), stride=2),
    }


# Fewer points of the predicted path, where the difference is too small to be seen.
#
# Every second point is left out if it lies near the chord of its neighbours and has their colour;
# then every second one of those that are left, and so on. Points that stay are not moved, and each
# round moves the path by the tolerance at most.

MAX_POINTS = 200_000

FINEST_MM = 1e-4
"""Points this near to the chord of their neighbours may be left out ..."""

FINEST_SHARE = 0.01
"""... or within this share of the largest error, where that is less ..."""

MIN_UNIT_MM = 1e-6
"""... but always within this ..."""

COARSER = 4.0
"""... and the distance grows by this factor while there are too many points."""


def thinned(points: Floats, bins: Ints, largest_mm: float, max_points: int = MAX_POINTS) -> Ints:
    """Return the ascending rows of the points (T, 2) mm to keep, so that the path changes by no
    more than need be.

    The ends of all pieces of one colour, `bins` (T,), are kept, unless these alone are more than
    `max_points`."""
    kept_rows = np.arange(len(points))
    near_mm = finest_mm(largest_mm)
    while True:
        fewer = _halved(points, bins, kept_rows, near_mm)
        if len(fewer) < len(kept_rows):
            kept_rows = fewer
        elif len(kept_rows) <= max_points:
            return kept_rows
        elif near_mm > np.ptp(points, axis=0).max():
            return kept_rows[:: -(-len(kept_rows) // max_points)]
        else:
            near_mm *= COARSER


def finest_mm(largest_mm: float) -> float:
    """Return by how much, mm, a path with this largest error may be simplified; this is also the
    unit of its points."""
    return max(min(FINEST_MM, FINEST_SHARE * largest_mm), MIN_UNIT_MM)


def _halved(points: Floats, bins: Ints, kept_rows: Ints, near_mm: float) -> Ints:
    """Return the rows without those of the 2nd, 4th, … points that lie near enough to the line
    between their neighbours; the first and the last row stay."""
    middle = np.arange(1, len(kept_rows) - 1, 2)
    before, point, after = kept_rows[middle - 1], kept_rows[middle], kept_rows[middle + 1]
    # The colour of a piece is that of the point that it leads to.
    same_bin = bins[point] == bins[after]
    goes = same_bin & (_from_chord(points[before], points[point], points[after]) <= near_mm)
    stays = np.ones(len(kept_rows), dtype=np.bool_)
    stays[middle[goes]] = False
    return kept_rows[stays]


def _from_chord(begin: Floats, point: Floats, end: Floats) -> Floats:
    chord, arm = end - begin, point - begin
    square = (chord**2).sum(axis=1)
    share = (arm * chord).sum(axis=1) / np.where(square > 0.0, square, 1.0)
    offsets = arm - np.clip(share, 0.0, 1.0)[:, None] * chord
    return np.asarray(np.hypot(offsets[:, 0], offsets[:, 1]))
