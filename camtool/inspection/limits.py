"""By how much a dimension may differ from its nominal value: limits from words.

    H7  h6  JS7                    a class of ISO 286: its deviations belong to the nominal size
    ±0.05  +0.1/-0.2  +0.1 0       deviations, the upper one first
    19.9 … 20.1   20.1/19.9        limits of size, less the nominal size
    H7 (+0.012/0)                  a class and its deviations, which must agree
    ISO 2768-m                     the general tolerance of a whole drawing

    words ──read_words──▶ LimitsText ──limits(nominal size)──▶ Limits

Every error is an OptionError in one line with its mend; the caller adds file and place."""

from __future__ import annotations

import math
import re

from msgspec import Struct

from camtool.errors import OptionError
from camtool.findings import Finding
from camtool.inspection.dimensions import ZONES, Dimension, Kind, Limits
from camtool.inspection.findings import NO_GENERAL_TOLERANCE
from camtool.records import replace
from camtool.units import MM_PER_UNIT, UM_PER_MM

SIZE_DIGITS = 3
"""Nominal sizes are rounded to so many decimals of a millimetre before a table is searched: a
circle drawn as 6.0000001 mm has 6 mm, the last size of its band."""

SAME_LIMIT_MM = 1e-6
"""Limits given both as a class and as numbers must agree within this."""


class NotUnderstood(OptionError):
    """The error for a text that states no limits."""


MAX_WORDS_CHARS = 200

_INCHES = frozenset(("in", '"', "ft"))
_UNIT = r'(?:mm|cm|um|µm|μm|in|")'
_NUMBER = rf"(?P<%s>[+-]?(?:\d+(?:\.\d*)?|\.\d+))\s*(?P<%sunit>{_UNIT})?"
_PAIR = re.compile(
    rf"{_NUMBER % ('a', 'a')}\s*(?P<between>/|\^|;|,|…|\.\.\.?|\bto\b|\s|(?=[+-]))\s*"
    rf"{_NUMBER % ('b', 'b')}"
)
_BOTH = re.compile(rf"±\s*{_NUMBER % ('a', 'a')}")
_CLASS = re.compile(r"(?:[A-Z][A-Za-z]?|[a-z]{1,2})\d{1,2}")
_FIT = re.compile(rf"({_CLASS.pattern})\s*[/-]\s*({_CLASS.pattern})")
_WITH_NUMBERS = re.compile(rf"({_CLASS.pattern})\s*\((.*)\)")
_UPWARDS = ("…", "..", "...", "to")

_EXAMPLES = "write them like H7, ±0.05, +0.1/-0.2 or 19.9 … 20.1"


class LimitsText(Struct, frozen=True):
    """Limits parsed from text, before the nominal size is known.

    One of these is set, or a class and its deviations: `iso` ("H7", or ""), `deviations_mm`,
    `sizes_mm` (lower, upper). `unit`: that of their numbers ("" if the text names none)."""

    iso: str = ""
    deviations_mm: tuple[float, float] | None = None
    sizes_mm: tuple[float, float] | None = None
    unit: str = ""

    @property
    def in_inches(self) -> bool | None:
        """True if the text names inches, False for a metric unit, None for neither."""
        return self.unit in _INCHES if self.unit else None

    def limits(self, nominal_mm: float) -> Limits:
        """Return the limits for this nominal size, mm; OptionError if a class is not in the
        tables, or a limit of size is not above 0."""
        if self.iso:
            limits = iso_limits(self.iso, nominal_mm)
            self._check_agreement(limits)
            return limits
        lower, upper = self._deviations(nominal_mm)
        if nominal_mm > 0.0 and nominal_mm + lower <= 0.0:
            raise OptionError(
                f"limits {deviation_words(lower, upper)} leave nothing of {_mm(nominal_mm)} mm",
                mend="correct the limits or their unit",
            )
        return Limits(lower, upper, deviation_words(lower, upper))

    def _deviations(self, nominal_mm: float) -> tuple[float, float]:
        if self.deviations_mm is not None:
            return self.deviations_mm
        assert self.sizes_mm is not None
        lower, upper = (round(size - nominal_mm, 9) for size in self.sizes_mm)
        if not -nominal_mm / 2 <= (lower + upper) / 2 <= nominal_mm / 2:
            raise OptionError(
                f"limits of size {_mm(self.sizes_mm[0])} … {_mm(self.sizes_mm[1])} are far from "
                f"{_mm(nominal_mm)} mm",
                mend="write deviations with their signs, +0.1/0, or correct the sizes",
            )
        return lower, upper

    def _check_agreement(self, limits: Limits) -> None:
        if self.deviations_mm is None:
            return
        lower, upper = self.deviations_mm
        if max(abs(lower - limits.lower_mm), abs(upper - limits.upper_mm)) > SAME_LIMIT_MM:
            raise OptionError(
                f"{self.iso} is {deviation_words(limits.lower_mm, limits.upper_mm)}, "
                f"not {deviation_words(lower, upper)}",
                mend="keep the class or the numbers",
            )


def limits_of(words: str, nominal_mm: float, mm_per_unit: float = 1.0) -> Limits:
    """Parse a text to the limits of a nominal size, mm; numbers without a unit are multiplied by
    `mm_per_unit`. Raises OptionError.

    >>> limits_of("H7", 6.0)
    Limits(lower_mm=0.0, upper_mm=0.012, said='H7')
    >>> limits_of("+0,1/−0,2", 20.0)
    Limits(lower_mm=-0.2, upper_mm=0.1, said='+0.1/-0.2')
    """
    return read_words(words, mm_per_unit).limits(nominal_mm)


def read_words(words: str, mm_per_unit: float = 1.0) -> LimitsText:
    """Parse a text of limits; OptionError if it is not understood or contradicts itself.

    Decimals may have a comma, the sign may be a typographic minus, and ± may be written `%%p` as
    in DXF, or `+-`."""
    if len(words) > MAX_WORDS_CHARS:
        raise NotUnderstood(f"limits of {len(words)} characters are not read", mend=_EXAMPLES)
    text = normalised_words(words)
    if _CLASS.fullmatch(text):
        return LimitsText(text)
    fit = _FIT.fullmatch(text)
    if fit:
        raise OptionError(
            f"limits {text!r} are a fit of two parts",
            mend=f"write the class of this one: {fit[1]} or {fit[2]}",
        )
    both_match = _WITH_NUMBERS.fullmatch(text)
    if both_match:
        return replace(_numbers(both_match[2].strip(), mm_per_unit), iso=both_match[1])
    return _numbers(text, mm_per_unit)


def normalised_words(words: str) -> str:
    """Normalise a text: points in decimals, ASCII minus, ± for its other spellings, single
    spaces."""
    text = re.sub(r"%%[pP]|\+\s?/?\s?[-−]", "±", words)
    text = re.sub("[−–]", "-", text)
    text = re.sub(r"(?<=\d),(?=\d)", ".", text)
    return " ".join(text.split())


def _numbers(text: str, mm_per_unit: float) -> LimitsText:
    """Parse a text of two deviations, or of two limits of size."""
    match = _BOTH.fullmatch(text)
    if match:
        unit = match["aunit"] or ""
        value = float(match["a"]) * MM_PER_UNIT.get(unit, mm_per_unit)
        return LimitsText(deviations_mm=_ordered(-value, value, text), unit=unit)
    match = _PAIR.fullmatch(text)
    if not match:
        single_match = re.fullmatch(_NUMBER % ("a", "a"), text)
        if single_match and float(single_match["a"]):
            sign = single_match["a"] if single_match["a"][0] in "+-" else f"±{single_match['a']}"
            hint = {"+": f"{sign}/0", "-": f"0/{sign}"}.get(sign[0], sign)
            raise OptionError(f"limits {text!r} are one number of two", mend=f"write {hint}")
        raise NotUnderstood(f"limits {text!r} are not understood", mend=_EXAMPLES)
    units = {match[name] for name in ("aunit", "bunit") if match[name]}
    if len(units) > 1:
        raise OptionError(f"limits {text!r} have two units", mend="write both in one unit")
    unit = units.pop() if units else ""
    mm = MM_PER_UNIT.get(unit, mm_per_unit)
    first, second = (round(float(match[name]) * mm, 9) for name in "ab")
    signed = [name for name in "ab" if match[name][0] in "+-"]
    zero = [name for name in "ab" if not float(match[name])]
    if not signed and not zero:
        is_upwards = match["between"] in _UPWARDS
        return LimitsText(
            sizes_mm=_ordered(*_ascending(first, second, is_upwards), text, sizes=True), unit=unit
        )
    if not {*signed, *zero} >= {"a", "b"} or not signed:
        raise OptionError(
            f"limits {text!r} lack a sign", mend="write deviations like +0.1/-0.2 or +0.1/0"
        )
    return LimitsText(deviations_mm=_ordered(second, first, text), unit=unit)


def _ascending(first: float, second: float, upwards: bool) -> tuple[float, float]:
    return (first, second) if upwards else (second, first)


def _ordered(lower: float, upper: float, text: str, *, sizes: bool = False) -> tuple[float, float]:
    """Return both limits, with −0 as 0; OptionError unless the upper one is above the lower
    one."""
    if not (math.isfinite(lower) and math.isfinite(upper)):
        raise OptionError(f"limits {text!r} are not finite", mend=_EXAMPLES)
    lower, upper = round(lower, 9) + 0.0, round(upper, 9) + 0.0
    if lower > upper:
        mend = f"{_mm(upper)} … {_mm(lower)}" if sizes else deviation_words(upper, lower)
        raise OptionError(
            f"limits {text!r} are the wrong way round", mend=f"write {mend} if that is meant"
        )
    if lower == upper:
        raise OptionError(
            f"limits {text!r} leave no room between them", mend="write two that differ"
        )
    return lower, upper


def deviation_words(lower_mm: float, upper_mm: float) -> str:
    """Format deviations in mm as `read_words` parses them: "±0.05", "+0.1/-0.2", "+0.1/0"."""
    if lower_mm == -upper_mm:
        return f"±{_mm(upper_mm)}"
    return "/".join(f"{'+' if v > 0.0 else ''}{_mm(v)}" for v in (upper_mm, lower_mm))


def _mm(value: float) -> str:
    """Format a number without an exponent, to a picometre."""
    return f"{round(value, 9) + 0.0:.9f}".rstrip("0").rstrip(".")


# Classes of ISO 286-1:2010: a letter for the deviation that is nearest to zero, a number for the
# grade, whose tolerance IT depends on the size. The tables are the package pressfit's: shafts c to
# u and IT5 to IT11, over 0 and up to 500 mm. What follows from them by a general rule of the
# standard without exceptions is derived here:
#
#     holes of letters to H      EI = −es of the same letter, ES = EI + IT
#     JS                         ±IT/2
#
# Holes K to ZC have a rule with exceptions (Δ), holes J and shafts j none; grades under 5 and over
# 11 and sizes over 500 mm are not in the tables. All that is refused by name.

_SYMMETRIC = "js"


def iso_limits(name: str, nominal_mm: float) -> Limits:
    """Return the limits of a class such as "H7" for a nominal size, mm; OptionError with class and
    size if the tables lack them."""
    from pressfit import fit

    match = re.fullmatch(r"([A-Za-z]{1,2})(\d{1,2})", name)
    letter, grade = (match[1], int(match[2])) if match else (name, 0)
    size = round(nominal_mm, SIZE_DIGITS)
    hole, low = letter[0].isupper(), letter.lower()
    if not math.isfinite(size) or size <= 0.0:
        raise OptionError(
            f"class {name} needs a size above 0, not {nominal_mm:g} mm", mend="correct the size"
        )
    if hole and low > "h" and low != _SYMMETRIC:
        raise _not_in_table(name, size)
    try:
        of_shaft = fit(f"H{grade}/{low}{grade}", size)
    except (ValueError, NotImplementedError) as error:
        raise _not_in_table(name, size) from error
    lower, upper = of_shaft.shaft_ei_um / UM_PER_MM, of_shaft.shaft_es_um / UM_PER_MM
    if hole:
        lower, upper = -upper, -lower
    return Limits(lower + 0.0, upper + 0.0, name)


def _not_in_table(name: str, size_mm: float) -> OptionError:
    return OptionError(
        f"class {name} of {_mm(size_mm)} mm is not in the tables (holes C to H and JS, shafts c "
        "to h, js, k, m, n, p, s, u, grades 5 to 11, up to 500 mm)",
        mend="write its limits as numbers from ISO 286-2, such as +0.012/0",
    )


# General tolerances of ISO 2768-1:1989, for dimensions whose limits are not said. Table 1: linear
# sizes but those of broken edges. Table 2: broken edges, that is external radii and chamfers; all
# radii are taken by it. Each row: sizes over the one before, up to and including this, mm; then ±
# mm for f, m, c, v. None: the standard has no value.

_CLASSES = "fmcv"
MIN_GENERAL_MM = 0.5
"""Smaller nominal sizes have no general tolerance: their limits must be stated (ISO 2768-1, tables
1 and 2, note)."""

_TABLE_1: tuple[tuple[float, tuple[float | None, ...]], ...] = (
    (3.0, (0.05, 0.1, 0.2, None)),
    (6.0, (0.05, 0.1, 0.3, 0.5)),
    (30.0, (0.1, 0.2, 0.5, 1.0)),
    (120.0, (0.15, 0.3, 0.8, 1.5)),
    (400.0, (0.2, 0.5, 1.2, 2.5)),
    (1000.0, (0.3, 0.8, 2.0, 4.0)),
    (2000.0, (0.5, 1.2, 3.0, 6.0)),
    (4000.0, (None, 2.0, 4.0, 8.0)),
)
_TABLE_2: tuple[tuple[float, tuple[float | None, ...]], ...] = (
    (3.0, (0.2, 0.2, 0.4, 0.4)),
    (6.0, (0.5, 0.5, 1.0, 1.0)),
    (math.inf, (1.0, 1.0, 2.0, 2.0)),
)
_GENERAL = re.compile(r"(?:ISO\s*2768\s*(?:-\s*1\s*)?[-–− ]?\s*)?([fmcv])([HKL])?", re.IGNORECASE)


def general_class(words: str) -> str:
    """Return the class f, m, c or v of "ISO 2768-m"; OptionError for any other text."""
    match = _GENERAL.fullmatch(words.strip()) if len(words) <= MAX_WORDS_CHARS else None
    if match is None:
        raise OptionError(
            f"general tolerance {words[:MAX_WORDS_CHARS]!r} is not known",
            mend="use ISO 2768-f, ISO 2768-m, ISO 2768-c or ISO 2768-v",
        )
    if match[2]:
        raise OptionError(
            f"general tolerance {words!r} has a class of form, {match[2].upper()} of ISO 2768-2, "
            "which camtool does not know",
            mend=f"write ISO 2768-{match[1].lower()}, and tolerances of form as dimensions",
        )
    return match[1].lower()


def general_limits(words: str, kind: Kind, nominal_mm: float) -> Limits | None:
    """Return the general tolerance ("ISO 2768-m") of a nominal size, mm; None if the standard has
    none: for form and position, for sizes below MIN_GENERAL_MM and beyond its tables."""
    column = _CLASSES.index(general_class(words))
    size = round(nominal_mm, SIZE_DIGITS)
    if kind in ZONES or not size >= MIN_GENERAL_MM:
        return None
    table = _TABLE_2 if kind == "radius" else _TABLE_1
    for upper_mm, values in table:
        if size <= upper_mm:
            value = values[column]
            return None if value is None else Limits(-value, value, f"ISO 2768-{_CLASSES[column]}")
    return None


def limited(dimension: Dimension, drawn_mm: float) -> tuple[Dimension, tuple[Finding, ...]]:
    """Return the dimension with its nominal value and limits, now that the size of its drawn
    feature is known, mm, and a finding if the general tolerance has none for it. Raises
    OptionError if its limits do not fit that size."""
    nominal_mm = drawn_mm if dimension.nominal_mm is None else dimension.nominal_mm
    limits = dimension.limits
    findings: tuple[Finding, ...] = ()
    if limits is None and dimension.words:
        limits = read_words(dimension.words).limits(nominal_mm)
    elif limits is None and dimension.general:
        limits = general_limits(dimension.general, dimension.kind, nominal_mm)
        if limits is None:
            findings = (
                NO_GENERAL_TOLERANCE(
                    where=dimension.source,
                    measured=nominal_mm,
                    general=dimension.general,
                    kind=dimension.kind,
                ),
            )
    limited_dimension = replace(
        dimension, nominal_mm=nominal_mm, limits=limits, words="", general=""
    )
    return limited_dimension, findings
