"""Digests by which a batch knows what is up to date."""

from __future__ import annotations

import hashlib
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
