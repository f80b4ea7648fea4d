"""Writing results: all files of a command or none, and `-` for stdout.

Each file is first written whole beside its place, under a temporary name; only when every one of
them is there are they renamed. So an error (a full disk, a missing folder, Ctrl-C) leaves old
files as they were and no new one.
"""

from __future__ import annotations

import os
import stat
import sys
import tempfile
from pathlib import Path

from camtool.errors import OutputError

STDOUT = "-"


def write_all(files: dict[str, bytes]) -> None:
    """Write each `name: data`; OutputError names the first that cannot be written."""
    streams = {name: data for name, data in files.items() if _is_stream(name)}
    staged: list[tuple[Path, Path]] = []
    try:
        for name, data in files.items():
            if name not in streams:
                staged.append(_stage(Path(name), data))
        for temporary, place in staged:
            temporary.replace(place)
    finally:
        for temporary, _ in staged:
            temporary.unlink(missing_ok=True)
    for name, data in streams.items():
        _write_stream(name, data)


def check_writable(names: list[str | None], inputs: list[str]) -> None:
    """OutputError, before any work is done, when a place cannot be written or is an input."""
    sources = {Path(name).resolve() for name in inputs if name != STDOUT}
    given = [name for name in names if name is not None]
    for name in given:
        if given.count(name) > 1:
            raise OutputError(
                "is asked for twice", file=name, mend="give each output its own name"
            )
        if _is_stream(name):
            continue
        place = Path(name)
        if place.resolve() in sources:
            raise OutputError("is the input itself", file=name, mend="choose another -o")
        if place.is_dir():
            raise OutputError("is a folder", file=name, mend="give a file name")
        if not place.parent.is_dir():
            raise OutputError(
                f"the folder {place.parent} does not exist", file=name, mend="make it first"
            )
        if not os.access(place.parent, os.W_OK):
            raise OutputError("the folder is not writable", file=name, mend="choose another -o")
        if place.exists() and not os.access(place, os.W_OK):
            raise OutputError("is write-protected", file=name, mend="choose another -o")


def _is_stream(name: str) -> bool:
    """True for `-` and for devices and pipes, which cannot be replaced by a renamed file."""
    if name == STDOUT:
        return True
    try:
        mode = Path(name).stat().st_mode
    except OSError:
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


def _write_stream(name: str, data: bytes) -> None:
    if name == STDOUT:
        sys.stdout.flush()
        sys.stdout.buffer.write(data)
        sys.stdout.buffer.flush()
        return
    try:
        with Path(name).open("wb") as stream:
            stream.write(data)
    except OSError as error:
        raise OutputError(f"cannot be written ({error.strerror})", file=name) from error


def _stage(place: Path, data: bytes) -> tuple[Path, Path]:
    """(temporary file holding the data, final place), in the same folder; links are followed."""
    place = place.resolve()
    temporary: Path | None = None
    try:
        handle, name = tempfile.mkstemp(prefix=f".{place.name}.", dir=place.parent)
        temporary = Path(name)
        with os.fdopen(handle, "wb") as stream:
            stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())
        temporary.chmod(_mode_for(place))
    except OSError as error:
        if temporary is not None:
            temporary.unlink(missing_ok=True)
        raise OutputError(
            f"cannot be written ({error.strerror})",
            file=str(place),
            mend="choose another place with -o",
        ) from error
    return temporary, place


def _mode_for(place: Path) -> int:
    """The old file's permissions, or what the user's umask gives a new file."""
    try:
        return stat.S_IMODE(place.stat().st_mode)
    except OSError:
        mask = os.umask(0)
        os.umask(mask)
        return 0o666 & ~mask
