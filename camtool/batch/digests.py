"""Digests by which a batch knows what is up to date."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable
from pathlib import Path

CHUNK_BYTES = 1 << 20
"""How much of a file is read at a time for its digest: memory stays small for any drawing."""


def digest_of(*parts: str | bytes) -> str:
    """The digest of several parts in their order, each with its length: none runs into another."""
    digest = hashlib.sha256()
    for part in parts:
        data = part.encode("utf-8", "surrogateescape") if isinstance(part, str) else part
        digest.update(f"{len(data)}:".encode())
        digest.update(data)
    return digest.hexdigest()


def file_digest(path: Path) -> str:
    """The digest of a file's content, equal to `content_digest` of it; OSError without one."""
    digest = hashlib.sha256()
    with path.open("rb") as stream:
        while chunk := stream.read(CHUNK_BYTES):
            digest.update(chunk)
    return digest.hexdigest()


def content_digest(data: bytes) -> str:
    """The digest of a file's content."""
    return hashlib.sha256(data).hexdigest()


def code_digest(files: Iterable[Path]) -> str:
    """The digest of program files: their names and contents."""
    return digest_of(*(part for path in sorted(files) for part in (path.name, file_digest(path))))


def packages_digest(name: str) -> str:
    """The digest of the versions of all packages that the package `name` needs, without extras;
    that of nothing where it is not installed as a package."""
    from importlib import metadata

    try:
        needs = metadata.requires(name) or []
    except metadata.PackageNotFoundError:
        return digest_of()
    wanted = sorted(need for need in needs if "extra ==" not in need)
    found = (re.match(r"[\w.-]+", need) for need in wanted)
    return digest_of(*(f"{one[0]} {_version(one[0])}" for one in found if one))


def _version(name: str) -> str:
    """A package's version, "" for one that is only needed on other systems."""
    from importlib import metadata

    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return ""
