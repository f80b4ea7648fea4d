"""`camtool convert`: a program of one machine as the program of another."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from camtool.cli.files import display_name, read_bytes
from camtool.cli.life_signs import progress
from camtool.cli.options import MachineFlags, SectionedCommand, feed, talk_options
from camtool.cli.picture_options import (
    RESULT,
    UNVERIFIED,
    PictureFlags,
    picture_name,
    picture_options,
)
from camtool.cli.post import RequestedOutputs, finish
from camtool.cli.report import ReportOutputs, report_option
from camtool.errors import OptionError

if TYPE_CHECKING:
    from camtool.toolpath.surface import Surface

MAX_TURN_DEG = 360.0


@click.command(cls=SectionedCommand, short_help="A program of one machine as that of another.")
@click.argument("program", metavar="PROGRAM")
@click.option("--from", "source", metavar="NAME", required=True, help="The machine it is for.")
@click.option(
    "--to", "target", metavar="NAME", required=True, help="The machine to convert it for."
)
@click.option("-o", "--output", metavar="FILE", help="The program; - is stdout.  [PROGRAM.ext]")
@click.option("--machine", metavar="FILE", help="A TOML file that extends the machine of --to.")
@click.option("--set", "settings", multiple=True, metavar="KEY=VALUE", help="Change its values.")
@click.option("--from-machine", metavar="FILE", help="A TOML file that extends that of --from.")
@click.option("--from-set", multiple=True, metavar="KEY=VALUE", help="Change its values.")
@click.option(
    "--feed", "feed_mm_min", callback=feed, metavar="FEED", help="For all cuts, in mm/min."
)
@click.option(
    "--turn",
    "turn_deg",
    default=0.0,
    metavar="DEGREES",
    help="Turn it counter-clockwise about part zero.",
)
@click.option("--surface", metavar="FILE", help="Let the cuts follow this probed surface.")
@click.option(
    "--preview",
    metavar="FILE",
    callback=picture_name,
    help="Picture of the predicted result, .svg or .png; .html to pan, zoom and play.",
)
@click.option("--json", "report", metavar="FILE", help="The report; - is stdout.")
@report_option
@click.option("--no-verify", is_flag=True, help="Write without simulating the machine.")
@picture_options
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
    turn_deg: float,
    surface: str | None,
    preview: str | None,
    report: str | None,
    page: str | None,
    no_verify: bool,
    picture: PictureFlags,
    quiet: bool,
    verbose: bool,
) -> int:
    """Turn PROGRAM (- is stdin) of one machine into the program of another.

    The moves that the first controller decodes are written for the second one, read back,
    simulated and compared with them. Exit code 1 (and no file) when something is wrong. With
    --surface (camtool probe writes it) the cuts follow the measured top of the blank; --from and
    --to may be the same machine."""
    if not -MAX_TURN_DEG <= turn_deg <= MAX_TURN_DEG:
        raise OptionError(f"{turn_deg:g} is no angle from -360 to 360", where="--turn")
    outputs = ReportOutputs(preview, report, page)
    picture.check(outputs.pictures, UNVERIFIED if no_verify else RESULT)
    before = MachineFlags(source, from_machine, from_set).load()
    after = MachineFlags(target, machine, settings).load()
    reads = [program, str(before.file), str(after.file)]
    reads += [file for file in (from_machine, machine, surface) if file is not None]
    requested = RequestedOutputs(program, output, outputs, reads)
    requested.check(after.machine.target.extension, verified=not no_verify)

    from camtool.pipeline import convert_program

    run = convert_program(
        read_bytes(program),
        before,
        after,
        file=display_name(program),
        feed_mm_min=feed_mm_min,
        turn_deg=turn_deg,
        surface=None if surface is None else _surface(surface),
        check=not no_verify,
        progress=progress(),
    )
    painter = picture.painter(lambda: [run.scene()], quiet=quiet)
    return finish(run, requested, picture=painter, quiet=quiet, verbose=verbose)


def _surface(name: str) -> Surface:
    """Read a file with the surface of a blank, as `camtool probe` writes it."""
    from camtool.toolpath.surface import surface_of_text

    return surface_of_text(read_bytes(name).decode("utf-8", "replace"), display_name(name))
