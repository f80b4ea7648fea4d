"""Findings: remarks, warnings and errors about a drawing, a plan, a program or its motion.

Findings are collected, never raised at the first. The code that detects a fault calls a sentence
with the numbers (`yield HOLE_SIZE(where=…, measured=…, limit=…)`). Codes and sentences stand in
the `findings.py` of the room that reports them; a code that several rooms report stands in the
lowest room that all of them may import. A machine's own sentences stand in its folder, and a
plug-in adds codes of its own there too (`TargetCode`). docs/findings.md is made from all of them.

Numbers are stable: add, never renumber. Hundreds: 1xx drawing, 2xx planning, 3xx program, 4xx
motion and result, 5xx inspection, 6xx stock."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from enum import IntEnum
from string import Formatter
from typing import Any, Final, Protocol, Self, TypeVar

from camtool.plain import one_line
from camtool.records import FrozenRecord


class Severity(IntEnum):
    """Severity of a finding: an ERROR makes a command exit with 1 and write nothing."""

    INFO = 0
    WARNING = 1
    ERROR = 2


INFO: Final = Severity.INFO
WARNING: Final = Severity.WARNING
ERROR: Final = Severity.ERROR


class Code(IntEnum):
    """A code: number, severities (the usual one first), its meaning, and the remedy.

    Each room has an enumeration of its own codes, which is a subclass of this one."""

    severities: tuple[Severity, ...]
    means: str
    mend: str

    def __new__(
        cls, number: int, severity: Severity | tuple[Severity, ...], means: str, mend: str
    ) -> Self:
        """Return the number with its severities, meaning and remedy as attributes."""
        code = int.__new__(cls, number)
        code._value_ = number
        code.severities = severity if isinstance(severity, tuple) else (severity,)
        code.means, code.mend = means, mend
        return code

    def says(self, text: str, unit: str = "", severity: Severity | None = None) -> Sentence:
        """Return a sentence of this code."""
        return Sentence(self, text, unit, severity)


@dataclass(frozen=True, repr=False, eq=False)
class TargetCode(FrozenRecord):
    """A code of one target's own findings; its name begins with the target's: `mill.TOO_HOT`."""

    name: str
    severities: tuple[Severity, ...]
    means: str
    mend: str

    def says(self, text: str, unit: str = "", severity: Severity | None = None) -> Sentence:
        """Return a sentence of this code."""
        return Sentence(self, text, unit, severity)


@dataclass(frozen=True, repr=False, eq=False)
class Finding(FrozenRecord):
    """A remark, warning or error with its place, the measured value and the limit, if any.

    `unit` belongs to both `measured` and `limit` ("mm", "um", "chars", "mm_min", ...)."""

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


@dataclass(frozen=True, repr=False, eq=False)
class FindingReport(FrozenRecord):
    """A finding, by the names of its code and severity."""

    code: str
    severity: str
    message: str
    where: str
    measured: float | None = None
    limit: float | None = None
    unit: str = ""

    def to_line(self) -> str:
        """Return the finding as one line of readable text."""
        place = f" [{self.where}]" if self.where else ""
        return one_line(f"{self.severity} {self.code}{place}: {self.message}")

    def at(self, file: str, line: int | None) -> FoundAt:
        """Return the finding with its file and line; `line` None if it is about the file as a
        whole."""
        values = {**asdict(self), "file": file, "line": line or None}
        return FoundAt(**values)


@dataclass(frozen=True, repr=False, eq=False)
class FoundAt(FindingReport):
    """A finding in a line of a file, from 1; `line` None: in the file as a whole."""

    file: str = ""
    line: int | None = None


@dataclass(frozen=True, repr=False, eq=False)
class Sentence(FrozenRecord):
    """The text of a finding of one code; called with the numbers, it makes a finding.

    `text` is a format string. `{measured}` and `{limit}` are those of the finding, both in `unit`
    ("mm", "um", "chars", "mm_min", ...); all other names are given as keywords. A choice by number
    is written `{count:one|many}` or `{count:none|one|many}`, with `#` for the number itself (true
    is one, false none).
    `severity` stands where the code has several and the sentence one; else the caller may say it.

    >>> from camtool.planning.findings import PlanningCode
    >>> text = "{measured:# hole is|# holes are} wider than {drill:g} mm"
    >>> some = PlanningCode.HOLE_SIZE.says(text)
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
        """Return a finding with this sentence as its message."""
        used_severity = self.severity if severity is None else severity
        return Finding(
            self.code,
            self.code.severities[0] if used_severity is None else used_severity,
            _TEXTS.vformat(self.text, (), {**values, "measured": measured, "limit": limit}),
            where=where,
            measured=None if measured is None else float(measured),
            limit=None if limit is None else float(limit),
            unit=self.unit,
        )

    def words(self, **values: float | str) -> str:
        """Return only the text, for findings that are composed of several sentences."""
        return _TEXTS.vformat(self.text, (), values)


class _Texts(Formatter):
    """Format strings with a choice by number: `{count:one|many}`."""

    def format_field(self, value: Any, format_spec: str) -> str:
        """Return a value as text; with a choice in `format_spec`, the words that the number
        selects."""
        if "|" not in format_spec:
            return format(value, format_spec)
        *none_words, one, many_words = format_spec.split("|")
        words = none_words[0] if none_words and value == 0 else one if value == 1 else many_words
        return words.replace("#", f"{value:.0f}")


_TEXTS: Final = _Texts()


MAX_ALIKE = 3
"""Largest number of findings of one code and severity that are listed one by one in texts."""


class AnyFinding(Protocol):
    """A finding, here or in a report."""

    @property
    def code(self) -> Code | TargetCode | str:
        """The code, or its name."""

    @property
    def severity(self) -> Severity | str:
        """The severity, or its name."""


_F = TypeVar("_F", bound=AnyFinding)


def summarise_findings(findings: Iterable[_F]) -> list[tuple[_F, int]]:
    """Return (finding, number) of the first MAX_ALIKE findings of each code and severity, in their
    order. The number with the last of each group is that of the findings left out, the others have
    0."""
    groups: dict[tuple[object, object], list[_F]] = {}
    order = list(findings)
    for each in order:
        groups.setdefault((each.code, each.severity), []).append(each)
    shown = []
    for group in groups.values():
        shown += [(each, 0) for each in group[:MAX_ALIKE]]
        shown[-1] = (shown[-1][0], max(len(group) - MAX_ALIKE, 0))
    places = {id(each): place for place, each in enumerate(order)}
    return sorted(shown, key=lambda row: places[id(row[0])])


def worst(findings: tuple[Finding, ...] | list[Finding]) -> Severity:
    """Return the highest severity of the findings, INFO if there are none."""
    return max((f.severity for f in findings), default=Severity.INFO)


def and_more(noun: str) -> str:
    """Return the format text " and N more NOUN" for sentences that name one of several; `more` is
    the number of the others."""
    return f"{{more:|; and # more {noun.removesuffix('s')}|; and # more {noun}}}"
