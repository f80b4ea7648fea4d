"""A conversation joined to its line, the clock, the journal and the user.

All that decides what is sent is in the conversation; here bytes are carried, and nothing is
thought. Before bytes go out the journal says so; only what stops the machine waits for nothing.
Whatever fails here but the port itself stops the machine before it ends the program.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Protocol

from camtool.errors import OutputError
from camtool.target.wire import Conversation, Place, Tell, WireState, Write, port_fault

TICK_S = 0.05
"""The user's wishes and the signals are looked at so often."""

TOLD = "stopping: waiting until it stands (a second Ctrl-C does not wait)"

REOPEN_S = 60.0
"""A port that is to come back is waited for so long."""


class Wish(Enum):
    """What the user wants."""

    PAUSE = "pause"
    RESUME = "resume"
    STEP = "step"
    STOP = "stop"
    CLOSE = "close"  # stop as hard as can be, and wait for nothing


class Line(Protocol):
    """What bytes go through (`camtool.sending.line.Line`)."""

    def read(self, wait_s: float) -> bytes: ...

    def write(self, data: bytes) -> None: ...

    def reopen(self, wait_s: float) -> None: ...

    def close(self) -> None: ...


class Record(Protocol):
    """Where counts are kept (`camtool.sending.journal.Journal`)."""

    def note(self, place: Place | None = None, **counts: object) -> None: ...


def _nothing(_: Conversation) -> None:
    return


def _no_wish() -> Wish | None:
    return None


@dataclass
class Driver:
    """Carries a conversation to its end. `speed`: the clock runs so many times as fast as that on
    the wall, for virtual machines that do the same."""

    line: Line
    journal: Record | None = None
    block_of: Callable[[int], int] = lambda block: block
    wish: Callable[[], Wish | None] = _no_wish
    watch: Callable[[Conversation], None] = _nothing
    tell: Callable[[str], None] = lambda text: None
    speed: float = 1.0
    place_of: Callable[[Conversation], Place | None] = lambda conversation: conversation.at_mm
    trouble: OutputError | None = field(default=None, init=False)
    """Why the journal or what the user is shown could not be written, if it could not."""
    _notes: bool = field(default=True, init=False)
    _shows: bool = field(default=True, init=False)
    _fault: BaseException | None = field(default=None, init=False)
    """What else ended it: raised when the machine has been stopped."""

    def now(self) -> float:
        """The time of the conversation, s."""
        return time.monotonic() * self.speed

    def carry(self, conversation: Conversation) -> WireState:
        """Hold the conversation; how it ended."""
        conversation.begin(self.now())
        going = True
        while going:
            try:
                going = self._act(conversation)
                if going:
                    self._hear(conversation)
                    self._obey(conversation)
            except OSError as error:
                why, _ = port_fault(error)
                conversation.lost(f"the port is gone ({why})", self.now())
            except BaseException as error:
                if self._fault is not None:
                    conversation.lost("camtool was ended", self.now())
                else:
                    self._fault = error
                    conversation.stop(self.now())
        self._note(conversation)
        self._shown(conversation, self.watch, conversation)
        if self._fault is not None:
            raise self._fault
        return conversation.state

    def _act(self, conversation: Conversation) -> bool:
        """Do what the conversation wants; False at its end."""
        actions = conversation.actions()
        for action in actions:
            if isinstance(action, Tell):
                continue
            if conversation.state is not WireState.STOPPING and not self._note(conversation):
                break  # what is not noted must not be sent; the stop is
            if isinstance(action, Write):
                self.line.write(action.data)
            else:
                self._reopen(conversation)
        self._note(conversation)
        for action in actions:
            if isinstance(action, Tell):
                self._shown(conversation, self.tell, action.text)
        self._shown(conversation, self.watch, conversation)
        return not conversation.ended or conversation.has_actions

    def _reopen(self, conversation: Conversation) -> None:
        """Open the port again as soon as it is there, unless the user stops meanwhile."""
        end = time.monotonic() + REOPEN_S
        while not conversation.ended:
            try:
                self.line.reopen(0.0)
            except (OSError, ValueError):
                if time.monotonic() >= end:
                    raise
                self._obey(conversation)
            else:
                return

    def _shown(self, conversation: Conversation, show: Callable[[Any], None], what: Any) -> None:
        """Show it to the user. Where that fails, nobody watches the machine any more."""
        if not self._shows:
            return
        try:
            show(what)
        except BaseException as error:
            self._shows = False
            if isinstance(error, OSError):
                self.trouble = OutputError(f"its output is gone ({error.strerror or error})")
            else:
                self._fault = error
            conversation.stop(self.now())

    def _hear(self, conversation: Conversation) -> None:
        if conversation.ended or conversation.has_actions:
            return
        wait_s = min((conversation.next_s - self.now()) / self.speed, TICK_S)
        data = self.line.read(max(wait_s, 0.0))
        now = self.now()
        if data:
            conversation.received(data, now)
        if now >= conversation.next_s:
            conversation.elapsed(now)

    def _obey(self, conversation: Conversation) -> None:
        wish, now = self.wish(), self.now()
        if wish is Wish.PAUSE:
            conversation.pause(now)
        elif wish is Wish.RESUME:
            conversation.single = False
            conversation.resume(now)
        elif wish is Wish.STEP:
            conversation.single = True
            conversation.resume(now)
        elif wish is Wish.STOP:
            conversation.stop(now)
            if conversation.state is WireState.STOPPING:
                self._act(conversation)
                self._shown(conversation, self.tell, TOLD)
        elif wish is Wish.CLOSE:
            conversation.hurry(now)
            for action in conversation.actions():
                if isinstance(action, Write):
                    self.line.write(action.data)
            self.line.close()
            conversation.lost("camtool was ended before the machine said that it stands", now)

    def _note(self, conversation: Conversation) -> bool:
        """Say in the journal how the conversation stands; when that fails, it is stopped."""
        if self.journal is None or not self._notes:
            return True
        try:
            counts = counts_of(conversation, self.block_of)
            self.journal.note(place=self.place_of(conversation), **counts)
        except OutputError as error:
            self.trouble, self._notes = error, False
            conversation.stop(self.now())
            return False
        return True


def counts_of(conversation: Conversation, block_of: Callable[[int], int]) -> dict[str, int]:
    """How far a conversation has come: packets, and the last blocks of the program that are done
    and that were sent."""
    block, sent = conversation.block, conversation.packets[: conversation.sent]
    last = max((packet.block for packet in sent[-1:]), default=-1)
    return {
        "sent": conversation.sent,
        "acknowledged": conversation.acknowledged,
        "done": conversation.done,
        "block": block_of(block) if block >= 0 else -1,
        "last": block_of(last) if last >= 0 else -1,
    }
