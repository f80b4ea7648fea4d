"""A real Dask scheduler and workers on this computer; each of them is lost midway in some test."""

import json
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

from camtool.batches import cluster
from camtool.batches.cluster import ClusterPool
from camtool.batches.manifest import NAME, Manifest
from camtool.batches.run import DrawingTask, Outputs
from camtool.errors import CamtoolError, OptionError
from tests.oracles.batch_works import Obedient
from tests.waiting import HANG_S, heard_from

ROOT = Path(__file__).parents[2]
SAMPLES = ROOT / "samples"
BATCH = [sys.executable, "-m", "camtool", "batch", "drawings", "-t", "pic-mmh"]
MADE, LONELY = r"made:", r"has no workers"


@contextmanager
def process(
    *command: str, said: str, path: Path = ROOT, **environment: str
) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A process, and what it said up to the line that is waited for."""
    with subprocess.Popen(
        [sys.executable, *command],
        stderr=subprocess.STDOUT,
        stdout=subprocess.PIPE,
        text=True,
        cwd=path,
        env={**os.environ, "PYTHONPATH": str(path), **environment},
    ) as running:
        try:
            yield running, heard_from(running, said)
        finally:
            running.kill()


@contextmanager
def scheduler(**environment: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """The process and its address."""
    command = ("-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", "0")
    said = r"Scheduler at: +tcp://\S+"
    with process(*command, "--no-dashboard", said=said, **environment) as (running, heard):
        yield running, re.findall(r"tcp://\S+", heard)[-1]


@contextmanager
def worker(
    address: str, folder: Path, *, path: Path = ROOT, start: tuple[str, ...] = ("-m",)
) -> Iterator[subprocess.Popen[str]]:
    """A worker of one thread, without a process that would start it anew."""
    command = (*start, "distributed.cli.dask_worker", address, "--nthreads", "1", "--no-nanny")
    flags = ("--no-dashboard", "--host", "127.0.0.1", "--local-directory", str(folder))
    with process(*command, *flags, said="Registered to", path=path) as (running, _):
        yield running


@contextmanager
def batch(folder: Path, *flags: str, until: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """The command in a folder, and what it said until it said this."""
    pipe = subprocess.PIPE
    with subprocess.Popen(
        [*BATCH, "-o", "cluster", *flags], cwd=folder, stderr=pipe, text=True
    ) as running:
        try:
            yield running, heard_from(running, until)
        finally:
            running.kill()


def drawn(folder: Path, count: int) -> None:
    (folder / "drawings" / "in").mkdir(parents=True)
    for number in range(count):
        place = folder / "drawings" / "in" / f"{number:02}.dxf"
        shutil.copy(SAMPLES / "pieces/pic-mmh-square.dxf", place)


def assert_same_as_here(folder: Path, count: int) -> None:
    """The cluster's files are those that this computer makes."""
    subprocess.run([*BATCH, "-o", "here", "-q"], cwd=folder, check=False, capture_output=True)
    for name in (f"in/{number:02}.pic" for number in range(count)):
        assert (folder / "cluster" / name).read_bytes() == (folder / "here" / name).read_bytes()


def assert_whole(out: Path) -> int:
    """Nothing is there but whole outputs and a manifest of them; how many."""
    programs = {path.resolve() for path in out.rglob("*") if path.is_file()} - {out / NAME}
    assert programs == Manifest(out).outputs()
    assert len({path.read_bytes() for path in programs}) == 1
    return len(programs)


def test_a_cluster_makes_what_one_computer_makes_though_a_worker_is_killed(tmp_path: Path) -> None:
    drawn(tmp_path, 12)
    (tmp_path / "drawings" / "junk.dxf").write_text("junk\n")
    with ExitStack() as stack:
        _, address = stack.enter_context(scheduler())
        first = stack.enter_context(worker(address, tmp_path / "one"))
        stack.enter_context(worker(address, tmp_path / "two"))
        run, said = stack.enter_context(batch(tmp_path, "--scheduler", address, until=MADE))
        first.send_signal(signal.SIGKILL)
        said += run.communicate(timeout=HANG_S)[1]
    assert run.returncode == 1, said
    assert "13 drawings: 12 made, 1 failed" in said, said
    assert "drawings/junk.dxf | is no DXF" in said
    assert len(Manifest(tmp_path / "cluster").outputs()) == 12
    assert_same_as_here(tmp_path, 12)


@pytest.mark.slow
@pytest.mark.parametrize("lost", ["scheduler", "client"])
def test_what_is_left_halfway_is_whole_and_can_be_gone_on_with(tmp_path: Path, lost: str) -> None:
    drawn(tmp_path, 40)
    with ExitStack() as stack:
        head, address = stack.enter_context(scheduler())
        stack.enter_context(worker(address, tmp_path / "one"))
        flags = ("--scheduler", address, "--json", "all.json")
        run, said = stack.enter_context(batch(tmp_path, *flags, until=MADE))
        if lost == "scheduler":
            head.send_signal(signal.SIGKILL)
        else:
            run.send_signal(signal.SIGINT)
        said += run.communicate(timeout=HANG_S)[1]
        if lost == "client":  # the cluster is as good as before
            again, more = stack.enter_context(batch(tmp_path, *flags, until="drawings:"))
            assert again.wait(timeout=HANG_S) == 0, more
            assert "up to date" in more
    assert "Traceback" not in said
    assert len(said.splitlines()) < 45, said
    whole = json.loads((tmp_path / "all.json").read_text())
    if lost == "scheduler":
        assert run.returncode == 2, said
        assert (
            "camtool: error: --scheduler: the scheduler was lost; all written files are complete"
            in said
        )
        assert 1 <= assert_whole(tmp_path / "cluster") == whole["made"] == 40 - whole["not_run"]
        here = [*BATCH, "-o", "cluster", "-q"]
        subprocess.run(here, cwd=tmp_path, check=True, timeout=HANG_S)
    else:
        assert run.returncode == 128 + signal.SIGINT, said
        assert "interrupted; written files are complete" in said
        assert re.search(r"40 drawings: \d+ made, \d+ not run", said)
    assert_same_as_here(tmp_path, 40)


@pytest.mark.slow
def test_a_cluster_without_workers_is_told_and_waited_for(tmp_path: Path) -> None:
    drawn(tmp_path, 2)
    with ExitStack() as stack:
        _, address = stack.enter_context(scheduler())
        run, _ = stack.enter_context(batch(tmp_path, "--scheduler", address, until=LONELY))
        run.send_signal(signal.SIGINT)
        assert run.wait(timeout=HANG_S) == 128 + signal.SIGINT
        run, said = stack.enter_context(batch(tmp_path, "--scheduler", address, until=LONELY))
        stack.enter_context(worker(address, tmp_path / "one"))
        said += run.communicate(timeout=HANG_S)[1]
    assert run.returncode == 0, said
    assert "the cluster has workers now" in said
    assert said.count("has no workers") == 1


def tasks_of(folder: Path, *contents: str) -> list[DrawingTask]:
    tasks = [DrawingTask(str(folder / f"{n}.dxf"), str(n)) for n in range(len(contents))]
    for task, content in zip(tasks, contents, strict=True):
        task.path.write_text(content)
    return tasks


def made_on(address: str, tasks: list[DrawingTask]) -> dict[str, Outputs]:
    notes: list[str] = []
    results = ClusterPool(Obedient(), address, notes.append).results(tasks)
    return {task.stem: made for task, made in (each for each in results if each is not None)}


@pytest.mark.slow
def test_a_worker_with_another_camtool_is_refused_by_name(tmp_path: Path) -> None:
    other = tmp_path / "other"
    shutil.copytree(ROOT / "camtool", other / "camtool")
    shutil.copytree(ROOT / "tests", other / "tests")
    works = other / "tests" / "oracles" / "batch_works.py"
    works.write_text(works.read_text().replace("of no matter", "of other code"))
    said = r"--scheduler: tcp://127\.0\.0\.1:\d+ is refused: it has camtool 0\.\S+, or other code"
    with (
        scheduler() as (_, address),
        worker(address, tmp_path / "one", path=other),
        pytest.raises(CamtoolError, match=said),
    ):
        made_on(address, tasks_of(tmp_path, "a", "b"))


@pytest.mark.slow
def test_a_worker_without_camtool_is_told(tmp_path: Path) -> None:
    code = (
        "import runpy, sys; sys.modules['camtool'] = None\n"
        "runpy.run_module(sys.argv.pop(1), {}, '__main__')"
    )
    with (
        scheduler() as (_, address),
        worker(address, tmp_path / "one", start=("-c", code)),
        pytest.raises(CamtoolError, match=r"is refused: it cannot run this camtool .*No module"),
    ):
        made_on(address, tasks_of(tmp_path, "a", "b"))


@pytest.mark.slow
def test_a_drawing_that_kills_its_workers_is_given_up_by_name(tmp_path: Path) -> None:
    once = {"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "0"}
    with ExitStack() as stack:
        _, address = stack.enter_context(scheduler(**once))
        for name in ("one", "two"):
            stack.enter_context(worker(address, tmp_path / name))
        made = made_on(address, tasks_of(tmp_path, "a", "die", "broken"))
    assert made["0"].error is None
    assert made["1"].error == f"{tmp_path}/1.dxf: 1 workers were lost over it, and it was given up"
    assert made["2"].error == f"{tmp_path}/2.dxf: is broken"


def test_without_a_scheduler_it_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "CONNECT_S", 0.2)
    with pytest.raises(OptionError, match=r"no scheduler answers at 'tcp://127\.0\.0\.1:9'"):
        made_on("tcp://127.0.0.1:9", [DrawingTask("a.dxf", "a")])
