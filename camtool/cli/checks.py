"""The flags `--sarif`, `--junit` and `--annotations`: findings for other programs.

They are written although a file has errors, or cannot be used at all: then most of all somebody
wants to read them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

import click
from msgspec import Struct
from msgspec.structs import astuple

from camtool.cli.files import display_name, write_all
from camtool.cli.options import Command, option, with_flags
from camtool.errors import CamtoolError, OutputError

if TYPE_CHECKING:
    from camtool.cli.check_formats import CheckedFile
    from camtool.findings import TargetCode

_PIPELINES = "For pipelines"


class CheckOutputs(Struct, frozen=True):
    """`--sarif`, `--junit`, `--annotations`: names of files; None is not requested."""

    sarif: str | None = None
    junit: str | None = None
    annotations: str | None = None

    @property
    def names(self) -> list[str]:
        """The files that are requested."""
        values = astuple(self)
        return [value for value in values if value is not None]

    def files(
        self, checked: Sequence[CheckedFile], own_codes: Iterable[TargetCode] = ()
    ) -> dict[str, bytes]:
        """Return the requested files (content by name) about what was checked; `own_codes` are the
        codes that the target adds."""
        if not self.names:
            return {}
        from camtool.cli import check_formats as formats

        files: dict[str, bytes] = {}
        if self.sarif is not None:
            files[self.sarif] = formats.sarif(checked, own_codes)
        if self.junit is not None:
            command = str(click.get_current_context().info_name)
            files[self.junit] = formats.junit(checked, command)
        if self.annotations is not None:
            files[self.annotations] = formats.workflow_commands(checked)
        return files

    @contextmanager
    def reporting_refusal(self, source: str) -> Iterator[None]:
        """Write the requested files if the block raises an error that makes `source` unusable; the
        error is raised again."""
        try:
            yield
        except CamtoolError as error:
            if self.names and not isinstance(error, OutputError):
                from camtool.cli.check_formats import refused_file

                write_all(self.files([refused_file(error, display_name(source))]))
            raise


def check_outputs(command: Command) -> Command:
    """Add `checks: CheckOutputs`."""
    return with_flags(
        command,
        "checks",
        CheckOutputs,
        [
            option(
                _PIPELINES, "--sarif", metavar="FILE", help="Findings as SARIF 2.1.0; - is stdout."
            ),
            option(
                _PIPELINES,
                "--junit",
                metavar="FILE",
                help="A test case for each file as JUnit's XML; - is stdout.",
            ),
            option(
                _PIPELINES,
                "--annotations",
                metavar="FILE",
                help="Errors and warnings as annotations of GitHub; - is stdout, into the log.",
            ),
        ],
    )
