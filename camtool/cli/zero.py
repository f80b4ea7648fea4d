"""`camtool zero`: where the machine stands becomes part zero."""

from __future__ import annotations

import click

from camtool.cli.home import UNLOCK, act, axes_of, port_options
from camtool.cli.options import MachineFlags, SectionedCommand, talk_options
from camtool.errors import OptionError


@click.command(cls=SectionedCommand, short_help="Make this place part zero.")
@click.argument("axes", nargs=-1, metavar="[X0 Y0 Z0]")
@port_options
@UNLOCK
@talk_options
def zero(
    axes: tuple[str, ...],
    machine: MachineFlags,
    port: str,
    baud: int | None,
    unlock: bool,
    quiet: bool,
    verbose: bool,
) -> int:
    """Make the place where the machine stands part zero: of all axes, or of those given, which
    may also be elsewhere (Z12.5)."""
    values = axes_of(axes) or dict.fromkeys("xyz", 0.0)
    if "f" in values:
        raise OptionError("nothing moves: a feed means nothing", where="zero")
    return act("zero", machine, port, baud, values, quiet=quiet, unlock=unlock)
