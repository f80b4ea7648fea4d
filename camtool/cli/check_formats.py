"""Findings for other programs: SARIF, JUnit's XML, and annotations of GitHub.

    runs, errors ─▶ CheckedFile ─▶ `sarif`, `junit`, `workflow_commands`

All three are made from the same records and hold no time and no absolute path, so that the same
files give the same bytes. Names and texts come from drawings: each writer escapes them for its
format, and characters that cannot be seen are shown as escapes in all of them."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import quote

from camtool.errors import CamtoolError
from camtool.findings import Code, FindingReport, FoundAt, TargetCode
from camtool.geometry.findings import ContourCode
from camtool.importers.findings import DrawingCode
from camtool.inspection.findings import InspectionCode
from camtool.plain import one_line, to_json
from camtool.planning.findings import PlanningCode
from camtool.stock.findings import StockCode
from camtool.toolpath.findings import INPUT_REFUSED, ProgramCode
from camtool.verification.findings import VerificationCode
from camtool.verification.report import finding_reports
from camtool.version import __version__

if TYPE_CHECKING:
    from camtool.run import Run

_ROOMS: Final = (
    ContourCode, DrawingCode, PlanningCode, ProgramCode, VerificationCode, InspectionCode,
    StockCode,
)  # fmt: skip

CODES: Final[dict[str, Code | TargetCode]] = {each.name: each for room in _ROOMS for each in room}
"""The codes of all rooms by name; those of a target are its own."""

LEVELS: Final = {"info": "note", "warning": "warning", "error": "error"}

COMMANDS: Final = {"info": "notice", "warning": "warning", "error": "error"}

SCHEMA: Final = "https://json.schemastore.org/sarif-2.1.0.json"

_BLOCK: Final = re.compile(r"block (\d{1,9})\b")
_LINE: Final = re.compile(r"(?:^|, |: |\bat )line (\d{1,9})\b")
_ENTITY: Final = re.compile(r"\b[A-Z][A-Z0-9_]* ([0-9A-F]{1,16})(?= |$)")
"""An entity of a DXF file by its kind and its handle: CIRCLE 2C."""


@dataclass(frozen=True)
class CheckedFile:
    """A drawing or program that was checked, under its name on the command line, with all its
    findings. `is_refused`: an error in it ended the check; `unread`: the file itself could not be
    read; `passed_over`: the reason why it was not checked."""

    name: str
    findings: tuple[FoundAt, ...] = ()
    is_refused: bool = False
    unread: bool = False
    passed_over: str = ""

    @property
    def errors(self) -> tuple[FoundAt, ...]:
        """The findings of severity error."""
        return tuple(each for each in self.findings if each.severity == "error")


def checked_run(run: Run, program: str | None) -> CheckedFile:
    """Return a run as a checked file. `program`: the name of the file that holds its program,
    None where none was written."""
    name = f"{run.source}, {run.part}" if run.part else run.source
    return CheckedFile(name, found_in(run, program))


def found_in(run: Run, program: str | None) -> tuple[FoundAt, ...]:
    """Return the findings of a run with the file and line of each: findings about the drawing or
    its plan at the drawing's file, the others at the program's. `program` as for `checked_run`."""
    of_drawing: set[str] = set()
    if run.drawing is not None:
        planned = () if run.wanted is None else run.wanted.findings
        of_drawing = {str(each) for each in (*run.drawing.findings, *planned)}
    places = _Places(run, program)
    return tuple(
        places.found_at(record, in_drawing=str(finding) in of_drawing)
        for finding in dict.fromkeys(run.findings)
        for record in finding_reports([finding])
    )


def refused_file(error: CamtoolError, name: str, *, unread: bool = False) -> CheckedFile:
    """Return a checked file whose only finding is the error that made it unusable."""
    mend = f"; {error.mend}" if error.mend else ""
    where = error.where or ""
    finding = INPUT_REFUSED(where=where, message=f"{error.message}{mend}")
    line = _LINE.search(where or error.message)
    refusal = finding_reports([finding])[0].at(error.file or name, line and int(line[1]))
    return CheckedFile(name, (refusal,), is_refused=True, unread=unread)


class _Places:
    """The line numbers of findings: of blocks in the program of a run, and of entities in its
    drawing."""

    def __init__(self, run: Run, program: str | None) -> None:
        self._run = run
        self._program = program
        self._block_lines: Sequence[int] | None = None
        self._drawing_text: bytes | None = None

    def found_at(self, record: FindingReport, *, in_drawing: bool) -> FoundAt:
        """Return a finding with the file and the line that it is about."""
        block = None if in_drawing else _BLOCK.match(record.where)
        line = _LINE.search(record.where)
        if block is not None and self._program is not None:
            return record.at(self._program, self._line_of_block(int(block[1])))
        if in_drawing or (self._run.drawing is not None and self._run.source != self._program):
            file = self._run.source if self._run.drawing is None else self._run.drawing.file
            return record.at(file, self._line_of_entity(file, record.where))
        return record.at(self._run.source, line and int(line[1]))

    def _line_of_block(self, block: int) -> int | None:
        """Return the line (from 1) of a block (from 1) of the program, None if its dialect has no
        listing."""
        if self._block_lines is None:
            make = self._run.listing
            listing = None if make is None else make()
            self._block_lines = () if listing is None else listing.lines
        return self._block_lines[block - 1] if 0 < block <= len(self._block_lines) else None

    def _line_of_entity(self, file: str, where: str) -> int | None:
        """Return the line of the drawing on which an entity of a DXF (by its handle) or of an SVG
        begins, None if that is unknown."""
        line, handle = _LINE.search(where), _ENTITY.search(where)
        if line is not None:
            return int(line[1])
        if handle is None:
            return None
        if self._drawing_text is None:
            try:
                self._drawing_text = Path(file).read_bytes()
            except (OSError, ValueError):
                self._drawing_text = b""
        tag = rb"^[ \t]*5[ \t]*\r?\n[ \t]*" + handle[1].encode() + rb"[ \t]*\r?$"
        place = re.search(tag, self._drawing_text, re.MULTILINE)
        return None if place is None else self._drawing_text.count(b"\n", 0, place.start()) + 1


# SARIF 2.1.0: one run with a rule for each code that was found.


def sarif(files: Sequence[CheckedFile], own_codes: Iterable[TargetCode] = ()) -> bytes:
    """Return the findings as SARIF 2.1.0; `own_codes` are those of the target."""
    codes = CODES | {code.name: code for code in own_codes}
    findings = list(dict.fromkeys(each for file in files for each in file.findings))
    names = sorted({each.code for each in findings})
    rules = [_rule(name, codes.get(name)) for name in names]
    driver = {"name": "camtool", "semanticVersion": __version__, "rules": rules}
    run = {
        "tool": {"driver": driver},
        "columnKind": "unicodeCodePoints",
        "results": [_result(each, names.index(each.code)) for each in findings],
    }
    return to_json({"$schema": SCHEMA, "version": "2.1.0", "runs": [run]}).encode()


def _rule(name: str, code: Code | TargetCode | None) -> dict[str, Any]:
    """Return the SARIF rule of a code; for an unknown code, a rule with only the name."""
    if code is None:
        return {"id": name}
    return {
        "id": name,
        "shortDescription": {"text": code.means},
        "help": {"text": code.mend},
        "defaultConfiguration": {"level": LEVELS[code.severities[0].name.lower()]},
    }


def _result(finding: FoundAt, rule: int) -> dict[str, Any]:
    physical: dict[str, Any] = {"artifactLocation": {"uri": _address(finding.file)}}
    if finding.line is not None:
        physical["region"] = {"startLine": finding.line}
    location: dict[str, Any] = {"physicalLocation": physical}
    if finding.where:
        location["logicalLocations"] = [{"fullyQualifiedName": one_line(finding.where)}]
    result = {
        "ruleId": finding.code,
        "ruleIndex": rule,
        "level": LEVELS[finding.severity],
        "message": {"text": _text(finding)},
        "locations": [location],
    }
    figures = {"measured": finding.measured, "limit": finding.limit, "unit": finding.unit or None}
    properties = {name: value for name, value in figures.items() if value is not None}
    return {**result, "properties": properties} if properties else result


def _address(file: str) -> str:
    """Return the file as a URI: a relative reference (RFC 3986), or a file URI if the path is
    absolute."""
    path = PurePath(file)
    if path.is_absolute():
        return path.as_uri() if file.isprintable() else "file://" + _quoted(path.as_posix())
    return _quoted(path.as_posix())


def _quoted(path: str) -> str:
    return quote(path.encode("utf-8", "surrogateescape"), safe="/")


def _text(finding: FoundAt) -> str:
    """Return the place and the message of a finding in one line, as they are shown on the
    terminal."""
    place = f"[{finding.where}] " if finding.where else ""
    return one_line(f"{place}{finding.message}")


# JUnit's XML, as the plug-ins of Jenkins, GitLab and others read it.


def junit(files: Sequence[CheckedFile], command: str) -> bytes:
    """Return JUnit XML with one test case for each file: a failure if it has findings of severity
    error, an error if it could not be used. Warnings are in its output."""
    from xml.etree import ElementTree as tree

    failed = [file for file in files if file.errors and not file.is_refused]
    counts = {
        "tests": len(files),
        "failures": len(failed),
        "errors": sum(file.is_refused for file in files),
        "skipped": sum(bool(file.passed_over) for file in files),
    }
    numbers = {name: str(count) for name, count in counts.items()}
    suite = tree.Element("testsuite", {"name": f"camtool {command}", **numbers})
    for file in files:
        names = {"name": one_line(file.name), "classname": f"camtool.{command}"}
        case = tree.SubElement(suite, "testcase", names)
        if file.passed_over:
            tree.SubElement(case, "skipped", {"message": file.passed_over})
        if file.errors:
            worst, more = file.errors[0], len(file.errors) - 1
            message = _text(worst) + (f" (and {more} more)" if more else "")
            kind = "error" if file.is_refused else "failure"
            element = tree.SubElement(case, kind, {"type": worst.code, "message": message})
            element.text = "\n".join(map(_line, file.errors))
        others = [_line(each) for each in file.findings if each.severity == "warning"]
        if others:
            tree.SubElement(case, "system-out").text = "\n".join(others)
    tree.indent(suite)
    text: bytes = tree.tostring(suite, "utf-8", xml_declaration=True)
    return text + b"\n"


def _line(finding: FoundAt) -> str:
    line = "" if finding.line is None else f":{finding.line}"
    return f"{one_line(finding.file)}{line}: {finding.to_line()}"


# Annotations: workflow commands of GitHub, which stand in the log of a job.

MAX_ANNOTATIONS: Final = 10
"""GitHub shows no more annotations of one step and level than this."""


def workflow_commands(files: Sequence[CheckedFile]) -> bytes:
    """Return one line `::error file=…,line=…::message` (or `::warning`) for each finding, errors
    first; at most MAX_ANNOTATIONS of each level, and none for remarks."""
    every = dict.fromkeys(each for file in files for each in file.findings)
    findings = [each for each in every if each.severity != "info"]
    findings.sort(key=lambda each: each.severity)  # error before warning; else in their order
    counts: Counter[str] = Counter()
    lines = []
    for each in findings:
        counts[each.severity] += 1
        if counts[each.severity] <= MAX_ANNOTATIONS:
            lines.append(_command(each))
    return "".join(f"{line}\n" for line in lines).encode("utf-8", "backslashreplace")


def _command(finding: FoundAt) -> str:
    """Return the GitHub workflow command of a finding. Values are escaped as GitHub's toolkit
    does, so that no text from a drawing can end the command or begin another one."""
    line = "" if finding.line is None else f",line={finding.line}"
    file, title = _property(PurePath(finding.file).as_posix()), _property(finding.code)
    return (
        f"::{COMMANDS[finding.severity]} file={file}{line},title={title}::{_data(_text(finding))}"
    )


def _data(text: str) -> str:
    return text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _property(text: str) -> str:
    return _data(one_line(text)).replace(":", "%3A").replace(",", "%2C")
