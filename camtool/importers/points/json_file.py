"""Points as JSON, one of

[[x, y], ...]                   one stroke
[[[x, y], ...], ...]            strokes
{"units": "mm", "strokes": [{"points": [[x, y], ...], "closed": true, "layer": "CUT"}]}
"""

from __future__ import annotations

import json
import math
from typing import Any, NoReturn

import numpy as np

from camtool.errors import DrawingError
from camtool.importers.points.stroke import Stroke, Table
from camtool.units import MM_PER_UNIT

_FILE_KEYS = ("units", "strokes")
_STROKE_KEYS = ("points", "closed", "layer")


def parse_json(text: str, file: str) -> Table:
    """The strokes of a JSON text and its unit; DrawingError naming the field."""
    try:
        value = json.loads(text, parse_constant=_refuse_constant)
    except json.JSONDecodeError as error:
        where = f"line {error.lineno}, column {error.colno}"
        raise DrawingError(f"is no JSON: {error.msg}", file=file, where=where) from error
    except RecursionError as error:
        raise DrawingError("is nested too deep for points", file=file) from error
    except ValueError as error:
        raise DrawingError(f"is no JSON: {error}", file=file) from error
    return _Walker(file).document(value)


def _stroke(
    points: list[tuple[float, float]], index: int, closed: bool | None = None, layer: str = "0"
) -> Stroke:
    rows = np.array(points, dtype=np.float64).reshape(-1, 2)
    return Stroke(rows, f"{index + 1}", closed, layer)


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is not finite")


class _Walker:
    """Checks every field on the way down; `file` is for the messages."""

    def __init__(self, file: str) -> None:
        self.file = file

    def document(self, value: object) -> Table:
        if isinstance(value, dict):
            self._known(value, _FILE_KEYS, "")
            rows = self._list(value.get("strokes"), "strokes")
            strokes = [self._stroke(row, f"strokes[{i}]", i) for i, row in enumerate(rows)]
            return Table(strokes, self._unit(value.get("units")))
        rows = self._list(value, "the file")
        # [x, y] holds numbers, a stroke holds lists.
        first = rows[0] if rows else None
        if isinstance(first, list) and first and isinstance(first[0], list):
            return Table([_stroke(self._points(row, f"[{i}]"), i) for i, row in enumerate(rows)])
        return Table([_stroke(self._points(rows, ""), 0)])

    def _stroke(self, value: object, where: str, index: int) -> Stroke:
        if not isinstance(value, dict):
            self._fail("is no object", where)
        self._known(value, _STROKE_KEYS, where)
        closed = value.get("closed")
        if closed is not None and not isinstance(closed, bool):
            self._fail("is neither true nor false", f"{where}.closed")
        layer = value.get("layer", "0")
        if not isinstance(layer, str) or not layer.isprintable():
            self._fail("is no text", f"{where}.layer")
        points = self._points(value.get("points"), f"{where}.points")
        return _stroke(points, index, closed, layer)

    def _points(self, value: object, where: str) -> list[tuple[float, float]]:
        points: list[tuple[float, float]] = []
        for row, pair in enumerate(self._list(value, where)):
            at = f"{where}[{row}]"
            if not isinstance(pair, list) or len(pair) != 2:
                self._fail("is no [x, y]", at)
            points.append((self._number(pair[0], f"{at}[0]"), self._number(pair[1], f"{at}[1]")))
        return points

    def _number(self, value: object, where: str) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            self._fail("is no number", where)
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            self._fail("is not finite", where)
        return number

    def _unit(self, value: object) -> str | None:
        if value is None:
            return None
        if not isinstance(value, str) or value.lower() not in MM_PER_UNIT:
            self._fail(f"{value!r} is no unit of length", "units")
        return value.lower()

    def _list(self, value: object, where: str) -> list[Any]:
        if not isinstance(value, list):
            self._fail("is no list", where)
        return value

    def _known(self, table: dict[str, Any], keys: tuple[str, ...], where: str) -> None:
        unknown = sorted(set(table) - set(keys))
        if unknown:
            self._fail(
                f"unknown key {unknown[0]!r}", where or "the file", f"known: {', '.join(keys)}"
            )

    def _fail(self, message: str, where: str, mend: str = "") -> NoReturn:
        raise DrawingError(message, file=self.file, where=where or "the file", mend=mend)
