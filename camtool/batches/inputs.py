"""The drawings of a batch, and the names of their outputs.

    drawings/            every drawing below it      drawings/a/b.dxf → OUT/a/b.*
    'parts/**/*.dxf'     files that match            parts/x/y.dxf    → OUT/x/y.*
    one.dxf              this file                   one.dxf          → OUT/one.*

Outputs keep the path below the folder, or below the part of a pattern that has no wildcard. Names
that differ only in case, or in how accents are encoded, count as the same: on other computers they
are one file, and programs are copied there."""

from __future__ import annotations

import fnmatch
import glob
import os
import unicodedata
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path, PurePath

from camtool.batches.manifest import RealPaths
from camtool.batches.run import DrawingTask
from camtool.errors import InputError, OutputError
from camtool.importers.options import SUFFIXES


def find_tasks(
    sources: Sequence[str], folder: Path, outputs: Collection[Path] = frozenset()
) -> list[DrawingTask]:
    """Return one task for each drawing, sorted by output; a drawing given twice counts once.

    `outputs` are outputs of earlier runs (resolved paths), which are not taken as drawings.
    Raises InputError when a source has no drawing, OutputError when two drawings have the same
    output."""
    tasks: dict[Path, DrawingTask] = {}
    places = RealPaths()
    for source in sources:
        has_drawing = False
        for path, stem in _drawings_of(source, places.of(folder)):
            place = places.of(path)
            if place not in outputs:
                has_drawing = True
                tasks.setdefault(place, DrawingTask(str(path), stem))
        if not has_drawing:
            raise InputError(
                "holds no drawing" if Path(source).is_dir() else "no file matches",
                file=source,
                mend=f"a folder is searched for {', '.join(SUFFIXES)}; quote a pattern such as "
                "'parts/**/*.csv' for others",
            )
    _refuse_collisions(tasks.values())
    return sorted(tasks.values(), key=lambda task: task.stem)


def _drawings_of(source: str, folder: Path) -> Iterator[tuple[Path, str]]:
    """Yield the path and the output stem of each drawing that one argument (file, folder or
    pattern) names; `folder` is a real path."""
    path = Path(source)
    if path.is_dir():
        for file in files_below(path, folder):
            if file.suffix.lower() in SUFFIXES:
                yield file, _stem(file.relative_to(path))
    elif path.exists() or not glob.has_magic(source):
        if not path.exists():
            raise InputError("there is no such file or folder", file=source, mend="check the path")
        yield path, _stem(PurePath(path.name))
    else:
        base = _fixed_part(source)
        if base.is_dir():
            for file in files_matching(base, path.relative_to(base).parts, folder):
                yield file, _stem(file.relative_to(base))


def _fixed_part(pattern: str) -> Path:
    """Return the leading folders of a pattern, up to its first wildcard."""
    parts = PurePath(pattern).parts
    fixed = next(n for n, part in enumerate(parts) if glob.has_magic(part))
    return Path(*parts[: min(fixed, len(parts) - 1)])


def _stem(relative: PurePath) -> str:
    """Return a relative path without its file extension, the name that its outputs share."""
    return relative.with_suffix("").as_posix()


def _refuse_collisions(tasks: Collection[DrawingTask]) -> None:
    places: dict[str, DrawingTask] = {}
    for task in tasks:
        other = places.setdefault(_fold_name(task.stem), task)
        if other is not task:
            as_what = f"as {task.stem}.*"
            if other.stem != task.stem:
                as_what += " (one file where case and the encoding of accents are ignored)"
            raise OutputError(
                f"{other.source} and {task.source} would both be written {as_what}",
                mend="rename one, or make them by two batches with an --out for each",
            )


def _fold_name(name: str) -> str:
    """Return the name folded to one case and one encoding of accents."""
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", name).casefold())


# Files below a folder, and files that match a pattern.
#
# `**` stands for any folders, `*`, `?` and `[...]` for parts of a name, as in a shell; none
# matches a name that begins with a dot. Links to files count as files. A search and `**` do not
# enter links to folders, which could lead in circles.

ANY_FOLDERS = "**"


def files_below(folder: Path, excluded: Path | None = None) -> Iterator[Path]:
    """Yield the files in a folder and below it, sorted, without hidden ones and those in
    `excluded`.

    Raises InputError for a folder that cannot be read, so that no drawing is left out silently."""
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
        if excluded is None or not _is_folder(entry, excluded):
            yield from files_below(Path(entry.path), excluded)


def files_matching(
    base: Path, parts: Sequence[str], excluded: Path | None = None
) -> Iterator[Path]:
    """Yield the files below `base` that match a pattern, given by its parts; `**` does not enter
    the folder `excluded`."""
    head, tail = parts[0], parts[1:]
    if head == ANY_FOLDERS:
        yield from files_matching(base, tail or ("*",), excluded)
        for entry in _entries(base):
            hidden = entry.name.startswith(".") or entry.is_symlink()
            if _is_dir(entry) and not (
                hidden or (excluded is not None and _is_folder(entry, excluded))
            ):
                yield from files_matching(Path(entry.path), parts, excluded)
    elif not glob.has_magic(head):
        place = base / head
        if tail and place.is_dir():
            yield from files_matching(place, tail, excluded)
        elif not tail and place.is_file():
            yield place
    else:
        for entry in _entries(base):
            if not fnmatch.fnmatch(entry.name, head):
                continue
            if entry.name.startswith(".") and not head.startswith("."):
                continue
            if tail and _is_dir(entry):
                yield from files_matching(Path(entry.path), tail, excluded)
            elif not tail and not _is_dir(entry) and _is_file(entry):
                yield Path(entry.path)


def _entries(folder: Path) -> list[os.DirEntry[str]]:
    try:
        with os.scandir(folder) as entries:
            return sorted(entries, key=lambda entry: entry.name)
    except OSError as error:
        raise InputError(
            f"cannot be searched ({error.strerror})",
            file=str(folder),
            mend="make it readable, or name the folders that are wanted",
        ) from error


def _is_dir(entry: os.DirEntry[str]) -> bool:
    try:
        return entry.is_dir()
    except OSError:  # a link that leads nowhere
        return False


def _is_file(entry: os.DirEntry[str]) -> bool:
    """Return True for a file and for a broken link (reading it gives an error), not for pipes and
    devices."""
    try:
        return entry.is_file() or (entry.is_symlink() and not Path(entry.path).exists())
    except OSError:
        return True


def _is_folder(entry: os.DirEntry[str], folder: Path) -> bool:
    try:
        return os.path.samestat(entry.stat(), folder.stat())
    except OSError:  # the output folder does not exist yet
        return False
