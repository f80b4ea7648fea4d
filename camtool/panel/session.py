"""A machine at a port, from opening to closing: one conversation after another, in one thread.

Between programs the machine is moved by hand (`camtool.target.wire.Hand`). A program that is
loaded is sent by the same functions as those of `camtool send`, with the same journal. Requests
come from other threads, and are carried out at the next turn of the driver, within `TICK_S`.
"""

from __future__ import annotations

import queue
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final

from msgspec import Struct

from camtool.errors import CamtoolError, MachineError
from camtool.sending.carry import SendOptions, carry_program, program_conversation
from camtool.sending.drive import Driver, LineToController, Order, Request
from camtool.sending.line import Port
from camtool.sending.prepare import Consignment, manner_of, wire_of
from camtool.target.wire import (
    LATE_S,
    Conversation,
    Hand,
    HandAction,
    Override,
    Place,
    WireState,
)

if TYPE_CHECKING:
    from camtool.target.registry import LoadedTarget

TICK_S: Final = 0.02
"""Interval at which requests are carried out, s."""

HELD_S: Final = 0.08
"""A held key that nobody confirms for so long counts as let go, s. With `TICK_S` and the line, a
jog ends within 0.1 s of a page that is gone."""

MAX_MESSAGES: Final = 200
"""Messages that are kept for pages that come later."""


class Message(Struct, frozen=True):
    """A sentence for the user with its number, counted from 1; `bad` if something went wrong."""

    number: int
    text: str
    bad: bool = False


class MachineState(Struct, frozen=True):
    """State of the machine, as far as it is known.

    `state`: "closed" without a line, otherwise the state of the conversation; `why`: what it waits
    for, or why it has ended; `says`: the state in the controller's word; `place_mm`: as it reports
    it, in the work frame; `overrides` in %. Of a program: `sent`, `acknowledged`, `done` packets,
    the `block` that was acknowledged last (from 1; 0 for none), and the time `left_s`.
    """

    state: str = "closed"
    why: str = ""
    says: str = ""
    runs: bool = False
    place_mm: Place | None = None
    overrides: Mapping[Override, int] = {}
    sent: int = 0
    acknowledged: int = 0
    done: int = 0
    block: int = 0
    left_s: float = 0.0


class Session:
    """A machine at its port. `open_line` opens and locks the port for the length of a `with`;
    `watch`, which may be set later, is called in the session's thread when the state has changed
    or a message has come."""

    def __init__(
        self,
        target: LoadedTarget,
        port: Port,
        open_line: Callable[[Port], Any],
        *,
        speed: float = 1.0,
        watch: Callable[[], None] = lambda: None,
    ) -> None:
        self.target, self.port, self.speed = target, port, speed
        self.wire = wire_of(target)
        self.state = MachineState()
        self.messages: deque[Message] = deque(maxlen=MAX_MESSAGES)
        self._open_line, self.watch = open_line, watch
        self._requests: queue.SimpleQueue[Request | Order] = queue.SimpleQueue()
        self._next: tuple[Consignment, SendOptions] | None = None
        self._held_until: float | None = None
        self._closing = threading.Event()
        self._opens = threading.Event()
        self._left_s: list[float] = []
        self._running: Consignment | None = None
        self._count = 0
        self._at_mm: Place | None = None
        """Where the machine stands between conversations, as far as that is known."""
        self._thread: threading.Thread | None = None

    # Requests, from any thread.

    def start(self) -> None:
        """Open the line, in a thread of its own."""
        self._opens.set()
        self._thread = threading.Thread(target=self._run, name="session", daemon=True)
        self._thread.start()

    def close(self, wait_s: float = 30.0) -> None:
        """Stop the machine if it moves, and close the line."""
        self._closing.set()
        self._opens.set()
        if self._thread is not None:
            self._thread.join(wait_s)

    def reopen(self) -> None:
        """Open the line again after it was lost, or the machine was not found."""
        self._opens.set()

    def stop(self) -> None:
        """Stop the machine. What is waiting to be done is forgotten."""
        with suppress(queue.Empty):
            while True:
                self._requests.get_nowait()
        self._held_until = self._next = None
        self._requests.put(Request.STOP)

    def request(self, request: Request) -> None:
        """Pause, go on, or do a single block, of a program that runs."""
        self._requests.put(request)

    def order(self, action: HandAction, values: Mapping[str, float]) -> None:
        """Home, zero, jog or unlock."""
        self._by_hand(lambda hand, now: hand.order(action, values, now))

    def say(self, line: str) -> None:
        """Type a line to the controller."""
        self.tell(f"> {line}")
        self._by_hand(lambda hand, now: hand.say(line, now))

    def hold(self, values: Mapping[str, float]) -> None:
        """Move until `release`, or until `keep` has not been called for `HELD_S`."""
        self._held_until = time.monotonic() + HELD_S

        def begin(hand: Hand, now: float) -> None:
            if self._held_until is not None:  # else it has been let go already
                hand.hold(values, now)

        self._by_hand(begin)

    def keep(self) -> None:
        """Confirm that the key is still held."""
        if self._held_until is not None:
            self._held_until = time.monotonic() + HELD_S

    def release(self) -> None:
        """End a held jog."""
        self._held_until = None
        self._by_hand(lambda hand, now: hand.release(now))

    def override(self, name: Override, percent: int) -> None:
        """Change an override, by hand or in a program."""
        self._requests.put(lambda talk, now: talk.override(name, percent, now))

    def run_program(self, one: Consignment, options: SendOptions) -> None:
        """Send a program; MachineError if the machine is not ready."""
        if self.state.state != WireState.READY.value:
            raise MachineError(
                f"the machine is not ready ({self.state.state})",
                mend="wait until it stands, or connect it",
            )
        self._next = one, options
        self._by_hand(lambda hand, now: hand.close(now))

    def tell(self, text: str, *, bad: bool = False) -> None:
        """Add a message."""
        self._count += 1
        self.messages.append(Message(self._count, text, bad))
        self.watch()

    def _by_hand(self, act: Callable[[Hand, float], None]) -> None:
        def order(talk: Conversation, now: float) -> None:
            if not isinstance(talk, Hand):
                self.tell("a program is running: stop it first", bad=True)
                return
            try:
                act(talk, now)
            except CamtoolError as error:
                self._held_until = None
                self.tell(str(error), bad=True)

        self._requests.put(order)

    # The thread.

    def _run(self) -> None:
        while not self._closing.is_set():
            self._opens.wait()
            self._opens.clear()
            if self._closing.is_set():
                return
            try:
                with self._open_line(self.port) as line:
                    self._converse(line)
            except CamtoolError as error:
                self.tell(str(error), bad=True)
            self._set(MachineState(why=self.state.why))

    def _converse(self, line: LineToController) -> None:
        """Hold conversations until the line is to be closed or nobody can speak to the machine."""
        while not self._closing.is_set():
            following, self._next = self._next, None
            if following is not None:
                self._send(line, *following)
                continue
            manner = manner_of(self.target, late_s=LATE_S * self.speed, at_mm=self._at_mm)
            hand = self.wire.hand(self.target.machine, manner)
            driver = Driver(
                line,
                wish=self._wish,
                watch=self._show,
                tell=self.tell,
                speed=self.speed,
                tick_s=TICK_S,
            )
            driver.carry(hand)
            self._at_mm = hand.place_mm if hand.is_still else None
            if hand.state is WireState.FAILED:
                self.tell(hand.why, bad=True)
                return
            if hand.state is WireState.STOPPED:
                self.tell(hand.why)

    def _send(self, line: LineToController, one: Consignment, options: SendOptions) -> None:
        """Send a program to its end."""
        self._left_s, self._running = one.times_left_s(), one
        try:
            conversation = program_conversation(one, self.target, self.port, options)
            sent = carry_program(
                one,
                self.target,
                self.port,
                line,
                options,
                conversation=conversation,
                wish=self._wish,
                watch=self._show,
                tell=self.tell,
            )
        except CamtoolError as error:
            self.tell(str(error), bad=True)
            return
        finally:
            self._running = None
        is_still = sent.conversation.is_still
        self._at_mm = one.place_of(sent.conversation) if is_still else None
        if sent.is_finished:
            self.tell(f"finished: {len(one.packets)} packets")
        else:
            self.tell(f"{sent.words}; it can be resumed", bad=True)

    def _wish(self) -> Request | Order | None:
        if self._closing.is_set() and self.state.state != WireState.STOPPING.value:
            return _close
        held = self._held_until
        if held is not None and time.monotonic() > held:
            self.release()
            self.tell("let go: the page has not confirmed the key")
        with suppress(queue.Empty):
            return self._requests.get_nowait()
        return None

    def _show(self, talk: Conversation) -> None:
        one, block, left = self._running, 0, 0.0
        if one is not None:
            left = self._left_s[talk.acknowledged]
            if talk.acknowledged:
                block = one.block_of(one.packets[talk.acknowledged - 1].block) + 1
        self._set(
            MachineState(
                state=talk.state.value,
                why=talk.why,
                says=getattr(talk, "says", ""),
                runs=one is not None,
                place_mm=talk.place_mm if one is None else one.place_of(talk),
                overrides=dict(talk.overrides),
                sent=talk.sent,
                acknowledged=talk.acknowledged,
                done=talk.done,
                block=block,
                left_s=left,
            )
        )

    def _set(self, state: MachineState) -> None:
        if state != self.state:
            self.state = state
            self.watch()


def _close(talk: Conversation, now: float) -> None:
    """End a conversation: a hand that is ready, or a machine that is to be stopped."""
    if isinstance(talk, Hand):
        talk.close(now)
    else:
        talk.stop(now)
