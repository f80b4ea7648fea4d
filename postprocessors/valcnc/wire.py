"""How programs are sent to the PIC18F4550: one block, its simulated time, the next block.

9600 8N1 without handshake (L1177-1209, L1468-1498); `C` and a line feed on opening. No answer and
no error is documented; the only pace of the PC's own program is its animation. So a block goes out
when the one before must be over, and a stop or a pause can only leave out what comes next. Of 128
characters and more a block is lost; that a block ends with a line feed is inferred from `C`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from camtool.errors import MachineError
from camtool.target.wire import Forecast, Manner, Packet, PacketByPacket, Wire

from .dialect import ValcncMachine

OPENING: Final = b"C\n"

BUFFER_CHARS: Final = 127
"""A block has fewer than 128 characters."""

SLOWER: Final = 1.05
"""How much longer than simulated a block may take: nothing says when it is over."""

BITS: Final = 10
"""Of a character on the line: 8N1."""


class ValcncWire(Wire):
    """The controller over RS-232."""

    baud = 9600
    ready = (
        "the controller answers nothing: camtool waits for the simulated times, and cannot see "
        "whether a block was lost",
        "keep a hand at the switch: a stop takes effect behind the block that is being cut",
    )
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
            packets.append(Packet(line + b"\n", block, float(forecast.seconds[block])))
        return packets

    def conversation(
        self, packets: Sequence[Packet], machine: ValcncMachine, manner: Manner
    ) -> ValcncConversation:
        """The conversation that sends these blocks."""
        if manner.home:
            raise MachineError("the controller has no command to home", where="--home")
        return ValcncConversation(packets, manner)


class ValcncConversation(PacketByPacket):
    """A block and its time."""

    def _send(self, packet: Packet, now: float) -> None:
        self._write(packet.data)
        line_s = len(packet.data) * BITS / (ValcncWire.baud or 1)
        self.next_s = now + line_s + SLOWER * packet.seconds + 2.0 * self.manner.late_s

    def received(self, data: bytes, now: float) -> None:
        """Shown; nothing is known of what it might say."""
        text = data.decode("latin-1").strip()
        if text and not self.ended:
            self._tell(f"it says: {text[:60]}")

    def elapsed(self, now: float) -> None:
        """The block must be over."""
        if self._busy and now >= self.next_s:
            self._packet_done(now)
