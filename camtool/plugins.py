"""Entry points of installed packages, by which they add machines, operations and importers.

`importlib.metadata` finds them too, but it loads the package for electronic mail
(docs/decisions/0085-entry-points.md)."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterator
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple


class EntryPoint(NamedTuple):
    """An object that an installed package offers: `value` is `module:attribute`, or a module."""

    name: str
    value: str

    @property
    def module(self) -> str:
        """The name of its module."""
        return self.value.partition(":")[0].strip()

    @property
    def attr(self) -> str:
        """The name of the object in its module; "" for the module itself."""
        return self.value.partition(":")[2].partition("[")[0].strip()

    def load(self) -> Any:
        """Import the module and return the object."""
        value: Any = import_module(self.module)
        for part in filter(None, self.attr.split(".")):
            value = getattr(value, part)
        return value


def entry_points(group: str) -> tuple[EntryPoint, ...]:
    """Return the entry points of a group, in the order of `sys.path`.

    A search reads a file of every installed package. It is repeated only after a folder of
    `sys.path` has changed, as it does when a package is installed."""
    return _search(group, _path_state())


PathState = tuple[tuple[str, int], ...]
"""The folders of `sys.path`, and when each changed last, ns since 1970; 0 where there is none."""


@lru_cache(maxsize=8)
def _search(group: str, folders: PathState) -> tuple[EntryPoint, ...]:
    """Return the entry points of a group; cached by the state of the folders of `sys.path`."""
    if any(Path(folder).is_file() for folder, _ in folders):  # an archive
        from importlib import metadata

        points = metadata.entry_points(group=group)
        return tuple(EntryPoint(point.name, point.value) for point in points)
    return tuple(
        point for text in _texts(folders) if f"[{group}]" in text for point in _points(text, group)
    )


@lru_cache(maxsize=8)
def _texts(folders: PathState) -> tuple[str, ...]:
    """Return the `entry_points.txt` of each installed package; of a package that is installed
    twice, the first counts. The names are split as text, since a `Path` for each of a thousand
    modules took 4 ms."""
    files: dict[str, str] = {}
    for folder, has_changed in folders:
        for entry in os.scandir(Path(folder)) if has_changed and Path(folder).is_dir() else ():
            stem, _, suffix = entry.name.rpartition(".")
            if suffix in ("dist-info", "egg-info"):
                files.setdefault(stem.partition("-")[0].lower().replace(".", "_"), entry.path)
    return tuple(map(_text, files.values()))


def _text(folder: str) -> str:
    """Return the `entry_points.txt` in the metadata folder of a package, "" if there is none that
    can be read as UTF-8."""
    try:
        with io.FileIO(f"{folder}/entry_points.txt") as file:
            return file.readall().decode()
    except (OSError, ValueError):  # ValueError: not UTF-8
        return ""


def _points(text: str, group: str) -> Iterator[EntryPoint]:
    """Yield the entry points of a group from a text with lines `[group]` and `name =
    module:attribute`."""
    section = ""
    for line in map(str.strip, text.splitlines()):
        if line.startswith("["):
            section = line[1:].rstrip("]")
        elif section == group and "=" in line and not line.startswith(("#", ";")):
            name, _, value = line.partition("=")
            yield EntryPoint(name.strip(), value.strip())


def _path_state() -> PathState:
    """Return the folders of `sys.path` with their times of change, as the key of the cache."""
    return tuple((folder, _changed_at_ns(folder)) for folder in sys.path)


def _changed_at_ns(folder: str) -> int:
    """Return the time (ns) of a folder's last change, 0 if it does not exist."""
    try:
        return Path(folder).stat().st_mtime_ns
    except OSError:
        return 0
