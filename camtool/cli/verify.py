"""`camtool verify`: simulate and judge any program of a machine."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, cast

import click

from camtool.cli.drawing import DrawingFlags, drawing_options
from camtool.cli.jobflags import JobFlags, job_options
from camtool.cli.options import (
    INTERPOLATORS,
    MachineFlags,
    machine_options,
    talk_options,
)
from camtool.cli.output import STDOUT, check_writable, write_all
from camtool.cli.sections import SectionedCommand
from camtool.cli.talk import say, say_findings, say_first_run
from camtool.cli.types import picture as picture_name
from camtool.errors import ProgramError

if TYPE_CHECKING:
    from camtool.machine.controllers import Interpolator


@click.command(cls=SectionedCommand, short_help="Simulate and judge a program.")
@click.argument("program", metavar="PROGRAM")
@machine_options
@click.option("--against", metavar="DRAWING", help="The drawing that it should make.")
@click.option(
    "--interpolator",
    type=click.Choice(INTERPOLATORS),
    help="How the controller draws arcs, to compare; default: as the machine does.",
)
@click.option(
    "--preview",
    metavar="FILE",
    callback=picture_name,
    help="Picture of the predicted result, .svg or .png.",
)
@click.option("--json", "report", metavar="FILE", help="The report; - is stdout.")
@job_options
@drawing_options
@talk_options
def verify(
    program: str,
    machine: MachineFlags,
    against: str | None,
    interpolator: str | None,
    preview: str | None,
    report: str | None,
    job: JobFlags,
    drawing: DrawingFlags,
    quiet: bool,
    verbose: bool,
) -> int:
    """Simulate PROGRAM (- is stdin) as the machine would run it, and judge the result.

    With --against, the path is compared with what DRAWING would give, planned with the same flags
    (--tool-diameter, --side ...). Exit code 1 when a finding is an error.
    """
    target = machine.load()
    check_writable([preview, report], [program, *([against] if against else [])])

    from camtool.findings import Severity, worst
    from camtool.pipeline import picture, verify_program

    say_first_run(quiet=quiet)
    data = read_bytes(program)
    wanted = job.job(drawing)
    read = drawing.read(against, target.machine, wanted) if against else None
    with job.blamed():
        decoded, verification = verify_program(
            data,
            target,
            source=shown(program),
            drawing=read,
            job=wanted,
            interpolator=cast("Interpolator | None", interpolator),
        )
    files: dict[str, bytes] = {}
    if preview is not None:
        from camtool.preview.render import render

        scene = picture(
            title=Path(shown(program)).name,
            drawing=read,
            job=wanted,
            toolpath=decoded,
            verification=verification,
            machine=target.machine,
        )
        files[preview] = render(scene, preview)
    if report is not None:
        files[report] = verification.report.to_json().encode()
    write_all(files)
    if report != STDOUT and not quiet:
        click.echo(verification.report.to_text(findings=False))
    say_findings(verification.findings, quiet=quiet, verbose=verbose)
    failed = worst(verification.findings) >= Severity.ERROR
    if failed:
        say(f"camtool: error: {program}: the errors above would spoil the part", quiet=False)
    return 1 if failed else 0


def shown(name: str) -> str:
    """The name of a file in messages."""
    return "<stdin>" if name == STDOUT else name


def read_bytes(name: str) -> bytes:
    """The bytes of a file, or of stdin for `-`; ProgramError when it cannot be read."""
    if name == STDOUT:
        return sys.stdin.buffer.read()
    try:
        return Path(name).read_bytes()
    except OSError as error:
        raise ProgramError(
            f"cannot be read ({error.strerror})", file=name, mend="check the path"
        ) from error
