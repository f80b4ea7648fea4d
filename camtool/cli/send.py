"""`camtool send`: a program to its machine, by the machine's own protocol."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from camtool.cli.files import display_name, read_bytes, refuse_same, write_all
from camtool.cli.home import UNLOCK
from camtool.cli.life_signs import progress, signs_of_command
from camtool.cli.messages import say, say_findings, show_facts, show_text
from camtool.cli.options import MachineFlags, SectionedCommand, machine_options, talk_options
from camtool.cli.wishes import (
    AtStop,
    Messages,
    UserRequests,
    keys_of_terminal,
    override_orders,
    takes_more,
)
from camtool.errors import InputError, OptionError, OutputError
from camtool.plain import one_line
from camtool.sending.drive import Order, Request
from camtool.sending.journal import digest, read_journal
from camtool.sending.line import opened_line, port_of, wire_of
from camtool.units import clock

if TYPE_CHECKING:
    from camtool.cli.wishes import AtStop
    from camtool.sending.journal import JournalState
    from camtool.sending.line import Port
    from camtool.sending.live import LivePage
    from camtool.sending.prepare import Consignment
    from camtool.target.registry import LoadedTarget
    from camtool.target.wire import Conversation, ToolAt

MAX_NAMED = 5

NAME_WIDTH = 11
"""Width, in columns, of the names in a dry run."""


@click.command(cls=SectionedCommand, short_help="Send a program to its machine.")
@click.argument("program", metavar="PROGRAM")
@machine_options
@click.option("--port", metavar="PORT", help="Such as /dev/ttyUSB0, COM3, socket://host:5007.")
@click.option("--baud", type=click.IntRange(min=1), help="Rate of the port, where not its own.")
@click.option("--yes", is_flag=True, help="Begin without asking.")
@click.option("--from", "first", type=click.IntRange(min=1), metavar="BLOCK", help="Begin there.")
@click.option("--resume", is_flag=True, help="Go on behind what the journal says is done.")
@click.option(
    "--tool-at",
    type=click.Choice(["journal", "zero", "known"]),
    callback=lambda context, option, value: value or "",
    help="With --resume: where it was left, at part zero, or as the controller says.",
)
@click.option("--single", is_flag=True, help="Wait after every block.")
@click.option(
    "--at-stop",
    metavar="wait|fail|COMMAND",
    help="At M0 without a terminal: stop the machine, or run a command and go on if it ends well.",
)
@click.option("--home", is_flag=True, help="Home the machine first.")
@UNLOCK
@click.option("--journal", metavar="FILE", help="Where it says how far it is  [PROGRAM.journal]")
@click.option("--live", metavar="FILE", help="A page for a browser that shows how far it is.")
@click.option("--json", "as_json", is_flag=True, help="Progress on stdout, as JSON lines.")
@click.option(
    "--speed",
    type=click.FloatRange(min=0.001, max=1e6),
    default=1.0,
    help="For a virtual machine whose clock runs so many times as fast.",
)
@talk_options
def send(
    program: str,
    machine: MachineFlags,
    port: str | None,
    baud: int | None,
    yes: bool,
    first: int | None,
    resume: bool,
    tool_at: ToolAt,
    single: bool,
    at_stop: str | None,
    home: bool,
    unlock: bool,
    journal: str | None,
    live: str | None,
    as_json: bool,
    speed: float,
    quiet: bool,
    verbose: bool,
) -> int:
    """Send PROGRAM to its machine, and watch over it.

    First the program is verified, and what will be done is said; nothing goes out before --yes or
    an answer. Without --port that is all. Ctrl-C stops the machine as its protocol can, and so
    does all else that would end camtool; a second one does not wait until it stands. On a
    terminal: p pauses, r goes on, s does a single block, q stops; + and - change the feed, ] and [
    the spindle by 10 %, = brings back 100 %. Exit code 1 when the program was not finished."""
    from camtool.sending.prepare import consignment, lines_of, tool_at_of

    if first is not None and resume:
        raise click.UsageError("--from and --resume are two beginnings; give one of them")
    target, data = machine.load(), read_bytes(program)
    place = Path(journal or f"{program}.journal")
    refuse_same([program, *machine.files()], [str(place), live])
    state = _read_state(place, data, target) if resume else _find_unfinished(place, data)
    begin = state.block if state and resume else (first or 1) - 1
    if first is None and not resume:
        if tool_at:
            raise click.UsageError("--tool-at is for a program that goes on: give --resume")
        if state is not None and state.last >= 0 and not quiet:
            say(
                f"camtool: {place} is of this program, of which {state.block} blocks are done: "
                "--resume would go on there, and this begins anew"
            )
        state = None
    elif state is not None:
        name = target.machine.target.name
        tool_at = _confirmed_place(*tool_at_of(wire_of(target), state, tool_at, name))
    elif tool_at:
        raise OptionError(
            "no journal says where this program was left",
            where=f"--tool-at {tool_at}",
            mend="leave it out; the tool must stand at part zero",
        )
    one = consignment(
        data,
        target,
        source=display_name(program),
        first=begin,
        state=state,
        tool_at=tool_at,
        progress=progress(),
    )
    say_findings(one.run.findings, quiet=quiet, verbose=verbose)
    if one.run.failed:
        say(f"camtool: error: {one.run.source}: the errors above would spoil the part")
        return 1
    if not quiet:
        rows = lines_of(one, target)
        facts = "\n".join(f"{name:<{NAME_WIDTH}}{one_line(words)}" for name, words in rows)
        show_facts(facts, NAME_WIDTH, {}, err=as_json)
    if port is None:
        return 0
    if not sys.stdin.isatty():
        _refuse_waiting(one, single=single, at_stop=at_stop)
    line = port_of(port, baud, one.wire, target)
    if speed != 1.0 and not line.is_virtual:
        raise OptionError("a real machine has only its own speed", where="--speed")
    if not yes and not _confirm():
        return 1

    answer = None if at_stop in (None, "wait") else AtStop(at_stop or "")
    job = _Sending(program, one, target, line, place, live, resume, as_json, quiet, answer)
    return job.run(single=single, home=home, unlock=unlock, speed=speed, yes=yes)


def _find_unfinished(place: Path, data: bytes) -> JournalState | None:
    """Return the state of this program in its journal; None if there is no journal or the program
    was finished."""
    with suppress(InputError):
        state = read_journal(place)
        if state.sha256 == digest(data) and not state.finished:
            return state
    return None


def _confirmed_place(tool_at: ToolAt, question: str) -> ToolAt:
    """Return where the tool is after the user has agreed to `question` ("": nothing is asked);
    OptionError if the user does not."""
    if not question:
        return tool_at
    if sys.stdin.isatty():
        with signs_of_command().hidden():
            agreed = click.confirm(
                f"{question[0].upper()}{question[1:]}?", err=True, default=False
            )
        if agreed:
            return tool_at
    mend = "bring the tool there, and give --tool-at zero"
    if tool_at == "journal":
        mend = (
            "give --tool-at journal if it has stayed there; else bring it to part zero, and give "
            "--tool-at zero"
        )
    raise OptionError(question.partition(": ")[0], where="--resume", mend=mend)


def _read_state(place: Path, data: bytes, target: LoadedTarget) -> JournalState:
    """Read from a journal how far sending this program has come.

    Raises InputError for the journal of another program or another machine file, and OptionError
    if the program was finished."""
    state = read_journal(place)
    if state.sha256 != digest(data):
        raise InputError(
            "is the journal of another program, or this one was changed since",
            file=str(place),
            mend="give the journal of this program with --journal, or begin with --from",
        )
    if state.machine != target.machine.digest:
        raise InputError(
            "the machine file has changed since", file=str(place), mend="begin with --from"
        )
    if state.finished:
        raise OptionError("the program was finished", where="--resume", mend="leave it out")
    return state


def _refuse_waiting(one: Consignment, *, single: bool, at_stop: str | None) -> None:
    """Raise a usage error for a program that waits for an operator if there is no terminal at
    which to answer. With `at_stop`, a command answers its stops."""
    asks = sum(bool(packet.ask) and not packet.waits for packet in one.packets[1:])
    if asks:
        raise click.UsageError(f"it waits for an answer {asks} times: run it at a terminal")
    if single:
        raise click.UsageError("--single waits behind every block: run it at a terminal")
    stops = [packet for packet in one.packets if packet.waits]
    if stops and at_stop is None:
        named = ", ".join(
            f"block {one.block_of(packet.block) + 1} ({packet.data.strip().decode('latin-1')})"
            for packet in stops[:MAX_NAMED]
        )
        suffix = f" and {len(stops) - MAX_NAMED} more" if len(stops) > MAX_NAMED else ""
        raise click.UsageError(
            f"the program stops until somebody lets it go on, in {named}{suffix}: run it at a "
            "terminal, give --at-stop, or take the stops out"
        )


def _confirm() -> bool:
    """Ask the user at a terminal; return True for yes."""
    if not sys.stdin.isatty():
        raise click.UsageError("nobody can be asked here: give --yes")
    with signs_of_command().hidden():
        agreed = click.confirm("Begin?", err=True, default=False)
    if agreed:
        return True
    say("camtool: nothing was sent")
    return False


@dataclass
class _Sending:
    """The sending of one program, with the requests of the user and the display."""

    program: str
    one: Consignment
    target: LoadedTarget
    port: Port
    place: Path
    live: str | None
    more: bool
    as_json: bool
    quiet: bool
    answer: AtStop | None
    _tell: Callable[[str], None] = field(default=lambda text: None, init=False)
    _shown: dict[str, Any] = field(default_factory=dict, init=False)
    _left: list[float] = field(default_factory=list, init=False)
    _page: LivePage | None = field(default=None, init=False)
    _paged: tuple[float, str] = field(default=(0.0, ""), init=False)

    def run(self, *, single: bool, home: bool, unlock: bool, speed: float, yes: bool) -> int:
        """Send the program; return the exit code."""
        from camtool.sending.carry import SendOptions, carry_program, program_conversation
        from camtool.sending.live import LivePage

        one = self.one
        self._left = one.times_left_s()
        if self.live is not None:
            listing = one.run.listing if one.rest is None else None
            decoded = one.forecast.decoded
            self._page = LivePage(Path(self.live), one.run.source, decoded, listing)
            try:
                self._page.write(self._page.html("opening", {}, -1))
            except OSError as error:
                raise OutputError(
                    f"cannot be written ({error.strerror})", file=self.live
                ) from error
        progress().begin("sending", len(one.packets))
        options = SendOptions(
            self.place,
            single=single,
            home=home,
            unlock=unlock,
            speed=speed,
            more=self.more,
            file=self._program_file(),
        )
        conversation = program_conversation(one, self.target, self.port, options)
        keys: dict[str, Request | Order] = {
            "p": Request.PAUSE,
            " ": Request.PAUSE,
            "r": Request.RESUME,
            "\n": Request.RESUME,
        }
        keys |= {"s": Request.STEP, "q": Request.STOP}
        keys |= override_orders()
        with opened_line(self.port) as line, keys_of_terminal() as key:
            wishes = UserRequests(key, keys)
            self._tell = tell = Messages(quiet=self.quiet)
            with wishes.catch_signals():
                sent = carry_program(
                    one,
                    self.target,
                    self.port,
                    line,
                    options,
                    conversation=conversation,
                    wish=lambda: wishes() or (self.answer and self.answer()) or None,
                    watch=self._watch,
                    tell=tell,
                )
        tell.rest()
        if self.answer is not None:
            self.answer.end()
        if sent.is_finished:
            say(f"camtool: finished: {len(one.packets)} packets", quiet=self.quiet)
            return 0
        trouble = f"{self.answer.trouble}; " if self.answer and self.answer.trouble else ""
        say(f"camtool: error: {one.run.source}: {trouble}{sent.words}; --resume goes on")
        return 1

    def _program_file(self) -> str:
        """Return the path of the file that is sent, for a controller that opens a file itself."""
        one = self.one
        if not one.wire.opens_file:
            return ""
        if self.program == "-":
            raise click.UsageError("the controller opens a file: save the program in one")
        file = Path(self.program)
        copy = file.with_name(f"{file.stem}.sent{file.suffix}").resolve()
        write_all({str(copy): one.data})
        say(f"camtool: it opens {display_name(str(copy))}", quiet=self.quiet)
        return str(copy)

    def _watch(self, conversation: Conversation) -> None:
        """Show the state of the conversation each time it has changed."""
        block = (
            self.one.block_of(self.one.packets[conversation.acknowledged - 1].block)
            if (conversation.acknowledged)
            else -1
        )
        remaining_s = self._left[conversation.acknowledged]
        facts = {
            "state": conversation.state.value,
            "packet": conversation.acknowledged,
            "packets": len(self.one.packets),
            "block": block + 1,
            "place_mm": conversation.place_mm,
            "left_s": round(remaining_s, 1),
            "why": conversation.why,
        }
        self._show_page(conversation, remaining_s)
        if facts == self._shown or (self.as_json and not takes_more(sys.stdout)):
            return
        before, self._shown = self._shown, facts
        if self.as_json:
            show_text(json.dumps(facts))
        place = conversation.place_mm
        place_text = "" if place is None else " X{:.3f} Y{:.3f} Z{:.3f}".format(*place)
        signs = progress()
        signs.stage = (
            f"{conversation.state.value}, block {block + 1}{place_text}, {clock(remaining_s)} left"
        )
        signs.done = conversation.acknowledged
        if conversation.state.value == "waiting" and before.get("state") != "waiting":
            answers = self.answer is not None and conversation.is_program_stop
            self._tell(f"waiting: {conversation.why}{'' if answers else ' (r goes on)'}")
            if self.answer is not None and answers:
                self.answer.begin(conversation.why)

    def _show_page(self, conversation: Conversation, left_s: float) -> None:
        """Update the live page, once a second and when the state changes. A page that cannot be
        written is given up: the machine is not stopped for it."""
        state, time_s = conversation.state.value, time.monotonic()
        if self._page is None:
            return
        if time_s - self._paged[0] < self._page.every_s and state == self._paged[1]:
            return
        self._paged = time_s, state
        done_packets = self.one.packets[: conversation.acknowledged]
        block = done_packets[-1].block if done_packets else -1
        place = conversation.place_mm
        facts = {
            "block": f"{self.one.block_of(block) + 1} of {self.one.blocks}",
            "time left": clock(left_s),
            "place": "" if place is None else "X{:.3f} Y{:.3f} Z{:.3f}".format(*place),
        }
        total_s = self._left[0]
        share = 1.0 - left_s / total_s if total_s else float(state == "finished")
        try:
            reason = conversation.why
            page = self._page.html(state, facts, block, place, share=share, reason=reason)
            self._page.write(page)
        except OSError as error:
            self._tell(f"{self.live} cannot be written ({error.strerror})")
            self._page = None
