"""A lock file that one process at a time holds, locked by the operating system.

The lock ends with the process, so that it is never stale. The file names the process and is
removed at the end; after a crash it remains, unlocked, and the next process takes it over."""

from __future__ import annotations

import errno
import os
import socket
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

_NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP)
"""Error numbers of file systems without locks."""

_LOCKED = (errno.EWOULDBLOCK, errno.EAGAIN, errno.EACCES, errno.EDEADLK)
"""Error numbers of a file that another process has locked."""

_READ_BYTES = 1000
"""Bytes read from the lock file of another process."""


@contextmanager
def held(place: Path, refusal: Callable[[str], Exception]) -> Iterator[bool]:
    """Hold the lock file at `place` within the block; yield False if its file system has no locks.

    Raises `refusal(owner)` if another process holds it, where `owner` describes that process, and
    OSError if the file cannot be made."""
    handle, locked = _open_locked(place, refusal)
    try:
        with suppress(OSError):  # a full disk: the lock holds without a name in it
            os.ftruncate(handle, 0)
            os.lseek(handle, 0, os.SEEK_SET)
            os.write(handle, f"process {os.getpid()} on {socket.gethostname()}\n".encode())
        yield locked
    finally:
        _release(place, handle)


def _open_locked(place: Path, refusal: Callable[[str], Exception]) -> tuple[int, bool]:
    """Open and lock the file; return its descriptor, and False if the file system has no locks."""
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
            raise refusal(who or "it has just begun") from error


def _is_at(handle: int, place: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(handle), place.stat())
    except OSError:
        return False


if sys.platform == "win32":
    import msvcrt

    _FAR = 1 << 20
    """Offset of the locked byte: Windows lets no process read locked bytes, so it lies far behind
    the text."""

    def _lock(handle: int) -> None:
        """Lock an open file; OSError at once if it is locked."""
        os.lseek(handle, _FAR, os.SEEK_SET)
        msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)

    def _release(place: Path, handle: int) -> None:
        os.close(handle)
        with suppress(OSError):  # another process has opened it meanwhile
            place.unlink()

else:
    import fcntl

    def _lock(handle: int) -> None:
        """Lock an open file; OSError at once if it is locked."""
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)

    def _release(place: Path, handle: int) -> None:
        with suppress(OSError):  # the folder is gone or write-protected by now
            place.unlink()
        os.close(handle)
