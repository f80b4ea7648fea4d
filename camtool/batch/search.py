"""Files below a folder, and files that match a pattern: neither follows links round in circles.

`**` stands for any folders, `*`, `?` and `[...]` for parts of a name, as in a shell; a name that
begins with a dot is hidden from them. Links to files are files, links to folders are not entered
by a search or by `**`.
"""

from __future__ import annotations

import fnmatch
import glob
import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from camtool.errors import InputError

ANY_FOLDERS = "**"


def files_below(folder: Path, apart: Path | None = None) -> Iterator[Path]:
    """Files in a folder and those below it, sorted; nothing hidden, and nothing in `apart`.

    InputError for a folder that cannot be read: what is in it would be missing without a word.
    """
    folders = []
    for entry in _entries(folder):
        if entry.name.startswith("."):
            continue
        if _is_dir(entry):
            if not entry.is_symlink():
                folders.append(entry)
        elif _is_file(entry):
            yield Path(entry.path)
    for entry in folders:
        if apart is None or not _same(entry, apart):
            yield from files_below(Path(entry.path), apart)


def files_matching(base: Path, parts: Sequence[str], apart: Path | None = None) -> Iterator[Path]:
    """Files below `base` that match a pattern, given by its parts; `**` does not enter `apart`."""
    head, rest = parts[0], parts[1:]
    if head == ANY_FOLDERS:
        yield from files_matching(base, rest or ("*",), apart)
        for entry in _entries(base):
            hidden = entry.name.startswith(".") or entry.is_symlink()
            if _is_dir(entry) and not (hidden or (apart is not None and _same(entry, apart))):
                yield from files_matching(Path(entry.path), parts, apart)
    elif not glob.has_magic(head):
        place = base / head
        if rest and place.is_dir():
            yield from files_matching(place, rest, apart)
        elif not rest and place.is_file():
            yield place
    else:
        for entry in _entries(base):
            if not fnmatch.fnmatch(entry.name, head):
                continue
            if entry.name.startswith(".") and not head.startswith("."):
                continue
            if rest and _is_dir(entry):
                yield from files_matching(Path(entry.path), rest, apart)
            elif not rest and not _is_dir(entry) and _is_file(entry):
                yield Path(entry.path)


def _entries(folder: Path) -> list[os.DirEntry[str]]:
    try:
        with os.scandir(folder) as entries:
            return sorted(entries, key=lambda entry: entry.name)
    except OSError as error:
        raise InputError(
            f"cannot be searched ({error.strerror})",
            file=str(folder),
            mend="let it be read, or name the folders that are wanted",
        ) from error


def _is_dir(entry: os.DirEntry[str]) -> bool:
    try:
        return entry.is_dir()
    except OSError:  # a link that nobody can follow
        return False


def _is_file(entry: os.DirEntry[str]) -> bool:
    """A file, or a link to nothing (an error by its name later); no pipe and no device."""
    try:
        return entry.is_file() or (entry.is_symlink() and not Path(entry.path).exists())
    except OSError:
        return True


def _same(entry: os.DirEntry[str], folder: Path) -> bool:
    try:
        return os.path.samestat(entry.stat(), folder.stat())
    except OSError:  # an output folder that is still to be made
        return False
