"""A prepared program on its way to its machine: its conversation, its journal and its outcome.

`camtool send` and the panel both send programs by these functions, so that a program which one of
them has begun can be continued by the other."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgspec import Struct

from camtool.errors import OutputError
from camtool.records import replace
from camtool.sending.drive import Driver, LineToController, Wish, counts_of
from camtool.sending.journal import Journal
from camtool.sending.line import Port, manner_of
from camtool.sending.prepare import Consignment
from camtool.target.wire import LATE_S, Conversation, WireState

if TYPE_CHECKING:
    from camtool.target.registry import LoadedTarget


class SendOptions(Struct, frozen=True):
    """Options of sending. `single`: wait after every block; `home`, `unlock`: do this first;
    `speed`: ratio of the machine's clock to real time; `journal`: its file, to which `more`
    appends; `file`: path of the program, for controllers that open it themselves."""

    journal: Path
    single: bool = False
    home: bool = False
    unlock: bool = False
    speed: float = 1.0
    more: bool = False
    file: str = ""


class SentProgram(Struct, frozen=True, eq=False):
    """Outcome of sending a program: its conversation, and the error that kept the journal or the
    display from being written, if any."""

    one: Consignment
    conversation: Conversation
    trouble: OutputError | None

    @property
    def is_finished(self) -> bool:
        """True if the whole program is done and recorded."""
        return self.conversation.state is WireState.FINISHED and self.trouble is None

    @property
    def words(self) -> str:
        """Why it ended, and which block is the last that is done."""
        ends = self.conversation.why or self.conversation.state.value
        why = f"{self.trouble}; {ends}" if self.trouble else ends
        last_block = self.conversation.block
        block = max(self.one.block_of(last_block) if last_block >= 0 else -1, self.one.first - 1)
        last = f"block {block + 1} is the last that is done" if block >= 0 else "no block is done"
        return f"{why}; {last}"


def program_conversation(
    one: Consignment, target: LoadedTarget, port: Port, options: SendOptions
) -> Conversation:
    """Return the conversation that sends a program. The user must already have been asked for what
    its first packet needs."""
    manner = manner_of(
        target,
        single=options.single,
        home=options.home,
        unlock=options.unlock,
        late_s=LATE_S * options.speed,
        paced=not port.is_virtual,
        file=options.file,
        standing=one.standing if one.wire.place == "told" else None,
        at_mm=one.begin_mm,
        reach_mm=one.reach_mm,
    )
    packets = [replace(packet, ask="") for packet in one.packets[:1]] + [*one.packets[1:]]
    return one.wire.conversation(packets, target.machine, manner)


def carry_program(
    one: Consignment,
    target: LoadedTarget,
    port: Port,
    line: LineToController,
    options: SendOptions,
    *,
    conversation: Conversation,
    wish: Wish,
    watch: Callable[[Conversation], None],
    tell: Callable[[str], None],
) -> SentProgram:
    """Send a program to its end, write its journal, and return the outcome."""
    head: dict[str, Any] = {
        "program": one.run.source,
        "sha256": one.sha256,
        "target": target.machine.target.name,
        "machine": target.machine.digest,
        "port": port.name,
        "first": one.first,
        "packets": len(one.packets),
    }
    journal = Journal(options.journal, head, appends=options.more)
    driver = Driver(line, journal, one.block_of, wish, watch, tell, options.speed, one.place_of)
    try:
        driver.carry(conversation)
    finally:
        counts = counts_of(conversation, one.block_of)
        with suppress(OSError):
            journal.close(
                conversation.state.value,
                conversation.why,
                is_still=conversation.is_still,
                place=one.place_of(conversation),
                **counts,
            )
    return SentProgram(one, conversation, driver.trouble)
