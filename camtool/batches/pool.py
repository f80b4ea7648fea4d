"""Worker processes of this computer; one that dies or is killed does not affect the others.

When a process of a standard library's pool is killed, the whole pool is broken. Here each worker
has a pipe of its own: the end of the pipe shows which drawing it was making, and a new worker
takes its place."""

from __future__ import annotations

import gc
import multiprocessing
import os
import signal
import sys
import time
import traceback
from collections import deque
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

from camtool.batches.run import BatchWork, DrawingTask, Outputs
from camtool.errors import CamtoolError
from camtool.records import replace

TICK_S = 0.2
"""Time to wait for a result before control returns to the caller (to redraw, to stop)."""

END_S = 2.0
"""Time that a worker has to end before it is killed."""

RECYCLE_AFTER = 200
"""Number of drawings after which a worker is replaced by a new one."""

RECYCLE_MIB = 1024.0
"""A worker that has used more memory than this is replaced too."""

FAILED_STARTS = 3
"""Consecutive workers that die before they are ready, after which the run ends."""


@dataclass(frozen=True)
class PoolOptions:
    """`jobs` processes, each drawing in at most `timeout_s` (None: no limit)."""

    jobs: int = 1
    timeout_s: float | None = None


@dataclass(eq=False)
class _Worker:
    process: Any
    pipe: Connection
    ready: bool = False
    task: DrawingTask | None = None
    since_s: float = 0.0
    done: int = 0


class LocalPool:
    """Worker processes for one BatchWork."""

    def __init__(self, work: BatchWork, options: PoolOptions) -> None:
        self._work = work
        self._options = options
        self._workers: list[_Worker] = []
        self._failed_starts = 0

    def results(
        self, tasks: Sequence[DrawingTask]
    ) -> Generator[tuple[DrawingTask, Outputs] | None]:
        """Yield a result for each task, in any order, and None after each `TICK_S` without one.

        Closing the generator kills the workers. Raises CamtoolError when no worker can be started.
        """
        queue = deque(tasks)
        try:
            while queue or any(worker.task for worker in self._workers):
                self._assign_tasks(queue)
                ready_pipes = wait([worker.pipe for worker in self._workers], TICK_S)
                senders = [worker for worker in self._workers if worker.pipe in ready_pipes]
                results = [each for worker in senders if (each := self._receive(worker))]
                results += self._kill_overdue()
                yield from results
                if not results:
                    yield None
        finally:
            self._end()

    def _assign_tasks(self, queue: deque[DrawingTask]) -> None:
        """Start workers while there are tasks for them; give each free worker a task."""
        busy = sum(worker.task is not None for worker in self._workers)
        worker_count = min(self._options.jobs, busy + len(queue))
        while len(self._workers) < worker_count:
            self._workers.append(self._start_worker())
        for worker in self._workers:
            if queue and worker.ready and worker.task is None:
                task = queue.popleft()
                worker.task, worker.since_s = task, time.monotonic()
                try:
                    worker.pipe.send(task)
                except OSError:  # it died while idle, not because of this drawing
                    worker.task = None
                    queue.appendleft(task)
                    self._drop(worker)
                    return

    def _start_worker(self) -> _Worker:
        context = multiprocessing.get_context("spawn")
        own_pipe, other_pipe = context.Pipe()
        process = context.Process(target=serve, args=(other_pipe,), daemon=True)
        with _interrupts_blocked():
            process.start()
        other_pipe.close()
        worker = _Worker(process, own_pipe)
        with suppress(OSError):  # it has ended: the pipe shows that later
            own_pipe.send(self._work)
        return worker

    def _receive(self, worker: _Worker) -> tuple[DrawingTask, Outputs] | None:
        """Receive a result from a worker; None if the worker reported that it is ready, or died
        while idle."""
        try:
            message = worker.pipe.recv()
        except (EOFError, OSError):
            return self._remove_dead(worker)
        self._failed_starts = 0
        if message == READY:
            worker.ready = True
            return None
        outputs, peak_mib = message
        task, worker.task = worker.task, None
        worker.done += 1
        if worker.done >= RECYCLE_AFTER or peak_mib > RECYCLE_MIB:
            self._drop(worker)
        return None if task is None else (task, outputs)

    def _remove_dead(self, worker: _Worker) -> tuple[DrawingTask, Outputs] | None:
        worker.process.join(END_S)
        code = worker.process.exitcode
        task = worker.task
        self._drop(worker)
        if task is None:
            self._failed_starts += not worker.ready
            if self._failed_starts >= FAILED_STARTS:
                raise CamtoolError(
                    f"workers die before their first drawing ({_cause(code)})",
                    mend="see whether camtool post does one of the drawings",
                )
            return None
        return task, Outputs(
            error=f"{task.source}: its worker was lost ({_cause(code)}); the others went on",
            seconds=time.monotonic() - worker.since_s,
        )

    def _kill_overdue(self) -> list[tuple[DrawingTask, Outputs]]:
        """Kill the workers that exceed the time limit; return an error for each of their
        drawings."""
        limit = self._options.timeout_s
        if limit is None:
            return []
        overdue = []
        for worker in list(self._workers):
            spent = time.monotonic() - worker.since_s
            if worker.task is not None and spent > limit:
                error = f"{worker.task.source}: took longer than --timeout {limit:g} s"
                overdue.append((worker.task, Outputs(error=error, seconds=spent)))
                worker.process.kill()
                self._drop(worker)
        return overdue

    def _drop(self, worker: _Worker) -> None:
        self._workers.remove(worker)
        worker.pipe.close()
        if worker.task is not None:
            worker.process.kill()
        worker.process.join(END_S)
        if worker.process.exitcode is None:
            worker.process.kill()
            worker.process.join()
        worker.process.close()

    def _end(self) -> None:
        for worker in self._workers:
            if worker.task is not None or not worker.ready:
                worker.process.kill()
        for worker in list(self._workers):
            self._drop(worker)


def _cause(code: int | None) -> str:
    """Describe why a process ended, from its exit code."""
    if code is None or code >= 0:
        return f"exit code {code}"
    try:
        name = signal.Signals(-code).name
    except ValueError:
        name = f"signal {-code}"
    hint = ", perhaps because memory ran out" if name == "SIGKILL" else ""
    return f"killed by {name}{hint}"


@contextmanager
def _interrupts_blocked() -> Iterator[None]:
    """Block Ctrl-C (SIGINT) within the block. A worker started there inherits this, so that Ctrl-C
    cannot stop it before it ignores the signal itself."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    old = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, old)


# One worker: it takes tasks from its pipe and sends back the results, until the pipe ends.

READY = "ready"
"""The message of a worker that has loaded what it needs."""

_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def serve(pipe: Connection) -> None:
    """Run a worker: receive a BatchWork, then tasks, until None or the end of the pipe.

    Ctrl-C reaches every process of a terminal; workers ignore it, because the parent ends them."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for name in _ONE_THREAD:  # before numpy is loaded: the workers share the cores already
        os.environ.setdefault(name, "1")
    try:
        work: BatchWork = pipe.recv()
        gc.disable()
        with suppress(Exception):  # the fault shows again at each drawing, with its name
            work.warm()
        gc.freeze()  # loaded objects are kept out of garbage collection
        gc.enable()
        pipe.send(READY)
        while (task := pipe.recv()) is not None:
            pipe.send((make_outputs(work, task, None), peak_mib()))
    except (EOFError, BrokenPipeError, ConnectionResetError):
        return


def make_outputs(work: BatchWork, task: DrawingTask, data: bytes | None) -> Outputs:
    """Make the outputs of one drawing; any exception becomes an error of this drawing alone."""
    begin = time.perf_counter()
    try:
        outputs = work.make(task, data)
    except CamtoolError as error:
        outputs = Outputs(error=str(error))
    except MemoryError:
        outputs = Outputs(error=f"{task.source}: needs more memory than there is")
    except Exception as error:
        place = traceback.format_exc(limit=-1).strip().splitlines()[1].strip()
        outputs = Outputs(
            error=f"{task.source}: fault in camtool itself ({type(error).__name__}: {error}; "
            f"{place}); please report it"
        )
    return replace(outputs, seconds=time.perf_counter() - begin)


def peak_mib() -> float:
    """Return the peak memory of this process, MiB; 0 if the system does not report it.

    Linux's getrusage gives the parent's memory at the fork if that was larger, even after an
    exec; VmHWM is that of this program alone."""
    try:
        status = Path("/proc/self/status").read_text(encoding="ascii", errors="replace")
        return float(status.partition("VmHWM:")[2].split()[0]) / (1 << 10)
    except (OSError, IndexError, ValueError):
        pass
    try:
        import resource
    except ImportError:
        return 0.0
    peak = float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
    return peak / (1 << 20) if sys.platform == "darwin" else peak / (1 << 10)
