"""Colours and tables are for terminals, and for nobody who says NO_COLOR."""

import os
import pty
import subprocess
import sys

import pytest

RED = b"\x1b[31m"
ESCAPE = b"\x1b["
WRONG = ("post", "samples/logo.dxf", "-t", "pic-mnh")


def on_terminal(*arguments: str, **more: str) -> bytes:
    """What `camtool ARGUMENTS` writes to a terminal of 120 columns."""
    kept = {key: value for key, value in os.environ.items() if key != "NO_COLOR"}
    environment = kept | {"TERM": "xterm-256color", "COLUMNS": "120"} | more
    ours, theirs = pty.openpty()
    command = [sys.executable, "-m", "camtool", *arguments]
    with subprocess.Popen(command, stdout=theirs, stderr=theirs, env=environment) as process:
        os.close(theirs)
        written = b""
        while True:
            try:
                part = os.read(ours, 4096)
            except OSError:  # Linux: the other end is closed
                break
            if not part:
                break
            written += part
    os.close(ours)
    assert process.returncode is not None
    return written


def test_errors_are_red_on_a_terminal() -> None:
    assert RED in on_terminal(*WRONG)


@pytest.mark.parametrize("more", [{"NO_COLOR": "1"}, {"TERM": "dumb"}])
def test_no_colour_where_none_is_wanted(more: dict[str, str]) -> None:
    written = on_terminal(*WRONG, **more)
    assert b"did you mean pic-mmh" in written
    assert ESCAPE not in written
    assert ESCAPE not in on_terminal("targets", **more)


def test_machines_are_a_table_on_a_terminal_alone() -> None:
    table = on_terminal("targets")
    assert ESCAPE in table
    assert b"machine" in table.splitlines()[0]
    plain = subprocess.run(
        [sys.executable, "-m", "camtool", "targets"], capture_output=True, check=True
    ).stdout
    assert ESCAPE not in plain
    assert plain.startswith(b"flashcut ")
