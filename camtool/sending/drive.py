"""The driver joins a conversation to its line, the clock, the journal and the user.

The conversation decides what is sent; the driver only carries bytes. The journal records bytes
before they are sent, except the bytes that stop the machine, which wait for nothing. Any failure
here, except of the port itself, stops the machine before the program ends."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, Protocol

from camtool.errors import OutputError
from camtool.target.wire import Conversation, Place, Tell, WireState, Write, port_fault

TICK_S = 0.05
"""Default interval at which requests of the user and signals are read."""

STOPPING_MESSAGE = "stopping: waiting until it stands (a second Ctrl-C does not wait)"

REOPEN_S = 60.0


class Request(Enum):
    """Requests of the user."""

    PAUSE = "pause"
    RESUME = "resume"
    STEP = "step"
    STOP = "stop"
    CLOSE = "close"  # stop at once by any means, and wait for nothing


Order = Callable[[Conversation, float], None]
"""A request with values: a function that acts on the conversation at a given time."""

Wish = Callable[[], Request | Order | None]
"""The function that returns the next request of the user, None without one."""


class LineToController(Protocol):
    """The line to a controller (`camtool.sending.line.OpenPort`)."""

    def read(self, wait_s: float) -> bytes: ...

    def write(self, data: bytes) -> None: ...

    def reopen(self, wait_s: float) -> None: ...

    def close(self) -> None: ...


class Record(Protocol):
    """Storage of the counts of a conversation (`camtool.sending.journal.Journal`)."""

    def note(self, place: Place | None = None, **counts: object) -> None: ...


def _watch_nothing(_: Conversation) -> None:
    return


def _no_wish() -> Request | Order | None:
    return None


@dataclass
class Driver:
    """Carries a conversation over a line to its end. `speed`: ratio of the conversation's clock to
    real time, for virtual machines with the same ratio."""

    line: LineToController
    journal: Record | None = None
    block_of: Callable[[int], int] = lambda block: block
    wish: Wish = _no_wish
    watch: Callable[[Conversation], None] = _watch_nothing
    tell: Callable[[str], None] = lambda text: None
    speed: float = 1.0
    place_of: Callable[[Conversation], Place | None] = lambda conversation: conversation.at_mm
    tick_s: float = TICK_S
    trouble: OutputError | None = field(default=None, init=False)
    """The error that kept the journal or the display from being written, if any."""
    _has_journal: bool = field(default=True, init=False)
    _has_display: bool = field(default=True, init=False)
    _fault: BaseException | None = field(default=None, init=False)
    """Any other exception that ended it; raised after the machine has been stopped."""

    def now(self) -> float:
        """Return the time of the conversation, s."""
        return time.monotonic() * self.speed

    def carry(self, conversation: Conversation) -> WireState:
        """Hold the conversation to its end; return the state in which it ended."""
        conversation.begin(self.now())
        is_running = True
        while is_running:
            try:
                is_running = self._act(conversation)
                if is_running:
                    self._listen(conversation)
                    self._handle_request(conversation)
            except OSError as error:
                reason, _ = port_fault(error)
                conversation.lose_port(f"the port is gone ({reason})", self.now())
            except BaseException as error:
                if self._fault is not None:
                    conversation.lose_port("camtool was ended", self.now())
                else:
                    self._fault = error
                    conversation.stop(self.now())
        self._note(conversation)
        self._show(conversation, self.watch, conversation)
        if self._fault is not None:
            raise self._fault
        return conversation.state

    def _act(self, conversation: Conversation) -> bool:
        """Perform the pending actions of the conversation; return False at its end."""
        actions = conversation.actions()
        for action in actions:
            if isinstance(action, Tell):
                continue
            if conversation.state is not WireState.STOPPING and not self._note(conversation):
                break  # bytes that are not in the journal must not be sent, except the stop
            if isinstance(action, Write):
                self.line.write(action.data)
            else:
                self._reopen(conversation)
        self._note(conversation)
        for action in actions:
            if isinstance(action, Tell):
                self._show(conversation, self.tell, action.text)
        self._show(conversation, self.watch, conversation)
        return not conversation.is_over or conversation.has_actions

    def _reopen(self, conversation: Conversation) -> None:
        """Reopen the port as soon as it exists again, unless the user stops the machine
        meanwhile."""
        end = time.monotonic() + REOPEN_S
        while not conversation.is_over:
            try:
                self.line.reopen(0.0)
            except (OSError, ValueError):
                if time.monotonic() >= end:
                    raise
                self._handle_request(conversation)
            else:
                return

    def _show(self, conversation: Conversation, show: Callable[[Any], None], value: Any) -> None:
        """Show a value to the user. If that fails, the machine is stopped, since nobody watches
        it."""
        if not self._has_display:
            return
        try:
            show(value)
        except BaseException as error:
            self._has_display = False
            if isinstance(error, OSError):
                self.trouble = OutputError(f"its output is gone ({error.strerror or error})")
            else:
                self._fault = error
            conversation.stop(self.now())

    def _listen(self, conversation: Conversation) -> None:
        if conversation.is_over or conversation.has_actions:
            return
        wait_s = min((conversation.next_s - self.now()) / self.speed, self.tick_s)
        data = self.line.read(max(wait_s, 0.0))
        time_s = self.now()
        if data:
            conversation.receive(data, time_s)
        if time_s >= conversation.next_s:
            conversation.tick(time_s)

    def _handle_request(self, conversation: Conversation) -> None:
        wish, time_s = self.wish(), self.now()
        if wish is None:
            return
        if not isinstance(wish, Request):
            wish(conversation, time_s)
        elif wish is Request.PAUSE:
            conversation.pause(time_s)
        elif wish is Request.RESUME:
            conversation.single = False
            conversation.resume(time_s)
        elif wish is Request.STEP:
            conversation.single = True
            conversation.resume(time_s)
        elif wish is Request.STOP:
            conversation.stop(time_s)
            if conversation.state is WireState.STOPPING:
                self._act(conversation)
                self._show(conversation, self.tell, STOPPING_MESSAGE)
        elif wish is Request.CLOSE:
            conversation.hurry(time_s)
            for action in conversation.actions():
                if isinstance(action, Write):
                    self.line.write(action.data)
            self.line.close()
            conversation.lose_port(
                "camtool was ended before the machine said that it stands", time_s
            )

    def _note(self, conversation: Conversation) -> bool:
        """Write the counts of the conversation to the journal; if that fails, stop the machine."""
        if self.journal is None or not self._has_journal:
            return True
        try:
            counts = counts_of(conversation, self.block_of)
            self.journal.note(place=self.place_of(conversation), **counts)
        except OutputError as error:
            self.trouble, self._has_journal = error, False
            conversation.stop(self.now())
            return False
        return True


def counts_of(conversation: Conversation, block_of: Callable[[int], int]) -> dict[str, int]:
    """Return the progress of a conversation: packets sent, acknowledged and done, and the last
    blocks of the program that are done and that were sent."""
    block, packets_sent = conversation.block, conversation.packets[: conversation.sent]
    last = max((packet.block for packet in packets_sent[-1:]), default=-1)
    return {
        "sent": conversation.sent,
        "acknowledged": conversation.acknowledged,
        "done": conversation.done,
        "block": block_of(block) if block >= 0 else -1,
        "last": block_of(last) if last >= 0 else -1,
    }
