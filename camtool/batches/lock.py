"""The lock of an output folder: one batch at a time writes to it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from camtool.errors import OutputError
from camtool.lock import held

NAME = ".camtool-batch.lock"


@contextmanager
def lock_folder(folder: Path) -> Iterator[bool]:
    """Lock the folder `folder` against other batches within the block; yields False if its file
    system has no locks.

    Raises OutputError, which names the process that holds the lock or the reason why the folder
    cannot be written."""

    def refuse_taken(who: str) -> OutputError:
        return OutputError(
            f"another batch writes there ({who})",
            file=str(folder),
            mend="let it end, or choose another --out",
        )

    has_begun = False
    try:
        with held(folder / NAME, refuse_taken) as locked:
            has_begun = True
            yield locked
    except OutputError:
        raise
    except OSError as error:
        if has_begun:
            raise
        raise OutputError(
            f"cannot be written ({error.strerror})",
            file=str(folder / NAME),
            mend="choose another --out",
        ) from error
