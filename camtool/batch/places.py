"""Where files really are: as `Path.resolve`, quick for many files of few folders."""

from __future__ import annotations

import os
from pathlib import Path


class Places:
    """Real paths; each folder is looked up once."""

    def __init__(self) -> None:
        self._folders: dict[str, str] = {}

    def of(self, path: str | Path) -> Path:
        """The real path of a file, there or not, through all links."""
        folder, name = os.path.split(path)
        if name in ("", ".", ".."):
            return Path(os.path.realpath(path))
        real = self._folders.get(folder)
        if real is None:
            real = self._folders[folder] = os.path.realpath(folder)
        place = Path(real, name)
        return Path(os.path.realpath(place)) if place.is_symlink() else place
