"""A machine at a port, from opening to closing: one conversation after another, in one thread.

Between programs the machine is moved by hand (`camtool.target.wire.Hand`). A program that is
loaded is sent by the same functions as those of `camtool send`, with the same journal. Requests
come from other threads, and are carried out at the next turn of the driver, within `TICK_S`."""

from __future__ import annotations

import math
import queue
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final

from msgspec import Struct

from camtool.errors import CamtoolError, MachineError
from camtool.panel.program import BlockFacts, Course
from camtool.sending.carry import SendOptions, carry_program, program_conversation
from camtool.sending.drive import Driver, LineToController, Order, Request
from camtool.sending.line import Port, manner_of, wire_of
from camtool.sending.prepare import Consignment
from camtool.target.wire import (
    LATE_S,
    NEAR_MM,
    Conversation,
    Hand,
    HandAction,
    Manner,
    Override,
    Place,
    WireState,
    place_words,
)

if TYPE_CHECKING:
    from camtool.target.registry import LoadedTarget
    from camtool.toolpath.probing import Measured, ProbeScript

TICK_S: Final = 0.02
"""Interval at which requests are carried out, s."""

HELD_S: Final = 0.08
"""A held key that is not confirmed for this time counts as released, s. With `TICK_S` and the
line, a jog ends within 0.1 s after the page is gone."""

MAX_MESSAGES: Final = 200


RATE_S: Final = 0.5
"""Time of the machine over which the rate of counted steps is measured, s."""

AXES: Final = "xyz"


class Message(Struct, frozen=True):
    """A sentence for the user with its number, counted from 1; `bad` if something went wrong."""

    number: int
    text: str
    bad: bool = False


class MachineState(Struct, frozen=True):
    """State of the machine, as far as it is known.

    `state`: "closed" without a line, otherwise the state of the conversation; `why`: what it waits
    for, or why it ended; `says`: the state in the controller's own word. `place_mm`: in the work
    frame, as reported or counted; `machine_mm`: from machine zero; `is_homed`: that is known, so
    that the travel is watched, whose ends in the work frame are `travel_mm`. The feed, the step
    rate of the fastest axis, and the spindle speed; `overrides` in %.

    Of a program: the numbers of packets `sent`, `acknowledged` and `done`; the bytes `buffered`
    that are not acknowledged; the `block` that was acknowledged last (from 1; 0 for none); the end
    `programmed_mm` of the block that runs; the remaining time `left_s`. `stops`: it waits at a
    stop for the user, for example for another tool; `change_first`: it was left there to touch
    off, and resumes with this block (0: it was not)."""

    state: str = "closed"
    why: str = ""
    says: str = ""
    runs: bool = False
    place_mm: Place | None = None
    machine_mm: Place | None = None
    is_homed: bool = False
    travel_mm: tuple[Place, Place] | None = None
    programmed_mm: Place | None = None
    feed_mm_min: float | None = None
    step_hz: float | None = None
    rpm: float | None = None
    overrides: Mapping[Override, int] = {}
    sent: int = 0
    acknowledged: int = 0
    done: int = 0
    buffered: int = 0
    block: int = 0
    left_s: float = 0.0
    stops: bool = False
    change_first: int = 0


class StepRate:
    """The rate of counted steps, from the places within the last `RATE_S`."""

    def __init__(self, step_mm: tuple[float, ...], speed: float) -> None:
        self._step_mm, self._speed = step_mm, speed
        self._places: deque[tuple[float, Place]] = deque()

    def add(self, place_mm: Place, now: float) -> tuple[float, float]:
        """Record a place and the time; return the feed (mm/min) and the step rate of the fastest
        axis (Hz) over the last `RATE_S`."""
        self._places.append((now, place_mm))
        while len(self._places) > 2 and now - self._places[1][0] > RATE_S / self._speed:
            self._places.popleft()
        before, start = self._places[0]
        seconds = (now - before) * self._speed
        if seconds <= 0.0:
            return 0.0, 0.0
        distances = [abs(to - at) for to, at in zip(place_mm, start, strict=True)]
        hz = (
            max(distance / step for distance, step in zip(distances, self._step_mm, strict=True))
            / seconds
        )
        return math.hypot(*distances) / seconds * 60.0, hz


class Session:
    """A machine at its port. `open_line` opens and locks the port within a `with` block; `watch`,
    which may be set later, is called in the session's thread when the state has changed or a
    message has come."""

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
        self._touch: tuple[str, Callable[[Place], Measured]] | None = None
        self._course: Course | None = None
        self._legs: deque[tuple[Mapping[str, float], float]] = deque()
        self._leg: Mapping[str, float] = {}
        self._change_first = 0
        self._leaves_stop = False
        is_told = self.wire.place == "told" or self.wire.jogs_from_place
        self._place_mm: Place | None = None if is_told else (0.0, 0.0, 0.0)
        self._machine_mm: Place | None = None
        self._is_homed = False
        self._home_mm: Place | None = None  # position after homing, from machine zero
        steps = tuple(axis.coded_step_mm for axis in target.machine.axes)
        self._step_mm, self._rate = steps, StepRate(steps, speed)
        self._count = 0
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
        """Open the line again after it was lost, or if the machine was not found."""
        self._opens.set()

    def stop(self) -> None:
        """Stop the machine and drop all waiting requests."""
        with suppress(queue.Empty):
            while True:
                self._requests.get_nowait()
        self._held_until = self._next = self._touch = None
        self._legs.clear()
        self._requests.put(Request.STOP)

    def request(self, request: Request) -> None:
        """Pause or resume the program that runs, or do a single block of it."""
        self._requests.put(request)

    def order(self, action: HandAction, values: Mapping[str, float]) -> None:
        """Home, zero, jog or unlock. A jog that would leave the travel is refused with a message
        to the user."""

        def begin(hand: Hand, now: float) -> None:
            if action == "jog":
                self._check_travel(values)
            hand.order(action, values, now)

        self._by_hand(begin)

    def go(self, places: Mapping[str, float], feed: float) -> None:
        """Move to a place of the work frame: up first, then across, then down. MachineError if the
        position of the tool is not known."""
        at = self.state.place_mm
        if at is None:
            raise MachineError("nobody knows where the tool stands", mend="home it or zero it")
        goal = {axis: places[axis] for axis in AXES if axis in places}
        self._check_travel({axis: goal[axis] - at[AXES.index(axis)] for axis in goal})
        across = {axis: goal[axis] for axis in "xy" if axis in goal}
        legs = [across] if across else []
        if "z" in goal:
            legs.insert(0 if goal["z"] > at[2] else len(legs), {"z": goal["z"]})
        self._leg = {}
        self._legs = deque((leg, feed) for leg in legs)

    def go_home(self, feed: float) -> None:
        """Move to machine zero, where homing ends. MachineError if the machine was not homed."""
        at, machine_at, home = self.state.place_mm, self.state.machine_mm, self._home_mm
        if at is None or machine_at is None or home is None or not self.state.is_homed:
            raise MachineError("it was not homed from here", mend="home it")
        columns = zip(AXES, at, machine_at, home, strict=True)
        self.go({axis: end + one - other for axis, one, other, end in columns}, feed)

    def touch(self, what: str, measure: Callable[[Place], Measured]) -> None:
        """Touch a part or a plate by a cycle of `camtool.toolpath.probing`; MachineError if the
        machine is not ready."""
        self._check_ready()
        self._touch = what, measure
        self._by_hand(lambda hand, now: hand.close(now))

    def leave_stop(self) -> None:
        """End a program that waits at a stop, so that the machine can be moved by hand, for
        example to touch off another tool. It can be resumed after the stop."""
        if not self.state.stops:
            self.tell("the program does not wait at a stop", bad=True)
            return
        self._leaves_stop = True
        self._requests.put(Request.STOP)

    def say(self, line: str) -> None:
        """Type a line to the controller."""
        self.tell(f"> {line}")
        self._by_hand(lambda hand, now: hand.say(line, now))

    def hold(self, values: Mapping[str, float]) -> None:
        """Jog until `release` is called, until `keep` has not been called for `HELD_S`, or to the
        end of the travel if that is known."""
        self._held_until = time.monotonic() + HELD_S

        def begin(hand: Hand, now: float) -> None:
            if self._held_until is not None:  # else it has been let go already
                hand.hold({**values, **self._room(values)}, now)

        self._by_hand(begin)

    @property
    def ends_mm(self) -> tuple[Place, Place] | None:
        """The ends of the travel in the work frame; None while they are not known."""
        at, machine_at = self._place_mm, self._machine_mm
        if not self._is_homed or at is None or machine_at is None:
            return None
        low, high = self.wire.travel_mm(self.target.machine)
        (x, y, z), (u, v, w) = (
            [end + at[k] - machine_at[k] for k, end in enumerate(ends)] for ends in (low, high)
        )
        return (x, y, z), (u, v, w)

    def _check_travel(self, values: Mapping[str, float]) -> None:
        """Raise MachineError for a distance, mm by axis, that leaves the travel."""
        ends, at = self.ends_mm, self._place_mm
        if ends is None or at is None:
            return
        for k, axis in enumerate(AXES):
            distance = values.get(axis, 0.0)
            excess = max(at[k] + distance - ends[1][k], ends[0][k] - at[k] - distance)
            if (
                distance
                and excess > NEAR_MM
                and (at[k] + distance > ends[1][k]) == (distance > 0.0)
            ):
                room = abs(distance) - excess
                raise MachineError(
                    f"{axis.upper()}{distance:+.3f} mm leaves the travel by {excess:.3f} mm: it "
                    f"ends at {axis.upper()}{ends[distance > 0.0][k]:.3f}",
                    mend=f"go by {max(room, 0.0):.3f} mm at most",
                )

    def _room(self, values: Mapping[str, float]) -> Mapping[str, float]:
        """Return how far (mm, by axis) a held jog may go; MachineError if an axis is at the end of
        its travel."""
        ends, at = self.ends_mm, self._place_mm
        senses = [values.get(axis, 0.0) for axis in AXES]
        norm = math.hypot(*senses)
        if ends is None or at is None:
            return {}
        rooms = [
            (ends[sense > 0.0][k] - at[k]) * norm / sense
            for k, sense in enumerate(senses)
            if sense
        ]
        room = min(rooms, default=math.inf)
        if room <= NEAR_MM:
            raise MachineError("it stands at the end of its travel", mend="jog the other way")
        return {"room": room} if math.isfinite(room) else {}

    def keep(self) -> None:
        """Confirm that the key is still held."""
        if self._held_until is not None:
            self._held_until = time.monotonic() + HELD_S

    def release(self) -> None:
        """End a held jog."""
        self._held_until = None
        self._by_hand(lambda hand, now: hand.release(now))

    def override(self, name: Override, percent: int) -> None:
        """Set an override in percent, between programs or during one."""
        self._requests.put(lambda talk, now: talk.override(name, percent, now))

    def run_program(self, one: Consignment, options: SendOptions) -> None:
        """Send a program; MachineError if the machine is not ready."""
        self._check_ready()
        at = self.state.place_mm
        if self.wire.place == "kept" and at is not None:
            start = one.begin_mm
            if math.dist(at, start) > NEAR_MM:
                raise MachineError(
                    f"the tool stands at {place_words(at)}, and the program begins at "
                    f"{place_words(start)}",
                    mend="go there, or zero all axes here",
                )
        self._next, self._change_first = (one, options), 0
        self._by_hand(lambda hand, now: hand.close(now))

    def _check_ready(self) -> None:
        if self.state.state != WireState.READY.value:
            raise MachineError(
                f"the machine is not ready ({self.state.state})",
                mend="wait until it stands, or connect it",
            )

    def tell(self, text: str, *, bad: bool = False) -> None:
        """Add a message for the user."""
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
            self._forget_place()
            self._set(MachineState(why=self.state.why, change_first=self._change_first))

    def _forget_place(self) -> None:
        """Mark the machine position as unknown, since the machine may have been switched off."""
        self._is_homed, self._machine_mm = False, None

    def _converse(self, line: LineToController) -> None:
        """Hold conversations one after another, until the line is to be closed or no conversation
        is possible any more."""
        while not self._closing.is_set():
            following, self._next = self._next, None
            if following is not None:
                self._send(line, *following)
                continue
            touch, self._touch = self._touch, None
            manner = manner_of(self.target, late_s=LATE_S * self.speed, at_mm=self._place_mm)
            if touch is not None:
                self._measure(line, manner, *touch)
                continue
            hand = self.wire.hand(self.target.machine, manner)
            hand.machine_mm, hand.is_homed = self._machine_mm, self._is_homed
            self._driver(line).carry(hand)
            if hand.state is WireState.FAILED:
                self.tell(hand.why, bad=True)
                return
            if hand.state is WireState.STOPPED:
                self.tell(hand.why)

    def _driver(self, line: LineToController) -> Driver:
        return Driver(
            line,
            wish=self._wish,
            watch=self._show,
            tell=self.tell,
            speed=self.speed,
            tick_s=TICK_S,
        )

    def _measure(
        self,
        line: LineToController,
        manner: Manner,
        what: str,
        measure: Callable[[Place], Measured],
    ) -> None:
        """Run a cycle of touches, and report to the user what it measured."""
        measured: dict[str, float] = {}

        def cycle(start: Place) -> ProbeScript:
            measured.update((yield from measure(start)))

        try:
            conversation = self.wire.probing(cycle, self.target.machine, manner)
        except CamtoolError as error:
            self.tell(str(error), bad=True)
            return
        self._driver(line).carry(conversation)
        if conversation.state is WireState.FINISHED:
            figures = []
            for name, value in measured.items():
                quantity, _, unit = name.rpartition("_")
                letter = quantity.upper() if len(quantity) == 1 else quantity
                figures.append(f"{letter} {value:.3f} {unit}")
            self.tell(f"{what}: {', '.join(figures)}")
        else:
            self.tell(f"{what}: {conversation.why}", bad=True)

    def _send(self, line: LineToController, one: Consignment, options: SendOptions) -> None:
        """Send a program to its end."""
        self._course, self._leaves_stop = Course(one), False
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
            self._course = None
        if conversation.state is WireState.FAILED:
            self._forget_place()
        knows = conversation.is_still or conversation.counts_steps
        if self.wire.place != "told" and not knows:
            self._place_mm = None
        if sent.is_finished:
            self.tell(f"finished: {len(one.packets)} packets")
        elif self._leaves_stop and conversation.state is WireState.STOPPED:
            self.tell(f"change the tool and touch off; it goes on with block {self._change_first}")
        else:
            self.tell(f"{sent.words}; it can be resumed", bad=True)

    def _wish(self) -> Request | Order | None:
        if self._closing.is_set() and self.state.state != WireState.STOPPING.value:
            return _close
        release_s = self._held_until
        if release_s is not None and time.monotonic() > release_s:
            self.release()
            self.tell("let go: the page has not confirmed the key")
        with suppress(queue.Empty):
            return self._requests.get_nowait()
        if self._legs and self.state.state == WireState.READY.value:
            return self._next_leg()
        return None

    def _next_leg(self) -> Order | None:
        """Return the order for the next leg of the way to a place. None if there is nothing to
        move, or if the last leg did not arrive: then the way ends there with a message."""
        at = self.state.place_mm
        (goal, feed), before = self._legs.popleft(), self._leg
        arrived = at is not None and all(
            abs(at[AXES.index(axis)] - place) < NEAR_MM for axis, place in before.items()
        )
        if at is None or not arrived:
            self._legs.clear()
            self.tell("it has not arrived where it was to go, and stays there", bad=True)
            return None
        self._leg = goal
        distances = {axis: place - at[AXES.index(axis)] for axis, place in goal.items()}
        distances = {
            axis: distance
            for axis, distance in distances.items()
            if abs(distance) >= 0.5 * self._step_mm[AXES.index(axis)]
        }
        if not distances:
            return None

        def begin(talk: Conversation, now: float) -> None:
            if isinstance(talk, Hand):
                try:
                    talk.order("jog", {**distances, "feed": feed}, now)
                except CamtoolError as error:
                    self._legs.clear()
                    self.tell(str(error), bad=True)

        return begin

    def _show(self, talk: Conversation) -> None:
        course = self._course
        facts = BlockFacts() if course is None else course.facts(talk)
        before, at = self._place_mm, talk.place_mm
        if course is not None and not talk.counts_steps:
            at = course.one.place_of(talk)
        if self.wire.place == "told":
            self._machine_mm = talk.machine_mm or self._machine_mm
        elif isinstance(talk, Hand):
            self._machine_mm = talk.machine_mm
        elif self._machine_mm is not None and None not in (at, before):
            columns = zip(self._machine_mm, at or (), before or (), strict=True)
            x, y, z = (machine + to - start for machine, to, start in columns)
            self._machine_mm = x, y, z
        self._place_mm = at
        if isinstance(talk, Hand):
            if talk.is_homed and not self._is_homed:
                self._home_mm = self._machine_mm
            self._is_homed = talk.is_homed
        stops = course is not None and talk.state is WireState.WAITING
        stops = stops and (talk.is_program_stop or bool(talk.packets[talk.done].ask))
        if course is not None and stops:
            self._change_first = course.following_block(talk)
        elif course is not None and not self._leaves_stop:
            self._change_first = 0
        feed, hz = self._speeds(talk, facts)
        self._set(
            MachineState(
                state=talk.state.value,
                why=talk.why,
                says=getattr(talk, "says", ""),
                runs=course is not None,
                place_mm=at,
                machine_mm=self._machine_mm,
                is_homed=self._is_homed,
                travel_mm=self.ends_mm,
                programmed_mm=facts.end_mm,
                feed_mm_min=feed,
                step_hz=hz,
                rpm=talk.rpm if course is None or talk.rpm is not None else facts.rpm,
                overrides=dict(talk.overrides),
                sent=talk.sent,
                acknowledged=talk.acknowledged,
                done=talk.done,
                buffered=0 if course is None else course.waiting_bytes(talk),
                block=0 if course is None else course.acknowledged_block(talk),
                left_s=0.0 if course is None else course.left_s(talk.acknowledged),
                stops=stops,
                change_first=0 if stops else self._change_first,
            )
        )

    def _speeds(self, talk: Conversation, facts: BlockFacts) -> tuple[float | None, float | None]:
        """Return the feed (mm/min) and the step rate (Hz): as counted, or from the reported or
        programmed feed; None where unknown, as for a rapid."""
        if talk.counts_steps and talk.place_mm is not None:
            return self._rate.add(talk.place_mm, time.monotonic())
        moves = talk.state in (WireState.SENDING, WireState.PAUSING, WireState.STOPPING)
        feed = talk.feed_mm_min
        if feed is None and (self._course is None or not moves):
            return (None if moves else 0.0), (None if moves else 0.0)
        feed = facts.feed_mm_min if feed is None else feed
        return feed, None if feed is None else feed / 60.0 / self._step_mm[0]

    def _set(self, state: MachineState) -> None:
        if state != self.state:
            self.state = state
            self.watch()


def _close(talk: Conversation, now: float) -> None:
    """End a conversation: leave a hand that is ready, stop a machine otherwise."""
    if isinstance(talk, Hand):
        talk.close(now)
    else:
        talk.stop(now)
