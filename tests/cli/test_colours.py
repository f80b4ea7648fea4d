"""Colours and tables are for terminals, and for nobody who says NO_COLOR."""

import os
import pty
import re
import subprocess
import sys

import pytest

from camtool.cli.messages import REPORT_NAMES, report_marks, show_compared, show_facts
from camtool.findings import Code, Finding, Severity
from camtool.verification.findings import VerificationCode
from tests.waiting import all_written

RED = b"\x1b[31m"
YELLOW = b"\x1b[33m"
GREEN = b"\x1b[32m"
BOLD = b"\x1b[1m"
COLOUR = re.compile(rb"\x1b\[[0-9;]*m")
ESCAPE = b"\x1b["
SIGNS = re.compile(rb"camtool: [^\r\n]*\d s *\r| +\r")
"""What is said of a command that takes long: the machine is busy."""

WRONG = ("post", "samples/logo.dxf", "-t", "pic-mnh")


def on_terminal(*arguments: str, **more: str) -> bytes:
    """Return the output on a terminal of 120 columns, without progress lines."""
    kept = {key: value for key, value in os.environ.items() if "COLOR" not in key}
    environment = kept | {"TERM": "xterm-256color", "COLUMNS": "120"} | more
    ours, theirs = pty.openpty()
    command = [sys.executable, "-m", "camtool", *arguments]
    with subprocess.Popen(command, stdout=theirs, stderr=theirs, env=environment) as process:
        os.close(theirs)
        written = all_written(ours)
    assert process.returncode is not None
    return SIGNS.sub(b"", written)


def test_errors_are_red_on_a_terminal() -> None:
    assert RED in on_terminal(*WRONG)


def test_how_to_mend_it_stands_out() -> None:
    assert BOLD + b"did you mean pic-mmh?" in on_terminal(*WRONG)


@pytest.mark.parametrize("more", [{"NO_COLOR": "1"}, {"CLICOLOR": "0"}, {"TERM": "dumb"}])
def test_no_colour_where_none_is_wanted(more: dict[str, str]) -> None:
    written = on_terminal(*WRONG, **more)
    assert b"did you mean pic-mmh" in written
    assert ESCAPE not in written
    assert ESCAPE not in on_terminal("targets", **more)


def test_machines_are_a_table_on_a_terminal_alone() -> None:
    table = on_terminal("targets")
    assert ESCAPE in table
    assert b"machine" in table.split(b"flashcut")[0]
    plain = subprocess.run(
        [sys.executable, "-m", "camtool", "targets"], capture_output=True, check=True
    ).stdout
    assert ESCAPE not in plain
    assert plain.startswith(b"# step-true: ")
    assert b"\nflashcut " in plain


PLAIN = """target     pic-mmh (arcs by dsm)
time       3:22:13 (cutting 2:49:44)
error      14.95 µm at most, rms 6.33, p95 11.44
reversals  X 1, Y 2, Z 3 (while cutting X 1, Y 2)"""


def above(flag: str, code: Code = VerificationCode.ABOVE_GATE) -> Finding:
    severity = Severity.ERROR if code is VerificationCode.ABOVE_GATE else Severity.WARNING
    return Finding(code, severity, "too much", flag)


@pytest.fixture
def coloured(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """stdout is taken for a terminal of 40 columns."""
    monkeypatch.setattr("camtool.cli.messages.in_colour", lambda stream: True)
    monkeypatch.setattr("click.utils.should_strip_ansi", lambda *_: False)
    monkeypatch.setenv("COLUMNS", "40")


def test_what_exceeds_a_limit_is_red(coloured: None, capsys: pytest.CaptureFixture[str]) -> None:
    many = above("", VerificationCode.MANY_REVERSALS)
    marks = report_marks([above("--max-error"), many, above("--max-reversals"), many])
    assert marks == {"error": "error", "reversals": "error"}
    show_facts(PLAIN, REPORT_NAMES, {**marks, "time": "warning"})
    shown = capsys.readouterr().out.encode()
    target, time, error, below, *_ = shown.splitlines()
    assert target == BOLD + b"target\x1b[0m     pic-mmh (arcs by dsm)\x1b[0m"
    assert YELLOW in time
    assert RED in error
    assert below == b" " * 11 + RED + b"p95 11.44\x1b[0m"
    assert COLOUR.sub(b"", shown).decode().split() == PLAIN.split()


def test_the_best_way_is_green_and_an_endless_one_red(
    coloured: None, capsys: pytest.CaptureFixture[str]
) -> None:
    from camtool.verification.contrast import ContrastRow, contrast_table

    rows = [
        ContrastRow(name, 1.0, 1.0, total, 1.0, None, 1, 1, 1, endless, 1.0)
        for name, total, endless in (("a", 2.0, 0), ("b", 1.0, 0), ("c", 0.5, 1), ("d", None, 0))
    ]
    plain = contrast_table(rows)
    show_compared(plain, rows)
    shown = capsys.readouterr().out.encode()
    head, *lines = shown.splitlines()
    assert head.startswith(BOLD)
    assert [line[:5] for line in lines] == [lines[0][:5], GREEN, RED, lines[3][:5]]
    assert COLOUR.sub(b"", shown).decode() == plain + "\n"


def test_a_check_on_a_terminal_says_the_same_words() -> None:
    shown = on_terminal("check", "samples/logo.dxf")
    assert BOLD + b"units" in shown
    command = [sys.executable, "-m", "camtool", "check", "samples/logo.dxf"]
    plain = subprocess.run(command, capture_output=True, check=True)
    assert ESCAPE not in plain.stdout + plain.stderr
    words = COLOUR.sub(b"", shown).split()
    assert words == (plain.stdout + plain.stderr).split()
