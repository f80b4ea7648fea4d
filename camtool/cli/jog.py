"""`camtool jog`: a machine moved by so much."""

from __future__ import annotations

import click

from camtool.cli.home import BAUD, PORT, UNLOCK, act, axes_of
from camtool.cli.options import MachineFlags, machine_options, talk_options
from camtool.errors import OptionError


@click.command(
    short_help="Move a machine by so much.", context_settings={"ignore_unknown_options": True}
)
@click.argument("axes", nargs=-1, required=True, metavar="X1.5 Y-2mm F200")
@machine_options
@PORT
@BAUD
@UNLOCK
@talk_options
def jog(
    axes: tuple[str, ...],
    machine: MachineFlags,
    port: str,
    baud: int | None,
    unlock: bool,
    quiet: bool,
    verbose: bool,
) -> int:
    """Move the machine by so much from where it stands; Ctrl-C stops it."""
    values = axes_of(axes)
    values["feed"] = values.pop("f", 0.0) or machine.load().machine.feed.default_mm_min
    if not values.keys() & set("xyz"):
        raise OptionError("no axis is to move", where="jog", mend="write X1.5")
    return act("jog", machine, port, baud, values, quiet=quiet, unlock=unlock)
