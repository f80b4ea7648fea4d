"""Wishes of the user while a machine works: keys, signals, a terminal or a pipe that is lost.

Nothing here may leave a machine alone: every signal that would end camtool, a terminal that is
closed, and a reader of its output that goes away are wishes to stop. Only kill -9 is not seen.
"""

from __future__ import annotations

import os
import select
import signal
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from types import FrameType
from typing import TextIO

from camtool.cli.messages import say
from camtool.plain import one_line
from camtool.sending.drive import Request

ENDING = ("SIGINT", "SIGQUIT", "SIGBREAK", "SIGTERM", "SIGHUP")
"""Signals that would end camtool; not all systems have all of them."""

BY_HAND = ("SIGINT", "SIGQUIT", "SIGBREAK")
"""Those that a person gives: a second one ends camtool without waiting for the machine. Others may
come twice for one cause, as SIGHUP does from a shell and from the terminal that it lost."""

ONE_S = 0.5
"""Interrupts that follow each other within this time are one: a program that started camtool may
pass on what the terminal has sent to both."""

SUSPEND = "SIGTSTP"
"""Ctrl-Z. A sender that slept would leave its machine alone."""


class UserRequests:
    """Return the next request each time it is called, None without one. `key` returns the pressed
    key, and `keys` maps it to a request; interrupts within `one_s` count as one."""

    def __init__(
        self,
        key: Callable[[], str] = lambda: "",
        keys: Mapping[str, Request] | None = None,
        *,
        one_s: float = ONE_S,
    ) -> None:
        self._key, self._keys, self._one_s = key, keys or {}, one_s
        self._stops = self._closes = self._suspends = 0
        self._ended = False  # by a signal that no person at the keyboard gives
        self._interrupted: float | None = None
        self.by_hand = False
        """True if the last wish came from a person at the keyboard who is still there."""
        self._watched = {each for each in _streams() if not _is_lost(each)}

    def __call__(self) -> Request | None:
        self.by_hand = not self._ended
        if self._closes:
            self._closes = self._stops = 0
            return Request.CLOSE
        if self._stops:
            self._stops = 0
            return Request.STOP
        if self._suspends:
            self._suspends = 0
            return self._keys.get("p", Request.STOP)
        if any(map(_is_lost, self._watched)):
            self._watched.clear()  # said once
            self.by_hand = False
            return Request.STOP
        try:
            return self._keys.get(self._key())
        except OSError:  # what a terminal says that has been closed
            self._key = lambda: ""
            self.by_hand = False
            return Request.STOP

    @contextmanager
    def catch_signals(self) -> Iterator[None]:
        """Turn signals into requests within the block. A SIGHUP that is ignored, as under nohup,
        stays ignored."""
        names = [name for name in (*ENDING, SUSPEND) if hasattr(signal, name)]
        olds = {getattr(signal, name): name for name in names}
        if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
            del olds[signal.SIGHUP]
        before = {number: signal.signal(number, self._signal) for number in olds}
        try:
            yield
        finally:
            for number, old in before.items():
                signal.signal(number, old)

    def _signal(self, number: int, frame: FrameType | None) -> None:
        name = signal.Signals(number).name
        if name == SUSPEND:
            self._suspends += 1
            return
        if name in BY_HAND:
            time_s, last = time.monotonic(), self._interrupted
            self._interrupted = time_s
            if last is not None:
                self._closes += time_s - last >= self._one_s
                return
        else:
            self._ended = True
        self._stops += 1


def _streams() -> Iterator[int]:
    """Return the terminal that keys come from, and the output streams."""
    for stream in (sys.stdin, sys.stdout, sys.stderr):
        with suppress(AttributeError, OSError, ValueError):  # None, replaced or closed
            if stream is not sys.stdin or stream.isatty():
                yield stream.fileno()


def _is_lost(file: int) -> bool:
    """True if a terminal was closed, or a pipe has no reader any more."""
    if not hasattr(select, "poll"):
        return False
    looking = select.poll()
    looking.register(file, 0)
    return any(event & (select.POLLERR | select.POLLHUP) for _, event in looking.poll(0))


def takes_more(stream: TextIO | None) -> bool:
    """True if a stream can be written to at once. One that cannot, such as a terminal after Ctrl-S
    or a full pipe, must not keep a machine waiting."""
    if stream is None or not hasattr(select, "poll"):
        return True
    looking = select.poll()
    with suppress(OSError, ValueError):  # it is none of the system
        looking.register(stream.fileno(), select.POLLOUT)
        return bool(looking.poll(0))
    return True


class Messages:
    """Messages on stderr while a machine works; messages for which there is no room are kept."""

    def __init__(self, *, quiet: bool) -> None:
        self._quiet, self._waiting = quiet, list[str]()

    def __call__(self, text: str) -> None:
        self._waiting.append(text)
        while self._waiting and takes_more(sys.stderr):
            self.rest(1)

    def rest(self, max_count: int | None = None) -> None:
        """Write the messages that were kept."""
        for each in self._waiting[:max_count]:
            say(f"camtool: {one_line(each)}", quiet=self._quiet)
        del self._waiting[:max_count]


@contextmanager
def keys_of_terminal() -> Iterator[Callable[[], str]]:
    """Return a function that returns the pressed key, "" without one; None if stdin is no
    terminal. Its OSError means that the terminal is gone."""
    if sys.platform == "win32" or sys.stdin is None or not sys.stdin.isatty():
        yield lambda: ""
        return
    import termios
    import tty

    handle = sys.stdin.fileno()
    before = termios.tcgetattr(handle)

    def key() -> str:
        readable, _, _ = select.select([handle], [], [], 0)
        if not readable:
            return ""
        pressed = os.read(handle, 1)
        if not pressed:
            raise OSError("the terminal is gone")
        return pressed.decode("latin-1")

    try:
        tty.setcbreak(handle)
        yield key
    finally:
        with suppress(termios.error):  # it is gone
            termios.tcsetattr(handle, termios.TCSADRAIN, before)
