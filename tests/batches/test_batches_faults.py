"""Full disks, folders that nobody may write, broken drawings: errors of one drawing."""

import os
import resource
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from camtool.batches.manifest import Manifest
from camtool.batches.run import BatchSettings, DrawingTask, Outcome, OutcomeState, run_batch
from camtool.cli.files import write_all
from tests.oracles.batch_works import HerePool, Obedient

NOBODY = 65534


def tasks_of(folder: Path, **contents: str) -> list[DrawingTask]:
    tasks = []
    for name, content in contents.items():
        (folder / f"{name}.dxf").write_text(content)
        tasks.append(DrawingTask(str(folder / f"{name}.dxf"), name))
    return tasks


def run(tasks: list[DrawingTask], out: Path, *, force: bool = False) -> dict[str, Outcome]:
    order = BatchSettings(out, write_all, "base", {}, force)
    outcomes = run_batch(tasks, order, Manifest(out), HerePool(Obedient()))
    return {each.stem: each for each in outcomes if each is not None}


def states(outcomes: dict[str, Outcome]) -> dict[str, str]:
    return {stem: outcome.state.value for stem, outcome in outcomes.items()}


def files_in(folder: Path) -> set[str]:
    return {path.name for path in folder.rglob("*") if path.is_file()}


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A disk of 64 KiB."""
    place = tmp_path / "disk"
    place.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", str(place)]
    if os.geteuid() != 0 or subprocess.run(command, capture_output=True, check=False).returncode:
        pytest.skip("only root can mount a small disk to fill")
    try:
        yield place
    finally:
        subprocess.run(["umount", str(place)], check=True)


def test_a_full_disk_is_the_error_of_that_drawing(tmp_path: Path, small_disk: Path) -> None:
    tasks = tasks_of(tmp_path, a="a", b="large 100000", c="c")
    outcomes = run(tasks, small_disk)
    assert states(outcomes) == {"a": "made", "b": "failed", "c": "made"}
    error = outcomes["b"].error or ""
    assert error.startswith(f"{tmp_path}/b.dxf: {small_disk}/b.out: cannot be written (No space")
    assert files_in(small_disk) == {"a.out", "c.out", ".camtool-batch.jsonl"}
    again = states(run(tasks, small_disk))
    assert again == {"a": "up to date", "b": "failed", "c": "up to date"}


@contextmanager
def files_of_at_most(size: int) -> Iterator[None]:
    """Limit the size of files, since a test cannot fill a disk."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_a_file_that_grows_too_large_is_the_error_of_that_drawing(tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "b.out").write_text("old")
    tasks = tasks_of(tmp_path, a="a", b="large 100000", c="c")
    with files_of_at_most(50_000):
        outcomes = run(tasks, out, force=True)
    assert states(outcomes) == {"a": "made", "b": "failed", "c": "made"}
    assert "cannot be written (File too large)" in (outcomes["b"].error or "")
    assert files_in(out) == {"a.out", "b.out", "c.out", ".camtool-batch.jsonl"}
    assert (out / "b.out").read_text() == "old"
    assert Manifest(out).outputs() == {out / "a.out", out / "c.out"}


def fill(filler: Path) -> None:
    with suppress(OSError), filler.open("wb", buffering=0) as stream:
        while True:
            stream.write(b"x" * 512)


def test_a_disk_too_full_for_the_manifest(tmp_path: Path, small_disk: Path) -> None:
    run(tasks_of(tmp_path, a="a"), small_disk)
    filler = small_disk / "filler"
    fill(filler)
    outcomes = run(tasks_of(tmp_path, a="a", b="b"), small_disk)
    assert states(outcomes) == {"a": "up to date", "b": "failed"}
    assert files_in(small_disk) == {"a.out", "filler", ".camtool-batch.jsonl"}
    filler.unlink()
    outcomes = run(tasks_of(tmp_path, a="a", b="b"), small_disk)
    assert states(outcomes) == {"a": "up to date", "b": "made"}


@contextmanager
def as_nobody() -> Iterator[None]:
    """Root may write everywhere: for permissions we are somebody else."""
    if os.geteuid() != 0:
        yield
        return
    os.seteuid(NOBODY)
    try:
        yield
    finally:
        os.seteuid(0)


@pytest.fixture
def open_path() -> Iterator[Path]:
    """A folder that anybody can come to; pytest's own folders are its user's alone."""
    with TemporaryDirectory() as folder:
        Path(folder).chmod(0o755)
        yield Path(folder)


def test_missing_permissions_are_the_error_of_that_drawing(open_path: Path) -> None:
    out = open_path / "out"
    for folder in (out, out / "closed"):
        folder.mkdir()
        folder.chmod(0o777)
    tasks = tasks_of(open_path, a="a", secret="s", z="z")
    tasks.insert(1, DrawingTask(tasks[0].source, "closed/b"))
    (open_path / "secret.dxf").chmod(0)
    (out / "closed" / "b.out").write_text("old")
    (out / "closed").chmod(0o555)
    with as_nobody():
        outcomes = run(tasks, out, force=True)
        again = run(tasks, out)
    (out / "closed").chmod(0o755)
    assert states(outcomes) == {"a": "made", "closed/b": "failed", "secret": "failed", "z": "made"}
    assert "Permission denied" in (outcomes["closed/b"].error or "")
    assert "Permission denied" in (outcomes["secret"].error or "")
    assert files_in(out) == {"a.out", "b.out", "z.out", ".camtool-batch.jsonl"}
    assert (out / "closed" / "b.out").read_text() == "old"
    assert again["z"].state is OutcomeState.UP_TO_DATE


def test_a_file_where_a_folder_must_be(tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "x").write_text("no folder")
    tasks = [DrawingTask(each.source, f"x/{each.stem}") for each in tasks_of(tmp_path, a="a")]
    outcomes = run([*tasks, *tasks_of(tmp_path, b="b")], out)
    assert states(outcomes) == {"x/a": "failed", "b": "made"}
    assert f"{out}/x" in (outcomes["x/a"].error or "")


def test_broken_drawings_among_good_ones(tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    tasks = tasks_of(tmp_path, a="a", b="broken", c="fault", d="memory", e="e")
    assert list(states(run(tasks, out)).values()) == ["made", "failed", "failed", "failed", "made"]
    assert files_in(out) == {"a.out", "e.out", ".camtool-batch.jsonl"}
