"""Signs of life: on terminals, for commands that take long, and gone when they end."""

import io
import os
import pty
import re
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from camtool.cli import life_signs as module
from camtool.cli.life_signs import LifeSigns, life_signs
from camtool.cli.main import main
from camtool.progress import Progress
from tests.cli.conftest import Run
from tests.waiting import HANG_S, all_written


class Terminal(io.StringIO):
    """A stream that says it is one, and tells when something was written."""

    def __init__(self, *, is_one: bool = True) -> None:
        super().__init__()
        self.is_one, self.seen = is_one, threading.Event()

    def isatty(self) -> bool:
        return self.is_one

    def write(self, text: str) -> int:
        written = super().write(text)
        self.seen.set()
        return written


@pytest.fixture(autouse=True)
def at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(module, "AFTER_S", 0.0)
    monkeypatch.setattr(module, "EVERY_S", 0.0)


def test_the_stage_is_shown_and_wiped_out_at_the_end() -> None:
    stream = Terminal()
    with life_signs(stream, ["post", "a.dxf"]) as signs:
        signs.progress.begin("planning")
        assert stream.seen.wait(HANG_S)
    lines = stream.getvalue().split("\r")
    assert lines[0] in ("camtool: 0 s", "camtool: planning, 0 s")
    assert lines[-1] == ""
    assert set(lines[-2]) == {" "}
    assert len(lines[-2]) >= len(lines[-3].rstrip())


def test_a_line_shows_stage_share_and_seconds_and_covers_the_one_before(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("COLUMNS", "40")
    stream, progress = io.StringIO(), Progress()
    signs = LifeSigns(stream, progress)
    progress.begin("simulating", 8)
    progress.done = 2
    signs.show()
    progress.begin("\n" + "x" * 60)
    signs.show()
    signs.hide()
    signs.hide()
    first, second, last, end = stream.getvalue().split("\r")
    assert first == "camtool: simulating, 25 %, 0 s"
    assert second == "camtool: \\n" + "x" * 28
    assert last == " " * 39
    assert end == ""


def test_nothing_is_shown_between_two_runs_of_one_command() -> None:
    stream = io.StringIO()
    signs = LifeSigns(stream, Progress())
    with signs.counting():
        signs.show()
    assert stream.getvalue() == f"camtool: 0 s\r{' ' * 12}\r"
    signs.show()
    assert stream.getvalue().count("camtool") == 1


def test_a_share_is_known_where_the_count_is() -> None:
    progress = Progress()
    assert progress.share is None
    progress.begin("judging", 4)
    progress.done = 5
    assert progress.share == 1.0
    progress.begin("drawing")
    assert progress.share is None


@pytest.fixture
def slowly(at_once: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each stage lasts long enough to be seen."""
    begin = Progress.begin

    def begin_slowly(self: Progress, *words: Any) -> None:
        begin(self, *words)
        time.sleep(0.05)

    monkeypatch.setattr(module, "EVERY_S", 0.001)
    monkeypatch.setattr(Progress, "begin", begin_slowly)


def on_terminal(*arguments: str, folder: Path) -> bytes:
    """Return all that a command writes to a terminal, progress lines included."""
    ours, theirs = pty.openpty()
    with ThreadPoolExecutor(1) as other, pytest.MonkeyPatch.context() as patch:
        written = other.submit(all_written, ours)
        try:
            with os.fdopen(theirs, "w", buffering=1, encoding="utf-8") as terminal:
                patch.chdir(folder)
                patch.setenv("COLUMNS", "100")
                patch.setattr(sys, "argv", ["camtool", *arguments])
                patch.setattr(sys, "stdout", terminal)
                patch.setattr(sys, "stderr", terminal)
                patch.setattr(sys, "unraisablehook", sys.unraisablehook)
                with pytest.raises(SystemExit) as stopped:
                    main()
        finally:
            found = written.result()
    assert not stopped.value.code, found
    return found


def shown_after(written: bytes) -> list[str]:
    """Return the lines on the screen after the text was written."""
    lines = []
    for line in (
        re.sub(rb"\x1b\[[0-9;]*m", b"", written).decode().replace("\r\n", "\n").split("\n")
    ):
        cells = ""
        for part in line.split("\r"):
            cells = part + cells[len(part) :]
        lines.append(cells.rstrip())
    return lines


@pytest.mark.parametrize(
    ("line", "stages"),
    [
        ("post {logo} -t grbl -o a.nc", ["reading logo.dxf", "planning", "judging"]),
        ("post {logo} -t grbl -o a.nc --preview a.svg", ["drawing the picture"]),
        ("check {logo}", ["reading logo.dxf"]),
        ("preview {logo} -o a.svg", ["reading logo.dxf"]),
        ("preview {program} -t grbl -o a.svg", ["reading logo.nc"]),
        ("post {logo} -t grbl -o a.nc --tolerances drawing", ["inspecting dimensions"]),
        ("verify {program} -t grbl", ["judging"]),
        ("convert {program} --from grbl --to linuxcnc -o b.ngc", ["judging"]),
        ("stale {logo} -t grbl", ["reading logo.dxf", "planning"]),
        ("job new {logo} -o new.toml", ["reading logo.dxf"]),
    ],
)
def test_each_command_shows_its_stages_on_a_terminal_and_leaves_none_of_them(
    camtool: Run, slowly: None, line: str, stages: list[str], samples: Path, tmp_path: Path
) -> None:
    logo = samples / "logo.dxf"
    places = {"logo": str(logo), "program": str(tmp_path / "logo.nc")}
    if "stale" in line:
        (tmp_path / "logo.dxf").write_bytes(logo.read_bytes())
        places["logo"] = str(tmp_path / "logo.dxf")
    if "{program}" in line or "stale" in line:
        made = camtool("post", logo, "-t", "grbl", "-q", "-o", places["program"])
        assert made.returncode == 0, made.stderr
    words = [word.format(**places) for word in line.split()]
    written = on_terminal(*words, folder=tmp_path)
    for stage in stages:
        assert stage in written.decode(), written
    left = shown_after(written)
    assert not [row for row in left if re.search(r"camtool: .*\d s$", row)], left
    (tmp_path / "new.toml").unlink(missing_ok=True)
    piped = camtool(*words)
    assert piped.returncode == 0, piped.stderr
    assert b"\r" not in piped.stderr + piped.stdout


def test_a_short_run_says_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "AFTER_S", 1e6)
    stream = Terminal()
    with life_signs(stream, ["post"]):
        pass
    assert stream.getvalue() == ""


@pytest.mark.parametrize(
    ("stream", "words"),
    [
        (Terminal(is_one=False), ["post"]),
        (Terminal(), ["post", "-q"]),
        (Terminal(), ["post", "--quiet"]),
        (Terminal(), ["batch", "x"]),
    ],
)
def test_who_wants_no_signs_gets_none(stream: Terminal, words: list[str]) -> None:
    threads = threading.active_count()
    with life_signs(stream, words):
        assert threading.active_count() == threads
    assert stream.getvalue() == ""


def test_no_stream_and_a_terminal_that_goes_away_are_no_fault() -> None:
    with life_signs(None, []):
        pass
    stream = Terminal()
    with life_signs(stream, []):
        stream.close()
