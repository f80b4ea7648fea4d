"""Signs of life: on a terminal, a command that takes longer than a second shows what it is doing.

    camtool: simulating and judging, 43 %, 12 s

The line stands on stderr, where the next one or a message takes its place, and is gone at the end.
It is written by a thread of its own from the `Progress` of the command, which stages set as they
begin. It stands still while a compiled loop runs that gives no other thread a turn."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import TextIO

import click

from camtool.plain import one_line
from camtool.progress import Progress

AFTER_S = 1.0
"""Time before the first status line."""

EVERY_S = 0.5
"""Interval of updates of the status line."""

_OWN = ("batch",)
_QUIET = ("-q", "--quiet")


class LifeSigns:
    """A status line on `stream` about a `progress`, with the time since `counting` began; other
    threads may print above it."""

    def __init__(self, stream: TextIO | None, progress: Progress) -> None:
        self.progress = progress
        self._stream = stream
        self._begun: float | None = time.monotonic()
        self._shown = ""
        self._writing = threading.Lock()

    @contextmanager
    def counting(self) -> Iterator[None]:
        """Count the time from now to the end of the block; nothing is shown after it."""
        self.progress.begin("")
        self._begun = time.monotonic()
        try:
            yield
        finally:
            self._begun = None
            self.hide()

    @contextmanager
    def hidden(self) -> Iterator[None]:
        """Hide the status line within the block, while the user is asked a question."""
        begin, self._begun = self._begun, None
        self.hide()
        try:
            yield
        finally:
            self._begun = begin

    def show(self) -> None:
        """Write the line, once the command takes long."""
        begin, progress = self._begun, self.progress
        if begin is None:
            return
        seconds = time.monotonic() - begin
        share = "" if progress.share is None else f"{progress.share:.0%}".replace("%", " %")
        parts = (progress.stage, share, f"{seconds:.0f} s")
        line = one_line(f"camtool: {', '.join(filter(None, parts))}")
        if seconds >= AFTER_S:
            import shutil

            self._write(line[: shutil.get_terminal_size().columns - 1])

    def hide(self) -> None:
        """Erase the line."""
        if self._shown:
            self._write("")

    def _write(self, line: str) -> None:
        with self._writing, suppress(OSError, ValueError):  # a terminal that goes away
            if self._stream is not None:
                self._stream.write(f"{line.ljust(len(self._shown))}\r")
                self._stream.flush()
                self._shown = line


@contextmanager
def life_signs(stream: TextIO | None, words: Sequence[str]) -> Iterator[LifeSigns]:
    """Show the progress on `stream` within the block, if it is a terminal, unless the `words` of
    the command line ask for quiet or the command has a display of its own."""
    if stream is None or not _are_wanted(stream, words):
        yield LifeSigns(None, Progress())
        return
    signs, end_event = LifeSigns(stream, Progress()), threading.Event()

    def tell() -> None:
        while not end_event.wait(EVERY_S):
            signs.show()

    teller = threading.Thread(target=tell, daemon=True)
    teller.start()
    try:
        yield signs
    finally:
        end_event.set()
        teller.join()
        signs.hide()


def _are_wanted(stream: TextIO, words: Sequence[str]) -> bool:
    if any(word in words for word in (*_OWN, *_QUIET)) or os.environ.get("TERM") == "dumb":
        return False
    with suppress(ValueError):  # closed
        return stream.isatty()
    return False


def signs_of_command() -> LifeSigns:
    """Return the status line of the running command, an invisible one without a command."""
    context = click.get_current_context(silent=True)
    signs = None if context is None else context.find_object(LifeSigns)
    return LifeSigns(None, Progress()) if signs is None else signs


def progress() -> Progress:
    """Return the progress of the running command."""
    return signs_of_command().progress


def hide_signs() -> None:
    """Erase the status line of the running command, to write another line."""
    signs_of_command().hide()
