"""The host of a virtual controller: a pseudo-terminal or a TCP port, and a clock.

The host is thin: it carries bytes between a port and a `Wired` twin, and says what time it is. One
client at a time; a new one finds the machine as the last has left it, and opens the line, which
some controllers take for a reset.
"""

from __future__ import annotations

import os
import select
import socket
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Final, Protocol

from camtool.errors import OptionError
from camtool.sending.faults import Wired

PORTION: Final = 4096
"""So many bytes are carried at a time."""

LOOK_S: Final = 0.02
"""How often it is looked whether somebody has opened the port, s."""

ANSWER_S: Final = 0.001
"""With no clock to keep, a client has so long to answer what it was told, s."""


class Port(Protocol):
    """Where clients come."""

    name: str
    """What a client opens."""

    def client(self) -> int | None:
        """The file descriptor of the client, None where there is none."""

    def hung_up(self) -> None:
        """The client has gone, or its plug was pulled."""

    def close(self) -> None:
        """No client can come any more."""


class PseudoTerminal:
    """A pseudo-terminal of this computer; a client is whoever has it open."""

    def __init__(self) -> None:
        if sys.platform == "win32":
            raise OptionError("Windows has no pseudo-terminals", mend="use --tcp PORT")
        import pty

        self._master, slave = pty.openpty()
        self.name = os.ttyname(slave)
        os.set_blocking(self._master, False)
        self._raw(slave)
        os.close(slave)
        self._open = False

    @staticmethod
    def _raw(slave: int) -> None:
        """No echo, no signals and no changed line ends, even before the client says so."""
        import tty

        tty.setraw(slave)

    def client(self) -> int | None:
        """The side of the machine, while somebody has the other one open."""
        looking = select.poll()
        looking.register(self._master, select.POLLIN)
        # What the client has written before it closed is still to be read.
        both = select.POLLHUP | select.POLLIN
        if any(event & both == select.POLLHUP for _, event in looking.poll(0)):
            self._open = False
            return None
        if not self._open:
            slave = os.open(self.name, os.O_RDWR | os.O_NOCTTY)
            self._raw(slave)
            os.close(slave)
            self._open = True
        return self._master

    def hung_up(self) -> None:
        """Nothing: the client has closed it."""

    def close(self) -> None:
        """Take it away; who has it open reads its end."""
        os.close(self._master)


class TcpPort:
    """A TCP port; the first client is served, others wait."""

    def __init__(self, host: str, port: int) -> None:
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        try:
            self._server = socket.create_server((host, port), family=family)
        except OSError as error:
            raise OptionError(f"cannot listen at {host}:{port} ({error.strerror})") from error
        self._server.setblocking(False)
        host, port = self._server.getsockname()[:2]
        self.name = f"socket://{host}:{port}"
        self._client: socket.socket | None = None

    def client(self) -> int | None:
        """The client that is served."""
        if self._client is None:
            with suppress(BlockingIOError):
                self._client, _ = self._server.accept()
                self._client.setblocking(False)
                self._client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return None if self._client is None else self._client.fileno()

    def hung_up(self) -> None:
        """Wait for the next client."""
        if self._client is not None:
            self._client.close()
        self._client = None

    def close(self) -> None:
        """Listen no more."""
        self.hung_up()
        self._server.close()


class Clock:
    """Seconds of the machine: `speed` times those of the world; None: it jumps to whatever comes
    next as soon as nobody says anything."""

    def __init__(self, speed: float | None) -> None:
        self.speed = speed
        self._begun, self._now = time.monotonic(), 0.0

    def now(self) -> float:
        """What time it is."""
        if self.speed is not None:
            self._now = (time.monotonic() - self._begun) * self.speed
        return self._now

    def patience_s(self, at: float | None) -> float:
        """How long to wait in the world for a client, where something comes at `at`."""
        if at is None:
            return LOOK_S
        if self.speed is None:
            return ANSWER_S
        return min(max((at - self.now()) / self.speed, 0.0), LOOK_S)

    def nobody_spoke(self, at: float | None) -> None:
        """Nothing came in the meantime."""
        if self.speed is None and at is not None:
            self._now = max(self._now, at)


def serve(
    wired: Wired,
    port: Port,
    clock: Clock,
    *,
    once: bool = False,
    each: Callable[[], None] = lambda: None,
) -> None:
    """Carry bytes until the plug is pulled, or with `once` until the first client has gone;
    `each`: called again and again."""
    waiting, connected = b"", False
    while not wired.unplugged(clock.now()):
        each()
        file = port.client()
        if file is None:
            if connected and once:
                return
            connected, waiting = False, b""
            wired.read(clock.now())
            at = wired.turn_s()
            time.sleep(min(clock.patience_s(at), LOOK_S))
            clock.nobody_spoke(at)
            continue
        if not connected:
            connected = True
            wired.connect(clock.now())
        waiting += wired.read(clock.now())
        at = wired.turn_s()
        patience = 0.0 if waiting else clock.patience_s(at)
        readable, writable, _ = select.select([file], [file] if waiting else [], [], patience)
        try:
            if writable:
                waiting = waiting[os.write(file, waiting[:PORTION]) :]
            if readable:
                data = os.read(file, PORTION)
                if not data:
                    raise ConnectionResetError
                wired.write(data, clock.now())
        except BlockingIOError:
            continue
        except OSError:
            port.hung_up()
            continue
        if not readable and not waiting:
            clock.nobody_spoke(at)
