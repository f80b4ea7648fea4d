"""`--watch`: the same again whenever one of its files has changed.

Files are looked at by their content, so that a save without a change does nothing and no clock of
a network drive matters. A change counts when it has settled: an editor may write in several goes.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from camtool.cli.talk import say, say_error
from camtool.errors import CamtoolError

POLL_S = 0.4
"""Files are looked at so often."""

SETTLED_S = 0.2
"""A change counts when the files are the same after so long."""

Files = Callable[[], Sequence[str]]
Digests = dict[str, bytes | None]


def watch(
    again: Callable[[], int],
    files: Files,
    *,
    quiet: bool,
    wait: Callable[[float], None] = time.sleep,
) -> int:
    """Calls `again` now and after each change of the `files`, until Ctrl-C; then 0.

    Which files these are may change with what they hold: a job file names a tool table.
    What is wrong is said on one line, and watching goes on: the next save may mend it.
    """
    try:
        seen = _digests(files)
        say(f"camtool: watching {', '.join(seen)}; Ctrl-C ends", quiet=quiet)
        _tried(again)
        while True:
            wait(POLL_S)
            now = _settled(files, seen, wait)
            changed = [file for file in now if file not in seen or now[file] != seen[file]]
            seen = now
            if changed:
                say(f"camtool: changed: {', '.join(changed)}", quiet=quiet)
                _tried(again)
    except KeyboardInterrupt:
        say("camtool: watching ended", quiet=quiet)
        return 0


def _tried(again: Callable[[], int]) -> None:
    try:
        again()
    except CamtoolError as error:
        say_error(error)


def _settled(files: Files, seen: Digests, wait: Callable[[float], None]) -> Digests:
    """What the files hold; where that has changed, once it stays the same."""
    now = _digests(files)
    while now != seen:
        wait(SETTLED_S)
        before, now = now, _digests(files)
        if now == before:
            break
    return now


def _digests(files: Files) -> Digests:
    """The content of each file as a digest; None for what cannot be read just now."""
    return {file: _digest(Path(file)) for file in files()}


def _digest(file: Path) -> bytes | None:
    try:
        with file.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").digest()
    except OSError:
        return None
