"""Two batches never write to one folder, and a lock never outlives its process."""

import errno
import fcntl
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from camtool.batches.lock import NAME, lock_folder
from camtool.errors import OutputError
from tests.waiting import HANG_S

ROOT = Path(__file__).parents[2]
HOLDER = """
import sys
from pathlib import Path
from camtool.batches.lock import lock_folder
with lock_folder(Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.read()
"""


@contextmanager
def holder(out: Path) -> Iterator[subprocess.Popen[str]]:
    """Another process that has the folder."""
    with subprocess.Popen(
        [sys.executable, "-c", HOLDER, str(out)],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "held\n"
        try:
            yield process
        finally:
            process.kill()


def test_another_process_is_refused_and_told_who_holds_it(tmp_path: Path) -> None:
    with holder(tmp_path) as other:
        who = f"process {other.pid} on {socket.gethostname()}"
        for _ in range(2):  # being refused harms nothing
            with pytest.raises(OutputError, match=f"another batch writes there .{who}."):
                lock_folder(tmp_path).__enter__()
        other.communicate("", timeout=HANG_S)
        assert other.returncode == 0
        assert not any(tmp_path.iterdir())
        with lock_folder(tmp_path):
            assert (tmp_path / NAME).read_text().startswith(f"process {os.getpid()} on ")
    assert not any(tmp_path.iterdir())


def test_a_holder_that_was_killed_holds_nothing(tmp_path: Path) -> None:
    with holder(tmp_path) as other:
        other.send_signal(signal.SIGKILL)
        other.wait()
    assert (tmp_path / NAME).exists()
    with lock_folder(tmp_path) as locked:
        assert locked
        assert f"process {os.getpid()} on" in (tmp_path / NAME).read_text()
    assert not any(tmp_path.iterdir())


def test_a_file_that_was_taken_away_while_it_was_locked_is_no_lock(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real, opened = fcntl.flock, []

    def late(handle: int, mode: int) -> None:
        if not opened:
            (tmp_path / NAME).unlink()  # as who held it until now does
        opened.append(handle)
        real(handle, mode)

    monkeypatch.setattr(fcntl, "flock", late)
    with lock_folder(tmp_path):
        assert (tmp_path / NAME).exists()
        with pytest.raises(OutputError, match="another batch"):
            lock_folder(tmp_path).__enter__()
    assert len(opened) == 3


def test_a_file_system_without_locks_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def none(handle: int, mode: int) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", none)
    with lock_folder(tmp_path) as locked:
        assert not locked
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize("fault", [errno.EIO, errno.ESTALE])
def test_a_broken_disk_is_not_taken_for_another_batch(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fault: int
) -> None:
    def broken(handle: int, mode: int) -> None:
        raise OSError(fault, os.strerror(fault))

    monkeypatch.setattr(fcntl, "flock", broken)
    with pytest.raises(OutputError, match=rf"{NAME}: cannot be written .{os.strerror(fault)}"):
        lock_folder(tmp_path).__enter__()


def test_a_folder_that_is_gone(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="No such file or directory"):
        lock_folder(tmp_path / "gone").__enter__()
