"""Drawings from objects: which library they are of, and its module.

The library of an object is the top-level package of the module that its class, or one that its
class is derived from, stands in: nothing is imported to find that out. A third party adds a
library by an entry point of the group `camtool.libraries`, named as that package, for a module
with the function `read` of `Library`; docs/python.md has an example.

Objects may be alone, in lists, or in a dictionary {layer: objects}."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from importlib import import_module
from itertools import chain
from numbers import Real
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, cast

import numpy as np
from msgspec import Struct

from camtool.errors import CamtoolError, DrawingError, OptionError
from camtool.importers.assemble import Found, assemble
from camtool.importers.options import DEFAULTS, ReadOptions
from camtool.importers.read import refuse_flags_of_pictures
from camtool.plugins import EntryPoint, entry_points
from camtool.records import replace

if TYPE_CHECKING:
    from camtool.geometry.drawing import Drawing

GROUP = "camtool.libraries"

LIBRARIES = {
    "build123d": "camtool.libraries.models",
    "ezdxf": "camtool.libraries.documents",
    "numpy": "camtool.libraries.points",
    "shapely": "camtool.libraries.areas",
    "svgpathtools": "camtool.libraries.svg_paths",
}
"""The libraries that camtool itself reads, and the module for each."""

_BUILTIN = "builtins"

MAX_NESTING = 8

NO_UNIT = "objects without a unit of their own count in mm"

_KINDS = (
    "a path, or objects of ezdxf, shapely, svgpathtools, numpy or build123d, "
    "alone, in a list or as {layer: objects}"
)


class Library(Protocol):
    """A module that reads the objects of one library."""

    def read(self, value: Any, name: str, options: ReadOptions) -> Found:
        """Return the pieces and marks that the object holds, in mm; `name` is its place in
        messages.

        DrawingError when it cannot be read, OptionError when it is no drawing."""


class ReadObject(Struct, frozen=True):
    """What was found in one object, its `place` among those that were given, and the layer under
    which it was given ("" without one)."""

    found: Found
    place: str
    layer: str


def is_path(value: object) -> bool:
    """Return True if the value names a file."""
    return isinstance(value, str | PathLike)


def path_of(value: Any) -> Path:
    """Return the path that the value names; OptionError for one that is no path of text."""
    try:
        return Path(value)
    except TypeError as error:
        raise OptionError(
            f"drawing is a path of type {type(value).__name__}", mend="give text, or a Path"
        ) from error


def library_of(value: object) -> EntryPoint | None:
    """Return the reader (entry point) for the library that the object's class is from; None for a
    library that is not known."""
    packages = [kind.__module__.partition(".")[0] for kind in type(value).__mro__]
    for package in packages:
        if package in LIBRARIES:
            return EntryPoint(package, LIBRARIES[package])
    if packages == [_BUILTIN] * len(packages):
        return None
    points = {point.name: point for point in entry_points(GROUP)}
    return next((points[package] for package in packages if package in points), None)


def read_objects(value: object, options: ReadOptions = DEFAULTS) -> Drawing:
    """Return the Drawing of an object, a list of objects, or a dictionary {layer: objects}.

    Raises OptionError, which names the argument, for what is no drawing, for mixed units and for
    options of files; DrawingError when an object cannot be read."""
    name = name_of(value)
    if options.format is not None:
        raise OptionError(f"format {options.format!r} is for files", mend="leave format out")
    refuse_flags_of_pictures(options, name)
    drawn = options.as_drawn()
    objects = [
        ReadObject(read_one(item, place, drawn), place, layer)
        for item, place, layer in items_of(value, "drawing", "", 0)
    ]
    _refuse_mixed_units(objects)
    contents = [_on_layer(each.found, each.layer) for each in objects]
    if not any(content.pieces or content.marks or content.skipped for content in contents):
        raise DrawingError("drawing is empty", file=name, mend="give geometry that has a length")
    used: dict[str, int] = {}
    for kind, count in chain.from_iterable(content.used.items() for content in contents):
        used[kind] = used.get(kind, 0) + count
    return assemble(
        [piece for content in contents for piece in content.pieces],
        file=name,
        options=drawn,
        units=contents[0].units,
        used=used,
        skipped=[item for content in contents for item in content.skipped],
        findings=[finding for content in contents for finding in content.findings],
        marks=[mark for content in contents for mark in content.marks],
        callouts=[callout for content in contents for callout in content.callouts],
    )


def name_of(value: object) -> str:
    """Return the name of a drawing of this object: its file, where it knows one, else its type, or
    "objects" for several."""
    file = getattr(value, "filename", None)
    if isinstance(file, str) and file:
        return file
    return "objects" if isinstance(value, list | tuple | Mapping) else type(value).__name__


def items_of(value: Any, place: str, layer: str, depth: int) -> Iterator[tuple[Any, str, str]]:
    """Yield each drawable object within `value`, which may be nested lists or {layer: objects},
    with its place for messages and its layer.

    OptionError for anything that is no drawing."""
    if depth > MAX_NESTING:
        raise OptionError(
            f"{place} lies deeper than {MAX_NESTING} lists", mend="give one list of objects"
        )
    if library_of(value) is not None:
        yield value, place, layer
    elif isinstance(value, Mapping) and not layer:
        for key, inner in value.items():
            if not isinstance(key, str) or not key:
                raise OptionError(
                    f"{place} has the key {key!r}, which names no layer",
                    mend="give {layer: objects} with the names of layers as text",
                )
            yield from items_of(inner, f"{place}[{key!r}]", key, depth)
    elif is_points(value):
        yield as_array(value, place), place, layer
    elif isinstance(value, list | tuple):
        for number, inner in enumerate(value):
            yield from items_of(inner, f"{place}[{number}]", layer, depth + 1)
    else:
        kind = type(value).__name__
        raise OptionError(f"{place} is of type {kind}, which is no drawing", mend=f"give {_KINDS}")


def is_points(value: object) -> bool:
    """Return True if the value is a list of points, each a list of numbers."""
    if not isinstance(value, list | tuple) or not value:
        return False
    first = value[0]
    is_row = isinstance(first, list | tuple) and bool(first)
    return is_row and all(isinstance(number, Real) for number in first)


def as_array(value: Any, place: str) -> Any:
    """Return a list of points as an array; OptionError when its rows differ in length."""
    try:
        return np.array(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise OptionError(
            f"{place} is no list of points ({error})", mend="give rows [x, y] or [x, y, bulge]"
        ) from error


def read_one(value: object, place: str, options: ReadOptions) -> Found:
    """Return the pieces and marks of one object, read by the module of its library.

    DrawingError, which names the plug-in, if a plug-in fails in an unexpected way."""
    library = library_of(value)
    if library is None:
        raise OptionError(f"{place} is of no library that is read", mend=f"give {_KINDS}")
    if library.name in LIBRARIES:
        return cast(Library, import_module(library.value)).read(value, place, options)
    try:
        return cast(Library, library.load()).read(value, place, options)
    except CamtoolError:
        raise
    except Exception as error:  # a plug-in may raise anything
        raise DrawingError(
            f"the reader of {library.name!r} fails ({type(error).__name__}: {error})",
            file=place,
            where=f"plug-in {library.value}",
            mend="tell whoever made it, or remove the package that brings it",
        ) from error


def _refuse_mixed_units(objects: list[ReadObject]) -> None:
    """Raise OptionError when the numbers of two objects count in different units."""
    for each in objects[1:]:
        first, units = objects[0].found.units, each.found.units
        if units.mm_per_unit != first.mm_per_unit:
            raise OptionError(
                f"mixed units: {objects[0].place} counts in {first.name} ({first.why}), "
                f"{each.place} in {units.name} ({units.why})",
                mend="say units=, which then holds for all of them",
            )


def _on_layer(content: Found, layer: str) -> Found:
    """Return the same content with everything moved to `layer`; unchanged for ""."""
    if not layer:
        return content
    return replace(
        content,
        pieces=[replace(piece, layer=layer) for piece in content.pieces],
        marks=[replace(mark, layer=layer) for mark in content.marks],
        callouts=[replace(callout, layer=layer) for callout in content.callouts],
    )
