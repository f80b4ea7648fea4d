"""`camtool unlock`: a controller that has locked itself takes orders again."""

from __future__ import annotations

import click

from camtool.cli.home import act, port_options
from camtool.cli.options import MachineFlags, SectionedCommand, talk_options


@click.command(cls=SectionedCommand, short_help="Unlock a controller.")
@port_options
@talk_options
def unlock(machine: MachineFlags, port: str, baud: int | None, quiet: bool, verbose: bool) -> int:
    """Unlock a controller that has locked itself, after an alarm or until it is homed.

    Look first why it is locked. A board that is reset when its port opens locks itself again:
    there give --unlock to the command that is to follow."""
    return act("unlock", machine, port, baud, {}, quiet=quiet, unlock=True)
