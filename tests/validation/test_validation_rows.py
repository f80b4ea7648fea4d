"""The tables of docs/theses.md: each row has a command that runs, and a verdict."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import pytest

import camtool
from tests.validation.pieces import ROOT

PAGE = ROOT / "docs" / "theses.md"
COLUMNS = 6
VERDICTS = ("works", "partly", "out")
PANEL_S = 8.0
"""So long a panel runs, which ends only when it is told to."""


class Row(NamedTuple):
    """A row of a table."""

    lines: str
    command: str
    camtool: str
    verdict: str


def rows() -> Iterator[Row]:
    """Yield the rows of all tables that have commands."""
    text = PAGE.read_text(encoding="utf-8")
    for table in re.findall(r"<!-- rows -->\n(.*?)<!-- end -->", text, re.DOTALL):
        for line in table.splitlines()[2:]:
            cells = [each.strip() for each in re.split(r"(?<!\\)\|", line)[1:-1]]
            assert len(cells) == COLUMNS, line
            command = cells[2].replace("\\|", "|").strip("`")
            yield Row(cells[0], command, cells[4], cells[5])


ROWS = list(rows())


def test_every_row_has_a_verdict() -> None:
    for row in ROWS:
        assert row.verdict.startswith(VERDICTS), row
        assert re.fullmatch(r"[\d, -]+", row.lines), row
        assert "camtool " in row.command, row
        # What is not whole says why.
        assert row.verdict.startswith("works") or ":" in row.verdict or row.verdict == "partly", (
            row
        )
    assert len(ROWS) >= 40


def test_every_row_names_machines_and_samples_that_exist() -> None:
    known = {each.target.name for each in camtool.targets()}
    named = {name for row in ROWS for name in re.findall(r"(?<=-t )[\w-]+", row.command)}
    assert len(named) >= 6
    assert named <= known
    files = {path for row in ROWS for path in re.findall(r"samples/[\w./-]+", row.command)}
    assert len(files) >= 20
    assert sorted(path for path in files if not (ROOT / path).exists()) == []


def test_speeds_of_the_router_are_those_that_the_command_prints() -> None:
    (row,) = (row for row in ROWS if "servo step" in row.command)
    words = [sys.executable, "-m", *row.command.split(), "--json", "-"]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, check=True)
    answers = json.loads(done.stdout)["axes"]
    printed = ", ".join(f"{each['end_rpm']:.0f}" for each in answers) + " rpm at the end of 1 s"
    assert row.camtool == printed
    assert printed in PAGE.with_name("validation.md").read_text(encoding="utf-8")


@contextmanager
def machine_at(command: str, folder: Path) -> Iterator[str]:
    """Put a virtual machine behind the PORT of a command, and return the command with it."""
    if "PORT" not in command or "flashcut" in command:
        yield command.replace("PORT", os.devnull)
        return
    target = re.search(r"-t (\S+)|console (\S+)", command)
    assert target is not None
    words = [sys.executable, "-m", "camtool", "twin", target[1] or target[2], "--speed", "20"]
    words += re.findall(r"(?:--machine|--set) \S+", command)
    words = [word for each in words for word in each.split(" ")]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True, cwd=folder) as twin:
        assert twin.stdout is not None
        try:
            yield command.replace("PORT", twin.stdout.readline().strip())
        finally:
            twin.send_signal(signal.SIGINT)


@pytest.mark.slow
@pytest.mark.parametrize("row", ROWS, ids=[f"{k}-{row.lines}" for k, row in enumerate(ROWS)])
def test_the_command_of_a_row_runs(row: Row, tmp_path: Path) -> None:
    shutil.copytree(ROOT / "samples", tmp_path / "samples")
    own = f'camtool() {{ {sys.executable} -m camtool "$@"; }}; '
    with machine_at(row.command, tmp_path) as command:
        words = ["bash", "-o", "pipefail", "-c", own + command]
        with subprocess.Popen(
            words, cwd=tmp_path, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True,
            start_new_session=True,
        ) as done:  # fmt: skip
            if "camtool panel" in command:
                time.sleep(PANEL_S)
                os.killpg(done.pid, signal.SIGINT)
            _, said = done.communicate(timeout=300)
    assert "fault in camtool" not in said, said
    assert (done.returncode != 0) is row.camtool.startswith("refused"), said
