"""What the readers of solids share: bodies with their names, and OpenCASCADE kept quiet.

`TopoDS_Shape` and all else of OpenCASCADE has no types for Python: it is `Any` here.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from camtool.errors import DrawingError
from camtool.findings import Finding
from camtool.geometry.drawing import Skipped
from camtool.importers.options import ReadOptions

_NO_NAME = re.compile(
    r"(?:COMPOUND|COMPSOLID|SOLID|SHELL|FACE|WIRE|EDGE|VERTEX|Open[_ ]CASCADE.*)?", re.DOTALL
)
"""What OpenCASCADE writes as the name of a shape that has none."""


@dataclass(frozen=True, eq=False)
class Body:
    """One solid, or what stands for none (a sketch, a shell, a wire): a `TopoDS_Shape`."""

    shape: Any
    layer: str
    colour: str


@dataclass(frozen=True, eq=False)
class Model:
    """All bodies in a file, in mm; `why` says from where the unit is known.

    `mm_per_file_unit` is what the reader has already applied; None when it cannot be told.
    """

    bodies: list[Body]
    why: str
    mm_per_file_unit: float | None = 1.0
    skipped: list[Skipped] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)

    def scale(self, options: ReadOptions, file: str) -> float:
        """By what lengths are to be multiplied, so that the caller's unit is the file's."""
        if options.units is None:
            return 1.0
        if self.mm_per_file_unit is None:
            raise DrawingError(
                "has no single unit that --units could replace", file=file, mend="leave it out"
            )
        return options.mm_per(options.units) / self.mm_per_file_unit


def bodies(shape: Any, layer: str = "0", colour: str = "") -> list[Body]:
    """The solids of a build123d shape with the names and colours of its tree, else itself."""
    return _bodies(shape.wrapped, shape, layer, colour)


def _bodies(topods: Any, shape: Any, layer: str, colour: str) -> list[Body]:
    """`topods` is where the shape really is: children do not move with what they belong to."""
    from OCP.TopAbs import TopAbs_SOLID
    from OCP.TopoDS import TopoDS_Iterator

    layer, colour = _layer(shape.label) or layer, _colour(shape.color) or colour
    children = tuple(shape.children)
    if children:
        parts = list(_listed(TopoDS_Iterator(topods)))
        if len(parts) == len(children):
            return [
                body
                for part, child in zip(parts, children, strict=True)
                for body in _bodies(part, child, layer, colour)
            ]
    solids = subshapes(topods, TopAbs_SOLID)
    return [Body(solid, layer, colour) for solid in solids or [topods]]


def subshapes(shape: Any, kind: Any) -> list[Any]:
    """All parts of this kind (`TopAbs_FACE` …), each once."""
    from build123d.topology import downcast
    from OCP.TopExp import TopExp_Explorer

    found: dict[int, list[Any]] = {}
    parts: list[Any] = []
    explorer = TopExp_Explorer(shape, kind)
    while explorer.More():
        part = explorer.Current()
        same = found.setdefault(hash(part), [])
        if not any(part.IsSame(other) for other in same):
            same.append(part)
            parts.append(downcast(part))
        explorer.Next()
    return parts


def has_edges(shape: Any) -> bool:
    """Whether there is anything in the shape that could be drawn."""
    from OCP.TopAbs import TopAbs_EDGE
    from OCP.TopExp import TopExp_Explorer

    return bool(TopExp_Explorer(shape, TopAbs_EDGE).More())


def _listed(explorer: Any) -> Iterator[Any]:
    while explorer.More():
        yield explorer.Value()
        explorer.Next()


def _layer(label: object) -> str:
    """The name as a layer; "" when there is none."""
    text = "".join(sign if sign.isprintable() else "_" for sign in str(label or "")).strip()
    return "" if _NO_NAME.fullmatch(text) else text


def _colour(colour: Any) -> str:
    if colour is None:
        return ""
    red, green, blue = (min(max(round(255.0 * part), 0), 255) for part in tuple(colour)[:3])
    return f"#{red:02x}{green:02x}{blue:02x}"


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """What OpenCASCADE prints goes nowhere; it writes past Python, straight to the descriptors."""
    with Path(os.devnull).open("wb") as nowhere:
        sink = nowhere.fileno()
        with redirected({1: sink, 2: sink}):
            yield


@contextlib.contextmanager
def redirected(targets: dict[int, int]) -> Iterator[None]:
    """Each file descriptor writes to another one in here; closed ones are left alone."""
    _flush()
    saved: dict[int, int] = {}
    try:
        for descriptor, target in targets.items():
            with contextlib.suppress(OSError):
                saved[descriptor] = os.dup(descriptor)
                os.dup2(target, descriptor)
        yield
    finally:
        _flush()
        for descriptor, copy in saved.items():
            os.dup2(copy, descriptor)
            os.close(copy)


def _flush() -> None:
    """What Python and C hold back is written to where it belongs so far."""
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError, AttributeError):
            stream.flush()
    if os.name == "posix":
        ctypes.CDLL(None).fflush(None)
