"""`camtool console`: a person who types to a controller, with its answers explained."""

from __future__ import annotations

import queue
import signal
import sys
import threading
import time
from types import FrameType

import click

from camtool.cli.home import BAUD
from camtool.cli.messages import say, show_text
from camtool.cli.options import MachineFlags, talk_options

TICK_S = 0.05
"""How long is listened before what is typed is looked at, s."""

QUIET_S = 0.3
"""An answer is over when nothing has come for so long, s."""

SILENT_S = 1.5
"""A line to which nothing is answered for so long has no answer, s."""

KNOCK_S = 0.5
"""How often a controller that may be starting is asked whether it is there, s."""

WAKES_S = 10.0
"""A boot loader takes no longer, s."""


@click.command(short_help="Type to a controller.")
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

    Ctrl-C stops the machine where its protocol can, and ends it where not; Ctrl-D ends it. Lines
    from a pipe go out one by one, the first when the controller has started, each other when the
    one before has been answered. Exit code 1 where an answer that is due does not come.

    \b
    camtool console grbl /dev/ttyUSB0
    echo '$$' | camtool console grbl /dev/ttyUSB0
    camtool console linuxcnc socket://localhost:5007
    """
    from camtool.sending.line import opened_line
    from camtool.sending.prepare import port_of, wire_of

    loaded = MachineFlags.of(target if machine is None else None, machine, settings).load()
    wire = wire_of(loaded)
    terminal = wire.terminal(loaded.machine)
    lines: queue.Queue[str | None] = queue.Queue()
    interrupts: list[int] = []
    at_terminal = sys.stdin.isatty()

    def read() -> None:
        for line in sys.stdin:
            lines.put(line.rstrip("\r\n"))
        lines.put(None)

    def interrupted(number: int, frame: FrameType | None) -> None:
        interrupts.append(number)

    with opened_line(port_of(port, baud, wire, loaded)) as line:
        if at_terminal:
            say(f"camtool: {terminal.about}; Ctrl-D ends", quiet=quiet)
        before = signal.signal(signal.SIGINT, interrupted)
        threading.Thread(target=read, daemon=True).start()
        heard = spoke = opened = time.monotonic()
        knocked, asked, answered, ends = 0.0, "", True, False
        if terminal.hello:
            line.write(terminal.hello)
            answered = False
        try:
            while True:
                data = line.read(TICK_S)
                now = time.monotonic()
                if data:
                    heard, answered = now, True
                    _show(terminal.heard(data))
                elif now - heard > QUIET_S:
                    _show(terminal.left())
                if interrupts:
                    stopped = interrupts.pop() and terminal.stop and not ends
                    if not stopped:
                        return 0
                    line.write(terminal.stop)
                    say("camtool: the machine is told to stop; Ctrl-C again ends", quiet=quiet)
                    ends, spoke = True, now
                if not at_terminal:
                    awaits = terminal.due or (terminal.answers and not answered)
                    if terminal.failed:
                        return _unanswered(asked, terminal.failed)
                    if not terminal.ready:
                        if now - opened >= min(WAKES_S, wait_s):
                            return _unanswered("", "is it switched on, and is --baud its rate?")
                        if now - knocked >= KNOCK_S:
                            line.write(terminal.knock)
                            knocked = now
                        continue
                    if awaits and now - spoke >= wait_s:
                        return _unanswered(asked, f"none came within {wait_s:g} s (--wait)")
                    if awaits or now - max(heard, spoke) < (QUIET_S if answered else SILENT_S):
                        continue
                try:
                    text = lines.get_nowait()
                except queue.Empty:
                    continue
                if text is None:
                    return 0
                data = terminal.typed(text)
                if data:
                    line.write(data)
                    asked, spoke, answered, ends = text, now, False, False
        finally:
            signal.signal(signal.SIGINT, before)


def _unanswered(asked: str, why: str) -> int:
    """Say that a line has no answer; the exit code."""
    what = f"no answer to {asked!r}" if asked else "the controller does not answer"
    say(f"camtool: error: {what}: {why}; what follows was not sent", quiet=False)
    return 1


def _show(lines: list[str]) -> None:
    for each in lines:
        show_text(each)
