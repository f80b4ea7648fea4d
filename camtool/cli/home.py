"""`camtool home`, `zero` and `jog`: a machine moved by hand, where its line can do so."""

from __future__ import annotations

import click

from camtool.cli.messages import say
from camtool.cli.options import MachineFlags, machine_options, talk_options
from camtool.errors import OptionError
from camtool.units import parse_feed, parse_length

PORT = click.option("--port", metavar="PORT", required=True, help="Such as /dev/ttyUSB0.")
UNLOCK = click.option("--unlock", is_flag=True, help="Unlock a controller that is locked first.")
BAUD = click.option("--baud", type=click.IntRange(min=1), help="Rate, where not its own.")


@click.command(short_help="Home a machine.")
@machine_options
@PORT
@BAUD
@talk_options
def home(machine: MachineFlags, port: str, baud: int | None, quiet: bool, verbose: bool) -> int:
    """Send the machine to its switches."""
    return act("home", machine, port, baud, {}, quiet=quiet)


def act(
    action: str,
    machine: MachineFlags,
    name: str,
    baud: int | None,
    values: dict[str, float],
    *,
    quiet: bool,
    unlock: bool = False,
) -> int:
    """Hold the conversation of one command; return the exit code. Ctrl-C, q and any exception stop
    the machine."""
    from camtool.cli.wishes import Messages, UserRequests, keys_of_terminal
    from camtool.sending.drive import Driver, Request
    from camtool.sending.line import opened_line
    from camtool.sending.prepare import manner_of, port_of, wire_of
    from camtool.target.wire import WireState

    target = machine.load()
    wire = wire_of(target)
    conversation = wire.command(action, target.machine, values, manner_of(target, unlock=unlock))
    with opened_line(port_of(name, baud, wire, target)) as line, keys_of_terminal() as key:
        wishes = UserRequests(key, {"q": Request.STOP})
        tell = Messages(quiet=quiet)
        driver = Driver(line, wish=wishes, tell=tell)
        with wishes.catch_signals():
            driver.carry(conversation)
    tell.rest()
    if conversation.state is WireState.FINISHED:
        say(f"camtool: {action}: done", quiet=quiet)
        return 0
    reason = str(driver.trouble or conversation.why or conversation.state.value)
    say(f"camtool: error: {action}: {reason}", quiet=False)
    return 1


def axes_of(words: tuple[str, ...]) -> dict[str, float]:
    """Parse `X1.5 Y-2mm F200` to mm and mm/min by axis; OptionError for other words."""
    values: dict[str, float] = {}
    for word in words:
        letter, text = word[:1].lower(), word[1:]
        if letter not in ("x", "y", "z", "f") or letter in values or not text:
            raise OptionError(f"{word!r} is no axis with a length", mend="write X1.5 Y-2mm F200")
        values[letter] = parse_feed(text) if letter == "f" else parse_length(text)
    return values
