"""The stages of an offset as drawings, one by one: for pictures, and to see what went wrong."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from camtool.geometry.drawing import Drawing, Units
from camtool.geometry.measure import point_at
from camtool.geometry.offset.shape import shape_stages
from camtool.geometry.offset.slices import Slices
from camtool.geometry.offset.stitch import paths_of
from camtool.geometry.offset.way import Way
from camtool.geometry.polylines import (
    POSITION_EPS_MM,
    Bools,
    Polyline,
    Polylines,
    Segments,
)


def stage_drawings(lines: Polylines, way: Way) -> dict[str, Drawing]:
    """Each stage of an offset of closed paths to the left with its source, by the stage's name.

    The layers say what is what; pieces too short for a polyline are left out.
    """
    stages = shape_stages(lines, way)
    elements = stages.trimmed.elements
    closed = np.ones(len(stages.loops), dtype=np.bool_)
    loops = paths_of(stages.loops, closed, stages.kept, elements, way.options)
    valid, every = stages.valid, np.ones(len(stages.kept), dtype=np.bool_)
    parts: dict[str, dict[str, list[Polyline]]] = {
        "raw": {
            "shifted": list(_pieces(stages.raw.elements[~stages.raw.join])),
            "joins": list(_pieces(stages.raw.elements[stages.raw.join])),
        },
        "trimmed": {"trimmed": list(_pieces(elements))},
        "slices": {
            "too near": list(_pieces(_cut(stages.slices, elements, ~valid))),
            "far enough": list(_pieces(_cut(stages.slices, elements, valid))),
        },
        "kept": {"kept": list(_pieces(_cut(stages.kept, elements, every)))},
        "loops": {"loops": list(loops)},
    }
    return {name: _drawing(name, {"source": list(lines), **part}) for name, part in parts.items()}


def _cut(slices: Slices, elements: Segments, rows: Bools) -> Segments:
    """The chosen slices as segments of their own."""
    some = slices[np.flatnonzero(rows)]
    start = point_at(elements, some.element, some.t0)
    end = point_at(elements, some.element, some.t1)
    sweep = elements.sweep[some.element] * (some.t1 - some.t0)
    return Segments.between(start, end, np.tan(0.25 * sweep))


def _pieces(segments: Segments) -> Iterator[Polyline]:
    """Each segment as a path, if it is long enough for one."""
    for start, end, bulge in zip(segments.start, segments.end, segments.bulge, strict=True):
        if np.hypot(*(end - start)) > POSITION_EPS_MM:
            yield Polyline(np.array([[*start, bulge], [*end, 0.0]]))


def _drawing(name: str, layers: dict[str, list[Polyline]]) -> Drawing:
    paths = [path for layer in layers.values() for path in layer]
    names = tuple(layer for layer, some in layers.items() for _ in some)
    blank = ("",) * len(paths)
    return Drawing(Polylines.of(paths), names, blank, blank, name, Units("mm", 1.0, "given"))
