"""Which paths and points of a placed drawing an operation takes."""

from __future__ import annotations

import numpy as np

from camtool.errors import OptionError
from camtool.geometry.drawing import Drawing
from camtool.geometry.polylines import Bools
from camtool.planning.items import Chosen
from camtool.planning.job import Operation
from camtool.planning.sides import Sides, runs_beside


def choose(drawing: Drawing, operation: Operation, sides: Sides) -> Chosen:
    """What the operation takes of a drawing in the work frame, with the sides of that drawing.

    OptionError, naming what there is, when the drawing has something, but nothing of that.
    """
    paths = zip(drawing.layers, drawing.colours, strict=True)
    index = [i for i, (layer, colour) in enumerate(paths) if operation.takes(layer, colour)]
    marks = [mark for mark in drawing.marks if operation.takes(mark.layer, mark.colour)]
    if not index and not marks and (len(drawing.paths) or drawing.marks):
        raise _nothing(drawing, operation)
    return Chosen(
        lines=drawing.paths.select(index),
        source=np.array(index, dtype=np.int64),
        names=tuple(path_name(drawing, i) for i in index),
        points=np.array([mark.at_mm for mark in marks], dtype=np.float64).reshape(len(marks), 2),
        point_names=tuple(f"{mark.layer}/{mark.source}" for mark in marks),
        rim=_rim(operation, sides, index),
    )


def _rim(operation: Operation, sides: Sides, index: list[int]) -> Bools:
    """(M,) which of the chosen paths are rims of parts, for a profile that asks for it."""
    if operation.side == "auto" and runs_beside(operation):
        return sides.seen_by(operation).rim[index]
    return np.full(len(index), operation.side == "outside")


def path_name(drawing: Drawing, index: int) -> str:
    """Layer and source of a path, as provenance and places in messages show it."""
    return f"{drawing.layers[index]}/{drawing.sources[index]}"


def _nothing(drawing: Drawing, operation: Operation) -> OptionError:
    marks = drawing.marks
    layers = sorted({*drawing.layers, *(mark.layer for mark in marks)})
    colours = sorted({*drawing.colours, *(mark.colour for mark in marks)} - {""})
    wanted = [f"the layers {', '.join(operation.layers)}"] if operation.layers else []
    wanted += [f"the colours {', '.join(operation.colours)}"] if operation.colours else []
    has = f"the drawing has: {', '.join(layers)}"
    if operation.colours:
        has += f"; colours {', '.join(colours) or 'none'}"
    return OptionError(
        f"no path lies on {' and '.join(wanted)}",
        file=drawing.file,
        where=f"operation {operation.name!r}" if operation.name else "",
        mend=has,
    )
