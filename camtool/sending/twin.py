"""The host of a virtual controller: a pseudo-terminal or a TCP port, and a clock.

The host carries bytes between a port and a `WiredTwin`, and keeps the time. It serves one client
at a time; a new one finds the machine as the last one left it, and opens the line, which resets
some controllers."""

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
from camtool.sending.faults import WiredTwin

MAX_WRITE_BYTES: Final = 4096

POLL_S: Final = 0.02
"""Interval at which a client is looked for."""

ANSWER_S: Final = 0.001
"""Time that a client has to answer before a clock without real time jumps."""


class TwinPort(Protocol):
    """A port that clients open."""

    name: str
    """The name by which a client opens it."""

    def client(self) -> int | None:
        """Return the file descriptor of the client, None without one."""

    def hang_up(self) -> None:
        """Close the connection of a client that is gone, or whose plug was pulled."""

    def close(self) -> None:
        """Close the port for all clients."""


class PseudoTerminal:
    """A pseudo-terminal of this computer; its client is the process that has it open."""

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
        """Switch off echo, signals and the translation of line ends, even before a client does."""
        import tty

        tty.setraw(slave)

    def client(self) -> int | None:
        """Return the machine's side while a client has the other side open."""
        looking = select.poll()
        looking.register(self._master, select.POLLIN)
        # What the client has written before it closed is still to be read.
        events = select.POLLHUP | select.POLLIN
        if any(event & events == select.POLLHUP for _, event in looking.poll(0)):
            self._open = False
            return None
        if not self._open:
            slave = os.open(self.name, os.O_RDWR | os.O_NOCTTY)
            self._raw(slave)
            os.close(slave)
            self._open = True
        return self._master

    def hang_up(self) -> None:
        """Do nothing: the client itself has closed the terminal."""

    def close(self) -> None:
        """Close the terminal; a client that has it open reads its end."""
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
        """Return the file descriptor of the client being served, None if there is none."""
        if self._client is None:
            with suppress(BlockingIOError):
                self._client, _ = self._server.accept()
                self._client.setblocking(False)
                self._client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return None if self._client is None else self._client.fileno()

    def hang_up(self) -> None:
        """Drop the client and wait for the next one."""
        if self._client is not None:
            self._client.close()
        self._client = None

    def close(self) -> None:
        """Stop listening."""
        self.hang_up()
        self._server.close()


class Clock:
    """Clock of the virtual machine, s: `speed` times real time. `speed` None: it jumps to the next
    event whenever no client sends anything."""

    def __init__(self, speed: float | None) -> None:
        self.speed = speed
        self._begun, self._now = time.monotonic(), 0.0

    def now(self) -> float:
        """Return the time of the machine, s."""
        if self.speed is not None:
            self._now = (time.monotonic() - self._begun) * self.speed
        return self._now

    def wait_s(self, event_s: float | None) -> float:
        """Return the real time to wait for a client if the next event is at `event_s`."""
        if event_s is None:
            return POLL_S
        if self.speed is None:
            return ANSWER_S
        return min(max((event_s - self.now()) / self.speed, 0.0), POLL_S)

    def skip_to(self, event_s: float | None) -> None:
        """Advance a clock without real time to `event_s`; called when no client has sent
        anything."""
        if self.speed is None and event_s is not None:
            self._now = max(self._now, event_s)


def serve(
    wired: WiredTwin,
    port: TwinPort,
    clock: Clock,
    *,
    ends_with_client: bool = False,
    each: Callable[[], None] = lambda: None,
) -> None:
    """Carry bytes until the plug is pulled, or until the first client is gone if
    `ends_with_client`; `each` is called in every turn."""
    waiting, connected = b"", False
    while not wired.unplugged(clock.now()):
        each()
        file = port.client()
        if file is None:
            if connected and ends_with_client:
                return
            connected, waiting = False, b""
            wired.read(clock.now())
            event_s = wired.wake_s()
            time.sleep(min(clock.wait_s(event_s), POLL_S))
            clock.skip_to(event_s)
            continue
        if not connected:
            connected = True
            wired.connect(clock.now())
        waiting += wired.read(clock.now())
        event_s = wired.wake_s()
        patience = 0.0 if waiting else clock.wait_s(event_s)
        readable, writable, _ = select.select([file], [file] if waiting else [], [], patience)
        try:
            if writable:
                waiting = waiting[os.write(file, waiting[:MAX_WRITE_BYTES]) :]
            if readable:
                data = os.read(file, MAX_WRITE_BYTES)
                if not data:
                    raise ConnectionResetError
                wired.write(data, clock.now())
        except BlockingIOError:
            continue
        except OSError:
            port.hang_up()
            continue
        if not readable and not waiting:
            clock.skip_to(event_s)
