"""`camtool convert`: a program of one machine as the program of another."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from camtool.cli.finish import Asked, finish
from camtool.cli.options import MachineFlags, talk_options
from camtool.cli.report import flags_given, report_option
from camtool.cli.talk import say_first_run
from camtool.cli.types import feed
from camtool.cli.verify import read_bytes, shown

if TYPE_CHECKING:
    from camtool.machine.registry import LoadedTarget
    from camtool.pipeline import Posted


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
@report_option
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
    page: str | None,
    no_verify: bool,
    quiet: bool,
    verbose: bool,
) -> int:
    """Turn PROGRAM (- is stdin) of one machine into the program of another.

    The moves that the first controller decodes are written for the second one, read back,
    simulated and compared with them. Exit code 1 (and no file) when something is wrong.
    """
    before = MachineFlags(source, from_machine, from_set).load()
    after = MachineFlags(target, machine, settings).load()
    asked = Asked(program, output, report, page=page, flags=flags_given())
    asked.check(after.machine.target.extension, verified=not no_verify)

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
    return finish(
        made,
        asked,
        quiet=quiet,
        verbose=verbose,
        picture=lambda name: _picture(name, shown(program), made, after),
        target=after,
    )


def _picture(name: str, title: str, made: Posted, target: LoadedTarget) -> bytes:
    from camtool.pipeline import posted_scene
    from camtool.preview.render import render

    scene = posted_scene(made, target, title=Path(title).name)
    return render(scene, name)
