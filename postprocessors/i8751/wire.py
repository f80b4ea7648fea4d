"""Protocol of the Intel 8751: a byte, its reply, the next byte; a packet, its F.

2400 8N1 (L3921), raw bytes; 13H and 11H are data, so that no flow control may be on. The key 13H
is answered by LISTO, or by OTRO, and is then sent again (L4397-4426). Each byte of a record is
answered by one character (L4428-4463), and each packet by F when it has been executed
(L4343-4366). So nothing moves before all of a packet has been answered. A reply that is missing
or another one ends the program; a wrong bit on the way to the machine is not seen, since replies
do not repeat what came. `[dialect]` and `[link]` say what the thesis leaves open."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import numpy as np
from msgspec import Struct

from camtool.errors import MachineError
from camtool.records import replace
from camtool.target.terminal import Terminal
from camtool.target.wire import NEVER, Forecast, Manner, Packet, PacketByPacket, Wire

from .dialect import I8751Dialect, I8751Link, I8751Machine
from .pulses import PulseTimes
from .stream import stream_of
from .write import END_OF_DATA, END_OF_PACKET, KEY, STOPPED, packet_bytes

READY: Final = "LISTO"
AGAIN: Final = "OTRO"

KEY_TRIES: Final = 5

TIME_FACTOR: Final = 1.05
"""Factor on the simulated time of a packet, beyond the lateness of the line."""

ANY: Final = "?"
"""A reply of which nothing is known, not even whether there is one."""

UNMOVED: Final = "nothing of this packet has moved, and the controller must be reset"

NONE: Final = "-"

ROUND_TRIP_S: Final = 2.0 * 10.0 / 2400.0 * 0.9
"""Shortest time between a byte and its reply, s: both take ten bits on the line, less a tenth for
clocks that differ."""

UNANSWERED_FACTOR: Final = 2.0
"""Wait behind a byte without a reply, in multiples of the lateness of the line."""

SLOWEST_HZ: Final = 8.0
"""Lowest rate of a motor (L3150-3183): the search of the origin has no ramp of its own."""

MAX_HOMING_S: Final = 1200.0
"""Longest search of the origin of an axis whose travel is not known, s."""

HOMES: Final = "if it seeks its origin, it goes on until it has found it: its switch stops it"


class I8751Wire(Wire):
    """The controller over RS-232."""

    baud = 2400
    place = "steps"
    ready = (
        "the controller knows only steps: wherever the tool stands is part zero to it",
        "the controller has just been reset: it waits for its key",
        "a wrong bit on the way to the machine is not seen: replies do not repeat what came",
    )
    by_hand = frozenset({"home", "jog", "line"})
    stopping = (
        "a packet that is being executed is executed to its end; one that is not complete yet is "
        "never begun, and the controller must then be reset"
    )

    def packets(self, data: bytes, machine: I8751Machine, forecast: Forecast) -> Sequence[Packet]:
        """Return the packets of up to five records, the first with the key; then the end of the
        data."""
        packets, record = [], 0
        for part in _parts(stream_of(data, machine), machine):
            seconds = float(forecast.seconds[record : record + part.records].sum())
            record += part.records
            # The end of the data is a block of its own, behind the last record.
            block = record - 1 if part.records else record
            packets.append(Packet(part.data, block, seconds))
        return packets

    def conversation(
        self, packets: Sequence[Packet], machine: I8751Machine, manner: Manner
    ) -> I8751Conversation:
        """Return the conversation that sends these packets."""
        if manner.home:
            raise MachineError(
                "the controller homes at a reset alone",
                where="--home",
                mend="home it by camtool home: where it stands then is part zero to a program",
            )
        return I8751Conversation(packets, machine, manner)

    def terminal(self, machine: I8751Machine) -> Terminal:
        """Return the terminal, to which bytes are typed in hex; it explains the letters."""
        return I8751Terminal()

    def command(
        self, action: str, machine: I8751Machine, values: Mapping[str, float], manner: Manner
    ) -> I8751Conversation:
        """Return the conversation of a jog: a program of its steps, at the machine's only speed.
        Homing is an empty program behind a reset."""
        if action == "home":
            return self._homing(machine, manner)
        if action != "jog":
            return super().command(action, machine, values, manner)  # type: ignore[return-value]
        axes = zip("xyz", machine.axes, strict=True)
        travel = [round(values.get(letter, 0.0) / axis.coded_step_mm) for letter, axis in axes]
        if not any(travel):
            raise MachineError("that is less than a step", mend="jog by more")
        max_steps = machine.dialect.most_steps
        count = -(-max(map(abs, travel)) // max_steps)
        ends = np.outer(np.arange(count + 1), travel) // count
        steps = np.diff(ends, axis=0)
        times = PulseTimes(machine.dialect)
        seconds = float(times.legs_s(steps[:, :2]).sum() + times.alone_s(steps[:, 2]).sum())
        stream = packet_bytes(steps, np.zeros((count, 2), dtype=np.int64), machine.dialect)
        parts = list(_parts(stream, machine))
        packets = [Packet(part.data, seconds=seconds) for part in parts]
        return I8751Conversation(packets, machine, manner)

    def _homing(self, machine: I8751Machine, manner: Manner) -> I8751Conversation:
        """Return the conversation with a controller that seeks its opto switches after a reset
        (L5267-5338): it takes the key when it has found them."""
        assert isinstance(machine.link, I8751Link)
        if machine.link.homing == "none":
            raise MachineError(
                "the controller's program has no search of its origin (link.homing is none)",
                mend='set link.homing to "start" where it was given one, as the thesis proposes',
            )
        nothing = np.zeros((1, 3), dtype=np.int64)
        stream = packet_bytes(nothing, nothing[:, :2], machine.dialect)
        packets = [Packet(part.data) for part in _parts(stream, machine)]
        packets[0] = replace(packets[0], ask="it homes when it is reset: has it just been reset")
        homing_s = sum(
            MAX_HOMING_S
            if axis.travel_mm is None
            else axis.travel_mm / axis.coded_step_mm / SLOWEST_HZ
            for axis in machine.axes
        )
        return I8751Conversation(packets, machine, manner, homing_s=homing_s)


class I8751Terminal(Terminal):
    """Bytes typed in hex, and the letters that come back."""

    end = b""
    about = (
        "bytes in hex: 13 is the key, 01 03 00 64 makes 100 steps of X, 45 executes a packet, 54 "
        "ends; nothing stops what is executed but the switch"
    )

    MEANINGS: Final = {
        READY: "the key was right: records may come",
        AGAIN: "this is not the key",
        "B": "the number of a motor was taken",
        "8": "the number of a motor was taken",
        "M": "a datum was stored",
        "F": "the packet has been executed",
        "A": "the end of the data was taken",
    }
    _WORDS: Final = re.compile(f"{READY}|{AGAIN}|.")

    def encode(self, line: str) -> bytes:
        """Return the bytes of hex digits; other text is encoded as for all wires."""
        try:
            return bytes.fromhex(line)
        except ValueError:
            return self.unescape(line)

    def decode(self, data: bytes) -> list[str]:
        """Return all letters and the meaning of the last one; the beginning of an unfinished word
        is kept for later."""
        text = "".join((self._rest + data).decode("latin-1").split())
        self._rest = b""
        if any(word.startswith(text) and word != text for word in (READY, AGAIN)):
            self._rest = text.encode("latin-1")
            return []
        words = self._WORDS.findall(text)
        return [self._with_meaning(" ".join(words).encode("latin-1"))] if words else []

    def meaning(self, line: str) -> str:
        """Return the meaning of the last word received."""
        return self.MEANINGS.get(line.rpartition(" ")[2], "")


class _Part(Struct, frozen=True):
    """A packet: its bytes, the reply to each, and how many records it has."""

    data: bytes
    replies: tuple[str, ...]
    records: int


def _parts(stream: bytes, machine: I8751Machine) -> Iterator[_Part]:
    """Yield the packets of a stream in which the reader has found no fault, or that the writer has
    made."""
    dialect: I8751Dialect = machine.dialect
    assert isinstance(machine.link, I8751Link)
    begin = offset = records = 0
    replies: list[str] = []
    while offset < len(stream):
        octet = stream[offset]
        if octet == KEY:
            replies.append(READY)
        elif octet == END_OF_PACKET:
            replies.append("".join(machine.link.packet_end.split()))
        elif octet == END_OF_DATA:
            replies.append("A")
        elif octet in (1, 2, 3):
            records += octet == 1
            data = 1 if stream[offset + 1] == STOPPED else 3
            replies += [dialect.motor_reply, *"M" * data]
        else:
            replies += dialect.dwell_replies
        offset = begin + len(replies)
        if octet in (END_OF_PACKET, END_OF_DATA):
            yield _Part(stream[begin:offset], tuple(replies), records)
            begin, replies, records = offset, [], 0


class I8751Conversation(PacketByPacket):
    """A conversation in single bytes, each sent after the reply to the one before."""

    stands = "stopped: it has executed what it was sent, and stands"
    goes_on = "it executes the packet to its end; its switch stops it"

    def __init__(
        self,
        packets: Sequence[Packet],
        machine: I8751Machine,
        manner: Manner,
        *,
        homing_s: float = 0.0,
    ) -> None:
        """Begin before the first packet. `homing_s`: the time that the machine may seek its origin
        before it takes the key, s."""
        super().__init__(packets, manner)
        self._homing_s = homing_s
        self._homed_by_s = NEVER
        stream = b"".join(packet.data for packet in packets)
        self._replies = [part.replies for part in _parts(stream, machine)]
        self._known = machine.dialect.motor_reply + "M"
        self._at = 0  # index of the byte that was sent last
        self._said = ""
        self._tries = 0
        self._written = 0.0

    @property
    def is_still(self) -> bool:
        """True as for other conversations, unless the machine may still seek its origin."""
        return super().is_still and not (self._seeks_origin and self.done == 0)

    @property
    def _seeks_origin(self) -> bool:
        """True until the key is answered, while the machine may still be homing."""
        return self._homing_s > 0.0 and self.sent <= 1 and self._at == 0

    def _send(self, packet: Packet, now: float) -> None:
        self._at, self._tries = 0, 1
        self._homed_by_s = now + self._homing_s
        self._send_byte(now)

    def _send_byte(self, now: float) -> None:
        packet, octet = self.packets[self.sent - 1], self._octet
        self._write(octet)
        self._said, self._written = "", now
        wait_s = self.manner.patience_s
        if self._reply in (ANY, NONE):
            wait_s = UNANSWERED_FACTOR * self.manner.late_s
        elif self._executes:
            wait_s += TIME_FACTOR * packet.seconds
        self.next_s = now + wait_s

    @property
    def _octet(self) -> bytes:
        return self.packets[self.sent - 1].data[self._at : self._at + 1]

    @property
    def _executes(self) -> bool:
        """True if the byte just sent ends the packet, which makes the machine move."""
        return self._octet[0] == END_OF_PACKET and self._at == len(self._packet_replies) - 1

    @property
    def _packet_replies(self) -> tuple[str, ...]:
        return self._replies[self.sent - 1]

    @property
    def _reply(self) -> str:
        return self._packet_replies[self._at]

    def receive(self, data: bytes, now: float) -> None:
        """Handle the reply to the byte just sent; line ends are ignored."""
        text = "".join(data.decode("latin-1").split())
        if self.is_over or not text:
            return
        if not self._busy:
            self._fail(f"it says {text[:20]!r} without being asked", now)
            return
        self._said += text
        awaits_key = self._reply == READY and self._tries < KEY_TRIES
        is_paced = self.manner.paced and not self._seeks_origin
        if is_paced and now - self._written < ROUND_TRIP_S:
            self._fail(f"{self._said[:20]!r} comes too soon{self._in_reply}", now)
        elif self._is_answered:
            self._byte_done(now)
        elif awaits_key and self._said == AGAIN:
            self._tries += 1
            self._send_byte(now)
        elif not self._reply.startswith(self._said) and not (
            awaits_key and AGAIN.startswith(self._said)
        ):
            self._fail(f"it says {self._said[:20]!r}, not {self._reply}{self._in_reply}", now)

    @property
    def _is_answered(self) -> bool:
        if self._reply == ANY:
            return len(self._said) == 1 and self._said in self._known
        return self._said == self._reply

    @property
    def _in_reply(self) -> str:
        return f", to the byte {self._octet.hex().upper()}H{self._mend}"

    @property
    def _mend(self) -> str:
        if self._executes:
            return "; it may be executing the packet: switch it off"
        if self._seeks_origin:
            return f"; {HOMES}"
        if not self.done and not self._at:
            return f"; {UNMOVED}; is it switched on, and is --baud its rate?"
        return f"; {UNMOVED}"

    @property
    def _unattended(self) -> str:
        if self._busy and self._seeks_origin:
            return HOMES
        return super()._unattended if self._busy and self._executes else ""

    def _byte_done(self, now: float) -> None:
        packet = self.packets[self.sent - 1]
        self._at += 1
        if self._at == len(packet.data):
            self._packet_done(now)
        else:
            self._send_byte(now)

    def tick(self, now: float) -> None:
        """Send the next byte where no reply is expected; fail where a reply is overdue."""
        if self.is_over or not self._busy or now < self.next_s:
            return
        if self._reply in (ANY, NONE):
            self._byte_done(now)
        elif self._seeks_origin and now < self._homed_by_s:
            self._send_byte(now)  # it hears nothing before it is at its origin
        else:
            self._fail(f"no reply, {self._reply} was awaited{self._in_reply}", now)

    def _halt(self, now: float, *, unsent: bool) -> bool:
        """Send nothing more: an incomplete packet is never executed."""
        if self._executes and not unsent:
            return False
        if self._seeks_origin:
            self._stopped(f"nothing more was sent; {HOMES}")
            return True
        self._stopped(f"stopped: {UNMOVED}")
        return True
