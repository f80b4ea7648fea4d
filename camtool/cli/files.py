"""The files of a command: what it reads, and what it writes: all or none, `-` for a stream.

Before any work the places are checked: no output is an input, and no two outputs are one file, by
whatever names and links they are called. Then each file is written whole beside its place, under a
temporary name; streams (`-`, devices, pipes) come next, for what they have taken cannot be taken
back; only when all of that is done are the files renamed. So an error (a full disk, a reader that
is gone, Ctrl-C) leaves old files as they were and no new one."""

from __future__ import annotations

import errno
import io
import os
import re
import stat
import sys
import time
import unicodedata
from collections.abc import Callable, Hashable, Iterable, Mapping
from contextlib import suppress
from pathlib import Path, PurePath
from typing import TypeAlias

from camtool.bounds import program_bytes
from camtool.errors import OutputError, ProgramError

STDOUT = "-"
"""The name of stdout among outputs, and of stdin among inputs."""

KEPT = 40
"""Number of characters of a file's name that its temporary file keeps, since the length of names
is limited."""

MAX_KIND_CHARS = 40
"""Number of characters of a tool's or a set-up's name that become part of a file name."""

READER_S = 10.0
"""A named pipe that nobody opens for reading within this time is refused."""

POLL_S = 0.05
"""Interval of the attempts to open a pipe until then."""


_NEW_FILE = (
    os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
)

Content: TypeAlias = bytes | Iterable[bytes]
"""The content of a file, whole or piece by piece as it is made."""


def write_all(files: Mapping[str, Content]) -> None:
    """Write these files (content by name), all or none; OutputError names the first that cannot be
    written."""
    streams = {name: data for name, data in files.items() if _is_stream(name)}
    staged: list[tuple[Path, Path]] = []
    try:
        for name, data in files.items():
            if name not in streams:
                staged.append(_stage(Path(name), data))
        for name, data in streams.items():
            _write_stream(name, data)
        _rename(staged)
    finally:
        for temporary, _ in staged:
            temporary.unlink(missing_ok=True)


def check_places(reads: Iterable[str | None], writes: Iterable[str | None]) -> None:
    """Raise OutputError, before any work is done, as `refuse_same` does, and for a place in
    `writes` that cannot be written. None stands for a file that was not requested."""
    names = [name for name in writes if name is not None]
    refuse_same(reads, names)
    for name in names:
        if not _is_stream(name):
            _check_file(name)


def refuse_same(reads: Iterable[str | None], writes: Iterable[str | None]) -> None:
    """Raise OutputError when a place of `writes` is one of `reads` or another one of `writes`,
    also through symbolic and hard links."""
    sources = {file_identity(name): name for name in reads if name is not None}
    sources.pop(None, None)
    places_used: dict[Hashable, str] = {}
    for name in writes:
        if name is None:
            continue
        place = _place_identity(name)
        if place in sources:
            read = sources[place]
            alias = "" if read in (name, STDOUT) else f" ({read})"
            raise OutputError(
                f"is the input itself{alias}", file=name, mend="choose another place"
            )
        if place in places_used:
            complaint = "is asked for twice"
            if places_used[place] != name:
                complaint = f"is asked for twice, also as {places_used[place]}"
            raise OutputError(complaint, file=name, mend="give each output its own name")
        places_used[place] = name


def check_new(name: str, mend: str = "give another name") -> None:
    """Raise OutputError if the file exists already; streams are always accepted."""
    if os.path.lexists(name) and not _is_stream(name):
        raise OutputError("exists already", file=name, mend=mend)


def check_ours(name: str, is_ours: Callable[[bytes], bool]) -> None:
    """Raise OutputError if a file with a default name exists and was not written by the command
    before."""
    if name == STDOUT or not os.path.lexists(name) or _is_stream(name):
        return
    try:
        own_file = is_ours(Path(name).read_bytes())
    except OSError:  # cannot be checked
        own_file = False
    if not own_file:
        raise OutputError(
            "is there, and camtool did not write it", file=name, mend=f"-o {name} replaces it"
        )


def _check_file(name: str) -> None:
    """Raise OutputError when no file can be created or replaced there."""
    place = Path(os.path.realpath(name))
    try:
        if place.is_dir():
            raise OutputError("is a folder", file=name, mend="give a file name")
        if not place.parent.is_dir():
            raise OutputError(
                f"the folder {place.parent} does not exist", file=name, mend="make it first"
            )
        if not os.access(place.parent, os.W_OK):
            raise OutputError("the folder is not writable", file=name, mend="choose another place")
        if _exists(place) and not os.access(place, os.W_OK):
            raise OutputError("is write-protected", file=name, mend="choose another place")
    except OSError as error:
        if isinstance(error, OutputError):
            raise
        raise _write_error(name, error) from error


def _exists(place: Path) -> bool:
    """Return True if the file exists; OSError if that cannot be determined: a loop of links, a
    name too long."""
    try:
        place.stat()
    except FileNotFoundError:
        return False
    return True


def file_identity(name: str) -> Hashable:
    """Return a value that identifies a file that is read, the same for all its names and links;
    None for one that no output can replace."""
    try:
        status = os.fstat(sys.stdin.fileno()) if name == STDOUT else Path(name).stat()
    except (OSError, ValueError, AttributeError):  # nothing there, or no file of the system's
        return None
    return (status.st_dev, status.st_ino) if stat.S_ISREG(status.st_mode) else None


def _place_identity(name: str) -> Hashable:
    """Return a value that identifies a place that is written: its file, or its folder and name.

    Names that differ only in case, or in how accents are coded, count as the same: they are one
    file on other computers, and programs are copied there."""
    try:
        status = os.fstat(sys.stdout.fileno()) if name == STDOUT else Path(name).stat()
    except (io.UnsupportedOperation, AttributeError):  # a stdout that is no file of the system's
        return name
    except OSError:
        folder, base = os.path.split(os.path.realpath(name))
        base = unicodedata.normalize("NFC", unicodedata.normalize("NFC", base).casefold())
        with suppress(OSError):
            status = Path(folder).stat()
            return status.st_dev, status.st_ino, base
        return folder, base
    return status.st_dev, status.st_ino


def _is_stream(name: str) -> bool:
    """Return True for `-` and for devices and pipes, which cannot be replaced by a renamed
    file."""
    if name == STDOUT:
        return True
    try:
        mode = Path(name).stat().st_mode
    except OSError:
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


def _write_stream(name: str, data: Content) -> None:
    """Write all data to stdout or to a named pipe or device, and flush it.

    Raises BrokenPipeError if the program that reads stdout has ended, else OutputError."""
    if name == STDOUT and sys.stdout is None:
        raise OutputError("is closed", file="<stdout>", mend="give a file name")
    try:
        if name == STDOUT:
            sys.stdout.flush()
            sys.stdout.buffer.writelines(_pieces(data))
            sys.stdout.buffer.flush()
            return
        with _open_stream(name) as stream:
            stream.writelines(_pieces(data))
    except BrokenPipeError:
        if name == STDOUT:
            raise
        raise OutputError("its reader is gone", file=name) from None
    except OutputError:
        raise
    except OSError as error:
        raise _write_error("<stdout>" if name == STDOUT else name, error) from error


def _open_stream(name: str) -> io.BufferedWriter:
    """Open a device or a pipe for writing. OutputError for a named pipe without a reader, since
    opening it would block for ever."""
    if not stat.S_ISFIFO(Path(name).stat().st_mode):
        return Path(name).open("wb")
    last = time.monotonic() + READER_S
    while True:
        try:
            handle = os.open(name, os.O_WRONLY | os.O_NONBLOCK)
        except OSError as error:
            if error.errno != errno.ENXIO:
                raise
            if time.monotonic() >= last:
                raise OutputError(
                    "is a pipe that nobody reads", file=name, mend="open its reader first"
                ) from None
            time.sleep(POLL_S)
        else:
            os.set_blocking(handle, True)
            return os.fdopen(handle, "wb")


def _write_error(name: str, error: OSError) -> OutputError:
    return OutputError(
        f"cannot be written ({error.strerror})", file=name, mend="choose another place"
    )


def _rename(staged: list[tuple[Path, Path]]) -> None:
    """Move every temporary file to its place; if one cannot be moved, or at Ctrl-C, undo the
    moves."""
    olds: dict[Path, Path | None] = {}
    if len(staged) > 1:
        olds = {place: _second_name(temporary, place) for temporary, place in staged}
    try:
        for temporary, place in staged:
            try:
                temporary.replace(place)
            except OSError as error:
                raise _write_error(str(place), error) from error
    except BaseException:
        for place, old in olds.items():
            if old is None:
                place.unlink(missing_ok=True)
            elif old != place:
                old.replace(place)
        raise
    finally:
        for place, old in olds.items():
            if old is not None and old != place:
                old.unlink(missing_ok=True)


def _second_name(temporary: Path, place: Path) -> Path | None:
    """Create a second name for the file at a place, by which it can be restored: the place itself
    if the file system has no links, None if there is no file."""
    if not os.path.lexists(place):
        return None
    old = temporary.with_name(f"{temporary.name}.old")
    try:
        old.hardlink_to(place)
    except OSError:
        return place
    return old


def _stage(place: Path, data: Content) -> tuple[Path, Path]:
    """Write a temporary file with the data in the folder of its place; return both paths. Links
    are followed."""
    named, place = str(place), Path(os.path.realpath(place))
    temporary: Path | None = None
    try:
        # As `tempfile` does, which loads all archives: 3 ms.
        name = place.parent / f".{place.name[:KEPT]}.{os.urandom(6).hex()}"
        handle = os.open(name, _NEW_FILE, 0o600)
        temporary = name
        with os.fdopen(handle, "wb") as stream:
            stream.writelines(_pieces(data))
            stream.flush()
            os.fsync(stream.fileno())
        temporary.chmod(_mode_for(place))
    except BaseException as error:
        if temporary is not None:
            temporary.unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise _write_error(named, error) from error
        raise
    return temporary, place


def _pieces(data: Content) -> Iterable[bytes]:
    return [data] if isinstance(data, bytes) else data


def _mode_for(place: Path) -> int:
    """Return the permissions of the old file, or those that the umask gives a new file."""
    try:
        return stat.S_IMODE(place.stat().st_mode)
    except OSError:
        mask = os.umask(0)
        os.umask(mask)
        return 0o666 & ~mask


# Programs that are read.


def display_name(name: str) -> str:
    """Return the name of a file as messages show it."""
    return "<stdin>" if name == STDOUT else name


def read_bytes(name: str) -> bytes:
    """Read a file, or stdin for `-`; ProgramError when it cannot be read or is too large."""
    if name == STDOUT and sys.stdin is None:
        raise ProgramError(
            "there is no standard input", file=display_name(name), mend="name a file"
        )
    source = sys.stdin.buffer if name == STDOUT else Path(name)
    return program_bytes(source, display_name(name))


# Pictures that nobody asked for by name carry a seal, by which camtool knows them again.
#
# A page in Markdown brings a picture along, a batch one for each program. They lie beside
# drawings, which may be SVG too: only a picture that bears the seal of its maker, and is as it was
# written, is replaced. The seal is a comment at the end of the SVG.

SEAL = b"<!-- camtool: sha256 "


def seal(svg: bytes, maker: str) -> bytes:
    """Return the SVG with a seal: a digest and the name of its maker (a page, or the outputs of a
    drawing), by which `is_foreign` recognises it."""
    import hashlib

    name = os.fsencode(PurePath(maker).name)
    digest = hashlib.sha256(name + b"\n" + svg).hexdigest().encode()
    return svg + SEAL + digest + b" -->\n"


def is_foreign(place: str | Path, maker: str) -> bool:
    """Return True if a file exists there that is not an unchanged picture of this maker."""
    if not os.path.lexists(place):
        return False
    try:
        data = Path(place).read_bytes()
    except OSError:  # unreadable, so not ours
        return True
    return data != seal(data[: data.rfind(SEAL)], maker)


def part_name(name: str, number: int, count: int, kind: str) -> str:
    """Return the name of a file of one part of `count`, such as a set-up or a tool: with its
    number and its kind, so that the parts sort in their order."""
    plain = re.sub(r"[^A-Za-z0-9_]+", "-", kind).strip("-")[:MAX_KIND_CHARS] or "tool"
    path = PurePath(name)
    return str(path.with_name(f"{path.stem}-{number:0{len(str(count))}}-{plain}{path.suffix}"))
