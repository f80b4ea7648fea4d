"""One batch at a time in an output folder.

The operating system locks a file in that folder for as long as the process lives, so that no lock
is ever stale. The file names the process, and is removed at the end; after a crash it stays,
unlocked, and the next batch takes it over.
"""

from __future__ import annotations

import errno
import os
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from camtool.errors import OutputError

NAME = ".camtool-batch.lock"
"""The lock's name in the output folder."""

_NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP)
"""Errors of file systems that have no locks."""

_LOCKED = (errno.EWOULDBLOCK, errno.EAGAIN, errno.EACCES, errno.EDEADLK)
"""Errors for a file that another process has locked."""

_READ_BYTES = 1000
"""How much is read of the lock file of another batch."""


@contextmanager
def alone_in(out: Path) -> Iterator[bool]:
    """Within the block, no other batch writes to the folder `out`; False where its file system has
    no locks.

    OutputError names the process that has the lock, or says why the folder cannot be written.
    """
    place = out / NAME
    try:
        handle, locked = _opened(place)
    except OutputError:
        raise
    except OSError as error:
        raise OutputError(
            f"cannot be written ({error.strerror})", file=str(place), mend="choose another --out"
        ) from error
    try:
        with suppress(OSError):  # a full disk: the lock holds without a name in it
            os.ftruncate(handle, 0)
            os.lseek(handle, 0, os.SEEK_SET)
            os.write(handle, f"process {os.getpid()} on {socket.gethostname()}\n".encode())
        yield locked
    finally:
        _release(place, handle)


def _opened(place: Path) -> tuple[int, bool]:
    """The lock file, opened, and whether it is locked; OutputError when another process has it."""
    while True:
        handle = os.open(place, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            _lock(handle)
            if _is_at(handle, place):
                return handle, True
            os.close(handle)  # its owner removed it before we had locked it
        except OSError as error:
            if error.errno in _NO_LOCKS:
                return handle, False
            who = os.read(handle, _READ_BYTES).decode(errors="replace").strip()
            os.close(handle)
            if error.errno not in _LOCKED:
                raise
            raise OutputError(
                f"another batch writes there ({who or 'it has just begun'})",
                file=str(place.parent),
                mend="let it end, or choose another --out",
            ) from error


def _is_at(handle: int, place: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(handle), place.stat())
    except OSError:
        return False


if sys.platform == "win32":
    import msvcrt

    _FAR = 1 << 20
    """Windows lets nobody read locked bytes: the locked one is far behind the text."""

    def _lock(handle: int) -> None:
        """Lock an open file, or OSError at once."""
        os.lseek(handle, _FAR, os.SEEK_SET)
        msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)

    def _release(place: Path, handle: int) -> None:
        os.close(handle)
        with suppress(OSError):  # another process has opened it meanwhile
            place.unlink()

else:
    import fcntl

    def _lock(handle: int) -> None:
        """Lock an open file, or OSError at once."""
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)

    def _release(place: Path, handle: int) -> None:
        with suppress(OSError):  # the folder is gone or write-protected by now
            place.unlink()
        os.close(handle)
