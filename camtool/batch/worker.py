"""One worker: takes tasks from a pipe, sends back what it made of them, until the pipe ends."""

from __future__ import annotations

import os
import signal
import sys
import time
import traceback
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from camtool.batch.records import Made, Task, Work
from camtool.errors import CamtoolError

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

READY = "ready"
"""What a worker sends when it is warm."""

_ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def serve(pipe: Connection) -> None:
    """The worker's whole life: first a Work comes, then tasks; None or the pipe's end ends it.

    Ctrl-C reaches every process of a terminal, but what it means the parent decides.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for name in _ONE_THREAD:  # before numpy: workers side by side share the cores already
        os.environ.setdefault(name, "1")
    try:
        work: Work = pipe.recv()
        with suppress(Exception):  # what is wrong shows at every drawing, by its name
            work.warm()
        pipe.send(READY)
        while (task := pipe.recv()) is not None:
            pipe.send((made_of(work, task, None), peak_mib()))
    except (EOFError, BrokenPipeError, ConnectionResetError):
        return


def made_of(work: Work, task: Task, data: bytes | None) -> Made:
    """What the work makes of a task; whatever goes wrong is an error of this drawing alone."""
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
    """The most memory that this process has had, MiB; 0 where the system does not tell.

    Linux's getrusage would tell that of the parent at the fork where it was more, even behind an
    exec; VmHWM is that of the program itself.
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
