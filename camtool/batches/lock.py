"""One batch at a time in an output folder.

A lock of the operating system on a file there: it ends with its process, however that ends, so
none is ever left stale. The file says who holds it, and is taken away at the end; after a crash
it stays, locked by nobody, and the next batch takes it over.
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
"""What file systems say that know no locks."""

_HELD = (errno.EWOULDBLOCK, errno.EAGAIN, errno.EACCES, errno.EDEADLK)
"""What systems say of a file that another process has locked."""

_READ_BYTES = 1000
"""So much is read of who holds a lock."""


@contextmanager
def alone_in(out: Path) -> Iterator[bool]:
    """Within, no other batch writes to the folder `out`; False where its file system has no locks.

    OutputError that names who holds it, or says why the folder cannot be written.
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
        with suppress(OSError):  # a full disk: then nobody can be named, but the lock holds
            os.ftruncate(handle, 0)
            os.lseek(handle, 0, os.SEEK_SET)
            os.write(handle, f"process {os.getpid()} on {socket.gethostname()}\n".encode())
        yield locked
    finally:
        _let_go(place, handle)


def _opened(place: Path) -> tuple[int, bool]:
    """The locked file (False where there are no locks); OutputError when another one has it."""
    while True:
        handle = os.open(place, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            _lock(handle)
            if _is_at(handle, place):
                return handle, True
            os.close(handle)  # who held it took it away between our opening and locking it
        except OSError as error:
            if error.errno in _NO_LOCKS:
                return handle, False
            who = os.read(handle, _READ_BYTES).decode(errors="replace").strip()
            os.close(handle)
            if error.errno not in _HELD:
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
    """Windows lets nobody read what is locked: a byte far behind the text is."""

    def _lock(handle: int) -> None:
        """Lock an open file, or OSError at once."""
        os.lseek(handle, _FAR, os.SEEK_SET)
        msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)

    def _let_go(place: Path, handle: int) -> None:
        os.close(handle)
        with suppress(OSError):  # another one has opened it by now
            place.unlink()

else:
    import fcntl

    def _lock(handle: int) -> None:
        """Lock an open file, or OSError at once."""
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)

    def _let_go(place: Path, handle: int) -> None:
        with suppress(OSError):  # a folder that is gone, or may not be written any more
            place.unlink()
        os.close(handle)
