"""The entry points by which other packages add machines, operations and importers."""

from __future__ import annotations

import sys
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint


def entry_points(group: str) -> tuple[EntryPoint, ...]:
    """Return the entry points of a group, in the order of `sys.path`.

    A search reads a file of every installed package, which takes some 5 ms. It is repeated only
    after a folder of `sys.path` has changed, as it does when a package is installed.
    """
    return _search(group, tuple((folder, _changed_at_ns(folder)) for folder in sys.path))


@lru_cache(maxsize=8)
def _search(group: str, folders: tuple[tuple[str, int], ...]) -> tuple[EntryPoint, ...]:
    """Find the entry points of a group; `folders` are those of `sys.path`, as they are now."""
    from importlib import metadata

    return tuple(metadata.entry_points(group=group))


def _changed_at_ns(folder: str) -> int:
    """Return when a folder changed last, 0 if there is none."""
    try:
        return Path(folder).stat().st_mtime_ns
    except OSError:
        return 0
