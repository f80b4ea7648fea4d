"""A scene as columns of numbers, packed for the page.

All columns follow each other in one block of bytes, little-endian, each beginning at a multiple of
four: f4 (float), u1 (byte), i2 and i4 (integer), d1 (integers as the small steps from each to the
next, from 0 to the first). Floats of 32 bits hold a place on a table of 8 m to a micrometre.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from camtool.geometry.drawing import Drawing
from camtool.geometry.polylines import POSITION_EPS_MM, Segments
from camtool.preview.content import bare_starts
from camtool.preview.scene import Scene
from camtool.preview.strokes import strokes_of
from camtool.preview.turns import turns_of
from camtool.preview.viewer.run import Run
from camtool.toolpath.moves import Kind, Toolpath
from camtool.units import UM_PER_MM

Columns = dict[str, npt.NDArray[np.generic]]

FLOAT, INT, BYTE = np.dtype("<f4"), np.dtype("<i4"), np.dtype("u1")
SHORT, STEP = np.dtype("<i2"), np.dtype("i1")

ALIGN_BYTES = 4
"""Every column begins at a multiple of this: browsers refuse others."""


def columns_of(scene: Scene, run: Run | None) -> Columns:
    """All columns of the page; those of what the scene does not have are empty."""
    return {
        **_drawing(scene.drawing),
        **_moves(scene.toolpath, run),
        **_marks(scene.toolpath),
        **_wanted(scene.wanted if run is not None else None),
    }


def packed(columns: Columns) -> tuple[dict[str, tuple[str, int, int]], bytes]:
    """({name: (type, byte offset, count)}, all bytes)."""
    named: dict[str, tuple[str, int, int]] = {}
    parts: list[bytes] = []
    at = 0
    for name, column in columns.items():
        kind, narrow = _narrow(column)
        data = narrow.tobytes()
        data += bytes(-len(data) % ALIGN_BYTES)
        named[name] = (kind, at, column.size)
        parts.append(data)
        at += len(data)
    return named, b"".join(parts)


def _narrow(column: npt.NDArray[np.generic]) -> tuple[str, npt.NDArray[np.generic]]:
    """A column in the smallest of the types that hold it, and the name of that type."""
    if column.dtype != INT:
        return column.dtype.str.lstrip("<|"), column
    steps = np.diff(column.astype(np.int64), prepend=0)
    for kind, values, dtype in (("d1", steps, STEP), ("i2", column, SHORT)):
        limits = np.iinfo(dtype)
        if not column.size or (values.min() >= limits.min and values.max() <= limits.max):
            return kind, values.astype(dtype)
    return "i4", column


def layer_names(drawing: Drawing) -> list[str]:
    """The layers in the order of their first paths, then of their first points."""
    return list(dict.fromkeys((*drawing.layers, *(mark.layer for mark in drawing.marks))))


def _drawing(drawing: Drawing | None) -> Columns:
    if drawing is None:
        none = np.empty(0)
        return {
            **_bends("drawn", none.astype(np.bool_), none.reshape(0, 2), none),
            **{name: none.astype(FLOAT) for name in ("drawn_from", "drawn_to", "mark_at")},
            **{name: none.astype(INT) for name in ("drawn_path", "drawn_layer", "mark_layer")},
        }
    segments, names = Segments.of(drawing.paths), layer_names(drawing)
    number = {name: index for index, name in enumerate(names)}
    layer = np.array([number[name] for name in drawing.layers], dtype=INT)
    marks = drawing.marks
    return {
        **_bends("drawn", segments.bulge != 0.0, segments.centre, segments.sweep),
        "drawn_from": segments.start.astype(FLOAT),
        "drawn_to": segments.end.astype(FLOAT),
        "drawn_path": segments.path.astype(INT),
        "drawn_layer": layer[segments.path] if len(layer) else np.empty(0, dtype=INT),
        "mark_at": np.array([mark.at_mm for mark in marks], dtype=FLOAT).reshape(-1, 2),
        "mark_layer": np.array([number[mark.layer] for mark in marks], dtype=INT),
    }


def _moves(toolpath: Toolpath | None, run: Run | None) -> Columns:
    if toolpath is None or run is None:
        none = np.empty(0)
        floats = ("move_start", "move_end", "move_feed", "move_seconds", "move_error")
        return {
            **_bends("move", none.astype(np.bool_), none.reshape(0, 2), none),
            **{name: none.astype(FLOAT) for name in floats},
            **{name: none.astype(INT) for name in ("move_block", "move_source")},
            **{name: none.astype(BYTE) for name in ("move_kind", "move_sort")},
        }
    if len(run.seconds) != len(toolpath):
        raise ValueError("the run is that of another toolpath")
    return {
        **_bends("move", toolpath.is_arc, toolpath.centre, toolpath.sweeps()),
        "move_start": toolpath.start.astype(FLOAT),
        "move_end": toolpath.end.astype(FLOAT),
        "move_feed": toolpath.feed.astype(FLOAT),
        "move_seconds": run.seconds.astype(FLOAT),
        "move_error": (run.error_mm * UM_PER_MM).astype(FLOAT),
        "move_block": toolpath.block.astype(INT),
        "move_source": toolpath.source.astype(INT),
        "move_kind": toolpath.kind.astype(BYTE),
        "move_sort": _sorts(toolpath),
    }


def _sorts(toolpath: Toolpath) -> npt.NDArray[np.generic]:
    """0 rapids and events, 1 level feeds, 2 feeds that sink or climb."""
    if not len(toolpath):
        return np.empty(0, dtype=BYTE)
    rise = np.abs(toolpath.end[:, 2] - toolpath.starts[:, 2]) > POSITION_EPS_MM
    sorts = np.where(toolpath.kind == Kind.RAPID, 0, np.where(rise, 2, 1))
    return np.where(toolpath.is_motion, sorts, 0).astype(BYTE)


def _marks(toolpath: Toolpath | None) -> Columns:
    """Places (x, y) mm: where contours begin, where no plunge marks that, where the tool goes
    straight down, and where X or Y turns back."""
    none = np.empty((0, 2))
    starts = bare = plunges = turns = none
    if toolpath is not None:
        strokes = strokes_of(toolpath)
        starts, bare, plunges = strokes.starts, bare_starts(strokes), strokes.plunges
        turns = np.unique(turns_of(toolpath), axis=0)
    places = {"start_at": starts, "bare_at": bare, "plunge_at": plunges, "turn_at": turns}
    return {name: points.astype(FLOAT) for name, points in places.items()}


def _wanted(wanted: Segments | None) -> Columns:
    """The wanted path: where each line or arc ends, and where those begin that do not go on from
    the one before."""
    if wanted is None or not len(wanted):
        none = np.empty(0)
        return {
            **_bends("wanted", none.astype(np.bool_), none.reshape(0, 2), none),
            "wanted_to": none.astype(FLOAT),
            "wanted_begin": none.astype(FLOAT),
            "wanted_break": none.astype(INT),
        }
    apart = np.hypot(*(wanted.start[1:] - wanted.end[:-1]).T) > POSITION_EPS_MM
    breaks = np.concatenate([[0], np.flatnonzero(apart) + 1])
    return {
        **_bends("wanted", wanted.bulge != 0.0, wanted.centre, wanted.sweep),
        "wanted_to": wanted.end.astype(FLOAT),
        "wanted_begin": wanted.start[breaks].astype(FLOAT),
        "wanted_break": breaks.astype(INT),
    }


def _bends(
    name: str,
    is_arc: npt.NDArray[np.bool_],
    centre: npt.NDArray[np.float64],
    sweep: npt.NDArray[np.float64],
) -> Columns:
    """Which rows are arcs, and the centre x, y and sweep of each."""
    rows = np.flatnonzero(is_arc)
    bends = np.column_stack([centre[rows], sweep[rows]])
    return {f"{name}_arc": rows.astype(INT), f"{name}_bend": bends.astype(FLOAT)}
