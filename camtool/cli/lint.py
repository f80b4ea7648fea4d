"""`camtool lint`: what is wrong with programs, without simulating them."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

import click

from camtool.cli.check_formats import CheckedFile, checked_run, refused_file
from camtool.cli.checks import CheckOutputs, check_outputs
from camtool.cli.files import STDOUT, check_places, display_name, read_bytes, write_all
from camtool.cli.messages import say, say_findings
from camtool.cli.options import MachineFlags, SectionedCommand, machine_options, talk_options
from camtool.errors import CamtoolError
from camtool.pipeline import lint_program
from camtool.plain import one_line, to_json

if TYPE_CHECKING:
    from camtool.target.registry import LoadedTarget

EXIT_BAD_INPUT = 2


@click.command(cls=SectionedCommand, short_help="Faults of programs, without simulating them.")
@click.argument("programs", metavar="PROGRAM...", nargs=-1, required=True)
@machine_options
@click.option("--json", "report", metavar="FILE", help="The findings as JSON; - is stdout.")
@check_outputs
@talk_options
def lint(
    programs: tuple[str, ...],
    machine: MachineFlags,
    report: str | None,
    checks: CheckOutputs,
    quiet: bool,
    verbose: bool,
) -> int:
    """Read each PROGRAM (- is stdin) as the controller would, and say what is wrong with it.

    Words and blocks that it refuses, arcs and feeds that it makes otherwise, travel, rapids in the
    stock: all that `camtool verify` finds without moving the machine's model, in a fraction of the
    time. Of several programs all are looked at, whatever is wrong with one of them. Exit code 1
    when a finding is an error, a program that cannot be decoded included."""
    check_places([*programs, *machine.files()], [report, *checks.names])
    target = machine.load()
    checked = [
        _check(program, target, quiet=quiet, verbose=verbose)
        for program in dict.fromkeys(programs)
    ]
    files = checks.files(checked, target.target.codes)
    if report is not None:
        files[report] = to_json([_row(each) for each in checked]).encode()
    write_all(files)
    if STDOUT not in files:
        say(f"camtool: {_summary(checked)}", quiet=quiet)
    if any(each.unread for each in checked):
        return EXIT_BAD_INPUT
    return int(any(each.errors for each in checked))


def _check(program: str, target: LoadedTarget, *, quiet: bool, verbose: bool) -> CheckedFile:
    """Return a program with its findings, and show these."""
    name = display_name(program)
    try:
        data = read_bytes(program)
    except CamtoolError as error:
        say(f"camtool: error: {error}")
        return refused_file(error, name, unread=True)
    try:
        run = lint_program(data, target, source=name)
    except CamtoolError as error:
        say(f"camtool: error: {error}")
        return refused_file(error, name)
    say_findings(run.findings, quiet=quiet, verbose=verbose, file=name)
    return checked_run(run, name)


def _row(checked: CheckedFile) -> dict[str, Any]:
    """Return the entry of a program for the JSON."""
    return {
        "program": checked.name,
        "errors": len(checked.errors),
        "warnings": sum(each.severity == "warning" for each in checked.findings),
        "findings": checked.findings,
    }


def _summary(checked: list[CheckedFile]) -> str:
    """Return a line of counts, such as `3 programs: 2 errors, 1 warning`."""
    counts = Counter(each.severity for file in checked for each in file.findings)
    words = [f"{counts[kind]} {kind}{'s' * (counts[kind] != 1)}" for kind in ("error", "warning")]
    subject = one_line(checked[0].name) if len(checked) == 1 else f"{len(checked)} programs"
    return f"{subject}: {', '.join(words)}"
