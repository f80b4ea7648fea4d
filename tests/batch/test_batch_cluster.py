"""A real Dask scheduler and two workers on this computer, one of which is killed midway."""

import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from camtool.batch.manifest import NAME, Manifest

ROOT = Path(__file__).parents[2]
SAMPLES = ROOT / "samples"

pytest.importorskip("distributed", reason="the extra `distributed` is not installed")


@contextmanager
def process(*command: str, said: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A process, and the line in which it said what is waited for."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(
        [sys.executable, *command],
        stderr=subprocess.STDOUT,
        stdout=subprocess.PIPE,
        text=True,
        env=environment,
    ) as running:
        assert running.stdout is not None
        try:
            heard = ""
            while not re.search(said, heard):
                line = running.stdout.readline()
                assert line, heard
                heard += line
            yield running, heard
        finally:
            running.kill()


@contextmanager
def scheduler() -> Iterator[str]:
    """Its address."""
    command = ("-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0")
    with process(*command, "--no-dashboard", said=r"Scheduler at: +tcp://\S+") as (_, heard):
        yield re.findall(r"tcp://\S+", heard)[-1]


@contextmanager
def worker(address: str, folder: Path) -> Iterator[subprocess.Popen[str]]:
    """A worker of one thread, without a process that would start it anew."""
    command = ("-m", "distributed.cli.dask_worker", address, "--nthreads", "1", "--no-nanny")
    flags = ("--no-dashboard", "--host", "127.0.0.1", "--local-directory", str(folder))
    with process(*command, *flags, said="Registered to") as (running, _):
        yield running


@pytest.mark.slow
def test_a_cluster_makes_what_one_computer_makes_though_a_worker_is_killed(tmp_path: Path) -> None:
    drawings = tmp_path / "drawings"
    (drawings / "in").mkdir(parents=True)
    for number in range(12):
        shutil.copy(SAMPLES / "pieces/pic-mmh-square.dxf", drawings / "in" / f"{number:02}.dxf")
    (drawings / "junk.dxf").write_text("junk\n")
    command = [sys.executable, "-m", "camtool", "batch", "drawings", "-t", "pic-mmh"]
    with ExitStack() as stack:
        address = stack.enter_context(scheduler())
        first = stack.enter_context(worker(address, tmp_path / "one"))
        stack.enter_context(worker(address, tmp_path / "two"))
        run = stack.enter_context(
            subprocess.Popen(
                [*command, "-o", "cluster", "--scheduler", address],
                cwd=tmp_path,
                stderr=subprocess.PIPE,
                text=True,
            )
        )
        stack.callback(run.kill)
        assert run.stderr is not None
        said = ""
        while "made:" not in said:
            line = run.stderr.readline()
            assert line, said
            said += line
        first.send_signal(signal.SIGKILL)
        said += run.communicate(timeout=120)[1]
    assert run.returncode == 1, said
    assert "13 drawings: 12 made, 1 failed" in said, said
    assert "drawings/junk.dxf | is no DXF" in said
    subprocess.run([*command, "-o", "here", "-q"], cwd=tmp_path, check=False, capture_output=True)
    for number in range(12):
        name = f"in/{number:02}.pic"
        assert (tmp_path / "cluster" / name).read_bytes() == (
            tmp_path / "here" / name
        ).read_bytes()
    assert len(Manifest(tmp_path / "cluster").outputs()) == 12
    assert (tmp_path / "cluster" / NAME).read_bytes() == (tmp_path / "here" / NAME).read_bytes()


def test_without_a_scheduler_it_says_so(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "camtool", "batch", str(SAMPLES / "letter.svg"), "-t", "grbl"]
    done = subprocess.run(
        [*command, "-o", "out", "--scheduler", "tcp://127.0.0.1:9"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert "--scheduler: no scheduler answers at 'tcp://127.0.0.1:9'" in done.stderr
    assert "Traceback" not in done.stderr
