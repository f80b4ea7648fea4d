"""The manifest of an output folder: the files that a batch made, and what they were made from.

It has a line of JSON for each drawing, appended when the drawing's files are written, so that it
can be used even after a crash: incomplete lines are skipped, and the last of several lines for one
drawing counts. A run that ends normally rewrites it, sorted, without the drawings whose files are
all gone. Drawings that failed stay in it."""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import msgspec
from msgspec import Struct, field

from camtool.findings import FoundAt
from camtool.records import replace

NAME = ".camtool-batch.jsonl"


class ManifestEntry(Struct, frozen=True):
    """The record of one drawing. `key`: digest of everything that its outputs depend on; `files`:
    digests of its outputs by name; `earlier`: digests of outputs that the last run did not make
    again, such as programs for another machine. A drawing that failed has its `error`, the `code`
    of the finding that was the error, and no files."""

    key: str
    files: Mapping[str, str]
    warnings: int = 0
    figures: Mapping[str, float] = field(default_factory=dict)
    verdicts: Mapping[str, int] = field(default_factory=dict)
    earlier: Mapping[str, str] = field(default_factory=dict)
    error: str = ""
    code: str = ""
    findings: tuple[FoundAt, ...] = ()

    @property
    def all_outputs(self) -> dict[str, str]:
        """Digests of all outputs that any run made, by name."""
        return {**self.earlier, **self.files}


class Manifest:
    """The entries of an output folder, by stem (output name without extension)."""

    def __init__(self, folder: Path) -> None:
        self._out = folder
        self._place = folder / NAME
        self._entries, self._tidy = _read(self._place)

    def up_to_date(self, stem: str, key: str) -> ManifestEntry | None:
        """Return the entry of a drawing if its key is the same and its files are unchanged, else
        None."""
        entry = self._entries.get(stem)
        if entry is None or entry.key != key:
            return None
        return entry if all(self._has_digest(*each) for each in entry.files.items()) else None

    def outputs(self) -> frozenset[Path]:
        """Return the real paths of all files of all entries."""
        names = (name for entry in self._entries.values() for name in entry.all_outputs)
        places = RealPaths()
        return frozenset(places.of(self._out / name) for name in names)

    def may_replace(self, stem: str, name: str, data: bytes) -> bool:
        """Return True if an output may be written: no file is there, or one that a batch made for
        this drawing and nobody changed, or one that holds `data` already, as after a run that was
        killed."""
        place, entry = self._out / name, self._entries.get(stem)
        if not os.path.lexists(place):
            return True
        own_outputs = {} if entry is None else entry.all_outputs
        return self._has_digest(name, content_digest(data)) or (
            name in own_outputs and self._has_digest(name, own_outputs[name])
        )

    def add(self, stem: str, entry: ManifestEntry) -> None:
        """Append the entry of a drawing to the file; OSError when it cannot be written."""
        before = self._entries.get(stem)
        if before is not None:
            earlier = {
                name: each for name, each in before.all_outputs.items() if name not in entry.files
            }
            entry = replace(entry, earlier=earlier)
        self._entries[stem] = entry
        self._tidy = False
        # The line break comes first too, in case a full disk has cut the line before short.
        line = f"\n{_line(stem, entry)}\n".encode()
        handle = os.open(self._place, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o666)
        try:
            if os.write(handle, line) != len(line):
                raise OSError("the disk is full")
        finally:
            os.close(handle)

    def tidy(self, write: Callable[[dict[str, bytes]], None]) -> None:
        """Rewrite the manifest, if needed, with one line for each drawing that still has files."""
        present = [stem for stem in sorted(self._entries) if self._is_used(self._entries[stem])]
        if self._tidy and len(present) == len(self._entries):
            return
        lines = [_line(stem, self._entries[stem]) for stem in present]
        write({str(self._place): ("\n".join(lines) + "\n").encode()})
        self._entries, self._tidy = {stem: self._entries[stem] for stem in present}, True

    def _is_used(self, entry: ManifestEntry) -> bool:
        return bool(entry.error) or any(
            os.path.lexists(self._out / name) for name in entry.all_outputs
        )

    def _has_digest(self, name: str, digest: str) -> bool:
        try:
            return file_digest(self._out / name) == digest
        except OSError:
            return False


def _line(stem: str, entry: ManifestEntry) -> str:
    row = {"stem": stem, **msgspec.to_builtins(entry)}
    return json.dumps(row, ensure_ascii=True, sort_keys=True)


def _read(place: Path) -> tuple[dict[str, ManifestEntry], bool]:
    """Return the entries of all complete lines (none without a manifest), and True if the file is
    as `tidy` would write it."""
    try:
        lines = place.read_bytes().splitlines()
    except OSError:
        return {}, True
    entries: dict[str, ManifestEntry] = {}
    for line in lines:
        try:
            row: dict[str, Any] = json.loads(line)
            stem = row.pop("stem")
            entry = msgspec.convert(row, ManifestEntry)
        except (ValueError, TypeError, KeyError, AttributeError, msgspec.ValidationError):
            continue
        if isinstance(stem, str):
            entries[stem] = entry
    return entries, len(lines) == len(entries) and list(entries) == sorted(entries)


# Digests by which a batch knows what is up to date.


def digest_of(*parts: str | bytes) -> str:
    """Return the digest of several parts in their order. Each part's length is included, so that
    ("ab", "c") differs from ("a", "bc")."""
    digest = hashlib.sha256()
    for part in parts:
        data = part.encode("utf-8", "surrogateescape") if isinstance(part, str) else part
        digest.update(f"{len(data)}:".encode())
        digest.update(data)
    return digest.hexdigest()


def file_digest(path: Path) -> str:
    """Return the digest of a file's content, as `content_digest`; OSError if it cannot be read."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def content_digest(data: bytes) -> str:
    """Return the digest of a file's content."""
    return hashlib.sha256(data).hexdigest()


def code_digest(files: Iterable[Path]) -> str:
    """Return the digest of the names and contents of source files."""
    return digest_of(*(part for path in sorted(files) for part in (path.name, file_digest(path))))


def packages_digest(name: str) -> str:
    """Return the digest of the versions of all packages that the package `name` requires, without
    extras; of no versions if it is not installed as a package."""
    from importlib import metadata

    try:
        needs = metadata.requires(name) or []
    except metadata.PackageNotFoundError:
        return digest_of()
    requirements = sorted(need for need in needs if "extra ==" not in need)
    names = (re.match(r"[\w.-]+", need) for need in requirements)
    return digest_of(*(f"{one[0]} {_version(one[0])}" for one in names if one))


def _version(name: str) -> str:
    """Return the version of an installed package; "" for one that only other systems need."""
    from importlib import metadata

    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return ""


# Real paths: as `Path.resolve`, but fast for many files in few folders.


class RealPaths:
    """A cache of the real paths of folders."""

    def __init__(self) -> None:
        self._folders: dict[str, str] = {}

    def of(self, path: str | Path) -> Path:
        """Return the real path of a file through all links, even if the file does not exist."""
        folder, name = os.path.split(path)
        if name in ("", ".", ".."):
            return Path(os.path.realpath(path))
        real = self._folders.get(folder)
        if real is None:
            real = self._folders[folder] = os.path.realpath(folder)
        place = Path(real, name)
        return Path(os.path.realpath(place)) if place.is_symlink() else place
