"""`camtool console`: a person who types to a controller, with its answers explained."""

from __future__ import annotations

import queue
import sys
import threading
import time
from contextlib import suppress
from typing import TYPE_CHECKING

import click

from camtool.cli.home import BAUD
from camtool.cli.messages import say, show_text
from camtool.cli.options import MachineFlags, SectionedCommand, talk_options
from camtool.cli.wishes import Messages, UserRequests, takes_more
from camtool.sending.line import opened_line, port_of, wire_of

if TYPE_CHECKING:
    from camtool.cli.wishes import UserRequests
    from camtool.sending.drive import Request
    from camtool.sending.line import OpenPort
    from camtool.target.terminal import Terminal

TICK_S = 0.05
"""Time to listen to the controller before the keyboard is read, s."""

QUIET_S = 0.3
"""An answer is complete when nothing has come for this time, s."""

SILENT_S = 1.5
"""A line that gets no answer within this time gets none at all, s."""

KNOCK_S = 0.5
"""Time between two questions to a controller that may be starting, s."""

CONFIRMS_S = 3.0
"""A machine that was told to stop is no longer expected to confirm it after this time of silence,
s."""

SLOWS_S = 30.0
"""Longest time that a machine which reports its state may take to slow down, s."""

WAKES_S = 10.0
"""Longest time that a boot loader takes, s."""


@click.command(cls=SectionedCommand, short_help="Type to a controller.")
@click.argument("target", metavar="TARGET")
@click.argument("port", metavar="PORT")
@click.option("--machine", metavar="NAME", help="Your own machine, by name or TOML file.")
@click.option("--set", "settings", multiple=True, metavar="KEY=VALUE", help="Of the machine.")
@BAUD
@click.option(
    "--wait",
    "wait_s",
    type=click.FloatRange(min=0.0),
    default=60.0,
    help="Seconds that a line from a pipe waits for the answer that is due.",
)
@talk_options
def console(
    target: str,
    port: str,
    machine: str | None,
    settings: tuple[str, ...],
    baud: int | None,
    wait_s: float,
    quiet: bool,
    verbose: bool,
) -> int:
    """Type to the controller of TARGET at PORT; its answers are shown, and what they mean.

    Ctrl-C stops the machine where its protocol can, and ends it where not; so does all else that
    would end camtool, which then waits until the machine stands. Ctrl-D ends it. Lines from a pipe
    go out one by one, the first when the controller has started, each other when the one before
    has been answered; one that stops the machine does not wait. Exit code 1 where an answer that
    is due does not come.

    \b
    camtool console grbl /dev/ttyUSB0
    echo '$$' | camtool console grbl /dev/ttyUSB0
    camtool console linuxcnc socket://localhost:5007"""
    loaded_target = MachineFlags.of(target if machine is None else None, machine, settings).load()
    wire = wire_of(loaded_target)
    terminal = wire.terminal(loaded_target.machine)
    with opened_line(port_of(port, baud, wire, loaded_target)) as line:
        return _Talk(terminal, line, wait_s, quiet=quiet).run()


class _Talk:
    """The dialogue of a person, or a pipe, with a controller."""

    def __init__(self, terminal: Terminal, line: OpenPort, wait_s: float, *, quiet: bool) -> None:
        self._terminal, self._line, self._wait_s = terminal, line, wait_s

        self._at_terminal = sys.stdin.isatty()
        self._lines: queue.Queue[str | None] = queue.Queue()
        self._next: list[str | None] = []  # the line that waits
        self._say = Messages(quiet=quiet)
        self._unshown: list[str] = []
        self._shows = True  # False if nobody reads what is shown
        self._heard = self._spoke = self._opened = time.monotonic()
        self._knocked = 0.0
        self._asked, self._answered = "", True
        self._told: float | None = None  # time at which it was told to stop
        self._stops = False  # True if nothing was typed since
        self._code: int | None = None  # the exit code, when the machine stands

    def run(self) -> int:
        """Run the dialogue until one side ends it; return the exit code. Any exception stops the
        machine first."""
        if self._at_terminal:
            self._say(f"{self._terminal.about}; Ctrl-D ends")
        wishes = UserRequests(one_s=0.0)
        code: int | None = None
        with wishes.catch_signals():
            threading.Thread(target=self._read, daemon=True).start()
            if self._terminal.hello:
                self._line.write(self._terminal.hello)
                self._answered = False
            try:
                while code is None:
                    code = self._turn(wishes)
            except BaseException:
                with suppress(OSError):
                    self._line.write(self._terminal.halt())
                raise
        self._show([], wait=self._code is None)
        self._say.rest()
        return code

    def _read(self) -> None:
        for text in sys.stdin:
            self._lines.put(text.rstrip("\r\n"))
        self._lines.put(None)

    def _turn(self, wishes: UserRequests) -> int | None:
        """Listen for a moment, then handle the user's requests; return the exit code when the
        dialogue ends, else None."""
        terminal, line = self._terminal, self._line
        data = line.read(TICK_S)
        time_s = time.monotonic()
        if data:
            self._heard, self._answered = time_s, True
            self._show(terminal.decode(data))
        elif time_s - self._heard > QUIET_S:
            self._show(terminal.flush())
        wish = wishes()
        if wish is not None and not callable(wish):
            return self._stop(wish, by_hand=wishes.by_hand)
        if not self._shows and self._code is None:
            return self._halt(1)
        if self._told is not None:
            end_code = self._stopped(time_s, self._told)
            if end_code or self._code is not None:
                return self._code if end_code else None
        if not self._next:
            with suppress(queue.Empty):
                self._next.append(self._lines.get_nowait())
        if not self._at_terminal:
            code = self._awaits(time_s)
            if code is not None:
                return code if code >= 0 else None
        if not self._next:
            return None
        text = self._next.pop()
        if text is None:
            wish = wishes()  # a closed terminal ends the input too
            if wish is not None and not callable(wish):
                return self._stop(wish, by_hand=wishes.by_hand)
            if terminal.runs_on:
                self._say("it would go on without an end: it is told to stop")
                return self._halt(1)
            return 0
        data = terminal.encode(text)
        if data:
            line.write(data)
            self._asked, self._spoke, self._answered = text, time_s, False
            self._stops = False
        return None

    def _stop(self, wish: Request, *, by_hand: bool) -> int | None:
        """Stop the machine; return the exit code if the dialogue ends now, None if it continues
        until the machine stands."""
        at_keyboard = self._at_terminal and by_hand
        if self._stops if at_keyboard else wish.value == "close":
            self._line.write(self._terminal.halt())
            return 0 if at_keyboard else 1
        return self._halt(None if at_keyboard else 1)

    def _halt(self, code: int | None) -> int | None:
        """Tell the machine to stop. With a `code`, the dialogue ends with this exit code once the
        machine stands. Return the exit code at once if the line has no means to stop it, else
        None."""
        stop = self._terminal.halt()
        if not stop:
            self._say("nothing stops it over its line: its switch does")
            return code or 0
        self._line.write(stop)
        suffix = "; Ctrl-C again ends" if code is None else ""
        self._say(f"the machine is told to stop{suffix}")
        self._told = self._knocked = time.monotonic()
        self._stops, self._code = True, code
        self._line.write(self._terminal.asks)
        return None

    def _stopped(self, time_s: float, told_s: float) -> bool:
        """Return True if the machine stands, or if its state cannot be known."""
        terminal = self._terminal
        silent = time_s - max(told_s, self._heard) >= CONFIRMS_S
        if terminal.stands:
            self._say("it says that it stands")
            if self._code is not None:
                self._line.write(terminal.leaves)
        elif silent or time_s - told_s >= SLOWS_S:
            self._say("it was told to stop, and does not say that it stands")
        else:
            if time_s - self._knocked >= KNOCK_S:
                self._line.write(terminal.asks or terminal.stop)
                self._knocked = time_s
            return False
        self._told = None
        return True

    def _awaits(self, time_s: float) -> int | None:
        """Return −1 while a line from a pipe has to wait, the exit code if it waits in vain, and
        None when it may go out."""
        terminal = self._terminal
        if self._next and self._next[0] is not None and terminal.is_urgent(self._next[0]):
            return None
        if terminal.failed:
            return _unanswered(self._asked, terminal.failed)
        if not terminal.ready:
            if time_s - self._opened >= min(WAKES_S, self._wait_s):
                return _unanswered("", "is it switched on, and is --baud its rate?")
            if time_s - self._knocked >= KNOCK_S:
                self._line.write(terminal.knock)
                self._knocked = time_s
            return -1
        awaits = terminal.due or (terminal.answers and not self._answered)
        silence_s = time_s - max(self._heard, self._spoke)
        if awaits and silence_s >= self._wait_s:
            return _unanswered(self._asked, f"none came within {self._wait_s:g} s (--wait)")
        quiet_s = QUIET_S if self._answered else SILENT_S
        if awaits or (silence_s < quiet_s + terminal.rests_s and not terminal.runs_on):
            return -1
        return None

    def _show(self, lines: list[str], *, wait: bool = False) -> None:
        """Print lines to stdout. A full pipe does not delay the dialogue, unless `wait` is set."""
        self._unshown += lines
        while self._shows and self._unshown and (wait or takes_more(sys.stdout)):
            try:
                show_text(self._unshown.pop(0))
            except OSError:
                self._shows = False


def _unanswered(request: str, reason: str) -> int:
    """Report that a line has no answer; return the exit code."""
    subject = f"no answer to {request!r}" if request else "the controller does not answer"
    say(f"camtool: error: {subject}: {reason}; what follows was not sent")
    return 1
