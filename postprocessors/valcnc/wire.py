"""Protocol of the PIC18F4550: a block, a wait for its simulated time, the next block.

9600 8N1 without handshake (L1177-1209, L1468-1498); `C` and a line feed on opening. No answer and
no error is documented; the only pace of the PC's own program is its animation. So a block goes out
when the one before must be over, and a stop or a pause can only leave out what comes next. Of 128
characters and more a block is lost; that a block ends with a line feed is inferred from `C`. Where
`[link]` names an answer, it is waited for as well."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Final, cast

import numpy as np

from camtool.arrays import Floats
from camtool.errors import MachineError, ProgramError
from camtool.machine.model import Machine
from camtool.simulation.motion import Options
from camtool.target.terminal import Terminal
from camtool.target.wire import (
    LATE_S,
    CommandHand,
    Conversation,
    Forecast,
    HandAction,
    Manner,
    Packet,
    PacketByPacket,
    Place,
    Wire,
)

from .controller import ValcncModel
from .dialect import ValcncController, ValcncDialect, ValcncLink, ValcncMachine, scales_of
from .read import read_block

SimulatedMachine = Machine[ValcncController, ValcncDialect]

OPENING: Final = b"C\n"

BUFFER_CHARS: Final = 127
"""A block has fewer than 128 characters."""

TIME_FACTOR: Final = 1.05
"""Factor on the simulated time of a block: nothing reports its end."""

BITS: Final = 10
"""Of a character on the line: 8N1."""


class ValcncWire(Wire):
    """The controller over RS-232."""

    baud = 9600
    ready = (
        "camtool waits for the simulated times, and cannot see whether a block was lost where the "
        "controller answers nothing (link.answer)",
        "keep a hand at the switch: a stop takes effect behind the block that is being cut",
    )
    by_hand = frozenset({"zero", "jog", "line"})
    jogs_from_place = True
    stopping = "nothing more is sent; the block that is being cut is cut to its end"

    def packets(self, data: bytes, machine: ValcncMachine, forecast: Forecast) -> Sequence[Packet]:
        """Return one packet for each line that has words, without its blanks."""
        packets = [Packet(OPENING)]
        lines = (line.translate(None, b" \t") for line in data.splitlines())
        for block, line in enumerate(filter(None, lines)):
            if len(line) > BUFFER_CHARS:
                raise MachineError(
                    f"has {len(line)} characters, and the controller takes {BUFFER_CHARS}",
                    where=f"block {block + 1}",
                )
            seconds, end_mm = forecast.seconds_of(block), forecast.end_of(block)
            packets.append(Packet(line + b"\n", block, seconds, end_mm=end_mm))
        return packets

    def conversation(
        self, packets: Sequence[Packet], machine: ValcncMachine, manner: Manner
    ) -> ValcncConversation:
        """Return the conversation that sends these blocks."""
        if manner.home:
            raise MachineError("the controller has no command to home", where="--home")
        assert isinstance(machine.link, ValcncLink)
        return ValcncConversation(packets, machine.link, manner)

    def terminal(self, machine: ValcncMachine) -> Terminal:
        """Return the terminal, to which blocks are typed."""
        return ValcncTerminal()

    def command(
        self, action: str, machine: ValcncMachine, values: Mapping[str, float], manner: Manner
    ) -> Conversation:
        """Return the conversation of a jog: a program of one block, or of two where Z moves too,
        up first or down last. Other actions as for all wires; MachineError for a zero."""
        if action == "zero":
            raise MachineError(
                f"{machine.target.name} has no command to zero over its line",
                mend="bring the tool to part zero, and switch the controller off and on there",
            )
        if action != "jog":
            return super().command(action, machine, values, manner)
        if manner.at_mm is None:
            raise MachineError(
                "its blocks are absolute, and it does not say where it stands",
                mend="say it: --at X0,Y0,Z0 (in the panel: zero) if it has just been switched on, "
                "else where the last program or jog has ended",
            )
        at = np.array(manner.at_mm)
        end = at + [values.get(letter, 0.0) for letter in "xyz"]
        packets, block = [Packet(OPENING)], _block(at, machine)
        place = manner.at_mm
        for corner in _corners(at, end):
            before, block = block, _block(corner, machine)
            if block != before:
                packets.append(_block_packet(block, machine, place))
                place = packets[-1].end_mm or place
        if len(packets) == 1:
            raise MachineError("that is less than the last decimal of a block", mend="jog by more")
        return self.conversation(packets, machine, manner)

    def hand(self, machine: ValcncMachine, manner: Manner) -> ValcncHand:
        """Return the conversation that jogs from place to place, and keeps the place."""
        return ValcncHand(self, machine, manner)


def _corners(at: Floats, end: Floats) -> Iterator[Floats]:
    """Yield the places (3,) mm of a jog: Z and the plane separately, with the tool up while it
    moves in the plane."""
    if end[2] > at[2]:
        yield np.array([at[0], at[1], end[2]])
    else:
        yield np.array([end[0], end[1], at[2]])
    yield end


def _block(place_mm: Floats, machine: ValcncMachine) -> bytes:
    """Return the block that moves to a place (3,) mm without cutting."""
    units = place_mm * scales_of(machine, machine.dialect)
    decimals = machine.dialect.decimals
    words = [
        f"{letter}{value:.{decimals}f}" for letter, value in zip("XYZ", units + 0.0, strict=True)
    ]
    return f"G00{''.join(words)}".encode("ascii")


def _block_packet(text: bytes, machine: ValcncMachine, at_mm: Place) -> Packet:
    """Return the packet of a block that begins at `at_mm`, with its simulated time and its end;
    ProgramError for text that is no block."""
    scales = scales_of(machine, machine.dialect)
    x, y, z = np.round(np.array(at_mm) * scales, machine.dialect.decimals).tolist()
    path, end = read_block(text, machine, (x, y, z))
    chunks = ValcncModel().run(path, cast(SimulatedMachine, machine), Options())
    seconds = float(np.concatenate([chunk.ledger.duration_s for chunk in chunks]).sum())
    x, y, z = (np.array(end) / scales).tolist()
    return Packet(text + b"\n", 0, seconds, end_mm=(x, y, z))


class ValcncHand(CommandHand):
    """A machine whose position is kept by the sender: it is known once the user has stated that
    the controller stands at part zero, and after a program."""

    def __init__(self, wire: ValcncWire, machine: ValcncMachine, manner: Manner) -> None:
        super().__init__(wire, machine, manner)
        self._of_valcnc = machine

    def order(self, action: HandAction, values: Mapping[str, float], now: float) -> None:
        """Carry out an order. "zero" sends nothing: it records that the controller stands at part
        zero."""
        if action != "zero":
            super().order(action, values, now)
            return
        self.check_ready(action)
        if not (values.keys() >= set("xyz") and not any(values.values())):
            raise MachineError(
                "the controller is at part zero on all axes when it is switched on, and takes no "
                "other place",
                mend="zero all axes at once",
            )
        self.place_mm = (0.0, 0.0, 0.0)
        self._tell("taken to stand at part zero: right if it has just been switched on there")

    def say(self, line: str, now: float) -> None:
        """Send a typed block, and wait for its simulated time where its start is known."""
        text = "".join(line.split()).encode("ascii", "replace")
        try:
            if self.place_mm is None:
                raise ProgramError("the begin of the block is not known")
            packet = _block_packet(text, self._of_valcnc, self.place_mm)
        except ProgramError:
            super().say(line, now)
            return
        packets = [Packet(OPENING), packet]
        self._begin("line", self._wire.conversation(packets, self._of_valcnc, self.manner), now)


class ValcncTerminal(Terminal):
    """Typed blocks, one a line; it is not known that any is answered."""

    about = (
        "blocks such as G01 X1 Y0 Z0, each when the one before has been drawn; no answer is "
        "known, and nothing stops the machine but its switch"
    )

    def __init__(self) -> None:
        super().__init__()
        self.hello = OPENING


class ValcncConversation(PacketByPacket):
    """A conversation that sends a block, and waits for its simulated time and its answer, if it
    has one."""

    goes_on = "it draws the block that it has to its end; its switch stops it"

    def __init__(self, packets: Sequence[Packet], link: ValcncLink, manner: Manner) -> None:
        super().__init__(packets, manner)
        self._answer = b"".join(link.answer.encode("ascii").split())
        self._margin_s = link.margin_s * manner.late_s / LATE_S
        self._said = b""
        self._awaits = self._answered = False
        self._over = 0.0  # end of the simulated time of the block
        self.place_mm = manner.at_mm
        if not self._answer:
            self.stands = (
                "nothing more was sent; by the simulated time it stands, and says nothing"
            )

    def _packet_done(self, now: float) -> None:
        self.place_mm = self.packets[self.sent - 1].end_mm or self.place_mm
        super()._packet_done(now)

    def _send(self, packet: Packet, now: float) -> None:
        self._write(packet.data)
        self._awaits = bool(self._answer) and packet.block >= 0  # the answer to C is not known
        self._answered = False
        self._over = now + len(packet.data) * BITS / (ValcncWire.baud or 1) + packet.seconds
        if not self._awaits:
            self._over += (TIME_FACTOR - 1.0) * packet.seconds + self._margin_s
        self.next_s = self._over

    def receive(self, data: bytes, now: float) -> None:
        """Compare received bytes with the awaited answer; show them to the user where none is
        awaited."""
        if self.is_over or not data.strip():
            return
        if not self._awaits:
            self._tell(f"it says: {data.strip()[:60].decode('latin-1')}")
            return
        self._said += b"".join(data.split())
        if not self._answer.startswith(self._said) or self._answered:
            self._fail(f"it says {self._said[:60]!r}, which is not the answer", now)
        elif self._said == self._answer:
            self._said, self._answered = b"", True
            self.tick(now)

    def tick(self, now: float) -> None:
        """End the block when its time is over."""
        if self.is_over or not self._busy or now < self._over:
            return
        if self._answered or not self._awaits:
            self._packet_done(now)
            return
        seconds = self.packets[self.sent - 1].seconds
        self.next_s = self._over + (TIME_FACTOR - 1.0) * seconds + self.manner.patience_s
        if now >= self.next_s:
            self._fail("it does not answer that the block is done", now)
