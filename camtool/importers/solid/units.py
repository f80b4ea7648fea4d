"""The unit of length of a solid model, and what `--units` makes of it."""

from __future__ import annotations

import re
from dataclasses import dataclass

from camtool.errors import DrawingError
from camtool.importers.options import ReadOptions

_CONTEXT = re.compile(rb"GLOBAL_UNIT_ASSIGNED_CONTEXT\s*\(\s*\(([#\d,\s]*)\)")
_ENTITY = re.compile(rb"#(\d+)\s*=\s*(\([^;]*LENGTH_UNIT[^;]*);")
_NAMED = re.compile(rb"CONVERSION_BASED_UNIT\s*\(\s*'([^']*)'")
_SI = re.compile(rb"SI_UNIT\s*\(\s*(?:\.(\w+)\.|\$)\s*,\s*\.METRE\.")

_MM = {
    "millimetre": 1.0,
    "centimetre": 10.0,
    "metre": 1000.0,
    "micrometre": 0.001,
    "inch": 25.4,
    "foot": 304.8,
}
_PREFIXES = {b"": "metre", b"MILLI": "millimetre", b"CENTI": "centimetre", b"MICRO": "micrometre"}
_SPELLINGS = {"inches": "inch", "in": "inch", "feet": "foot", "ft": "foot"}


@dataclass(frozen=True)
class FileUnit:
    """`mm` per unit of the file, which its reader has applied already; None: cannot be told."""

    why: str
    mm: float | None = 1.0

    def scale(self, options: ReadOptions, file: str) -> float:
        """By what lengths are to be multiplied, so that the caller's unit is the file's."""
        if options.units is None:
            return 1.0
        if self.mm is None:
            raise DrawingError(
                "has no single unit that --units could replace", file=file, mend="leave it out"
            )
        return options.mm_per(options.units) / self.mm


def unnamed_unit() -> FileUnit:
    """BREP names none."""
    return FileUnit("BREP names no unit; its makers count in mm")


def script_unit() -> FileUnit:
    """build123d's own."""
    return FileUnit("build123d counts in mm")


def step_unit(data: bytes) -> FileUnit:
    """The one unit of length that all parts of a STEP file name; its reader gives mm."""
    entities = {match[1]: match[2] for match in _ENTITY.finditer(data)}
    names = {
        _name(entities[number])
        for context in _CONTEXT.finditer(data)
        for number in re.findall(rb"#(\d+)", context[1])
        if number in entities
    }
    name = names.pop() if len(names) == 1 else ""
    if name not in _MM:
        return FileUnit("named in the file, turned into mm by its reader", None)
    return FileUnit(f"the file counts in {name}, turned into mm by its reader", _MM[name])


def _name(entity: bytes) -> str:
    named = _NAMED.search(entity)
    if named is not None:
        name = named[1].decode("ascii", errors="replace").strip().lower()
        return _SPELLINGS.get(name, name)
    si = _SI.search(entity)
    return "" if si is None else _PREFIXES.get(si[1] or b"", "")
