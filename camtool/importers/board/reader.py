"""Boards: Gerber (RS-274X, X2) and Excellon files, alone or as the ZIP archive for a fabricator.

    file ──gerbonara──▶ apertures, strokes and regions
                          ├ copper:  dark ∪, clear −   ──▶ closed contours of what stays copper
                          ├ outline: the strokes' centre lines
                          └ drills:  a circle for each hole, the contour of each slot

What a file is follows from its own attribute (X2's .FileFunction) or from its name. Layers are
COPPER-TOP, COPPER-BOTTOM, COPPER-INNER, OUTLINE, DRILL-0.80 and SLOT-0.80 (mm); any other Gerber
gives GERBER. Areas are united with shapely, arcs as chords within FLAT_MM, and the chords that
remain become arcs again: their ends lie on the circles exactly."""

from __future__ import annotations

import io
import math
import re
import warnings
import zipfile
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from pathlib import PurePosixPath
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from msgspec import Struct

from camtool.arrays import Floats
from camtool.errors import DrawingError
from camtool.geometry.drawing import Drawing, Skipped, Units
from camtool.geometry.fit import arc_vertices
from camtool.geometry.polylines import Polyline
from camtool.geometry.simplify import recognise_arcs
from camtool.importers.assemble import assemble
from camtool.importers.formats import is_excellon, is_gerber, zip_faults
from camtool.importers.options import ReadOptions
from camtool.importers.pieces import Piece

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

FLAT_MM = 2e-4
"""Chords lie within this of their arcs while areas are united."""

CHORD_RAD = math.pi / 16
"""Arcs have chords of at most this angle, fine enough to be recognised as arcs again."""

SPECK_MM = 1e-4
"""Points of united areas that are nearer than this to each other are one."""

MAX_PRIMITIVES = 400_000
"""Apertures and strokes of one file; uniting this many takes about a minute."""

MAX_BOARD_MM = 10_000.0
"""Numbers above this are faults of a file: the arcs of its areas could not be divided within
FLAT_MM."""

MAX_UNPACKED_BYTES = 200_000_000

_LAYERS = (
    (r"mask|paste|silk|legend|courtyard|fab\b|assy|\.g[tb][sop]$", ""),
    (r"outline|profile|edge.?cuts|dimension|\.(?:gko|gm\d*|gml|oln)$", "OUTLINE"),
    (r"\.gp?\d+$|in\d+.cu\b|inner", "COPPER-INNER"),
    (r"\.gtl$|\bf.cu\b|top", "COPPER-TOP"),
    (r"\.gbl$|\bb.cu\b|bottom|\bbot\b", "COPPER-BOTTOM"),
)
"""Layers by the names of files, first match; "" is left out of an archive."""

_FUNCTIONS = {"Copper": "COPPER", "Profile": "OUTLINE"}
_SIDES = {"Top": "-TOP", "Bot": "-BOTTOM", "Inr": "-INNER"}


_HARMLESS = "zero-size aperture|[Dd]eprecated"
"""Warnings of gerbonara about files that it draws correctly all the same."""

MAX_REMARK = 120


class _Part(Struct):
    """A file of a board: its `name`, `layer` and text."""

    name: str
    layer: str
    text: str


def read(data: bytes, file: str, options: ReadOptions) -> Drawing:
    """Return the Drawing of a board; DrawingError naming the file of an archive, and the line."""
    if options.units is not None:
        raise DrawingError(
            "says its own unit", file=file, mend="leave --units out; --scale changes its size"
        )
    skipped: list[Skipped] = []
    pieces: list[Piece] = []
    used: Counter[str] = Counter()
    for part in _parts(data, file, skipped):
        part_pieces = _pieces(part, file, skipped)
        used.update(piece.kind for piece in part_pieces)
        pieces += part_pieces
    return assemble(
        pieces,
        file=file,
        units=Units("mm", 1.0, "boards say their unit, and are read in mm"),
        used=dict(used),
        skipped=skipped,
        options=options,
    )


# The files of a board.


def _parts(data: bytes, file: str, skipped: list[Skipped]) -> list[_Part]:
    """Return the files of a board to read, those of an archive in the order of their names; others
    are added to `skipped`."""
    if not data.startswith(b"PK"):
        return [_Part("", _layer_by_name(file) or "GERBER", _text(data))]
    parts, total = [], 0
    try:
        archive = zipfile.ZipFile(io.BytesIO(data))
    except zip_faults() as error:
        raise DrawingError(f"is a damaged ZIP archive ({error})", file=file) from error
    with archive:
        for entry in sorted(archive.infolist(), key=lambda entry: entry.filename):
            if entry.is_dir():
                continue
            total += entry.file_size
            if total > MAX_UNPACKED_BYTES:
                raise DrawingError(
                    f"unpacks to more than {MAX_UNPACKED_BYTES // 1_000_000} MB", file=file
                )
            try:
                text = _text(archive.read(entry))
            except zip_faults() as error:
                raise DrawingError(
                    f"cannot be unpacked ({error})", file=file, where=entry.filename
                ) from error
            name = PurePosixPath(entry.filename).name
            head = text[:4096]
            if not (is_gerber(head) or is_excellon(head)):
                skipped.append(Skipped("file", 1, f"is no Gerber or Excellon: {name}"))
                continue
            layer = _layer_by_function(text) or _layer_by_name(name)
            if layer or is_excellon(head):
                parts.append(_Part(name, layer or "", text))
            else:
                skipped.append(
                    Skipped("file", 1, f"is neither copper, outline nor drills: {name}")
                )
    if not parts:
        raise DrawingError("holds no copper, outline or drills", file=file)
    return parts


def _text(data: bytes) -> str:
    return data.decode("utf-8-sig", "replace").replace("\x00", "")


def _layer_by_function(text: str) -> str | None:
    """Return the layer that the file's attribute .FileFunction names; "" for one that is not cut,
    None without the attribute."""
    match = re.search(r"TF\.FileFunction,(\w+)(?:,L\d+)?(?:,(\w+))?", text[:20_000])
    if match is None:
        return None
    layer = _FUNCTIONS.get(match[1], "")
    return layer + _SIDES.get(match[2], "") if layer == "COPPER" else layer


def _layer_by_name(name: str) -> str:
    base = PurePosixPath(name.replace("\\", "/")).name.lower()
    return next((layer for pattern, layer in _LAYERS if re.search(pattern, base)), "")


def _pieces(part: _Part, file: str, skipped: list[Skipped]) -> list[Piece]:
    """Return the pieces of one file; what is left out is added to `skipped`."""
    try:
        from gerbonara.excellon import ExcellonFile
        from gerbonara.rs274x import GerberFile
    except ImportError as error:
        raise DrawingError(
            "is a board, which is read with gerbonara",
            file=file,
            mend="pip install 'camtool[boards]'",
        ) from error
    drills = is_excellon(part.text[:4096])
    kind = ExcellonFile if drills else GerberFile
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            board = kind.from_string(part.text, filename=part.name or file)
            objects = [_primitives(each) for each in board.objects]
        except Exception as error:  # gerbonara raises whatever its parser meets
            raise DrawingError(
                f"cannot be read as {'Excellon' if drills else 'Gerber'} "
                f"({type(error).__name__}: {error})",
                file=file,
                where=part.name or None,
                mend="export it again, as RS-274X and as Excellon with a head (M48)",
            ) from error
    for text, count in Counter(_remark(str(each.message)) for each in caught).items():
        if not re.search(_HARMLESS, text):
            skipped.append(Skipped("statement", count, text))
    if sum(len(each) for each, _ in objects) > MAX_PRIMITIVES:
        raise DrawingError(f"has more than {MAX_PRIMITIVES} apertures and strokes", file=file)
    for primitive in (primitive for primitives, _ in objects for primitive in primitives):
        if not all(abs(number) <= MAX_BOARD_MM for number in _numbers(primitive)):
            raise DrawingError(
                f"has a number above {MAX_BOARD_MM / 1e3:g} m",
                file=file,
                where=part.name or None,
                mend="look for a missing point or a wrong number format (%FS, METRIC)",
            )
    if drills:
        return list(_holes(objects, part))
    layer = _layer_by_function(part.text) or part.layer
    if layer == "OUTLINE":
        return list(_centre_lines(objects, layer))
    return list(_areas(objects, layer))


def _numbers(value: Any) -> Iterator[float]:
    """Yield all numbers of a primitive of gerbonara: its coordinates and sizes, and those of the
    points and centres of a contour."""
    if isinstance(value, int | float):
        yield value
    elif isinstance(value, list | tuple):
        for each in value:
            yield from _numbers(each)
    elif value is not None:
        for each in vars(value).values():
            yield from _numbers(each)


def _remark(text: str) -> str:
    """Return a warning of gerbonara without the file, line and statement that it begins with."""
    return re.sub(r'^.*?:\d+ ".*?": ', "", text.partition("\n")[0])[:MAX_REMARK]


_Drawn = tuple[list[Any], bool]
"""The primitives of one object, and whether it is dark."""


def _primitives(drawn: Any) -> _Drawn:
    from gerbonara.utils import MM

    return list(drawn.to_primitives(MM)), bool(getattr(drawn, "polarity_dark", True))


# Drills: a circle for each hole, the contour of each slot.


def _holes(objects: Iterable[_Drawn], part: _Part) -> Iterator[Piece]:
    from gerbonara.graphic_primitives import Circle

    for number, (primitives, _) in enumerate(objects, start=1):
        for each in primitives:
            if isinstance(each, Circle):
                vertices = arc_vertices(np.array([each.x, each.y]), each.r, 0.0, 2.0 * math.pi)
                layer = f"DRILL-{2.0 * each.r:.2f}"
                yield Piece(vertices, True, layer, "", f"hole {number}")
            else:
                for contour in _contours(_area(each)):
                    layer = f"SLOT-{each.width:.2f}"
                    yield Piece(contour, True, layer, "", f"slot {number}")


# Outlines: the lines as they are drawn, whatever their width.


def _centre_lines(objects: Iterable[_Drawn], layer: str) -> Iterator[Piece]:
    from gerbonara.graphic_primitives import Arc, ArcPoly, Line

    for number, (primitives, _) in enumerate(objects, start=1):
        for each in primitives:
            source = f"stroke {number}"
            if isinstance(each, Line):
                vertices = np.array([[each.x1, each.y1, 0.0], [each.x2, each.y2, 0.0]])
                yield Piece(vertices, False, layer, "", source)
            elif isinstance(each, Arc):
                centre, radius, start, sweep = _arc_of(each)
                is_full = abs(sweep) >= 2.0 * math.pi
                yield Piece(arc_vertices(centre, radius, start, sweep), is_full, layer, "", source)
            elif isinstance(each, ArcPoly):
                for contour in _contours(_area(each)):
                    yield Piece(contour, True, layer, "", f"region {number}")


def _arc_of(arc: Any) -> tuple[Floats, float, float, float]:
    """Return centre, radius, start angle and sweep of an arc, rad, counter-clockwise positive."""
    centre = np.array([arc.cx, arc.cy])
    start = math.atan2(arc.y1 - arc.cy, arc.x1 - arc.cx)
    end = math.atan2(arc.y2 - arc.cy, arc.x2 - arc.cx)
    sweep = (end - start) % (2.0 * math.pi)
    if arc.is_circle:
        sweep = 2.0 * math.pi
    elif arc.clockwise:
        sweep -= 2.0 * math.pi
    return centre, math.hypot(arc.x1 - arc.cx, arc.y1 - arc.cy), start, sweep


# Areas: what is dark, without what is cleared after it.


def _areas(objects: Sequence[_Drawn], layer: str) -> Iterator[Piece]:
    """Yield the contours of the area that remains dark when all objects are drawn in order, dark
    ones added, clear ones removed."""
    area: BaseGeometry = shapely.Polygon()
    for is_dark, group in _groups(objects):
        united = shapely.union_all(group)
        area = area.union(united) if is_dark else area.difference(united)
    for number, contour in enumerate(_contours(area), start=1):
        yield Piece(contour, True, layer, "", f"area {number}")


def _groups(objects: Iterable[_Drawn]) -> Iterator[tuple[bool, list[BaseGeometry]]]:
    """Yield dark (True) or clear, and the shapes, of each sequence of objects of one polarity."""
    dark, group = True, list[Any]()
    for primitives, is_dark in objects:
        shape = _flash(primitives, is_dark)
        if shape.is_empty:
            continue
        if is_dark != dark and group:
            yield dark, group
            group = []
        dark = is_dark
        group.append(shape)
    if group:
        yield dark, group


def _flash(primitives: Sequence[Any], is_dark: bool) -> BaseGeometry:
    """Return the area of one object.

    A hole in an aperture shows what lies below it, so it is removed from this object alone."""
    shape: BaseGeometry = shapely.Polygon()
    for each in primitives:
        area = _area(each)
        adds = each.polarity_dark == is_dark
        shape = (
            area
            if shape.is_empty and adds
            else (shape.union(area) if adds else shape.difference(area))
        )
    return shape


def _area(primitive: Any) -> BaseGeometry:
    """Return the area of a primitive of gerbonara; strokes have round ends."""
    from gerbonara.graphic_primitives import Arc, ArcPoly, Circle, Line, Rectangle

    match primitive:
        case Circle():
            return _disc(primitive.x, primitive.y, primitive.r)
        case Line():
            return _stroke(primitive)
        case Arc():
            return _bent_stroke(primitive)
        case Rectangle():
            half_w, half_h = primitive.w / 2.0, primitive.h / 2.0
            cosine, sine = math.cos(primitive.rotation), math.sin(primitive.rotation)
            corners = [(-half_w, -half_h), (half_w, -half_h), (half_w, half_h), (-half_w, half_h)]
            return shapely.Polygon(
                [
                    (primitive.x + x * cosine - y * sine, primitive.y + x * sine + y * cosine)
                    for x, y in corners
                ]
            )
        case ArcPoly():
            return _region(primitive)
        case _:
            raise TypeError(f"{type(primitive).__name__} has no area")


def _chords(radius: float, sweep: float) -> int:
    """Return the number of chords that keep an arc of this sweep within FLAT_MM."""
    within = 2.0 * math.acos(max(1.0 - FLAT_MM / radius, -1.0)) if radius > FLAT_MM else math.pi
    return max(1, math.ceil(abs(sweep) / min(within, CHORD_RAD)))


def _along_arc(centre: Floats, radius: float, start: float, sweep: float) -> Floats:
    """Return points (n, 2) on an arc, both ends among them."""
    angles = start + sweep * np.linspace(0.0, 1.0, _chords(radius, sweep) + 1)
    return np.asarray(centre + radius * np.column_stack([np.cos(angles), np.sin(angles)]))


def _disc(x: float, y: float, radius: float) -> BaseGeometry:
    if radius <= 0.0:
        return shapely.Polygon()
    return shapely.Polygon(_along_arc(np.array([x, y]), radius, 0.0, 2.0 * math.pi)[:-1])


def _stroke(line: Any) -> BaseGeometry:
    """Return the area of a straight stroke: two half discs, joined."""
    radius = line.width / 2.0
    length = math.hypot(line.x2 - line.x1, line.y2 - line.y1)
    if radius <= 0.0 or length == 0.0:
        return _disc(line.x1, line.y1, radius)
    along = math.atan2(line.y2 - line.y1, line.x2 - line.x1)
    half = math.pi / 2.0
    end = _along_arc(np.array([line.x2, line.y2]), radius, along - half, math.pi)
    begin = _along_arc(np.array([line.x1, line.y1]), radius, along + half, math.pi)
    return shapely.Polygon(np.concatenate([end, begin]))


def _bent_stroke(arc: Any) -> BaseGeometry:
    """Return the area of a stroke along an arc: a sector of a ring and two discs."""
    half = arc.width / 2.0
    centre, radius, start, sweep = _arc_of(arc)
    if half <= 0.0 or radius == 0.0:
        return _disc(arc.x1, arc.y1, half)
    outer = _along_arc(centre, radius + half, start, sweep)
    inner = _along_arc(centre, max(radius - half, 0.0), start, sweep)[::-1]
    if abs(sweep) >= 2.0 * math.pi:
        ring = shapely.Polygon(outer)
        return ring.difference(shapely.Polygon(inner)) if radius > half else ring
    sector = shapely.make_valid(shapely.Polygon(np.concatenate([outer, inner])))
    ends = [_disc(arc.x1, arc.y1, half), _disc(arc.x2, arc.y2, half)]
    return shapely.union_all([sector, *ends])


def _region(region: Any) -> BaseGeometry:
    """Return the area of a region; where its outline cuts in and returns along the same line, it
    encloses a hole."""
    points: list[Floats] = []
    for (x1, y1), (x2, y2), (clockwise, (cx, cy)) in region.segments:
        if clockwise is None:
            points.append(np.array([[x1, y1]]))
            continue
        centre = np.array([cx, cy])
        start = math.atan2(y1 - cy, x1 - cx)
        sweep = (math.atan2(y2 - cy, x2 - cx) - start) % (2.0 * math.pi) or 2.0 * math.pi
        sweep -= 2.0 * math.pi if clockwise and sweep < 2.0 * math.pi else 0.0
        points.append(_along_arc(centre, math.hypot(x1 - cx, y1 - cy), start, sweep)[:-1])
    outline = np.concatenate(points) if points else np.empty((0, 2))
    if len(outline) < 3:
        return shapely.Polygon()
    return shapely.make_valid(shapely.Polygon(outline), method="structure", keep_collapsed=False)


def _contours(area: BaseGeometry) -> Iterator[Floats]:
    """Yield the closed contours of an area, vertices (n, 3), with chords of one circle replaced by
    arcs."""
    for polygon in shapely.get_parts(shapely.remove_repeated_points(area, SPECK_MM)):
        if polygon.geom_type != "Polygon" or polygon.is_empty:
            continue
        for ring in (polygon.exterior, *polygon.interiors):
            points = shapely.get_coordinates(ring)[:-1]
            vertices = np.column_stack([points, np.zeros(len(points))])
            path, _ = recognise_arcs(Polyline(vertices, True), FLAT_MM)
            yield path.vertices
