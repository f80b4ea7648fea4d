"""Programs as they come: files, or stdin for `-`."""

from __future__ import annotations

import sys
from pathlib import Path

from camtool.cli.output import STDOUT
from camtool.errors import ProgramError


def shown(name: str) -> str:
    """The name of a file in messages."""
    return "<stdin>" if name == STDOUT else name


def read_bytes(name: str) -> bytes:
    """The bytes of a file, or of stdin for `-`; ProgramError when it cannot be read."""
    if name == STDOUT and sys.stdin is None:
        raise ProgramError("there is no standard input", file=shown(name), mend="name a file")
    try:
        if name == STDOUT:
            return sys.stdin.buffer.read()
        return Path(name).read_bytes()
    except OSError as error:
        raise ProgramError(
            f"cannot be read ({error.strerror})", file=shown(name), mend="check the path"
        ) from error
