"""The contract of a wire: how a program comes down the line to a controller, without the line.

A `Wire` cuts a program into packets, and holds conversations about them. A `Conversation` is a
value with an explicit clock: it is given what was received, what the user wants, and the time; it
gives what to write and when it wants to be woken. It opens no port, reads no clock and starts no
thread, so that tests run thousands of faults through it in a second. `camtool.sending` joins it to
a port.

    conversation.begin(now)
    while not conversation.is_over:
        for action in conversation.actions():  ...   # write, reopen, tell
        ...                                          # wait for bytes, or until .next_s
        conversation.receive(data, now)             # or .tick(now), .stop(now) ...

Three counts of packets say where it stands: those that were `sent`, those that the controller has
`acknowledged` (or that are taken for acknowledged, where it says nothing), and those that are
`done`: what is cut for certain. After a crash a program goes on behind what is done."""

from __future__ import annotations

import errno
import math
import os
import re
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from enum import Enum
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from msgspec import Struct

from camtool.errors import MachineError
from camtool.machine.model import Machine
from camtool.records import replace
from camtool.target.terminal import Terminal

if TYPE_CHECKING:
    from camtool.arrays import Floats, Ints
    from camtool.toolpath.moves import Toolpath
    from camtool.toolpath.probing import ProbeCycle

Place = tuple[float, float, float]

ToolAt = Literal["", "journal", "zero", "known"]

Override = Literal["feed", "rapid", "spindle"]

HandAction = Literal["home", "zero", "jog", "hold", "unlock", "line"]
"""Orders by hand. `jog` moves by a distance, `hold` while a key is held, `line` is typed."""


class Forecast(Struct, frozen=True, eq=False):
    """The simulated course of the B blocks of a program: `decoded`, its moves; `seconds` (B,), the
    time of each block, and `compensation_s` (B,), the part of it for compensation; `outputs` (B,)
    of steps, each of one axis or several; `steps` and `reversals` (B, 3) of the axes; and the end
    of each block, `end_mm` (B, 3)."""

    decoded: Toolpath
    seconds: Floats
    compensation_s: Floats
    outputs: Ints
    steps: Ints
    reversals: Ints
    end_mm: Floats

    def __len__(self) -> int:
        return len(self.seconds)

    def end_of(self, block: int) -> Place | None:
        """Return the end of a block, mm; None behind the last block that does anything."""
        if block >= len(self.end_mm):
            return None
        x, y, z = self.end_mm[block].tolist()
        return x, y, z

    def seconds_of(self, block: int) -> float:
        """Return the time of a block, s; 0 for blocks after the last one that does anything."""
        return float(self.seconds[block]) if block < len(self.seconds) else 0.0


class Packet(Struct, frozen=True):
    """Bytes that are sent in one piece and acknowledged as one.

    `block`: the last block of the program that is done with it, −1 before the first; `seconds`:
    the time for which the machine is busy with it, by the simulation. `counts`: the greatest
    number of reports that the controller gives of it, if it reports. `ask`: what the user must do
    or allow before it is sent. `note`: what the user must know while the machine waits in it;
    `waits`: the program waits there until somebody resumes it. `end_mm`: its end in the work
    frame, if the conversation checks that."""

    data: bytes
    block: int = -1
    seconds: float = 0.0
    counts: tuple[int, ...] = ()
    ask: str = ""
    note: str = ""
    waits: bool = False
    end_mm: Place | None = None


class WireState(Enum):
    """State of a conversation."""

    OPENING = "opening"
    READY = "ready"  # it stands, and takes orders by hand
    SENDING = "sending"
    WAITING = "waiting"  # for the user: `why` says what for
    PAUSING = "pausing"
    PAUSED = "paused"
    STOPPING = "stopping"
    FINISHED = "finished"
    STOPPED = "stopped"  # by the user: `why` says whether the machine has said that it stands
    FAILED = "failed"


ENDS = frozenset({WireState.FINISHED, WireState.STOPPED, WireState.FAILED})
HALTS = frozenset({WireState.WAITING, WireState.PAUSED})


class Write(Struct, frozen=True):
    """Bytes to be written now."""

    data: bytes


class Reopen(Struct, frozen=True):
    """Close the port and open it again, since the controller starts anew."""


class Tell(Struct, frozen=True):
    """A sentence for the user, such as what the controller says."""

    text: str


Action = Write | Reopen | Tell

NEVER = math.inf
"""Time of an event that does not happen by itself, s."""

LATE_S = 0.05
"""Longest delay of a port and its cable, s."""

PATIENCE_FACTOR = 60
"""Longest wait for an answer that is due, in multiples of the lateness of the line (3 s in
all)."""


NEAR_MM = 0.02
"""Largest distance, mm, between a reported position and the same position as programmed: steps,
and rounding."""


class ResumePoint(Struct, frozen=True, eq=False):
    """The point at which an interrupted program resumes, from its journal. `place_mm`: the place
    of the tool, None if not known; `is_still`: it was known to stand there; `ends_mm` (K, 3):
    other places where it may stand, depending on how much was done. `tool_at`: what the user says:
    the tool stands at the place in the "journal", or at part "zero", and the controller must adopt
    that; or the controller's own place is "known" to be right; "" for nothing."""

    place_mm: Place | None
    is_still: bool
    ends_mm: Floats
    tool_at: ToolAt = ""

    @property
    def said_mm(self) -> Place | None:
        """Place at which the controller is told that the tool stands; None for its own."""
        return {"journal": self.place_mm, "zero": (0.0, 0.0, 0.0)}.get(self.tool_at)

    def refusal(self, at_mm: Place | None, *, restarted: bool) -> str:
        """Return the reason why the program cannot resume, if the controller takes the tool to
        stand at `at_mm`; "" if it can."""
        if self.tool_at:
            return ""
        if at_mm is not None:
            places = [] if self.place_mm is None else [self.place_mm]
            if not restarted and not self.is_still:
                places += [tuple(each) for each in self.ends_mm.tolist()]
            if (self.is_still or not restarted) and any(
                math.dist(at_mm, x) < NEAR_MM for x in places
            ):
                return ""
        claim = f"takes its place for {place_words(at_mm)}"
        if at_mm is None:
            claim = "does not say where it stands"
        place_text, choices = "nobody knows where the program was left", ""
        if self.place_mm is not None:
            place_text = f"the program was left at {place_words(self.place_mm)}"
            if self.is_still:
                choices = "journal (where it was left), "
            else:
                place_text = (
                    f"the program was not stopped, and last seen at {place_words(self.place_mm)}"
                )
        anew = "has begun anew, and " if restarted else ""
        return (
            f"the controller {anew}{claim}, but {place_text}: home it (--home), or say where the "
            f"tool is by --tool-at: {choices}zero (brought to part zero) or known (it is right "
            "there)"
        )


def place_words(place_mm: Place | None) -> str:
    """Return a place as `X1.000 Y2.000 Z3.000`."""
    return "" if place_mm is None else "X{:.3f} Y{:.3f} Z{:.3f}".format(*place_mm)


class Manner(Struct, frozen=True):
    """Options of a conversation. `single`: wait for `resume` after every packet; `home`: home the
    machine first; `unlock`: unlock a locked controller first; `late_s`: the greatest delay of the
    line, s; `checked`: compare the controller's settings with the machine file; `paced`: bytes
    take the time that the line's rate gives them, so that a reply that comes sooner is not one;
    `file`: path of what is sent, for controllers that open it themselves; `standing`: where a
    resumed program was left, for controllers that report their place; `at_mm`: where the tool
    stands now in the controller's frame, as far as known from the user or an earlier order;
    `reach_mm`: the lowest and the highest place of what is sent, in the work frame, for
    conversations that watch the travel."""

    single: bool = False
    home: bool = False
    unlock: bool = False
    late_s: float = LATE_S
    checked: bool = True
    paced: bool = False
    file: str = ""
    standing: ResumePoint | None = None
    at_mm: Place | None = None
    reach_mm: tuple[Place, Place] | None = None

    @property
    def patience_s(self) -> float:
        """Longest wait for an answer that is due, s."""
        return PATIENCE_FACTOR * self.late_s


class Conversation(ABC):
    """A conversation that sends packets; see the module. `place_mm`: the position that the
    controller reports, in the work frame, None if it reports none."""

    def __init__(self, packets: Sequence[Packet], manner: Manner) -> None:
        self.packets = tuple(packets)
        self.manner = manner
        self.single = manner.single
        self.state = WireState.OPENING
        self.why = ""
        self.sent = self.acknowledged = self.done = 0
        self.place_mm: Place | None = None
        self.machine_mm: Place | None = None
        """Position from machine zero, mm, None where it is not known."""
        self.counts_steps = False
        """True if its place is counted by the steps that the controller reports."""
        self.feed_mm_min: float | None = None
        self.rpm: float | None = None
        """Feed and spindle speed that the controller reports, None if it reports none."""
        self.is_program_stop = False
        """True if the state was last WAITING because the program stops for an operator (M0)."""
        self.overrides: dict[Override, int] = {}
        """Overrides in %, as the controller reports them or was told last."""
        self.next_s = NEVER
        """The time at which `tick` must be called; earlier calls do no harm."""
        self._out: list[Action] = []

    @property
    def is_over(self) -> bool:
        """True if the conversation is over."""
        return self.state in ENDS

    @property
    def block(self) -> int:
        """Index of the last block that is surely done, −1 before the first."""
        return max((packet.block for packet in self.packets[: self.done]), default=-1)

    def actions(self) -> list[Action]:
        """Return the actions to carry out now, in order; each is returned only once."""
        actions, self._out = self._out, []
        return actions

    @property
    def stop_index(self) -> int:
        """Index of the packet at which it waits for the user."""
        return min(self.acknowledged, len(self.packets) - 1)

    @property
    def at_mm(self) -> Place | None:
        """Position that the machine reports, mm in the work frame in which the program began; None
        if it reports none."""
        return self.place_mm

    @property
    def is_still(self) -> bool:
        """True if it has ended and the machine is known to stand: at the place that it says, or
        where the packets that are done have brought it."""
        return self.state in (WireState.FINISHED, WireState.STOPPED)

    @property
    def has_actions(self) -> bool:
        """True if actions wait to be carried out."""
        return bool(self._out)

    @abstractmethod
    def begin(self, now: float) -> None:
        """Begin the conversation: the port is open."""

    @abstractmethod
    def receive(self, data: bytes, now: float) -> None:
        """Handle bytes that have come."""

    @abstractmethod
    def tick(self, now: float) -> None:
        """Handle the time `now`: waits that are over, answers that are late."""

    @abstractmethod
    def pause(self, now: float) -> None:
        """Pause the program; the state becomes PAUSED when the machine stands."""

    @abstractmethod
    def resume(self, now: float) -> None:
        """Go on with the program after a pause, or after a stop at which the user had something to
        do."""

    @abstractmethod
    def stop(self, now: float) -> None:
        """Stop the machine and end the conversation. The bytes that stop it are the next to be
        written, whatever is awaited. The state becomes STOPPED when the machine stands, as far as
        its protocol can stop it; `why` then says how that is known, or that it is not."""

    def hurry(self, now: float) -> None:
        """Stop harder than `stop` did, where the protocol can; nobody waits for the end
        any more."""
        self.stop(now)

    def lose_port(self, reason: str, now: float) -> None:
        """End the conversation: the port is gone, and nothing can be sent any more."""
        if not self.is_over:
            self._out.clear()
            self._end(WireState.FAILED, "; ".join(filter(None, (reason, self._unattended))))

    def override(self, name: Override, percent: int, now: float) -> None:
        """Change feed, rapids or spindle to a percentage of what is programmed, as far as the
        controller can."""
        self._tell(f"it has no override of its {name} over its line")

    @property
    def _unattended(self) -> str:
        """Return a sentence on what the machine does if the connection is lost now; "" if it
        stands still."""
        return ""

    def _write(self, data: bytes) -> None:
        self._out.append(Write(data))

    def _unwrite(self) -> bool:
        """Take back bytes that were to be written and were not handed out yet; return True if
        there were any."""
        told_actions: list[Action] = [action for action in self._out if isinstance(action, Tell)]
        was_unwritten, self._out = len(told_actions) < len(self._out), told_actions
        return was_unwritten

    def _tell(self, text: str) -> None:
        self._out.append(Tell(text))

    def _end(self, state: WireState, reason: str = "") -> None:
        self.state, self.why, self.next_s = state, reason, NEVER


class PacketByPacket(Conversation):
    """A conversation that sends a packet when the one before is done.

    It pauses between packets, and also stops there unless `_halt` can do more."""

    stands = "stopped: it has done what it was sent, and stands"
    """Sentence for the user when the machine has stopped behind a packet."""
    goes_on = "it does what it was sent to its end; its switch stops it"
    """Sentence for the user about a machine that cannot be stopped, or that nobody speaks to any
    more."""
    halts_within: ClassVar[bool] = False
    """True if a stop may leave the machine somewhere within a packet."""

    @property
    def is_still(self) -> bool:
        """True behind a packet, and where a packet that was stopped has never begun."""
        is_done = self.is_over and self.done == self.sent and not self._busy
        return is_done or (self.state is WireState.STOPPED and not self.halts_within)

    def __init__(self, packets: Sequence[Packet], manner: Manner) -> None:
        super().__init__(packets, manner)
        self._busy = False
        """True while a packet is under way."""
        self._asked = False
        """True if the user has been asked for what the next packet needs."""
        self._failing = ""
        """Why it fails, while the machine is being stopped."""

    @abstractmethod
    def _send(self, packet: Packet, now: float) -> None:
        """Write a packet, and set `next_s`."""

    def _halt(self, now: float, *, unsent: bool) -> bool:
        """Stop the machine within a packet; return False if the protocol cannot. `unsent`: the
        last bytes of the packet were withdrawn before they were written."""
        if unsent:
            self._stopped()
        return unsent

    @property
    def _unattended(self) -> str:
        return self.goes_on if self._busy else ""

    def begin(self, now: float) -> None:
        """Send the first packet."""
        self.state = WireState.SENDING
        self._go_on(now)

    def pause(self, now: float) -> None:
        """Pause when the packet under way is done."""
        if self.state is WireState.SENDING:
            self.state = WireState.PAUSING
            if not self._busy:
                self.state = WireState.PAUSED

    def resume(self, now: float) -> None:
        """Go on with the next packet."""
        if self.state is WireState.PAUSING:
            self.state = WireState.SENDING
        elif self.state in HALTS:
            self._asked = self.state is WireState.WAITING
            self.state, self.why = WireState.SENDING, ""
            self._go_on(now)

    def stop(self, now: float) -> None:
        """Send nothing more; the state becomes STOPPED when the packet under way is done or was
        halted."""
        if self.is_over or self.state is WireState.STOPPING:
            return
        unsent = self._unwrite()
        self.state = WireState.STOPPING
        if not self._busy:
            self._stopped()
        elif not self._halt(now, unsent=unsent):
            remaining_s = self.next_s - now
            self._tell(
                self.goes_on
                + (f" (up to {remaining_s:.0f} s more)" if remaining_s < NEVER else "")
            )

    def _go_on(self, now: float) -> None:
        """Send the next packet, or wait if the user must do something first."""
        if self.done == len(self.packets):
            self._end(WireState.FINISHED)
            return
        packet = self.packets[self.done]
        if packet.ask and not self._asked:
            self.state, self.why, self.next_s = WireState.WAITING, packet.ask, NEVER
            self.is_program_stop = packet.waits
            return
        self._asked, self._busy = False, True
        self.sent = self.done + 1
        self._send(packet, now)

    def _packet_done(self, now: float) -> None:
        """Record that the packet under way is executed, and continue."""
        self._busy, self.next_s = False, NEVER
        self.done = self.acknowledged = self.sent
        if self.state is WireState.STOPPING:
            self._stopped()
        elif self.state is WireState.PAUSING:
            self.state = WireState.PAUSED
        elif self.single and self.done < len(self.packets):
            self.state, self.why = WireState.PAUSED, "single block"
        else:
            self._go_on(now)

    def _stopped(self, certainty: str = "") -> None:
        """End the conversation with a machine that stands; `certainty` (by default `stands`) tells
        the user how sure that is."""
        self._busy = False
        if self._failing:
            self._end(WireState.FAILED, self._failing)
        else:
            self._end(WireState.STOPPED, certainty or self.stands)

    def _fail(self, reason: str, now: float) -> None:
        """Stop the machine if the protocol can, and end in the state FAILED."""
        if self.is_over or self._failing:
            return
        self._failing, self.state = reason, WireState.STOPPING
        unsent = self._unwrite()
        if not self._busy or not self._halt(now, unsent=unsent):
            self._end(WireState.FAILED, reason)


class Hand(Conversation):
    """A machine moved by hand: a conversation that stays open between orders.

    `is_homed`: its machine position is known since it was homed.

    It is READY between orders, SENDING while one is carried out, and READY again when the machine
    stands; an order that the controller refuses is told, and changes nothing. `stop` stops the
    machine and ends the conversation, as everywhere; `close` ends it while the machine stands.
    `says`: the state that the controller reports, in its own word; "" where it reports none."""

    says = ""
    is_homed = False

    @abstractmethod
    def order(self, action: HandAction, values: Mapping[str, float], now: float) -> None:
        """Carry out "home", "zero", "jog" or "unlock"; `values` as for `Wire.command`.
        MachineError if the controller cannot, or is not READY."""

    @abstractmethod
    def hold(self, values: Mapping[str, float], now: float) -> None:
        """Move in a direction until `release`. `values`: the senses of the axes (−1, 1), the
        "feed" (mm/min), and, if known, the "room" (mm) after which the motion ends at the latest.
        MachineError as for `order`."""

    @abstractmethod
    def release(self, now: float) -> None:
        """End the motion of `hold`: the bytes that stop it are the next to be written."""

    @abstractmethod
    def say(self, line: str, now: float) -> None:
        """Send a typed line; its answers are shown to the user. MachineError as for `order`."""

    def close(self, now: float) -> None:
        """End the conversation if the machine stands; otherwise stop the machine first."""
        if self.state is WireState.READY:
            self._end(WireState.FINISHED)
        else:
            self.stop(now)

    def check_ready(self, action: str) -> None:
        """Raise MachineError unless the machine is READY for an order."""
        if self.state is not WireState.READY:
            raise MachineError(
                f"the machine is busy ({self.state.value}): it takes no order to {action}",
                mend="wait until it stands, or stop it",
            )


class SettingsConversation(Conversation):
    """A conversation that reads a controller's settings and changes them. `before`, `after`: its
    listings; `written`: the changes that it has accepted."""

    before: Sequence[str] = ()
    after: Sequence[str] = ()
    written: Sequence[str] = ()


class CommandHand(Hand):
    """A machine moved by the commands of its wire: each order is a conversation of its own.

    If the controller reports no place, the place is that at the begin of the session, plus the
    steps counted or the distances of the orders carried out since."""

    def __init__(self, wire: Wire, machine: Machine[Any, Any], manner: Manner) -> None:
        super().__init__((), manner)
        self._wire, self._machine = wire, machine
        self._order: Conversation | None = None
        self._action = ""
        self._values: Mapping[str, float] = {}

    def begin(self, now: float) -> None:
        """Set the state READY. Nothing is asked of the controller, so only what was known of the
        machine before is known."""
        self.state, self.place_mm = WireState.READY, self.manner.at_mm

    def order(self, action: HandAction, values: Mapping[str, float], now: float) -> None:
        """Begin the conversation of a command."""
        manner = replace(self.manner, at_mm=self.place_mm)
        self._begin(action, self._wire.command(action, self._machine, values, manner), now, values)

    def hold(self, values: Mapping[str, float], now: float) -> None:
        """Begin the conversation of the command that moves until it is stopped."""
        self.order("hold", values, now)

    def release(self, now: float) -> None:
        """Stop what `hold` began."""
        if self._order is not None:
            self._order.stop(now)
            self._follow()

    def say(self, line: str, now: float) -> None:
        """Type the line to the terminal of the controller."""
        self._begin("line", TypedLine(self._wire.terminal(self._machine), line, self.manner), now)

    def _begin(
        self,
        action: str,
        conversation: Conversation,
        now: float,
        values: Mapping[str, float] | None = None,
    ) -> None:
        self.check_ready(action)
        self._order, self.state, self.why = conversation, WireState.SENDING, ""
        self._action, self._values = action, values or {}
        conversation.begin(now)
        self._follow()

    def receive(self, data: bytes, now: float) -> None:
        """Pass bytes to the conversation of the present order; without one, show them to
        the user."""
        if self._order is not None:
            self._order.receive(data, now)
            self._follow()
        elif data.strip():
            self._tell(f"it says: {data.strip()[:60].decode('latin-1')}")

    def tick(self, now: float) -> None:
        """Pass the time to the conversation of the present order."""
        if self._order is not None and now >= self._order.next_s:
            self._order.tick(now)
            self._follow()

    def pause(self, now: float) -> None:
        """Do nothing: an order by hand has no pause."""

    def resume(self, now: float) -> None:
        """Let the present order go on where it waits for the user."""
        if self._order is not None:
            self._order.resume(now)
            self._follow()

    def stop(self, now: float) -> None:
        """Stop the present order, and end."""
        if self.is_over or self.state is WireState.STOPPING:
            return
        if self._order is None:
            self._end(WireState.STOPPED, "stopped: nothing had been ordered, and nothing moved")
            return
        self._out.clear()
        self.state = WireState.STOPPING
        self._order.stop(now)
        self._follow()

    def hurry(self, now: float) -> None:
        """Stop the present order harder."""
        if self._order is not None:
            self._order.hurry(now)
            self._follow()

    @property
    def _unattended(self) -> str:
        return "" if self._order is None else self._order._unattended

    def _follow(self) -> None:
        """Take over actions, place and state from the conversation of the present order."""
        order = self._order
        if order is None:
            return
        self._out += order.actions()
        self.next_s, self.why = order.next_s, order.why
        self.counts_steps = order.counts_steps
        if self._wire.place == "told":
            self.place_mm = order.place_mm or self.place_mm
            self.machine_mm = order.machine_mm or self.machine_mm
        elif order.place_mm is not None and self._action != "zero":
            self._move_to(order.place_mm)
        if not order.is_over:
            if self.state is not WireState.STOPPING:
                halted = order.state in HALTS
                self.state = order.state if halted else WireState.SENDING
            return
        self._settle(order)
        self._order, self.next_s = None, NEVER
        if self.state is WireState.STOPPING:
            self._end(order.state, order.why)
            return
        self.state, self.why = WireState.READY, ""
        if order.state is not WireState.FINISHED:
            self._tell(order.why)

    def _move_to(self, place_mm: Place) -> None:
        """Record that the tool stands at a place of the work frame."""
        if self.place_mm is not None and self.machine_mm is not None:
            columns = zip(self.machine_mm, place_mm, self.place_mm, strict=True)
            x, y, z = (machine + place - before for machine, place, before in columns)
            self.machine_mm = x, y, z
        self.place_mm = place_mm

    def _settle(self, order: Conversation) -> None:
        """Record where an order that is over has left the tool."""
        is_done = order.state is WireState.FINISHED
        if self._wire.place == "told":
            self.is_homed |= self._action == "home" and is_done
        elif self._action == "home":
            at = None if self.machine_mm is None else _moved(self.place_mm, self.machine_mm, -1.0)
            self.place_mm = order.place_mm or (at or (0.0, 0.0, 0.0) if is_done else None)
            self.machine_mm, self.is_homed = ((0.0, 0.0, 0.0) if is_done else None), is_done
        elif self._action == "zero":
            if is_done:
                at = self.place_mm or (0.0, 0.0, 0.0)
                x, y, z = (self._values.get(axis, at[k]) for k, axis in enumerate("xyz"))
                self.place_mm = x, y, z
        elif order.counts_steps and order.state is not WireState.FAILED:
            return
        elif order.place_mm is None and self._action == "jog" and is_done:
            x, y, z = (self._values.get(axis, 0.0) for axis in "xyz")
            place = _moved(self.place_mm, (x, y, z))
            if place is not None:
                self._move_to(place)
        elif order.place_mm is None or not order.is_still:
            self.place_mm = self.machine_mm = None
            self.is_homed = False


def _moved(place_mm: Place | None, by_mm: Place, sense: float = 1.0) -> Place | None:
    """Return the place moved by `sense` × `by_mm`; None for an unknown place."""
    if place_mm is None:
        return None
    x, y, z = (at + sense * by for at, by in zip(place_mm, by_mm, strict=True))
    return x, y, z


QUIET_S = 0.3
"""The answer to a typed line is complete when nothing has come for this time, s."""

SILENT_S = 1.5
"""A typed line that gets no answer within this time gets none at all, s."""


class TypedLine(Conversation):
    """A conversation about one line typed to a controller, and its answers."""

    def __init__(self, terminal: Terminal, line: str, manner: Manner) -> None:
        super().__init__((), manner)
        self._terminal, self._line = terminal, line
        self._answered = False

    def begin(self, now: float) -> None:
        """Send the line."""
        self.state = WireState.SENDING
        data = self._terminal.hello + self._terminal.encode(self._line)
        if data:
            self._write(data)
        self.next_s = now + SILENT_S

    def receive(self, data: bytes, now: float) -> None:
        """Show the answers to the user."""
        for line in self._terminal.decode(data):
            self._tell(line)
        self._answered = True
        self.next_s = now + QUIET_S

    def tick(self, now: float) -> None:
        """End the conversation when no answer is due and none has come for a while."""
        for line in self._terminal.flush():
            self._tell(line)
        if self._terminal.failed:
            self._end(WireState.FAILED, self._terminal.failed)
        elif self._terminal.due and not self.is_over:
            self.next_s = now + SILENT_S
        elif self.state is WireState.STOPPING:
            self._end(WireState.STOPPED, "stopped: it was told to stop, and says nothing more")
        elif self._terminal.runs_on:
            self.next_s = now + SILENT_S
        else:
            self._end(WireState.FINISHED)

    def pause(self, now: float) -> None:
        """Do nothing: a line has no pause."""

    def resume(self, now: float) -> None:
        """Do nothing: a line never waits for the user."""

    def stop(self, now: float) -> None:
        """Send the bytes that stop the machine."""
        stop = self._terminal.halt()
        self.state, self.next_s = WireState.STOPPING, now + SILENT_S
        if stop:
            self._write(stop)
        else:
            self._end(WireState.STOPPED, "nothing stops it over its line: its switch does")


class Wire(ABC):
    """The protocol of one controller. `baud` and `frame` (data bits, parity, stop bits) are those
    of a serial port; `baud` None: not known. `ready`: what the user must see to before sending."""

    baud: ClassVar[int | None] = None
    frame: ClassVar[str] = "8N1"
    ready: ClassVar[tuple[str, ...]] = ()
    opens_file: ClassVar[bool] = False
    """True if the controller opens the program as a file (`Manner.file`)."""
    place: ClassVar[Literal["told", "kept", "steps", "homed"]] = "kept"
    """Knowledge of the controller about its place: it is "told" by reports; "kept" while it is
    switched on, and not told; it knows "steps" only, and takes where it stands for the beginning;
    or each piece of a program begins with homing ("homed")."""
    unlocks: ClassVar[bool] = False
    """True if the controller locks itself and has a command to end that (`Manner.unlock`)."""
    stopping: ClassVar[str] = ""
    """Effect of a stop, such as "the machine stops at once"."""
    question: ClassVar[bytes] = b""
    """Bytes that the controller answers, and that move nothing on any machine; b"" where none are
    known to be so."""
    by_hand: ClassVar[frozenset[HandAction]] = frozenset()
    """Orders by hand that `command`, or the controller's own `hand`, takes."""
    zeroes_each: ClassVar[bool] = True
    """True if it zeroes axes one by one."""
    overrides: ClassVar[tuple[Override, ...]] = ()
    """Overrides that its conversations carry out."""
    jogs_from_place: ClassVar[bool] = False
    """True if a jog needs the place of the tool (`Manner.at_mm`), since the controller moves to
    absolute places and does not say where it stands."""

    def travel_mm(self, machine: Machine[Any, Any]) -> tuple[Place, Place]:
        """Return the lowest and the highest place of the travel, measured from machine zero, mm;
        infinite where unknown."""
        x, y, z = (math.inf if (each := axis.travel_mm) is None else each for axis in machine.axes)
        u, v, w = (0.0 if math.isfinite(each) else -math.inf for each in (x, y, z))
        return (u, v, w), (x, y, z)

    def with_stops(self, data: bytes, machine: Machine[Any, Any], path: Toolpath) -> bytes:
        """Return a program as it is sent to the controller, with stops where the user mounts
        another tool if the controller does not stop by itself. The numbers of blocks do not
        change; `path` is what they do."""
        return data

    @abstractmethod
    def packets(
        self, data: bytes, machine: Machine[Any, Any], forecast: Forecast
    ) -> Sequence[Packet]:
        """Return the packets of a program, which `read` accepts; MachineError and ProgramError
        for what the line cannot carry."""

    @abstractmethod
    def conversation(
        self, packets: Sequence[Packet], machine: Machine[Any, Any], manner: Manner
    ) -> Conversation:
        """Return the conversation that sends these packets of a program. MachineError if it must
        home first (`manner`) and the machine has no command for that."""

    def command(
        self, action: str, machine: Machine[Any, Any], values: Mapping[str, float], manner: Manner
    ) -> Conversation:
        """Return the conversation that homes, zeroes, jogs or unlocks the machine; `values` are
        those of axes ("x", "y", "z", mm) and the "feed" (mm/min). MachineError if the controller
        has no such command."""
        raise MachineError(
            f"{machine.target.name} has no command to {action} over its line",
            mend="do it at the machine",
        )

    def hand(self, machine: Machine[Any, Any], manner: Manner) -> Hand:
        """Return the conversation that moves the machine by hand."""
        return CommandHand(self, machine, manner)

    def probing(
        self, cycle: ProbeCycle, machine: Machine[Any, Any], manner: Manner
    ) -> Conversation:
        """Return the conversation that carries out a probing cycle. MachineError if the controller
        has no probe."""
        raise MachineError(
            f"{machine.target.name} has no command to probe over its line",
            mend="measure by hand; heights can be written into a file of a surface",
        )

    def settings(
        self, machine: Machine[Any, Any], manner: Manner, changes: Sequence[str] = ()
    ) -> SettingsConversation:
        """Return the conversation that reads the settings, makes these changes ("$110=800"), and
        reads them again. MachineError if the controller has no settings that its line reaches."""
        raise MachineError(
            f"{machine.target.name} has no settings that can be read over its line",
            mend="camtool settings compare FILE reads those that stand in a file, such as "
            "LinuxCNC's INI",
        )

    def recognised(self, heard: str) -> str:
        """Return the name and state of the controller from its answer to `question`; "" if it is
        another one."""
        return ""

    def terminal(self, machine: Machine[Any, Any]) -> Terminal:
        """Return the terminal that translates typed lines into bytes and explains answers."""
        return Terminal()


# Ports that fail.

_MENDS = {
    errno.ENOENT: "plug the machine in; camtool ports lists the ports",
    errno.ENODEV: "plug the machine in; camtool ports lists the ports",
    errno.EACCES: "ask for the right to use it: on Linux, be a member of its group (dialout)",
    errno.EBUSY: "close other programs that use it",
    errno.EAGAIN: "close other programs that use it",
    errno.ECONNREFUSED: "start what is to listen there",
}


def port_fault(error: Exception) -> tuple[str, str]:
    """Return (what is wrong with a serial port, the remedy) for an OSError or an exception of
    pyserial, whose own texts are for programmers."""
    text = str(error)
    match = re.search(r"\[Errno (\d+)\]", text)
    number = getattr(error, "errno", None) or (int(match[1]) if match else None)
    if number is not None:
        mend = _MENDS.get(number, "camtool ports lists the ports")
        return os.strerror(number), mend
    if "returned no data" in text or "disconnected" in text:
        mend = "plug it in again, and close other programs that read from it"
        return "it was unplugged, or another program reads from it", mend
    return text, "camtool ports lists the ports"


class NoWire(Struct, frozen=True):
    """A machine to which camtool cannot send: `why`, and what to use instead (`mend`)."""

    why: str = "the protocol of its line is not among those that can be sent"
    mend: str = "send the program as the machine's own programs do"
