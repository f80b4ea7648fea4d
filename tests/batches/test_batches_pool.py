"""Workers die, hang and leak; the others go on, and the drawing is named."""

import multiprocessing
from pathlib import Path

import pytest

from camtool.batches import pool
from camtool.batches.pool import LocalPool, PoolOptions
from camtool.batches.run import DrawingTask, Outputs
from camtool.errors import CamtoolError
from tests.oracles.batch_works import Obedient


def tasks_of(folder: Path, *contents: str) -> list[DrawingTask]:
    tasks = []
    for number, content in enumerate(contents):
        (folder / f"{number}.dxf").write_text(content)
        tasks.append(DrawingTask(str(folder / f"{number}.dxf"), str(number)))
    return tasks


def run(
    tasks: list[DrawingTask], work: Obedient | None = None, **options: object
) -> dict[str, Outputs]:
    workers = LocalPool(work or Obedient(), PoolOptions(**options))  # type: ignore[arg-type]
    results = [each for each in workers.results(tasks) if each is not None]
    assert not multiprocessing.active_children()
    made = {task.stem: made for task, made in results}
    assert len(made) == len(results)
    return made


def test_a_worker_that_is_killed_is_named_and_the_rest_goes_on(tmp_path: Path) -> None:
    tasks = tasks_of(tmp_path, "a", "die", "b", "leave", "c")
    made = run(tasks, jobs=2)
    assert sorted(made) == list("01234")
    assert [made[n].error is None for n in "01234"] == [True, False, True, False, True]
    assert made["1"].error is not None
    assert made["1"].error.startswith(f"{tmp_path}/1.dxf: its worker was lost (killed by SIGKILL")
    assert made["3"].error is not None
    assert "exit code 7" in made["3"].error


def test_every_fault_is_one_drawings(tmp_path: Path) -> None:
    made = run(tasks_of(tmp_path, "broken", "fault", "memory", "pid", "pid"), jobs=1)
    errors = [made[n].error or "" for n in "012"]
    assert "is broken" in errors[0]
    assert "fault in camtool itself (ZeroDivisionError: by nought" in errors[1]
    assert "more memory" in errors[2]
    assert made["3"].files[".out"] == made["4"].files[".out"]  # one worker all along


def test_one_that_takes_too_long_is_killed(tmp_path: Path) -> None:
    made = run(tasks_of(tmp_path, "sleep 60", "a"), jobs=1, timeout_s=0.5)
    assert made["0"].error == f"{tmp_path}/0.dxf: took longer than --timeout 0.5 s"
    assert made["1"].error is None


@pytest.mark.parametrize(
    ("bound", "value", "workers"), [("RECYCLE_AFTER", 2, 2), ("RECYCLE_MIB", 0.001, 4)]
)
def test_workers_are_replaced_before_they_grow(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, bound: str, value: float, workers: int
) -> None:
    monkeypatch.setattr(pool, bound, value)
    made = run(tasks_of(tmp_path, *["pid"] * 4), jobs=1)
    assert len({made[n].files[".out"] for n in "0123"}) == workers


def test_the_memory_of_the_parent_is_not_the_worker_s(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pool, "RECYCLE_MIB", 600.0)
    much = bytearray(700 << 20)
    much[:: 1 << 12] = b"x" * len(much[:: 1 << 12])  # every page is really there
    made = run(tasks_of(tmp_path, *["pid"] * 3), jobs=1)
    assert len(much) == 700 << 20
    assert len({made[n].files[".out"] for n in "012"}) == 1


def test_where_no_worker_can_live_the_run_ends(tmp_path: Path) -> None:
    with pytest.raises(CamtoolError, match="die before their first drawing"):
        run(tasks_of(tmp_path, "a", "b"), Obedient(dies_warm=True), jobs=2)
    assert not multiprocessing.active_children()


def test_closing_ends_the_workers(tmp_path: Path) -> None:
    results = LocalPool(Obedient(), PoolOptions(jobs=2)).results(
        tasks_of(tmp_path, "a", "sleep 60", "sleep 60")
    )
    while next(results) is None:
        pass
    results.close()
    assert not multiprocessing.active_children()
