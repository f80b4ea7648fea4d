"""`camtool jog`: a machine moved by so much."""

from __future__ import annotations

import click

from camtool.cli.home import UNLOCK, act, axes_of, port_options
from camtool.cli.options import MachineFlags, SectionedCommand, talk_options
from camtool.errors import OptionError
from camtool.target.wire import Place


@click.command(
    cls=SectionedCommand,
    short_help="Move a machine by so much.",
    context_settings={"ignore_unknown_options": True},
)
@click.argument("axes", nargs=-1, required=True, metavar="X1.5 Y-2mm F200")
@port_options
@UNLOCK
@click.option(
    "--at",
    metavar="X0,Y0,Z5",
    help="Where the tool stands now, for a controller that does not know it and moves to absolute "
    "places (valcnc).",
)
@talk_options
def jog(
    axes: tuple[str, ...],
    machine: MachineFlags,
    port: str,
    baud: int | None,
    unlock: bool,
    at: str | None,
    quiet: bool,
    verbose: bool,
) -> int:
    """Move the machine by so much from where it stands; Ctrl-C stops it."""
    values = axes_of(axes)
    values["feed"] = values.pop("f", 0.0) or machine.load().machine.feed.default_mm_min
    if not values.keys() & set("xyz"):
        raise OptionError("no axis is to move", where="jog", mend="write X1.5")
    return act("jog", machine, port, baud, values, quiet=quiet, unlock=unlock, at_mm=_place_of(at))


def _place_of(text: str | None) -> Place | None:
    """Parse a place such as `X0,Y0,Z5`; None without text, OptionError for other text."""
    if text is None:
        return None
    values = axes_of(tuple(text.replace(",", " ").split()))
    if values.keys() != set("xyz"):
        raise OptionError(
            f"{text!r} is no place", where="--at", mend="write all axes, such as X0,Y0,Z5"
        )
    return values["x"], values["y"], values["z"]
