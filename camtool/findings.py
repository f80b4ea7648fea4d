"""Findings: remarks, warnings and errors about a drawing, a plan, a program or its motion.

Findings are collected, never raised at the first. The code that detects a fault calls a sentence
with the numbers (`yield HOLE_SIZE(where=…, measured=…, limit=…)`). Codes and sentences stand in
the `findings.py` of the room that reports them; a code that several rooms report stands in the
lowest room that all of them may import. A machine's own sentences stand in its folder, and a
plug-in adds codes of its own there too (`TargetCode`). docs/findings.md is made from all of them.

Numbers are stable: add, never renumber. Hundreds: 1xx drawing, 2xx planning, 3xx program, 4xx
motion and result, 5xx inspection.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import IntEnum
from string import Formatter
from typing import Any, Final, Protocol, Self, TypeVar

from camtool.plain import one_line


class Severity(IntEnum):
    """How grave: an ERROR makes a command exit with 1 and write nothing."""

    INFO = 0
    WARNING = 1
    ERROR = 2


INFO: Final = Severity.INFO
WARNING: Final = Severity.WARNING
ERROR: Final = Severity.ERROR


class Code(IntEnum):
    """A code: number, severity (of several the usual one first), what it means, what to do."""

    severities: tuple[Severity, ...]
    means: str
    mend: str

    def __new__(
        cls, number: int, severity: Severity | tuple[Severity, ...], means: str, mend: str
    ) -> Self:
        """A code is its number, and carries what is known of it."""
        code = int.__new__(cls, number)
        code._value_ = number
        code.severities = severity if isinstance(severity, tuple) else (severity,)
        code.means, code.mend = means, mend
        return code


@dataclass(frozen=True)
class TargetCode:
    """A code of one target's own findings; its name begins with the target's: `mill.TOO_HOT`."""

    name: str
    severities: tuple[Severity, ...]
    means: str
    mend: str


@dataclass(frozen=True)
class Finding:
    """One thing found, with its place, the measured value and the limit where there are any.

    `unit` belongs to both `measured` and `limit` ("mm", "um", "chars", "mm_min", ...).
    """

    code: Code | TargetCode
    severity: Severity
    message: str
    where: str = ""
    measured: float | None = None
    limit: float | None = None
    unit: str = ""

    def __str__(self) -> str:
        place = f" [{self.where}]" if self.where else ""
        return one_line(f"{self.severity.name.lower()} {self.code.name}{place}: {self.message}")


@dataclass(frozen=True)
class Sentence:
    """What is said of a code; called with the numbers, it makes a finding.

    `text` is a format string. `{measured}` and `{limit}` are those of the finding, both in `unit`
    ("mm", "um", "chars", "mm_min", ...); all other names are given as keywords. A choice by number
    is written `{count:one|many}` or `{count:none|one|many}`, with `#` for the number itself (true
    is one, false none).
    `severity` stands where the code has several and the sentence one; else the caller may say it.

    >>> some = Sentence(Code.HOLE_SIZE, "{measured:# hole is|# holes are} wider than {drill:g} mm")
    >>> print(some(measured=1, drill=3.0, where="layer 0"))
    warning HOLE_SIZE [layer 0]: 1 hole is wider than 3 mm
    """

    code: Code | TargetCode
    text: str
    unit: str = ""
    severity: Severity | None = None

    def __call__(
        self,
        *,
        where: str = "",
        measured: float | None = None,
        limit: float | None = None,
        severity: Severity | None = None,
        **values: float | str,
    ) -> Finding:
        """The finding with its sentence."""
        given = self.severity if severity is None else severity
        return Finding(
            self.code,
            self.code.severities[0] if given is None else given,
            _TEXTS.vformat(self.text, (), {**values, "measured": measured, "limit": limit}),
            where=where,
            measured=None if measured is None else float(measured),
            limit=None if limit is None else float(limit),
            unit=self.unit,
        )

    def words(self, **values: float | str) -> str:
        """The sentence alone, where several make one finding."""
        return _TEXTS.vformat(self.text, (), values)


class _Texts(Formatter):
    """Format strings that know the choice by number."""

    def format_field(self, value: Any, format_spec: str) -> str:
        """One value as the text has it."""
        if "|" not in format_spec:
            return format(value, format_spec)
        *none, one, many = format_spec.split("|")
        words = none[0] if none and value == 0 else one if value == 1 else many
        return words.replace("#", f"{value:.0f}")


_TEXTS: Final = _Texts()


MAX_ALIKE = 3
"""At most this many findings of one code and severity are listed one by one in texts for
people."""


class AnyFinding(Protocol):
    """A finding, here or in a report."""

    @property
    def code(self) -> Code | TargetCode | str:
        """What was found."""

    @property
    def severity(self) -> Severity | str:
        """How grave it is."""


_F = TypeVar("_F", bound=AnyFinding)


def summarise_findings(findings: Iterable[_F]) -> list[tuple[_F, int]]:
    """The first findings of each code and severity, in their order; the last of them with the
    number of those that are left out behind it, the others with 0."""
    alike: dict[tuple[object, object], list[_F]] = {}
    order = list(findings)
    for each in order:
        alike.setdefault((each.code, each.severity), []).append(each)
    shown = []
    for group in alike.values():
        shown += [(each, 0) for each in group[:MAX_ALIKE]]
        shown[-1] = (shown[-1][0], max(len(group) - MAX_ALIKE, 0))
    places = {id(each): place for place, each in enumerate(order)}
    return sorted(shown, key=lambda row: places[id(row[0])])


def worst(findings: tuple[Finding, ...] | list[Finding]) -> Severity:
    """The gravest severity present; INFO when there is no finding."""
    return max((f.severity for f in findings), default=Severity.INFO)


def and_more(noun: str) -> str:
    """The end of a sentence of which only the first are listed; `more` is how many are not."""
    return f"{{more:|; and # more {noun.removesuffix('s')}|; and # more {noun}}}"
