"""One batch at a time in an output folder."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from camtool.errors import OutputError
from camtool.lock import held

NAME = ".camtool-batch.lock"
"""The lock's name in the output folder."""


@contextmanager
def alone_in(out: Path) -> Iterator[bool]:
    """Within the block, no other batch writes to the folder `out`; False where its file system has
    no locks.

    OutputError names the process that has the lock, or says why the folder cannot be written.
    """

    def taken(who: str) -> OutputError:
        return OutputError(
            f"another batch writes there ({who})",
            file=str(out),
            mend="let it end, or choose another --out",
        )

    begun = False
    try:
        with held(out / NAME, taken) as locked:
            begun = True
            yield locked
    except OutputError:
        raise
    except OSError as error:
        if begun:
            raise
        raise OutputError(
            f"cannot be written ({error.strerror})",
            file=str(out / NAME),
            mend="choose another --out",
        ) from error
