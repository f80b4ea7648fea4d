"""`camtool probe`: the top of the blank, measured where a program cuts."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from camtool.cli.files import display_name, read_bytes, refuse_same, write_all
from camtool.cli.home import BAUD, PORT, UNLOCK
from camtool.cli.life_signs import progress, signs_of_command
from camtool.cli.messages import say
from camtool.cli.options import MachineFlags, feed, length, machine_options, talk_options
from camtool.errors import OptionError

if TYPE_CHECKING:
    from camtool.geometry.polylines import Segments


@click.command(short_help="Measure the top of the blank.")
@click.argument("program", metavar="PROGRAM")
@machine_options
@PORT
@BAUD
@UNLOCK
@click.option("-o", "--output", metavar="FILE", help="The surface  [PROGRAM.surface.csv]")
@click.option(
    "--step", default="10mm", callback=length, metavar="LENGTH", help="Between points, at most."
)
@click.option(
    "--clear", default="2mm", callback=length, metavar="LENGTH", help="Height between points."
)
@click.option(
    "--lowest", default="-2mm", callback=length, metavar="LENGTH", help="The probe goes no lower."
)
@click.option("--feed", default="50", callback=feed, metavar="FEED", help="Of the probe.")
@click.option("--holes", metavar="DRAWING", help="Leave out points in its closed contours.")
@click.option(
    "--margin",
    default="1mm",
    callback=length,
    metavar="LENGTH",
    help="Distance of points from the holes.",
)
@click.option("--yes", is_flag=True, help="Begin without asking.")
@talk_options
def probe(
    program: str,
    machine: MachineFlags,
    port: str,
    baud: int | None,
    unlock: bool,
    output: str | None,
    step: float,
    clear: float,
    lowest: float,
    feed: float,
    holes: str | None,
    margin: float,
    yes: bool,
    quiet: bool,
    verbose: bool,
) -> int:
    """Probe the top of the blank at the points of a grid over the area that PROGRAM cuts.

    The tool stands above part zero, which was touched off; heights are measured from there.
    `camtool convert PROGRAM --from NAME --to NAME --surface FILE` lets the cuts follow them.
    Ctrl-C stops the machine. Exit code 1, and no file, when a point was not touched.
    """
    from camtool.cli.wishes import Messages, UserRequests, keys_of_terminal
    from camtool.pipeline import read_program
    from camtool.sending.drive import Driver, Request
    from camtool.sending.line import opened_line
    from camtool.sending.prepare import manner_of, port_of, wire_of
    from camtool.target.wire import ProbePlan, WireState
    from camtool.toolpath.probing import grid_over, in_rows, surface_from, without_holes
    from camtool.toolpath.surface import text_of_surface

    target = machine.load()
    wire = wire_of(target)
    out = output or str(Path(program).with_suffix(".surface.csv"))
    refuse_same([program, *machine.files()], [out])
    decoded = read_program(read_bytes(program), target, source=display_name(program)).decoded
    assert decoded is not None
    x, y = grid_over(decoded, step)
    probed = without_holes(x, y, [] if holes is None else _contours(holes), margin)
    points = in_rows(x, y, probed)
    plan = ProbePlan(tuple(points), clear, lowest, feed)
    conversation, heights = wire.probing(plan, target.machine, manner_of(target, unlock=unlock))
    if not yes:
        with signs_of_command().hidden():
            words = (
                f"Probe {len(points)} points from X{x[0]:g} Y{y[0]:g} to X{x[-1]:g} Y{y[-1]:g}?"
            )
            if not click.confirm(words, err=True, default=False):
                say("camtool: nothing was sent", quiet=False)
                return 1
    signs = progress()
    signs.begin("probing", len(points))

    def watch(_: object) -> None:
        signs.done = len(heights)

    with opened_line(port_of(port, baud, wire, target)) as line, keys_of_terminal() as key:
        wishes = UserRequests(key, {"q": Request.STOP})
        tell = Messages(quiet=quiet)
        driver = Driver(line, wish=wishes, watch=watch, tell=tell)
        with wishes.catch_signals():
            driver.carry(conversation)
    tell.rest()
    if conversation.state is not WireState.FINISHED or len(heights) != len(points):
        why = str(driver.trouble or conversation.why or "a point was not touched")
        say(f"camtool: error: probe: {why}; {len(heights)} points were touched", quiet=False)
        return 1
    surface = surface_from(x, y, probed, heights)
    write_all({out: text_of_surface(surface).encode()})
    low, high = surface.range_mm
    say(
        f"camtool: {out}: {len(points)} points, {low:.3f} to {high:.3f} mm; camtool convert "
        f"{display_name(program)} --from … --to … --surface {out} follows it",
        quiet=quiet,
    )
    return 0


def _contours(name: str) -> list[Segments]:
    """Return the closed contours of a drawing."""
    from camtool.geometry.polylines import Segments
    from camtool.importers.read import read_drawing

    rings = [Segments.of(path) for path in read_drawing(Path(name)).paths if path.closed]
    if not rings:
        raise OptionError("has no closed contours", where=f"--holes {name}")
    return rings
