"""The dimensions of a drawing that are inspected: its callouts, and those of `tolerances.toml`.

    tolerances.toml ──read_tolerances──▶ dimensions ─┐
    Drawing.callouts ──text, style──▶ dimensions ────┴─bind─▶ known size: limits ──▶ Dimension

A dimension of the file holds where a callout measures the same. The nominal size is what file or
text say, else what is drawn; where both are known they must agree within DIFFERS_MM."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

import msgspec
from msgspec import Struct

from camtool.errors import DrawingError, InputError, OptionError
from camtool.findings import Finding
from camtool.geometry.drawing import Callout, Drawing
from camtool.inspection.dimensions import DEPTHS, ZONES, Dimension, Kind, Limits
from camtool.inspection.features import (
    BIND_MM,
    BoundDimension,
    CircleFeature,
    Features,
    bind,
    features_of,
)
from camtool.inspection.findings import (
    CALLOUT_TEXT,
    COUNT_DIFFERS,
    DIMENSION_DIFFERS,
    DIMENSION_DIFFERS_VIEW,
    DIMENSION_TWICE,
    DIMENSION_TWICE_DIFFERS,
)
from camtool.inspection.limits import (
    LimitsText,
    NotUnderstood,
    deviation_words,
    general_class,
    limited,
    normalised_words,
    read_words,
)
from camtool.plain import one_line
from camtool.records import replace
from camtool.tables import convert, read_table
from camtool.units import MM_PER_UNIT, parse_angle, parse_length

DIFFERS_MM = 0.02
"""A nominal size that differs more from the drawn size is an error.

Inches with three decimals are rounded by up to 0.0127 mm."""

MAX_SIZE_MM = 1e6

Length = str | float


Asked = tuple[str, tuple[Dimension, ...]]
"""Content of a file of tolerances: the general tolerance ("" for none), and its dimensions."""


def dimensions_of(
    drawing: Drawing,
    tolerances_file: Path | Asked | None = None,
    *,
    faults: list[DrawingError] | None = None,
) -> tuple[tuple[Dimension, ...], tuple[Finding, ...]]:
    """Return the dimensions of a drawing, those of the file first, with nominal sizes and limits
    as far as they are known, and the findings about them.

    A dimension that fits no feature is included. Raises CamtoolError for a file or a callout whose
    limits are wrong, with its place and how to correct it; if `faults` is given, the errors of
    callouts are added to it, and these dimensions have no limits."""
    if isinstance(tolerances_file, Path):
        tolerances_file = read_tolerances(tolerances_file)
    general, stated = tolerances_file or ("", ())
    features, file = features_of(drawing.paths), drawing.file
    findings: list[Finding] = []
    dimensions: list[Dimension] = []
    by_measure: dict[object, Dimension] = {}
    with_limits: dict[str, list[Dimension]] = {}
    for each in stated:
        bound = bind(each, features, file)
        settled = _with_limits(each, bound, file, findings)
        holds = by_measure.setdefault(_measures(each, bound), each)
        if holds is each:
            with_limits[each.source] = settled
            dimensions += settled
        for one in settled if holds is not each else ():
            findings += (
                _duplicate_finding(one, other, file) for other in with_limits[holds.source]
            )
    drawn: list[tuple[int, Dimension]] = []
    for place, callout in enumerate(drawing.callouts):
        measured = replace(_measured_dimension(callout), general=general)
        bound = bind(measured, features, file)
        measure = _measures(measured, bound)
        if measure in by_measure:
            findings.append(_duplicate_finding(measured, by_measure[measure], file))
            continue
        drawn_mm = bound.drawn_mm if isinstance(bound, BoundDimension) else math.inf
        # Programs round the places of a dimension: the size of the drawn feature counts.
        if abs(drawn_mm - callout.measured_mm) <= DIFFERS_MM:
            measured = replace(measured, nominal_mm=round(drawn_mm, 9))
        callout_dimensions = _callout_dimensions(
            callout, measured, file, features, findings, faults
        )
        drawn += ((place, each) for each in callout_dimensions)
    kept_dimensions: list[tuple[int, Dimension]] = []
    for place, each in sorted(drawn, key=lambda item: item[1].limits is None):
        bound = bind(each, features, file)
        if isinstance(bound, BoundDimension):
            earlier = by_measure.setdefault(measured_by(bound), each)
            if earlier is not each:
                if earlier.source != each.source:
                    findings.append(_duplicate_finding(each, earlier, file))
                continue
        kept_dimensions += ((place, one) for one in _with_limits(each, bound, file, findings))
    dimensions += (each for _, each in sorted(kept_dimensions, key=lambda item: item[0]))
    return tuple(_with_unique_names(dimensions)), tuple(findings)


def _duplicate_finding(one: Dimension, holds: Dimension, file: str) -> Finding:
    """Return the finding that two dimensions measure the same: a warning if both are of the
    drawing and their limits differ."""
    place = f"{file}, {one.source}"
    own, other_limits = one.limits, holds.limits
    if own is None or other_limits is None or _deviations(own) == _deviations(other_limits):
        return DIMENSION_TWICE(where=place, holds=holds.source)
    return DIMENSION_TWICE_DIFFERS(
        where=place, limits=own.said, holds=holds.source, others=other_limits.said
    )


def _deviations(limits: Limits) -> tuple[float, float]:
    """Return the lower and the upper deviation of limits, mm."""
    return limits.lower_mm, limits.upper_mm


def _with_limits(
    dimension: Dimension, bound: BoundDimension | Finding, file: str, findings: list[Finding]
) -> list[Dimension]:
    """Return the dimension with its limits, now that the size of its feature is known, in a list;
    [] and a finding if its nominal size differs from the drawn one.

    A dimension without a feature keeps what is known."""
    drawn = bound.drawn_mm if isinstance(bound, BoundDimension) else dimension.nominal_mm
    if dimension.kind in DEPTHS:
        drawn = dimension.nominal_mm
    if drawn is None or dimension.kind in ZONES:
        return [dimension]
    nominal = dimension.nominal_mm
    if nominal is not None and abs(nominal - drawn) > DIFFERS_MM:
        place = f"{file}, {_place_of(dimension)}"
        findings.append(
            DIMENSION_DIFFERS(where=place, measured=drawn, limit=nominal, name=dimension.name)
        )
        return []
    with _with_place(file, _place_of(dimension)):
        settled, lacks = limited(dimension, drawn)
    findings += lacks
    return [settled]


def _place_of(dimension: Dimension) -> str:
    x, y = dimension.places_mm[0]
    return f"{dimension.source}, at ({x:.3f}, {y:.3f}) mm"


def unbound_findings(drawing: Drawing, dimensions: Iterable[Dimension]) -> list[Finding]:
    """Return the findings about dimensions that fit no feature of the drawing, or several."""
    features = features_of(drawing.paths)
    bound = (bind(each, features, drawing.file) for each in dimensions)
    return [each for each in bound if isinstance(each, Finding)]


def _measures(dimension: Dimension, bound: BoundDimension | Finding) -> object:
    """Return a key of what a dimension measures; if it fits no feature, a key of the places that
    it names."""
    if isinstance(bound, BoundDimension) and dimension.kind not in DEPTHS:
        return measured_by(bound)
    places = frozenset((round(x, 3), round(y, 3)) for x, y in dimension.places_mm)
    angle = dimension.direction_rad
    return dimension.kind, places, None if angle is None else round(angle % math.pi, 6)


def measured_by(bound: BoundDimension) -> object:
    """Return a key of what a dimension measures, equal for two dimensions of the same features and
    direction."""
    if not bound.ends:
        return bound.dimension.kind, tuple(map(id, bound.features))
    x, y = (round(float(part), 3) + 0.0 for part in bound.direction)
    ends = frozenset((id(end.feature), end.how) for end in bound.ends)
    return ends, (x, y) if (x, y) > (0.0, 0.0) else (0.0 - x, 0.0 - y)


def _with_unique_names(dimensions: Sequence[Dimension]) -> Iterator[Dimension]:
    """Yield the dimensions, each with a name that no other one has."""
    names = [each.name for each in dimensions]
    names_used: set[str] = set()
    for each in dimensions:
        name, number = each.name, 1
        while name in names_used or (number == 1 and names.count(name) > 1):
            name, number = f"{each.name} #{number}", number + 1
        names_used.add(name)
        yield replace(each, name=name)


# tolerances.toml


class _Row(msgspec.Struct, forbid_unknown_fields=True, rename={"start": "from"}):
    """The keys of one [[dimension]] of a tolerance file."""

    kind: Literal[
        "diameter",
        "distance",
        "width",
        "radius",
        "position",
        "straightness",
        "roundness",
        "profile",
        "depth",
        "thickness",
    ]
    name: str = ""
    at: tuple[Length, Length] | None = None
    start: tuple[Length, Length] | None = None
    to: tuple[Length, Length] | None = None
    direction: Length | None = None
    nominal: Length | None = None
    limits: str | None = None
    zone: Length | None = None


class _File(msgspec.Struct, forbid_unknown_fields=True):
    """The keys of a tolerance file."""

    general: str = ""
    dimension: list[dict[str, Any]] = []


def read_tolerances(path: Path) -> Asked:
    """Read a tolerance file: its general tolerance ("" for none) and its dimensions.

    CamtoolError with file, place and correction for invalid content."""
    file = str(path)
    file_table = read_table(path)
    if isinstance(file_table.get("dimension"), dict):
        raise InputError(
            "[dimension] is a single table",
            file=file,
            where="table [dimension]",
            mend="write [[dimension]] above each dimension",
        )
    table = convert(file_table, _File, file)
    if not table.general and not table.dimension:
        raise InputError(
            "says nothing of any dimension",
            file=file,
            mend="write a [[dimension]], or general tolerances; camtool tolerances new DRAWING "
            "begins a file",
        )
    if table.general:
        with _with_place(file, "key general"):
            general_class(table.general)
    rows = [
        _dimension(convert(row, _Row, file, f"dimension {number}"), number, table.general, path)
        for number, row in enumerate(table.dimension, 1)
    ]
    return table.general, tuple(rows)


@contextmanager
def _with_place(file: str, place: str) -> Iterator[None]:
    """Add file and place to a CamtoolError raised in the `with` block."""
    try:
        yield
    except OptionError as error:
        raise InputError(error.message, file=file, where=place, mend=error.mend) from error


def _dimension(row: _Row, number: int, general: str, path: Path) -> Dimension:
    """Return the dimension that a row of the file describes."""
    place = f"dimension {number}"
    _check_keys(row, str(path), place)

    def mm(value: Length, key: str, min_mm: float = -MAX_SIZE_MM) -> float:
        with _with_place(str(path), f"{place}, key {key}"):
            return _mm(value, key, min_mm)

    pairs = {"at": row.at, "from": row.start, "to": row.to}
    places = tuple(
        (mm(pair[0], key), mm(pair[1], key)) for key, pair in pairs.items() if pair is not None
    )
    kind: Kind = "distance" if row.kind == "width" else row.kind
    limits, words = None, ""
    if row.zone is not None:
        size = mm(row.zone, "zone", 0.0)
        if not size:
            raise InputError(
                "a zone of 0 holds no part",
                file=str(path),
                where=f"{place}, key zone",
                mend="give its width",
            )
        limits = Limits(0.0, size, f"zone {size:g}")
    nominal = None if row.nominal is None else mm(row.nominal, "nominal", 0.0)
    if row.limits is not None:
        with _with_place(str(path), f"{place}, key limits"):
            limits_text = read_words(row.limits)
            _check_units(row.nominal, limits_text)
            words = row.limits
            if nominal is not None:
                limits, words = limits_text.limits(nominal), ""
    direction = None
    if row.direction is not None:
        with _with_place(str(path), f"{place}, key direction"):
            direction = _direction(row.direction)
    if len(places) == 2 and math.dist(*places) <= BIND_MM:
        raise InputError(
            "from and to are the same place",
            file=str(path),
            where=place,
            mend="give two places that differ",
        )
    return Dimension(
        name=one_line(row.name) or f"{row.kind} {number}",
        kind=kind,
        places_mm=places,
        source=f"{path.name}, {place}",
        direction_rad=direction,
        nominal_mm=nominal,
        limits=limits,
        words=words,
        general="" if kind in ZONES else general,
    )


def _check_keys(row: _Row, file: str, place: str) -> None:
    """Raise InputError for a key that this kind lacks or does not know."""
    given_keys = {
        "at": row.at,
        "from": row.start,
        "to": row.to,
        "direction": row.direction,
        "nominal": row.nominal,
        "limits": row.limits,
        "zone": row.zone,
    }
    needed = ["from", "to"] if row.kind in ("distance", "width") else ["at"]
    sizes = ["direction", "nominal", "limits"] if len(needed) == 2 else ["nominal", "limits"]
    takes = [*needed, *(["zone"] if row.kind in ZONES else sizes)]
    for key, value in given_keys.items():
        key_place = f"{place}, key {key}"
        if value is not None and key not in takes:
            raise InputError(
                f"a {row.kind} has no {key}",
                file=file,
                where=key_place,
                mend=f"it takes {', '.join(takes)}",
            )
        if value is None and key in needed:
            example = '["10mm", "5mm"]'
            raise InputError(
                "key is missing", file=file, where=key_place, mend=f"write {key} = {example}"
            )


def _mm(value: Length, name: str, min_mm: float) -> float:
    length = parse_length(value, name=name) if isinstance(value, str) else float(value)
    if not min_mm <= length <= MAX_SIZE_MM:
        raise OptionError(
            f"{name} {value!r} is not between {min_mm:g} and {MAX_SIZE_MM:g} mm",
            mend="correct it or its unit",
        )
    return length


def _check_units(nominal: Length | None, words: LimitsText) -> None:
    """Raise OptionError if one is in inches and the other in millimetres."""
    unit = re.sub(r"[\s\d.+/-]", "", nominal) if isinstance(nominal, str) else ""
    if not unit or words.in_inches is None:
        return
    if (unit.lower() in ("in", '"', "ft")) != words.in_inches:
        raise OptionError(
            f"limits in {_unit_name(words.unit)} contradict a nominal size in {_unit_name(unit)}",
            mend="write both in one unit",
        )


def _unit_name(unit: str) -> str:
    return {"in": "inches", '"': "inches"}.get(unit.lower(), unit)


def _direction(value: Length) -> float:
    """Return the direction, rad, of "x", "y" or an angle."""
    if isinstance(value, str) and value.strip().lower() in ("x", "y"):
        return 0.0 if value.strip().lower() == "x" else math.pi / 2.0
    try:
        angle = parse_angle(value) if isinstance(value, str) else math.radians(value)
    except OptionError as error:
        raise OptionError(error.message, mend='use "x", "y" or degrees') from error
    return angle


# Callouts


class CalloutText(Struct, frozen=True):
    """The parsed text of a callout: `count` of equal features, `sign` "Ø", "R" or "", the nominal
    size (None for "<>"), the `words` of its limits, and `bare` if the size has no tolerance: for
    information, in parentheses, or theoretically exact, in brackets."""

    count: int = 1
    sign: str = ""
    nominal_mm: float | None = None
    words: str = ""
    bare: bool = False


_NOTES = re.compile(r"(?i)\s*\b(?:typ\.?|thru|through)(?=\s|$)")
"""Texts that state no limits."""

_TEXT = re.compile(r"(?:(?P<count>\d{1,3})\s?[xX×]\s*)?(?P<sign>[Ø⌀∅ϕφΦR])?\s*(?P<rest>.*)")
_NUMBER = r"(?:\d+(?:\.\d*)?|\.\d+)"
_SIZE = re.compile(
    rf"(?P<size><>|{_NUMBER}(?![\d.]))\s*(?P<unit>mm|cm|in|\")?\s*(?P<limits>(?:[±+A-Za-z-]|0\b).*)?"
)
"""A size, and limits that begin with a sign, a letter or 0."""

_SIZES = re.compile(rf"{_NUMBER}\s*(?:/|…|\.\.\.?|\bto\b|\s)\s*{_NUMBER}\s*(?:mm|in|\")?")
_AROUND = {"(": ")", "[": "]"}


def read_text(text: str, mm_per_unit: float = 1.0) -> CalloutText | None:
    """Parse the text of a callout; numbers without a unit are multiplied by `mm_per_unit`. None if
    it is not understood.

    >>> read_text("4x Ø5 H7")
    CalloutText(count=4, sign='Ø', nominal_mm=5.0, words='H7', bare=False)
    """
    plain_text = normalised_words(_NOTES.sub("", text)) or "<>"
    is_bare = _AROUND.get(plain_text[:1], "") == plain_text[-1:] != ""
    match = _TEXT.fullmatch(plain_text[1:-1].strip() if is_bare else plain_text)
    if match is None or match["count"] == "0":
        return None
    sign = "Ø" if match["sign"] not in ("R", None) else match["sign"] or ""
    parsed = CalloutText(count=int(match["count"] or 1), sign=sign, bare=is_bare)
    size = _SIZE.fullmatch(match["rest"])
    if size is None:  # limits of size alone: 20.1/19.9
        return replace(parsed, words=match["rest"]) if _SIZES.fullmatch(match["rest"]) else None
    nominal = None
    if size["size"] != "<>":
        nominal = float(size["size"]) * MM_PER_UNIT.get(size["unit"] or "", mm_per_unit)
        if not 0.0 < nominal <= MAX_SIZE_MM:
            return None
    return replace(parsed, nominal_mm=nominal, words=size["limits"] or "")


def _callout_dimensions(
    callout: Callout,
    measured: Dimension,
    file: str,
    features: Features,
    findings: list[Finding],
    faults: list[DrawingError] | None,
) -> Iterator[Dimension]:
    """Yield the dimensions of a callout: one, or as many as its text counts."""
    place = f"{file}, {callout.source}"
    text = one_line(callout.text)
    if callout.scale != 1.0:
        shown = callout.measured_mm * callout.scale
        findings.append(
            DIMENSION_DIFFERS_VIEW(where=place, measured=callout.measured_mm, limit=shown)
        )
        return
    parsed = read_text(callout.text, callout.mm_per_unit)
    if parsed is None:
        findings.append(CALLOUT_TEXT(where=place, text=text))
        return
    one = _by_sign(measured, parsed.sign)
    assert one.nominal_mm is not None
    drawn = one.nominal_mm
    nominal = drawn if parsed.nominal_mm is None else round(parsed.nominal_mm, 9)
    sign = {"diameter": "Ø", "radius": "R"}.get(one.kind, parsed.sign)
    one = replace(one, name=f"{sign}{round(nominal, 4):g}", nominal_mm=nominal)
    if abs(nominal - drawn) > DIFFERS_MM:
        place_text = f"{file}, {_place_of(one)}"
        findings.append(
            DIMENSION_DIFFERS(where=place_text, measured=drawn, limit=nominal, name=one.name)
        )
        return
    limits = None
    try:
        limits = _limits(callout, parsed, nominal)
    except NotUnderstood:
        findings.append(CALLOUT_TEXT(where=place, text=text))
        return
    except OptionError as error:
        fault = DrawingError(
            f"{error.message}{f' (text {text})' if text else ''}",
            file=file,
            where=_place_of(one),
            mend=f"{error.mend}, or name the dimension in tolerances.toml",
        )
        if faults is None:
            raise fault from error
        faults.append(fault)
    has_own_limits = parsed.bare or callout.exact or limits is not None
    one = replace(one, limits=limits, general="" if has_own_limits else one.general)
    yield from _repeat_by_count(one, parsed.count, features, place, findings)


def _measured_dimension(callout: Callout) -> Dimension:
    """Return the dimension that a callout measures, without its text."""
    linear = callout.kind == "linear"
    return Dimension(
        name="",
        kind="distance" if callout.kind == "linear" else callout.kind,
        places_mm=callout.points_mm if linear else callout.points_mm[1:],
        source=callout.source,
        direction_rad=callout.direction_rad,
        nominal_mm=round(callout.measured_mm, 9),
    )


_OF_SIGN: dict[str, Kind] = {"Ø": "diameter", "R": "radius"}


def _by_sign(measured: Dimension, sign: str) -> Dimension:
    """Return the dimension as a diameter if the text has Ø, as a radius if it has R."""
    kind = _OF_SIGN.get(sign, measured.kind)
    if measured.kind == "distance" or kind == measured.kind or measured.nominal_mm is None:
        return measured
    share = 2.0 if kind == "diameter" else 0.5
    return replace(measured, kind=kind, nominal_mm=share * measured.nominal_mm)


def _limits(callout: Callout, parsed: CalloutText, nominal_mm: float) -> Limits | None:
    """Return the limits of the text, else those of its style if the text shows them; None without
    either."""
    if parsed.words:
        return read_words(parsed.words, callout.mm_per_unit).limits(nominal_mm)
    shown = not callout.text or "<>" in callout.text
    if not shown or parsed.bare or callout.upper_mm is None or callout.lower_mm is None:
        return None
    lower, upper = callout.lower_mm, callout.upper_mm
    return read_words(deviation_words(lower, upper)).limits(nominal_mm)


def _repeat_by_count(
    one: Dimension, count: int, features: Features, place: str, findings: list[Finding]
) -> Iterator[Dimension]:
    """Yield the dimension for each of the `count` circles of its size; if there are more or fewer,
    the dimension alone, with a finding."""
    if count == 1:
        yield one
        return
    assert one.nominal_mm is not None
    radius = one.nominal_mm * (0.5 if one.kind == "diameter" else 1.0)
    equal = [
        each
        for each in features
        if isinstance(each, CircleFeature)
        and one.kind != "distance"
        and abs(each.radius_mm - radius) <= BIND_MM
    ]
    if len(equal) != count:
        findings.append(
            COUNT_DIFFERS(where=place, measured=len(equal), limit=count, name=one.name)
        )
        yield one
        return
    for each in equal:
        middle = float(each.arcs[0, 0] + 0.5 * each.arcs[0, 1])
        x, y = each.centre_mm
        on_it = x + each.radius_mm * math.cos(middle), y + each.radius_mm * math.sin(middle)
        yield replace(one, places_mm=(on_it,))
