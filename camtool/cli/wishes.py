"""Wishes of the user while a machine works: keys, signals, a terminal or a pipe that is lost.

Nothing here may leave a machine alone: every signal that would end camtool, a terminal that is
closed, and a reader of its output that goes away are wishes to stop. Only kill -9 is not seen."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from types import FrameType
from typing import TextIO

from camtool.cli.messages import say
from camtool.plain import one_line
from camtool.sending.drive import Order, Request
from camtool.target.wire import Conversation, Override

ENDING = ("SIGINT", "SIGQUIT", "SIGBREAK", "SIGTERM", "SIGHUP")
"""Signals that would end camtool; not all systems have all of them."""

BY_HAND = ("SIGINT", "SIGQUIT", "SIGBREAK")
"""Signals that a person sends: a second one ends camtool without waiting for the machine. Others
may come twice for one cause, as SIGHUP does from a shell and from the terminal that it lost."""

ONE_S = 0.5
"""Interrupts that follow each other within this time count as one: a program that started camtool
may pass on what the terminal has sent to both."""

SUSPEND = "SIGTSTP"
"""Ctrl-Z. A sender that slept would leave its machine alone."""


MAX_OVERRIDE, OVERRIDE_STEP = 200, 10

OVERRIDE_KEYS: Mapping[str, tuple[Override, int]] = {
    "+": ("feed", OVERRIDE_STEP),
    "-": ("feed", -OVERRIDE_STEP),
    "]": ("spindle", OVERRIDE_STEP),
    "[": ("spindle", -OVERRIDE_STEP),
}
"""Keys of a terminal, with the override that each changes and by how much; "=" resets all to 100
%."""


def override_orders() -> dict[str, Request | Order]:
    """Return the orders by key: the keys that change feed and spindle overrides, and "=" which
    resets them."""

    def changed(name: Override, by: int) -> Order:
        def order(talk: Conversation, now: float) -> None:
            percent = talk.overrides.get(name, 100) + by
            talk.override(name, min(max(percent, OVERRIDE_STEP), MAX_OVERRIDE), now)

        return order

    def reset(talk: Conversation, now: float) -> None:
        for name in talk.overrides:
            talk.override(name, 100, now)

    return {**{key: changed(*change) for key, change in OVERRIDE_KEYS.items()}, "=": reset}


GUARDED = (
    'exec 3<&0 </dev/null; (read _ <&3; kill -s TERM 0) & exec 3<&-; sh -c "$0"; code=$?; '
    "kill -s KILL $! 2>/dev/null; exit $code"
)
"""Script of the shell that runs a command, `$0`, and ends it with all that it has begun when the
pipe at its input is closed: by camtool, or because camtool was killed."""


class AtStop:
    """The answer to a program that waits for an operator (M0, a tool change) when nobody is there.
    "fail" stops the machine; any other text is a shell command: the program goes on if it ends
    with exit code 0, and the machine is stopped otherwise.

    The command gets the reason in its environment (`CAMTOOL_WHY`), never in its text, since it
    comes from the program's comments."""

    def __init__(self, command: str) -> None:
        self._command = command
        self._running: subprocess.Popen[bytes] | None = None
        self._stops = False
        self.trouble = ""
        """Why the machine is being stopped, "" if it is not."""

    def begin(self, why: str) -> None:
        """Begin to answer a stop of the program: start the command, or note that the machine is to
        be stopped."""
        if self._command == "fail":
            self._stops, self.trouble = True, "it waits, and --at-stop is fail"
            return
        values = {**os.environ, "CAMTOOL_WHY": one_line(why)}
        if sys.platform == "win32":
            self._running = subprocess.Popen(  # the user's own command
                self._command, shell=True, env=values, stdin=subprocess.DEVNULL
            )
            return
        self._running = subprocess.Popen(
            ["/bin/sh", "-c", GUARDED, self._command],
            env=values,
            stdin=subprocess.PIPE,
            start_new_session=True,
        )

    def __call__(self) -> Request | None:
        """Return the request that the answer gives: RESUME or STOP once the command has ended,
        None before."""
        if self._stops:
            self._stops = False
            return Request.STOP
        code = None if self._running is None else self._running.poll()
        if code is None:
            return None
        self._running = None
        if code == 0:
            return Request.RESUME
        self.trouble = f"the command of --at-stop ended with exit code {code}"
        return Request.STOP

    def end(self) -> None:
        """End the command if it still runs: nobody needs its answer any more."""
        running, self._running = self._running, None
        if running is None:
            return
        if running.stdin is None:
            running.terminate()
        else:
            running.stdin.close()
            running.wait()


class UserRequests:
    """A function that returns the next request of the user, None without one. `key` returns the
    pressed key, and `keys` maps it to a request; interrupts within `one_s` count as one."""

    def __init__(
        self,
        key: Callable[[], str] = lambda: "",
        keys: Mapping[str, Request | Order] | None = None,
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

    def __call__(self) -> Request | Order | None:
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
    """Yield the descriptors to watch: the terminal that keys come from, and the output streams."""
    for stream in (sys.stdin, sys.stdout, sys.stderr):
        with suppress(AttributeError, OSError, ValueError):  # None, replaced or closed
            if stream is not sys.stdin or stream.isatty():
                yield stream.fileno()


def _is_lost(file: int) -> bool:
    """Return True if a terminal was closed, or a pipe has no reader any more."""
    if not hasattr(select, "poll"):
        return False
    looking = select.poll()
    looking.register(file, 0)
    return any(event & (select.POLLERR | select.POLLHUP) for _, event in looking.poll(0))


def takes_more(stream: TextIO | None) -> bool:
    """Return True if a write to the stream would not block. A stream that blocks, such as a
    terminal after Ctrl-S or a full pipe, must not delay a running machine."""
    if stream is None or not hasattr(select, "poll"):
        return True
    looking = select.poll()
    with suppress(OSError, ValueError):  # a stream without a file descriptor
        looking.register(stream.fileno(), select.POLLOUT)
        return bool(looking.poll(0))
    return True


class Messages:
    """Messages on stderr while a machine works. A message that stderr does not take at once is
    kept."""

    def __init__(self, *, quiet: bool) -> None:
        self._quiet, self._waiting = quiet, list[str]()

    def __call__(self, text: str) -> None:
        self._waiting.append(text)
        while self._waiting and takes_more(sys.stderr):
            self.rest(1)

    def rest(self, max_count: int | None = None) -> None:
        """Write the messages that were kept, at most `max_count` of them."""
        for each in self._waiting[:max_count]:
            say(f"camtool: {one_line(each)}", quiet=self._quiet)
        del self._waiting[:max_count]


@contextmanager
def keys_of_terminal() -> Iterator[Callable[[], str]]:
    """Yield a function that returns the pressed key, "" if none; yield None if stdin is no
    terminal. An OSError of the function means that the terminal is gone."""
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
