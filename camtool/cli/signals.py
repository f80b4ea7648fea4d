"""`camtool signals`: the lines of a controller over time, as dumps, tables and pictures."""

from __future__ import annotations

import math
from pathlib import PurePath
from typing import TYPE_CHECKING

import click

from camtool.cli.files import check_places, display_name, read_bytes, write_all
from camtool.cli.life_signs import progress
from camtool.cli.messages import say, show_text
from camtool.cli.options import (
    MachineFlags,
    SectionedCommand,
    duration,
    machine_options,
    talk_options,
)
from camtool.pictures.options import PictureOptions

if TYPE_CHECKING:
    from camtool.waveforms.signals import Signals

KINDS = (".vcd", ".csv", ".svg", ".png")


def _outputs(
    ctx: click.Context, param: click.Parameter, values: tuple[str, ...]
) -> tuple[str, ...]:
    """Validate the names of outputs."""
    for value in values:
        if PurePath(value).suffix.lower() not in KINDS:
            raise click.BadParameter(f"{value!r} ends in none of {', '.join(KINDS)}", ctx, param)
    return values


@click.command(cls=SectionedCommand, short_help="Step lines, coils and port bytes over time.")
@click.argument("program", metavar="PROGRAM")
@machine_options
@click.option(
    "-o",
    "--output",
    "outputs",
    multiple=True,
    metavar="FILE",
    callback=_outputs,
    help="A .vcd for GTKWave or PulseView, a .csv of port bytes, a .svg or .png; may be given "
    "several times.",
)
@click.option(
    "--from",
    "start",
    metavar="TIME",
    callback=duration,
    help="Begin so long after the start of the program, such as 1.5s or 20ms.",
)
@click.option(
    "--span",
    metavar="TIME",
    callback=duration,
    help="Only so long; a picture without it shows the first changes.",
)
@click.option("--motors", metavar="NAME,...", help="Only these motors in a picture, such as X,Y.")
@click.option("--size", type=click.INT, metavar="PX", help="Width of a picture in pixels.")
@click.option("--dark", is_flag=True, help="A picture on a dark ground.")
@talk_options
def signals(
    program: str,
    machine: MachineFlags,
    outputs: tuple[str, ...],
    start: float | None,
    span: float | None,
    motors: str | None,
    size: int | None,
    dark: bool,
    quiet: bool,
    verbose: bool,
) -> int:
    """Show when the controller of PROGRAM (- is stdin) sets each of its lines: steps and
    directions, or the coils of its motors, as its own timers and interpolators make them.

    Without -o it counts the steps of a whole run."""
    names = None if motors is None else [name.strip() for name in motors.split(",")]
    options = PictureOptions(size_px=size, dark=dark)
    pictures = [name for name in outputs if PurePath(name).suffix.lower() in (".svg", ".png")]
    if not pictures and (motors is not None or size is not None or dark):
        raise click.UsageError("--motors, --size and --dark are for pictures: give -o FILE.svg")
    if not outputs and (start is not None or span is not None):
        raise click.UsageError("--from and --span are for files: give -o FILE")
    check_places([program, *machine.files()], outputs)

    from camtool.waveforms.signals import Signals

    target = machine.load()
    progress().begin("reading the program")
    record = Signals.of(read_bytes(program), target, display_name(PurePath(program).name))
    progress().begin("running the controller")
    if outputs:
        write_all(
            {name: record.content(name, start or 0.0, span, names, options) for name in outputs}
        )
        say(f"written: {', '.join(outputs)}", quiet=quiet)
    elif not quiet:
        show_text(_text(record))
    if verbose:
        for note in record.board.notes:
            say(f"note: {note}", quiet=quiet)
    return 0


def _text(record: Signals) -> str:
    """Return the step counts of a whole run as readable text."""
    counts = record.count()
    lines = []
    for k, motor in enumerate(record.board.motors):
        words = f"{motor.name}: {counts.steps[k]:,} steps"
        if counts.added[k]:
            words += f", {counts.added[k]:,} more at reversals"
        if math.isfinite(counts.shortest_s[k]):
            words += f"; {1e3 * counts.shortest_s[k]:.6g} ms at least between two changes"
        lines.append(words)
    return "\n".join([*lines, f"time: {counts.seconds:.6g} s"])
