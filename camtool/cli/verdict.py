"""What `verify` gives: the verdict on one program, or the table of several ways to run it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from camtool.cli.output import STDOUT, write_all
from camtool.cli.programs import read_bytes, shown
from camtool.cli.report import Subject, flags_given, report_files
from camtool.cli.talk import say, say_findings, show_text
from camtool.cli.terminal import REPORT_NAMES, report_marks, show_compared, show_facts

if TYPE_CHECKING:
    from camtool.cli.pictureflags import PictureFlags
    from camtool.geometry.drawing import Drawing
    from camtool.machine.registry import LoadedTarget
    from camtool.pipeline import Judging, Way
    from camtool.planning.job import Job
    from camtool.preview.scene import Scene
    from camtool.toolpath.moves import Toolpath
    from camtool.verify.verify import Verification


@dataclass(frozen=True)
class Wishes:
    """What the user wants to have; `beside` is another program for the picture."""

    preview: str | None
    looks: PictureFlags
    report: str | None
    page: str | None
    beside: str | None
    quiet: bool
    verbose: bool


@dataclass(frozen=True, eq=False)
class Case:
    """How programs are judged: on which machine, by what, against which drawing."""

    target: LoadedTarget
    judging: Judging
    drawing: Drawing | None
    job: Job

    def judge(self, file: str) -> Judged:
        """The program in a file, run and judged."""
        from camtool.pipeline import verify_program

        data, name = read_bytes(file), shown(file)
        decoded, verification = verify_program(
            data,
            self.target,
            source=name,
            drawing=self.drawing,
            job=self.job,
            judging=self.judging,
        )
        return Judged(self, name, data, decoded, verification)


@dataclass(frozen=True, eq=False)
class Judged:
    """A program, its moves as the controller decodes them, and the verdict."""

    case: Case
    name: str
    data: bytes
    decoded: Toolpath
    verification: Verification

    def scene(self) -> Scene:
        """The predicted path over what was programmed."""
        from camtool.pipeline import listing_of, picture

        case = self.case
        return picture(
            title=Path(self.name).name,
            drawing=case.drawing,
            job=case.job,
            toolpath=self.decoded,
            verification=self.verification,
            machine=case.target.machine,
            listing=listing_of(self.data, case.target, self.decoded),
        )

    def subject(self) -> Subject:
        """What its page is about."""
        return Subject(
            title=Path(self.name).name,
            target=self.case.target,
            report=self.verification.report,
            findings=self.verification.findings,
            program=self.data,
            flags=flags_given(),
        )


def judged(file: str, case: Case, wishes: Wishes) -> int:
    """The verdict on one program, in words and files; the exit code."""
    from camtool.findings import Severity, worst

    one = case.judge(file)
    report, findings = one.verification.report, one.verification.findings

    def scenes() -> list[Scene]:
        return [one.scene(), *([case.judge(wishes.beside).scene()] if wishes.beside else [])]

    painted = wishes.looks.painter(scenes, quiet=wishes.quiet)
    files: dict[str, bytes] = {}
    if wishes.preview is not None:
        files[wishes.preview] = painted(wishes.preview)
    if wishes.report is not None:
        files[wishes.report] = report.to_json().encode()
    if wishes.page is not None:
        files.update(report_files(wishes.page, one.subject(), painted, preview=wishes.preview))
    write_all(files)
    if STDOUT not in (wishes.report, wishes.page) and not wishes.quiet:
        show_facts(report.to_text(findings=False), REPORT_NAMES, report_marks(findings))
        if case.judging.worst:
            show_text(report.worst_text())
    say_findings(findings, quiet=wishes.quiet, verbose=wishes.verbose)
    if worst(findings) < Severity.ERROR:
        return 0
    say(f"camtool: error: {one.name}: the errors above would spoil the part", quiet=False)
    return 1


def compared(file: str, ways: list[Way], case: Case, wishes: Wishes) -> int:
    """The table of all ways to run a program, and their picture; the exit code."""
    from camtool.pipeline import compare_picture, compare_program
    from camtool.verify.contrast import row_of, table, to_json

    data, name = read_bytes(file), shown(file)
    variants = compare_program(data, ways, source=name, drawing=case.drawing, job=case.job)
    rows = [row_of(variant.name, variant.verification.report) for variant in variants]
    files: dict[str, bytes] = {}
    if wishes.preview is not None:
        from camtool.preview.overlay import render_overlay

        overlay = compare_picture(data, ways, variants, title=Path(name).name)
        files[wishes.preview] = render_overlay(overlay, wishes.preview, wishes.looks.options())
    if wishes.report is not None:
        files[wishes.report] = to_json(rows).encode()
    write_all(files)
    if wishes.report != STDOUT and not wishes.quiet:
        show_compared(table(rows), rows)
    return 0
