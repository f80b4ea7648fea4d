"""`camtool home`, `zero` and `jog`: a machine moved by hand, where its line can do so."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import TYPE_CHECKING

import click

from camtool.cli.messages import say
from camtool.cli.options import (
    Command,
    MachineFlags,
    SectionedCommand,
    decorate,
    machine_options,
    talk_options,
)
from camtool.cli.wishes import Messages, UserRequests, keys_of_terminal
from camtool.errors import MachineError, OptionError
from camtool.sending.drive import Driver, Order, Request
from camtool.sending.line import manner_of, opened_line, port_of, wire_of
from camtool.target.wire import Conversation, Place, WireState, place_words
from camtool.units import parse_feed, parse_length

if TYPE_CHECKING:
    from camtool.target.registry import LoadedTarget

BAUD = click.option("--baud", type=click.IntRange(min=1), help="Rate, where not its own.")
UNLOCK = click.option("--unlock", is_flag=True, help="Unlock a controller that is locked first.")


def port_options(command: Command) -> Command:
    """Add `machine: MachineFlags`, `port` and `baud`."""
    port = click.option("--port", metavar="PORT", required=True, help="Such as /dev/ttyUSB0.")
    return machine_options(decorate(command, [port, BAUD]))


@click.command(cls=SectionedCommand, short_help="Home a machine.")
@port_options
@click.option("--yes", is_flag=True, help="Do not ask for what must be done at the machine first.")
@talk_options
def home(
    machine: MachineFlags, port: str, baud: int | None, yes: bool, quiet: bool, verbose: bool
) -> int:
    """Send the machine to its switches."""
    return act("home", machine, port, baud, {}, quiet=quiet, yes=yes)


def act(
    action: str,
    machine: MachineFlags,
    name: str,
    baud: int | None,
    values: dict[str, float],
    *,
    quiet: bool,
    unlock: bool = False,
    yes: bool = False,
    at_mm: Place | None = None,
) -> int:
    """Run one action of a machine (home, jog, zero, unlock) to its end; return the exit code."""
    target = machine.load()
    wire = wire_of(target)
    if at_mm is not None and not wire.jogs_from_place:
        raise MachineError(
            f"{target.machine.target.name} needs no place to jog from",
            where="--at",
            mend="leave it out",
        )
    manner = manner_of(target, unlock=unlock, at_mm=at_mm)
    conversation = wire.command(action, target.machine, values, manner)
    if not (yes or _is_agreed(conversation)):
        return 1
    reason = carried(conversation, target, name, baud, quiet=quiet, is_agreed=True)
    if not reason:
        place = conversation.place_mm if wire.jogs_from_place else None
        stands = f"; it stands at {place_words(place).replace(' ', ',')} (--at)" if place else ""
        say(f"camtool: {action}: done{stands}", quiet=quiet)
        return 0
    say(f"camtool: error: {action}: {reason}")
    return 1


def carried(
    conversation: Conversation,
    target: LoadedTarget,
    port: str,
    baud: int | None,
    *,
    quiet: bool,
    is_agreed: bool = False,
    watch: Callable[[Conversation], None] = lambda _: None,
) -> str:
    """Run a conversation to its end; return why it failed, "" if it did not. Ctrl-C, q and any
    exception stop the machine. `is_agreed`: go on without asking where it waits for the user."""
    opened = opened_line(port_of(port, baud, wire_of(target), target))
    with opened as line, keys_of_terminal() as key:
        wishes = UserRequests(key, {"q": Request.STOP})
        tell = Messages(quiet=quiet)

        def wish() -> Request | Order | None:
            if is_agreed and conversation.state is WireState.WAITING:
                return Request.RESUME
            return wishes()

        driver = Driver(line, wish=wish, watch=watch, tell=tell)
        with wishes.catch_signals():
            driver.carry(conversation)
    tell.rest()
    if conversation.state is WireState.FINISHED and driver.trouble is None:
        return ""
    return str(driver.trouble or conversation.why or conversation.state.value)


def _is_agreed(conversation: Conversation) -> bool:
    """Ask the user to do or allow what the conversation needs before its first packet. Return True
    if nothing is needed or the answer is yes."""
    question = next((packet.ask for packet in conversation.packets[:1]), "")
    if not question:
        return True
    if not sys.stdin.isatty():
        raise click.UsageError(f"{question}: when that is so, give --yes")
    if click.confirm(f"{question[0].upper()}{question[1:]}?", err=True, default=False):
        return True
    say("camtool: nothing was sent")
    return False


def axes_of(words: tuple[str, ...]) -> dict[str, float]:
    """Parse words such as `X1.5 Y-2mm F200` to mm and mm/min by axis; OptionError for
    other words."""
    values: dict[str, float] = {}
    for word in words:
        letter, text = word[:1].lower(), word[1:]
        if letter not in ("x", "y", "z", "f") or letter in values or not text:
            raise OptionError(f"{word!r} is no axis with a length", mend="write X1.5 Y-2mm F200")
        values[letter] = parse_feed(text) if letter == "f" else parse_length(text)
    return values
