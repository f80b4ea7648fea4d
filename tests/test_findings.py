"""Findings that repeat are summed up."""

from camtool.findings import MOST_ALIKE, Code, Finding, Severity, summed


def finding(code: Code, number: int, severity: Severity = Severity.WARNING) -> Finding:
    return Finding(code, severity, "words", where=f"place {number}")


def test_the_first_few_of_a_code_are_told_and_the_rest_is_counted() -> None:
    gaps = [finding(Code.GAP_OPEN, n) for n in range(20)]
    other = finding(Code.BRANCHED, 0)
    grave = finding(Code.GAP_OPEN, 99, Severity.ERROR)
    rows = summed([*gaps[:5], other, *gaps[5:], grave])
    assert [each for each, _ in rows] == [*gaps[:MOST_ALIKE], other, grave]
    assert [more for _, more in rows] == [0] * (MOST_ALIKE - 1) + [20 - MOST_ALIKE, 0, 0]
    assert summed(gaps[:MOST_ALIKE]) == [(each, 0) for each in gaps[:MOST_ALIKE]]
    assert summed([]) == []
