"""Worker processes of this computer, any of which may die or be stopped without harm to the rest.

When a process of a standard library's pool is killed, the whole pool is broken. Here each worker
has a pipe of its own: the end of the pipe shows which drawing it was making, and a new worker
takes its place.
"""

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

from camtool.batches.run import Made, Task, Work
from camtool.errors import CamtoolError
from camtool.records import replace

TICK_S = 0.2
"""How long to wait for a result before the caller gets a turn (to redraw, to stop)."""

END_S = 2.0
"""How long a worker may take to end before it is killed."""

RECYCLE_AFTER = 200
"""After how many drawings a new worker takes the place of an old one."""

RECYCLE_MIB = 1024.0
"""A worker that has taken more memory than this, MiB, is replaced too."""

FAILED_STARTS = 3
"""The run ends when this many workers in a row die before they are ready."""


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
    task: Task | None = None
    since_s: float = 0.0
    done: int = 0


class LocalPool:
    """Worker processes for one Work."""

    def __init__(self, work: Work, options: PoolOptions) -> None:
        self._work = work
        self._options = options
        self._workers: list[_Worker] = []
        self._failed_starts = 0

    def results(self, tasks: Sequence[Task]) -> Generator[tuple[Task, Made] | None]:
        """One result for each task, in any order, and None after each `TICK_S` without a result.

        Closing the generator kills the workers. CamtoolError when no worker can be started.
        """
        queue = deque(tasks)
        try:
            while queue or any(worker.task for worker in self._workers):
                self._staff(queue)
                ready = wait([worker.pipe for worker in self._workers], TICK_S)
                came = [worker for worker in self._workers if worker.pipe in ready]
                results = [each for worker in came if (each := self._received(worker))]
                results += self._overdue()
                yield from results
                if not results:
                    yield None
        finally:
            self._end()

    def _staff(self, queue: deque[Task]) -> None:
        """Start workers while there are tasks for them; give each free worker a task."""
        busy = sum(worker.task is not None for worker in self._workers)
        wanted = min(self._options.jobs, busy + len(queue))
        while len(self._workers) < wanted:
            self._workers.append(self._started())
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

    def _started(self) -> _Worker:
        context = multiprocessing.get_context("spawn")
        ours, theirs = context.Pipe()
        process = context.Process(target=serve, args=(theirs,), daemon=True)
        with _interrupts_blocked():
            process.start()
        theirs.close()
        worker = _Worker(process, ours)
        with suppress(OSError):  # it has ended: the pipe shows that later
            ours.send(self._work)
        return worker

    def _received(self, worker: _Worker) -> tuple[Task, Made] | None:
        """The result that a worker sent; None when it only says that it is ready, or died idle."""
        try:
            message = worker.pipe.recv()
        except (EOFError, OSError):
            return self._died(worker)
        self._failed_starts = 0
        if message == READY:
            worker.ready = True
            return None
        made, peak_mib = message
        task, worker.task = worker.task, None
        worker.done += 1
        if worker.done >= RECYCLE_AFTER or peak_mib > RECYCLE_MIB:
            self._drop(worker)
        return None if task is None else (task, made)

    def _died(self, worker: _Worker) -> tuple[Task, Made] | None:
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
        return task, Made(
            error=f"{task.source}: its worker was lost ({_cause(code)}); the others went on",
            seconds=time.monotonic() - worker.since_s,
        )

    def _overdue(self) -> list[tuple[Task, Made]]:
        """Kill the workers that have taken too long; an error for each of their drawings."""
        limit = self._options.timeout_s
        if limit is None:
            return []
        overdue = []
        for worker in list(self._workers):
            spent = time.monotonic() - worker.since_s
            if worker.task is not None and spent > limit:
                error = f"{worker.task.source}: took longer than --timeout {limit:g} s"
                overdue.append((worker.task, Made(error=error, seconds=spent)))
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
    """Why a process ended."""
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
    """Within the block, Ctrl-C waits. A worker that is started here inherits this: Ctrl-C cannot
    stop it before it ignores the signal."""
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
"""What a worker sends when it is warm."""

_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def serve(pipe: Connection) -> None:
    """The main function of a worker: it receives a Work, then tasks, until None or the pipe's end.

    Ctrl-C reaches every process of a terminal; workers ignore it, because the parent ends them.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for name in _ONE_THREAD:  # before numpy is loaded: the workers share the cores already
        os.environ.setdefault(name, "1")
    try:
        work: Work = pipe.recv()
        gc.disable()
        with suppress(Exception):  # the fault shows again at each drawing, with its name
            work.warm()
        gc.freeze()  # what is loaded lasts: no search for garbage looks at it
        gc.enable()
        pipe.send(READY)
        while (task := pipe.recv()) is not None:
            pipe.send((made_of(work, task, None), peak_mib()))
    except (EOFError, BrokenPipeError, ConnectionResetError):
        return


def made_of(work: Work, task: Task, data: bytes | None) -> Made:
    """The outputs of one drawing; any exception becomes an error of this drawing alone."""
    begin = time.perf_counter()
    try:
        made = work.make(task, data)
    except CamtoolError as error:
        made = Made(error=str(error))
    except MemoryError:
        made = Made(error=f"{task.source}: needs more memory than there is")
    except Exception as error:
        where = traceback.format_exc(limit=-1).strip().splitlines()[1].strip()
        made = Made(
            error=f"{task.source}: fault in camtool itself ({type(error).__name__}: {error}; "
            f"{where}); please report it"
        )
    return replace(made, seconds=time.perf_counter() - begin)


def peak_mib() -> float:
    """The most memory that this process has had, MiB; 0 where the system does not say.

    Linux's getrusage gives the parent's memory at the fork where that was more, even after an
    exec; VmHWM is that of this program alone.
    """
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
