"""Findings that repeat are summed up."""

from camtool.findings import MAX_ALIKE, Code, Finding, Severity, summarise_findings
from camtool.geometry.findings import ContourCode
from camtool.importers.findings import DrawingCode


def finding(code: Code, number: int, severity: Severity = Severity.WARNING) -> Finding:
    return Finding(code, severity, "words", where=f"place {number}")


def test_the_first_few_of_a_code_are_told_and_the_rest_is_counted() -> None:
    gaps = [finding(DrawingCode.GAP_OPEN, n) for n in range(20)]
    other = finding(ContourCode.BRANCHED, 0)
    grave = finding(DrawingCode.GAP_OPEN, 99, Severity.ERROR)
    rows = summarise_findings([*gaps[:5], other, *gaps[5:], grave])
    assert [each for each, _ in rows] == [*gaps[:MAX_ALIKE], other, grave]
    assert [more for _, more in rows] == [0] * (MAX_ALIKE - 1) + [20 - MAX_ALIKE, 0, 0]
    assert summarise_findings(gaps[:MAX_ALIKE]) == [(each, 0) for each in gaps[:MAX_ALIKE]]
    assert summarise_findings([]) == []
