"""`camtool post --watch`: again after each change, whatever the change does."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from camtool.cli.options import JobFlags
from camtool.cli.post import POLL_S, SETTLED_S, watch
from camtool.errors import DrawingError
from tests.cli.conftest import Run
from tests.waiting import HANG_S, heard_from

RING = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="40mm" height="40mm" viewBox="0 0 40 40">'
    '<circle cx="20" cy="20" r="{radius}"/></svg>'
)


class Days:
    """Each wait is a step of a story; after the last one comes Ctrl-C."""

    def __init__(self, *steps: Callable[[], object]) -> None:
        self.steps = list(steps)
        self.waited: list[float] = []

    def __call__(self, seconds: float) -> None:
        self.waited.append(seconds)
        if not self.steps:
            raise KeyboardInterrupt
        self.steps.pop(0)()


def nothing() -> None:
    """A step in which nothing happens."""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    place = tmp_path / "a.txt"
    place.write_text("one")
    return place


def rounds(file: Path, *steps: Callable[[], object]) -> list[str | None]:
    """Return the content of the file in each round."""
    held: list[str | None] = []

    def again() -> int:
        held.append(file.read_text() if file.exists() else None)
        return 1

    assert watch(again, lambda: [str(file), "missing.toml"], quiet=True, wait=Days(*steps)) == 0
    return held


def test_nothing_happens_without_a_change(file: Path) -> None:
    assert rounds(file, nothing, nothing, nothing) == ["one"]


def test_a_save_without_a_change_is_none(file: Path) -> None:
    assert rounds(file, lambda: file.write_text("one"), nothing) == ["one"]
    assert rounds(file, lambda: os.utime(file, (1, 1)), nothing) == ["one"]


def test_each_change_counts_once(file: Path) -> None:
    steps = (lambda: file.write_text("two"), nothing, nothing, lambda: file.write_text("three"))
    assert rounds(file, *steps, nothing, nothing) == ["one", "two", "three"]


def test_a_file_in_several_goes_counts_when_it_has_settled(file: Path) -> None:
    steps = [lambda part=part: file.write_text("two"[:part]) for part in (0, 1, 2, 3)]
    days = Days(*steps, nothing, nothing)
    held: list[str] = []
    watch(lambda: held.append(file.read_text()) or 0, lambda: [str(file)], quiet=True, wait=days)
    assert held == ["one", "two"]
    assert days.waited[:6] == [POLL_S, *[SETTLED_S] * 4, POLL_S]


def test_a_change_that_is_taken_back_is_none(file: Path) -> None:
    steps = (lambda: file.write_text("two"), lambda: file.write_text("one"))
    assert rounds(file, *steps, nothing, nothing) == ["one"]


def test_a_file_that_is_replaced_is_waited_for(file: Path) -> None:
    assert rounds(file, file.unlink, lambda: file.write_text("two"), nothing, nothing) == [
        "one",
        "two",
    ]


def test_an_editor_that_saves_by_renaming_is_seen(file: Path, tmp_path: Path) -> None:
    def saved() -> None:
        other = tmp_path / ".a.txt.swp"
        other.write_text("two")
        other.replace(file)

    assert rounds(file, saved, nothing, nothing) == ["one", "two"]


def test_a_file_that_goes_and_one_that_comes_are_changes(file: Path, tmp_path: Path) -> None:
    job, held = tmp_path / "job.toml", []

    def again() -> int:
        held.append((file.exists(), job.exists()))
        return 0

    steps = (file.unlink, nothing, lambda: file.write_text("one"), nothing)
    days = Days(*steps, lambda: job.write_text(""), nothing, job.unlink, nothing)
    watch(again, lambda: [str(file), str(job)], quiet=True, wait=days)
    there, gone, with_job = (True, False), (False, False), (True, True)
    assert held == [there, gone, there, with_job, there]


def test_a_change_while_it_runs_is_seen(file: Path) -> None:
    held: list[str] = []

    def again() -> int:
        held.append(file.read_text())
        if len(held) == 1:
            file.write_text("two")
        return 0

    watch(again, lambda: [str(file)], quiet=True, wait=Days(nothing, nothing, nothing))
    assert held == ["one", "two"]


def test_an_error_is_said_and_watching_goes_on(file: Path, capsys) -> None:
    count = 0

    def again() -> int:
        nonlocal count
        count += 1
        raise DrawingError("is no drawing", file="a.txt")

    days = Days(lambda: file.write_text("two"), nothing, nothing)
    assert watch(again, lambda: [str(file)], quiet=True, wait=days) == 0
    assert count == 2
    assert capsys.readouterr().err == "camtool: error: a.txt: is no drawing\n" * 2


def test_a_tool_table_of_the_job_is_watched(tmp_path: Path) -> None:
    job = tmp_path / "job.toml"
    flags = JobFlags(str(job))
    assert flags.files() == [str(job)]
    job.write_text("tool_table = [")
    assert flags.files() == [str(job)]
    job.write_text('tool_table = "my.tbl"')
    assert flags.files() == [str(job), str(tmp_path / "my.tbl")]
    given = JobFlags(str(job), (), {"tool_table": "other.tbl"})
    assert given.files() == [str(job), "other.tbl"]


def test_a_file_that_is_named_anew_counts(file: Path, tmp_path: Path) -> None:
    names, count = [str(file)], 0

    def again() -> int:
        nonlocal count
        count += 1
        return 0

    days = Days(lambda: names.append(str(tmp_path / "new.tbl")), nothing, nothing)
    watch(again, lambda: names, quiet=True, wait=days)
    assert count == 2


@pytest.mark.parametrize("flags", [("-", "-o", "a.nc"), ("a.svg", "-o", "-")])
def test_streams_cannot_be_watched(camtool: Run, flags: tuple[str, ...]) -> None:
    done = camtool("post", *flags, "-t", "grbl", "--watch")
    assert done.returncode == 2
    assert b"--watch works on files" in done.stderr


def test_a_process_posts_again_until_ctrl_c(tmp_path: Path) -> None:
    drawing, job = tmp_path / "ring.svg", tmp_path / "job.toml"
    machine, program = tmp_path / "mill.toml", tmp_path / "ring.nc"
    drawing.write_text(RING.format(radius=10))
    job.write_text('depth = "0.5mm"\n')
    machine.write_text('extends = "grbl"\n')
    command = [sys.executable, "-m", "camtool", "post", drawing.name, "--job", job.name]
    command += ["--machine", machine.name, "-o", program.name, "--watch"]
    with subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True) as running:
        try:
            said = heard_from(running, "written")
            first = program.read_bytes()
            drawing.write_text("<svg")  # half a drawing: an error, and the program stays
            said += heard_from(running, "camtool: error")
            assert program.read_bytes() == first
            drawing.write_text(RING.format(radius=9))
            said += heard_from(running, "written")
            second = program.read_bytes()
            job.write_text('depth = "0.25mm"\n')
            said += heard_from(running, "written")
            assert b"Z-0.25" in program.read_bytes()
            machine.write_text('extends = "grbl"\n[feed]\ndefault_mm_min = 77.0\n')
            said += heard_from(running, "written")
            assert b"F77" in program.read_bytes()
            assert len({first, second, program.read_bytes()}) == 3
            running.send_signal(signal.SIGINT)
            said += running.communicate(timeout=HANG_S)[1]
        finally:
            running.kill()
    assert running.returncode == 0, said
    assert "fault" not in said
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == ["job.toml", "mill.toml", "ring.nc", "ring.svg"]
