"""Golden programs: what a target writes, byte for byte."""

from __future__ import annotations

from pathlib import Path

import pytest

GOLDEN = Path(__file__).parents[1] / "golden"


def compare_golden(file: Path, data: bytes, *, bless: bool) -> None:
    """`data` must be what the file holds; a missing file is a failure."""
    if bless:
        file.write_bytes(data)
    if not file.exists():
        pytest.fail(f"{file.name} is missing: look at the program, then run pytest with --bless")
    # Text where it is text, so that a difference can be read.
    assert data.decode("latin-1") == file.read_bytes().decode("latin-1")
