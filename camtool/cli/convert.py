"""`camtool convert`: a program of one machine as the program of another."""

from __future__ import annotations

from pathlib import Path

import click

from camtool.cli.options import MachineFlags, talk_options
from camtool.cli.output import STDOUT, check_writable, write_all
from camtool.cli.talk import say, say_findings, say_first_run
from camtool.cli.types import feed
from camtool.cli.verify import read_bytes, shown


@click.command(short_help="A program of one machine as that of another.")
@click.argument("program", metavar="PROGRAM")
@click.option("--from", "source", metavar="NAME", required=True, help="The machine it is for.")
@click.option("--to", "target", metavar="NAME", required=True, help="The machine it shall be for.")
@click.option("-o", "--output", metavar="FILE", help="The program; - is stdout.  [PROGRAM.ext]")
@click.option("--machine", metavar="FILE", help="A TOML file that extends the machine of --to.")
@click.option("--set", "settings", multiple=True, metavar="KEY=VALUE", help="Change its values.")
@click.option("--from-machine", metavar="FILE", help="A TOML file that extends that of --from.")
@click.option("--from-set", multiple=True, metavar="KEY=VALUE", help="Change its values.")
@click.option(
    "--feed", "feed_mm_min", callback=feed, metavar="FEED", help="For all cuts, in mm/min."
)
@click.option("--json", "report", metavar="FILE", help="The report; - is stdout.")
@click.option("--no-verify", is_flag=True, help="Write without simulating the machine.")
@talk_options
def convert(
    program: str,
    source: str,
    target: str,
    output: str | None,
    machine: str | None,
    settings: tuple[str, ...],
    from_machine: str | None,
    from_set: tuple[str, ...],
    feed_mm_min: float | None,
    report: str | None,
    no_verify: bool,
    quiet: bool,
    verbose: bool,
) -> int:
    """Turn PROGRAM (- is stdin) of one machine into the program of another.

    The moves that the first controller decodes are written for the second one, read back,
    simulated and compared with them. Exit code 1 (and no file) when something is wrong.
    """
    if no_verify and report is not None:
        raise click.UsageError(
            "--json is the report of the verification that --no-verify leaves out"
        )
    before = MachineFlags(source, from_machine, from_set).load()
    after = MachineFlags(target, machine, settings).load()
    check_writable([output, report], [program])

    from camtool.pipeline import convert_program

    say_first_run(quiet=quiet)
    made = convert_program(
        read_bytes(program),
        before,
        after,
        file=shown(program),
        feed_mm_min=feed_mm_min,
        check=not no_verify,
    )
    say_findings(made.findings, quiet=quiet, verbose=verbose)
    if made.failed or made.program is None:
        say(f"camtool: error: {program}: nothing was written; mend the errors above", quiet=False)
        return 1
    output = output or _name_for(program, made.program.extension)
    check_writable([output, report], [program])
    files = {output: made.program.data}
    if report is not None and made.verification is not None:
        files[report] = made.verification.report.to_json().encode()
    write_all(files)
    if made.verification is not None:
        say(made.verification.report.to_text(findings=False), quiet=quiet)
    where = "stdout" if output == STDOUT else output
    say(f"written: {where} ({len(made.program.data)} bytes)", quiet=quiet)
    return 0


def _name_for(program: str, extension: str) -> str:
    """The new program's name when none is given: the old one's, here; stdin goes to stdout."""
    return STDOUT if program == STDOUT else Path(program).stem + extension
