"""Protocol of the PIC18F4550: a block, a wait for its simulated time, the next block.

9600 8N1 without handshake (L1177-1209, L1468-1498); `C` and a line feed on opening. No answer and
no error is documented; the only pace of the PC's own program is its animation. So a block goes out
when the one before must be over, and a stop or a pause can only leave out what comes next. Of 128
characters and more a block is lost; that a block ends with a line feed is inferred from `C`. Where
`[link]` names an answer, it is waited for as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from camtool.errors import MachineError
from camtool.target.terminal import Terminal
from camtool.target.wire import LATE_S, Forecast, Manner, Packet, PacketByPacket, Wire

from .dialect import ValcncLink, ValcncMachine

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
    by_hand = frozenset({"line"})
    stopping = "nothing more is sent; the block that is being cut is cut to its end"

    def packets(self, data: bytes, machine: ValcncMachine, forecast: Forecast) -> Sequence[Packet]:
        """The lines with words, without blanks."""
        packets = [Packet(OPENING)]
        lines = (line.translate(None, b" \t") for line in data.splitlines())
        for block, line in enumerate(filter(None, lines)):
            if len(line) > BUFFER_CHARS:
                raise MachineError(
                    f"has {len(line)} characters, and the controller takes {BUFFER_CHARS}",
                    where=f"block {block + 1}",
                )
            packets.append(Packet(line + b"\n", block, forecast.seconds_of(block)))
        return packets

    def conversation(
        self, packets: Sequence[Packet], machine: ValcncMachine, manner: Manner
    ) -> ValcncConversation:
        """The conversation that sends these blocks."""
        if manner.home:
            raise MachineError("the controller has no command to home", where="--home")
        assert isinstance(machine.link, ValcncLink)
        return ValcncConversation(packets, machine.link, manner)

    def terminal(self, machine: ValcncMachine) -> Terminal:
        """Blocks."""
        return ValcncTerminal()


class ValcncTerminal(Terminal):
    """Blocks, one a line, of which none is known to be answered."""

    about = (
        "blocks such as G01 X1 Y0 Z0, each when the one before has been drawn; no answer is "
        "known, and nothing stops the machine but its switch"
    )

    def __init__(self) -> None:
        super().__init__()
        self.hello = OPENING


class ValcncConversation(PacketByPacket):
    """A block, its time, and its answer where it has one."""

    goes_on = "it draws the block that it has to its end; its switch stops it"

    def __init__(self, packets: Sequence[Packet], link: ValcncLink, manner: Manner) -> None:
        super().__init__(packets, manner)
        self._answer = b"".join(link.answer.encode("ascii").split())
        self._margin_s = link.margin_s * manner.late_s / LATE_S
        self._said = b""
        self._awaits = self._answered = False
        self._over = 0.0  # when the time of the block is over
        if not self._answer:
            self.stands = (
                "nothing more was sent; by the simulated time it stands, and says nothing"
            )

    def _send(self, packet: Packet, now: float) -> None:
        self._write(packet.data)
        self._awaits = bool(self._answer) and packet.block >= 0  # what C is answered is not known
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
