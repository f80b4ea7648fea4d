"""How `post` and `convert` end: all files or none, and a short summary."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from camtool.cli.output import STDOUT, check_writable, write_all
from camtool.cli.talk import say, say_findings

if TYPE_CHECKING:
    from camtool.pipeline import Posted


@dataclass(frozen=True)
class Asked:
    """What the user wants written; `source` names what it is made of, None is not wanted."""

    source: str
    output: str | None
    report: str | None
    preview: str | None = None

    def check(self, extension: str, *, verified: bool) -> None:
        """OutputError, before any work is done, when a place cannot be written."""
        if self.report is not None and not verified:
            raise click.UsageError(
                "--json is the report of the verification that --no-verify leaves out"
            )
        check_writable([self.program(extension), self.preview, self.report], [self.source])

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
    picture: Callable[[str], bytes] | None = None,
) -> int:
    """Writes what was made and says so; the exit code. `picture` draws the one that was asked."""
    say_findings(made.findings, quiet=quiet, verbose=verbose)
    if made.failed or made.program is None:
        say(
            f"camtool: error: {asked.source}: nothing was written; mend the errors above",
            quiet=False,
        )
        return 1
    # A dialect of several forms (binary, listing) says only now which extension it takes.
    asked.check(made.program.extension, verified=True)
    output = asked.program(made.program.extension)
    files = {output: made.program.data}
    if asked.preview is not None and picture is not None:
        files[asked.preview] = picture(asked.preview)
    if asked.report is not None and made.verification is not None:
        files[asked.report] = made.verification.report.to_json().encode()
    write_all(files)
    if made.verification is not None:
        say(made.verification.report.to_text(findings=False), quiet=quiet)
    where = "stdout" if output == STDOUT else output
    say(f"written: {where} ({len(made.program.data)} bytes)", quiet=quiet)
    return 0
