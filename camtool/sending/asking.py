"""What stands behind a port, asked by bytes that move nothing."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator

from msgspec import Struct

from camtool.errors import InputError
from camtool.sending.line import Port, opened_line
from camtool.target.wire import Wire

ANSWER_S = 2.5
"""Longest wait for an answer: a board that its port resets takes 2 s to begin."""

AGAIN_S = 1.0
"""Interval at which the question is repeated: a board that begins loses what comes meanwhile."""

MAX_HEARD = 400


class Answer(Struct, frozen=True):
    """The answer at a port: its baud rate (None if it has none), the bytes that were sent
    (hexadecimal), the text that was received, and the controller that answers so ("" if unknown).
    """

    baud: int | None
    sent: str
    heard: str
    controller: str


def questions(port: str, wires: Iterable[Wire]) -> Iterator[tuple[Wire, Port]]:
    """Yield (wire, port with the wire's settings) for each wire that may be tried at a port: for a
    serial port the wires with a known rate, for a socket all."""
    for wire in wires:
        settings = Port(port, wire.baud, wire.frame)
        if wire.question and (wire.baud is not None or "://" in port):
            yield wire, settings


def ask(port: Port, wire: Wire) -> Answer:
    """Send a wire's question to a port until it is answered; return what was received. InputError
    for a port that cannot be opened or read."""
    sent, heard, controller = bytearray(), b"", ""
    with opened_line(port) as line:
        try:
            end = time.monotonic() + ANSWER_S
            next_s = 0.0
            while time.monotonic() < end:
                if time.monotonic() >= next_s:
                    line.write(wire.question)
                    sent += wire.question
                    next_s = time.monotonic() + AGAIN_S
                heard = (heard + line.read(0.05))[-MAX_HEARD:]
                more = wire.recognised(heard.decode("latin-1"))
                if more and not controller:  # a board that begins says its state a little later
                    end = min(end, time.monotonic() + AGAIN_S)
                controller = more
        except OSError as error:
            raise InputError(f"it is gone ({error})", file=port.name) from error
    return Answer(port.baud, sent.hex(" "), heard.decode("latin-1"), controller)
