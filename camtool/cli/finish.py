"""How `post` and `convert` end: all files or none, and a short summary."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from camtool.cli.output import STDOUT, check_places, write_all
from camtool.cli.report import (
    Subject,
    linked_picture,
    picture_beside,
    refuse_foreign_picture,
    report_files,
)
from camtool.cli.talk import say, say_findings
from camtool.cli.terminal import REPORT_NAMES, report_marks, show_facts

if TYPE_CHECKING:
    from camtool.cli.painter import Painter
    from camtool.cli.report import Flags
    from camtool.machine.registry import LoadedTarget
    from camtool.pipeline import Posted


ANY_MACHINE = "travel, rates and backlash are placeholders: camtool targets new NAME --extends {}"
"""What is said where nobody has told what the machine is."""


@dataclass(frozen=True)
class Asked:
    """What the user wants written; `source` names what it is made of, None is not wanted.

    `reads` are all files that are read for it.
    """

    source: str
    output: str | None
    report: str | None
    preview: str | None = None
    page: str | None = None
    flags: Flags = ()
    reads: Sequence[str] = ()

    def check(self, extension: str, *, verified: bool) -> None:
        """OutputError, before any work is done, when a place cannot be written."""
        for flag, name in (("--json", self.report), ("--report", self.page)):
            if name is not None and not verified:
                raise click.UsageError(
                    f"{flag} is the report of the verification that --no-verify leaves out"
                )
        outputs = [self.program(extension), self.preview, self.report, self.page]
        check_places(self.reads, [*outputs, picture_beside(self.page, self.preview)])
        refuse_foreign_picture(self.page, self.preview)

    def program(self, extension: str) -> str:
        """The program's name; when none is given the source's, here; stdin goes to stdout."""
        if self.output is not None:
            return self.output
        return STDOUT if self.source == STDOUT else Path(self.source).stem + extension


def finish(
    made: Posted,
    asked: Asked,
    *,
    quiet: bool,
    verbose: bool,
    picture: Painter,
    target: LoadedTarget,
) -> int:
    """Writes what was made and says so; the exit code. `picture` draws the ones that were asked.

    Where something is wrong only the page that was asked for is written: it says what.
    """
    say_findings(made.findings, quiet=quiet, verbose=verbose)
    if made.failed or made.program is None:
        if asked.page is not None:
            write_all(_page_alone(made, asked, picture, target))
        no = "nothing" if asked.page is None else "no program"
        say(
            f"camtool: error: {asked.source}: {no} was written; mend the errors above",
            quiet=False,
        )
        return 1
    # A dialect of several forms (binary, listing) says only now which extension it takes.
    asked.check(made.program.extension, verified=True)
    output = asked.program(made.program.extension)
    files = {output: made.program.data}
    if asked.preview is not None:
        files[asked.preview] = picture(asked.preview)
    if asked.report is not None and made.verification is not None:
        files[asked.report] = made.verification.report.to_json().encode()
    if asked.page is not None:
        files.update(_page(made, asked, picture, target))
    write_all(files)
    if made.verification is not None and not quiet:
        said = made.verification.report.to_text(findings=False)
        if target.any_machine:
            said += f"\n{'machine':<10} {ANY_MACHINE.format(target.machine.target.name)}"
        show_facts(said, REPORT_NAMES, report_marks(made.findings), err=True)
    where = "stdout" if output == STDOUT else output
    say(f"written: {where} ({len(made.program.data)} bytes)", quiet=quiet)
    return 0


def _page_alone(
    made: Posted, asked: Asked, picture: Painter, target: LoadedTarget
) -> dict[str, bytes]:
    """The files of the page, and the picture of `--preview` if that is what the page shows."""
    files, linked = _page(made, asked, picture, target), linked_picture(asked.page, asked.preview)
    return files if linked is None or linked in files else {**files, linked: picture(linked)}


def _page(made: Posted, asked: Asked, picture: Painter, target: LoadedTarget) -> dict[str, bytes]:
    """The files of the page that was asked for."""
    subject = Subject(
        title=Path(asked.source).name if asked.source != STDOUT else "<stdin>",
        target=target,
        report=made.verification.report if made.verification is not None else None,
        findings=made.findings,
        program=made.program.data if made.program is not None else None,
        flags=asked.flags,
    )
    return report_files(str(asked.page), subject, picture, preview=asked.preview)
