"""`camtool panel`: a page on this computer that moves a machine and runs a program."""

from __future__ import annotations

import asyncio
import threading
import webbrowser
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import click

from camtool.cli.home import BAUD
from camtool.cli.messages import say, show_text
from camtool.cli.options import (
    MachineFlags,
    SectionedCommand,
    length,
    machine_options,
    talk_options,
)
from camtool.cli.wishes import UserRequests
from camtool.sending.line import Port, opened_line, port_of, wire_of

if TYPE_CHECKING:
    from camtool.sending.twin import PseudoTerminal


@click.command(cls=SectionedCommand, short_help="A page that moves the machine.")
@click.argument("program", metavar="[PROGRAM]", required=False)
@machine_options
@click.option("--port", metavar="PORT", help="Such as /dev/ttyUSB0  [a virtual machine]")
@BAUD
@click.option(
    "--http",
    "http_port",
    type=click.IntRange(0, 65535),
    default=0,
    metavar="N",
    help="Port of the page on this computer  [any that is free]",
)
@click.option(
    "--tool-diameter",
    callback=length,
    metavar="LENGTH",
    help="Of the end mill in the machine: the picture shows the stock that it cuts.",
)
@click.option("--open", "opens", is_flag=True, help="Open the page in a browser.")
@talk_options
def panel(
    program: str | None,
    machine: MachineFlags,
    port: str | None,
    baud: int | None,
    http_port: int,
    tool_diameter: float | None,
    opens: bool,
    quiet: bool,
    verbose: bool,
) -> int:
    """Show a page that moves the machine by hand and sends PROGRAM.

    The page is served to this computer alone, at an address with a key that is printed. Without
    --port it moves a virtual machine. Ctrl-C stops the machine and ends the panel; a browser that
    is closed ends neither."""
    from camtool.panel.program import LoadedProgram
    from camtool.panel.server import PanelServer
    from camtool.panel.session import Session

    target = machine.load()
    wire = wire_of(target)
    loaded = None if program is None else LoadedProgram.read(program, target, tool_diameter)
    twin = None
    if port is None:
        twin, line = _virtual(machine), None
        line = Port(twin.name)
    else:
        line = port_of(port, baud, wire, target)
    session = Session(target, line, opened_line)
    folder = Path(program).parent if program else Path()
    server = PanelServer(session, loaded, folder, tool_diameter)
    session.watch = server.changed
    wishes = UserRequests(one_s=0.0)

    def ready() -> None:
        show_text(server.address)
        if opens:
            webbrowser.open(server.address)
        if not quiet:
            where = "a virtual machine" if port is None else line.name
            say(f"camtool: the panel of {where} is at the address above; Ctrl-C ends")
        session.start()

    async def serve() -> None:
        serving = asyncio.create_task(server.serve(http_port, ready))
        while not serving.done() and wishes() is None:
            await asyncio.sleep(0.05)
        if not serving.done():
            await asyncio.to_thread(session.close)
            server.end()
        await serving

    with wishes.catch_signals():
        asyncio.run(serve())
    if twin is not None:
        with suppress(OSError):
            twin.close()
    return 0


def _virtual(machine: MachineFlags) -> PseudoTerminal:
    """Start a virtual machine on a pseudo-terminal, and return that."""
    from camtool.sending.faults import WiredTwin
    from camtool.sending.twin import Clock, PseudoTerminal, serve

    terminal = PseudoTerminal()
    wired = WiredTwin(machine.load().twin([]))
    threading.Thread(
        target=serve, args=(wired, terminal, Clock(1.0)), name="twin", daemon=True
    ).start()
    return terminal
