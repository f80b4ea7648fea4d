"""STEP and BREP files to bodies; what is damaged is refused or counted."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from camtool.errors import DrawingError
from camtool.findings import Code, Finding, Severity
from camtool.geometry.drawing import Skipped
from camtool.importers.solid_shapes import Body, Model, bodies, has_edges, quiet

_AGAIN = "export it again as STEP (AP214 or AP242)"
_STEP_END = b"END-ISO-10303-21"
_STEP_SOLID = re.compile(rb"=\s*(?:MANIFOLD_SOLID_BREP|BREP_WITH_VOIDS|FACETED_BREP)\s*\(")
_STEP_CONTEXT = re.compile(rb"GLOBAL_UNIT_ASSIGNED_CONTEXT\s*\(\s*\(([#\d,\s]*)\)")
_STEP_NAMED = re.compile(rb"CONVERSION_BASED_UNIT\s*\(\s*'([^']*)'")
_STEP_SI = re.compile(rb"SI_UNIT\s*\(\s*(?:\.(\w+)\.|\$)\s*,\s*\.METRE\.")

_UNITS_MM = {
    "millimetre": 1.0,
    "centimetre": 10.0,
    "metre": 1000.0,
    "micrometre": 0.001,
    "inch": 25.4,
    "foot": 304.8,
}
_PREFIXES = {"": "metre", "MILLI": "millimetre", "CENTI": "centimetre", "MICRO": "micrometre"}
_SPELLINGS = {"inches": "inch", "in": "inch", "feet": "foot", "ft": "foot"}


def load_step(data: bytes, file: str) -> Model:
    """The bodies of a STEP file; DrawingError when it is cut off or cannot be read."""
    if _STEP_END not in data:
        raise DrawingError("is cut off: its end is missing", file=file, mend=_AGAIN)

    def importer(path: Path) -> Any:
        from build123d import import_step

        return import_step(path)

    found = _imported(importer, data, "part.step", file)
    unit = _step_unit(data)
    why = f"STEP in {unit or 'its own unit'}, which its reader turns into mm"
    return Model(found, why, _UNITS_MM.get(unit), _lost(data, found), _faults(found))


def load_brep(data: bytes, file: str) -> Model:
    """The bodies of a BREP file of OpenCASCADE; DrawingError when it cannot be read."""

    def importer(path: Path) -> Any:
        from build123d import import_brep

        return import_brep(path)

    found = _imported(importer, data, "part.brep", file)
    return Model(found, "BREP is in mm", findings=_faults(found))


def _imported(importer: Callable[[Path], Any], data: bytes, name: str, file: str) -> list[Body]:
    """What build123d reads from these bytes; it wants a file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, name)
        path.write_bytes(data)
        with quiet():
            try:
                shape = importer(path)
            # OpenCASCADE fails in every possible way at a damaged file.
            except Exception as error:
                raise DrawingError(
                    "cannot be read: its structure is damaged", file=file, mend=_AGAIN
                ) from error
    empty = shape is None or shape.wrapped is None or shape.wrapped.IsNull()
    found = [] if empty else [body for body in bodies(shape) if has_edges(body.shape)]
    if not found:
        raise DrawingError("holds no shapes, or is damaged", file=file, mend=_AGAIN)
    return found


def _lost(data: bytes, found: list[Body]) -> list[Skipped]:
    """Solids that the file holds and that did not come out."""
    read = len({hash(body.shape.TShape()) for body in found})
    lost = len(_STEP_SOLID.findall(data)) - read
    return [Skipped("solid", lost, "is damaged or belongs to no part")] if lost > 0 else []


def _faults(found: list[Body]) -> list[Finding]:
    """FILE_REPAIRED when faces or edges of a body do not fit together."""
    from OCP.BRepCheck import BRepCheck_Analyzer

    with quiet():
        faulty = sum(not BRepCheck_Analyzer(body.shape).IsValid() for body in found)
    if not faulty:
        return []
    return [
        Finding(
            Code.FILE_REPAIRED,
            Severity.WARNING,
            f"{faulty} of {len(found)} bodies have faces or edges that do not fit together",
            measured=float(faulty),
        )
    ]


def _step_unit(data: bytes) -> str:
    """The one unit of length of all parts of a STEP file; "" when it cannot be told."""
    units: set[str] = set()
    for context in _STEP_CONTEXT.finditer(data):
        for number in re.findall(rb"#(\d+)", context[1]):
            entity = re.search(rb"#" + number + rb"\s*=([^;]*LENGTH_UNIT[^;]*);", data)
            if entity is not None:
                units.add(_unit_name(entity[1]))
    return units.pop() if len(units) == 1 else ""


def _unit_name(entity: bytes) -> str:
    named = _STEP_NAMED.search(entity)
    if named is not None:
        name = named[1].decode("ascii", errors="replace").strip().lower()
        name = _SPELLINGS.get(name, name)
    else:
        si = _STEP_SI.search(entity)
        name = "" if si is None else _PREFIXES.get((si[1] or b"").decode("ascii"), "")
    return name if name in _UNITS_MM else ""
