"""Workers of a Dask cluster: drawings are sent to them, and the client writes the results.

The workers need the same camtool as the client, but no shared disk. A worker with another version
ends the run, because its programs would differ."""

from __future__ import annotations

import logging
import pickle
import time
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from functools import lru_cache
from typing import TYPE_CHECKING

from msgspec import Struct

from camtool.batches.pool import TICK_S, make_outputs
from camtool.batches.run import BatchWork, DrawingTask, Outputs
from camtool.errors import CamtoolError, OptionError
from camtool.version import __version__

if TYPE_CHECKING:
    from distributed import Client, Future

CONNECT_S = 10.0
"""Time limit for the first answer of the scheduler."""

CLOSE_S = 5.0

ALONE_S = 5.0
"""Time without any worker after which the user is told; workers may still join later."""

AHEAD = 2
"""Drawings sent for each thread of the cluster: one is being made, one waits. More would only take
memory."""

_MEND = "all written files are complete; run the same command again to continue"


class OtherCodeError(Exception):
    """The worker's camtool is not the client's; the text is the version of the worker's."""


class ClusterPool:
    """Workers of the Dask scheduler at `address` for one BatchWork; `note` shows a message to the
    user."""

    def __init__(self, work: BatchWork, address: str, note: Callable[[str], None]) -> None:
        self._work = work
        self._address = address
        self._note = note

    def results(
        self, tasks: Sequence[DrawingTask]
    ) -> Generator[tuple[DrawingTask, Outputs] | None]:
        """Yield a result for each task, in any order, and None after each `TICK_S` without one.

        Closing the generator cancels the tasks that are left. Raises OptionError without the
        package `distributed` or a scheduler at the address, and CamtoolError when the scheduler is
        lost or a worker has another camtool."""
        with _connect(self._address) as client:
            order = _Order(self._work.digest(), pickle.dumps(self._work))
            workers = _Workers(client, order, self._note)
            drawings_sent = _SentDrawings(client, order, tasks)
            while drawings_sent.has_results_left:
                threads = workers.threads()
                results = [*drawings_sent.send(AHEAD * threads), *drawings_sent.take_results()]
                yield from results
                if not results:
                    yield None


class _Order(Struct, frozen=True):
    """The work, pickled, and its digest. Dask gets only bytes: a worker that could not load an
    object, because it has another camtool, would end without an error."""

    digest: str
    work: bytes


class _SentDrawings:
    """Queue of the drawings to send, and those that the cluster is working on."""

    def __init__(self, client: Client, order: _Order, tasks: Sequence[DrawingTask]) -> None:
        self._client = client
        self._order = order
        self._queue = deque(tasks)
        self._busy: dict[Future, DrawingTask] = {}

    @property
    def has_results_left(self) -> bool:
        """True if any result is still missing."""
        return bool(self._queue or self._busy)

    def send(self, max_busy: int) -> Iterator[tuple[DrawingTask, Outputs]]:
        """Send drawings until `max_busy` of them await a result or none is left; yield the tasks
        whose drawings cannot be read, with the error in their outputs."""
        from camtool.importers.read import file_bytes

        while self._queue and len(self._busy) < max_busy:
            task = self._queue.popleft()
            try:
                data = file_bytes(task.path)
            except CamtoolError as error:
                yield task, Outputs(error=str(error))
                continue
            future = self._client.submit(
                make_on_worker,
                self._order.digest,
                self._order.work,
                pickle.dumps(task),
                data,
                pure=False,
                key=None,
            )
            self._busy[future] = task

    def take_results(self) -> Iterator[tuple[DrawingTask, Outputs]]:
        """Yield the results that are ready, after at most `TICK_S` of waiting for the first."""
        from distributed import wait

        if not self._busy:
            time.sleep(TICK_S)
            return
        try:
            with self._client.as_current():
                wait(list(self._busy), timeout=TICK_S, return_when="FIRST_COMPLETED")
        except (TimeoutError, CancelledError):  # a cancelled future gives its own error below
            pass
        for future in [future for future in self._busy if future.done()]:
            yield self._busy[future], _result(future, self._busy[future])
            del self._busy[future]


class _Workers:
    """The workers of the cluster. Before a worker gets its first drawing, its camtool is compared
    with the client's."""

    def __init__(self, client: Client, order: _Order, note: Callable[[str], None]) -> None:
        self._client = client
        self._order = order
        self._note = note
        self._checked: set[str] = set()
        self._without_since_s: float | None = None
        self._reported = False

    def threads(self) -> int:
        """Return the number of threads of all checked workers, after checking the workers that are
        new. Raises CamtoolError when the scheduler is lost or a worker has another camtool."""
        threads_of = _threads(self._client)
        if new := sorted(threads_of.keys() - self._checked):
            self._checked.update(self._same_camtool(new))
        threads = sum(threads_of[worker] for worker in threads_of.keys() & self._checked)
        self._report(threads)
        return threads

    def _same_camtool(self, workers: list[str]) -> Iterator[str]:
        """Yield the workers with the same camtool; those that have just left are skipped."""
        answers = self._client.run(
            check_worker, self._order.digest, self._order.work, workers=workers, on_error="return"
        )
        for worker, answer in answers.items():
            if answer is None:
                yield worker
            elif not isinstance(answer, OSError):
                raise _refusal(worker, answer)

    def _report(self, threads: int) -> None:
        """Tell the user when there have been no workers for `ALONE_S`, and when some join
        again."""
        if threads:
            if self._reported:
                self._note("the cluster has workers now")
            self._without_since_s, self._reported = None, False
            return
        time_s = time.monotonic()
        self._without_since_s = time_s if self._without_since_s is None else self._without_since_s
        if not self._reported and time_s - self._without_since_s >= ALONE_S:
            self._reported = True
            self._note("the cluster has no workers; waiting for some (Ctrl-C ends this)")


def check_worker(digest: str, work: bytes) -> None:
    """Raise OtherCodeError if the camtool of this worker is not the client's; runs on a worker."""
    _work_of(digest, work)


def make_on_worker(digest: str, work: bytes, task: bytes, data: bytes) -> Outputs:
    """Make the outputs of a drawing on a worker; raises OtherCodeError as `check_worker` does."""
    return make_outputs(_work_of(digest, work), pickle.loads(task), data)


@lru_cache(maxsize=1)
def _work_of(digest: str, work: bytes) -> BatchWork:
    """Unpickle the BatchWork once per run; later drawings of the run get it from a cache."""
    try:
        batch_work: BatchWork = pickle.loads(work)
        is_same = batch_work.digest() == digest
    except Exception:  # anything may go wrong when an object of other code is loaded
        is_same = False
    if not is_same:
        raise OtherCodeError(f"it has camtool {__version__}")
    return batch_work


@contextmanager
def _connect(address: str) -> Iterator[Client]:
    """Yield a client connected to the scheduler; at the end of the block its unfinished drawings
    are cancelled."""
    try:
        from distributed import Client
    except ImportError as error:
        raise OptionError(
            "needs the package distributed",
            where="--scheduler",
            mend="pip install 'camtool[distributed]'",
        ) from error
    with _silence():
        try:
            client = Client(address, timeout=CONNECT_S, set_as_default=False)
        except (OSError, ValueError) as error:
            raise OptionError(
                f"no scheduler answers at {address!r} ({type(error).__name__})",
                where="--scheduler",
                mend="start one with dask scheduler, and give the address that it prints",
            ) from error
        try:
            yield client
        finally:
            _leave(client)


def _leave(client: Client) -> None:
    with suppress(OSError, TimeoutError):  # the scheduler does not answer any more
        if client.status == "running":
            client.cancel(list(client.futures), force=True)
        client.close(CLOSE_S)


def _threads(client: Client) -> dict[str, int]:
    """Return the number of threads of each worker by its address; CamtoolError when the scheduler
    is lost."""
    try:
        if client.status == "running":
            return dict(client.nthreads())
    except (OSError, TimeoutError):
        pass
    raise _lost_error()


def _lost_error() -> CamtoolError:
    return CamtoolError("the scheduler was lost", where="--scheduler", mend=_MEND)


def _refusal(worker: str, error: Exception) -> CamtoolError:
    """Return the CamtoolError for a worker whose camtool is not the client's, with both
    versions."""
    if isinstance(error, OtherCodeError):
        reason = f"{error}, or other code or packages under that number, and this is {__version__}"
    else:
        reason = f"it cannot run this camtool {__version__} ({error})"
    return CamtoolError(
        f"{worker} is refused: {reason}",
        where="--scheduler",
        mend=f"install the same everywhere; {_MEND}",
    )


def _result(future: Future, task: DrawingTask) -> Outputs:
    """Return the result of a drawing, or an error for it if its workers were lost; CamtoolError
    for faults that end the whole run."""
    from distributed import KilledWorker

    try:
        outputs: Outputs = future.result()
    except KilledWorker as error:
        times = error.allowed_failures + 1
        return Outputs(
            error=f"{task.source}: {times} workers were lost over it, and it was given up"
        )
    except CancelledError as error:
        raise _lost_error() from error
    except Exception as error:
        raise _refusal("a worker", error) from error
    return outputs


@contextmanager
def _silence() -> Iterator[None]:
    """Silence the log of `distributed` within the block: camtool reports the same in one line."""
    names = [name for name in logging.root.manager.loggerDict if name.startswith("distributed")]
    handlers = {handler for name in names for handler in logging.getLogger(name).handlers}
    before = {handler: handler.level for handler in handlers}
    for handler in handlers:
        handler.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for handler, level in before.items():
            handler.setLevel(level)
