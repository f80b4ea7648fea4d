"""The workers of a Dask cluster: drawings are sent, results come back, files are written here.

The workers need the same camtool as the client, but no shared disk. A worker with another version
ends the run, because its programs would differ.
"""

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

from camtool import __version__
from camtool.batches.pool import TICK_S, made_of
from camtool.batches.run import Made, Task, Work
from camtool.errors import CamtoolError, OptionError

if TYPE_CHECKING:
    from distributed import Client, Future

CONNECT_S = 10.0
"""How long the scheduler may take to answer the first time."""

CLOSE_S = 5.0
"""How long the scheduler may take to close the connection."""

ALONE_S = 5.0
"""After this time without any worker a message says so: workers may come later, or never."""

AHEAD = 2
"""Number of drawings that are sent for each thread of the cluster: one is made, one waits. More
would only take memory."""

_MEND = "what is written is whole; the same command goes on"


class OtherCodeError(Exception):
    """A worker has another camtool than the client; the text says which one."""


class ClusterPool:
    """The workers of the scheduler at `address` for one Work; `note` shows a message."""

    def __init__(self, work: Work, address: str, note: Callable[[str], None]) -> None:
        self._work = work
        self._address = address
        self._note = note

    def results(self, tasks: Sequence[Task]) -> Generator[tuple[Task, Made] | None]:
        """One result for each task, in any order, and None after each `TICK_S` without a result.

        Closing the generator cancels the rest. OptionError without `distributed` or a scheduler at
        the address; CamtoolError when the scheduler is lost, or a worker has another camtool.
        """
        with _connected(self._address) as client:
            order = _Order(self._work.digest(), pickle.dumps(self._work))
            workers = _Workers(client, order, self._note)
            sent = _Sent(client, order, tasks)
            while sent.left:
                threads = workers.threads()
                came = [*sent.send(AHEAD * threads), *sent.done()]
                yield from came
                if not came:
                    yield None


class _Order(Struct, frozen=True):
    """The work, pickled, and its digest. Dask gets only bytes: a worker that could not load an
    object, because it has another camtool, would end without an error."""

    digest: str
    work: bytes


class _Sent:
    """The drawings that are still to be sent, and those that the cluster has."""

    def __init__(self, client: Client, order: _Order, tasks: Sequence[Task]) -> None:
        self._client = client
        self._order = order
        self._queue = deque(tasks)
        self._busy: dict[Future, Task] = {}

    @property
    def left(self) -> bool:
        """Whether any result is still missing."""
        return bool(self._queue or self._busy)

    def send(self, most: int) -> Iterator[tuple[Task, Made]]:
        """Send drawings until the cluster has `most`; errors of those that cannot be read."""
        from camtool.importers.read import file_bytes

        while self._queue and len(self._busy) < most:
            task = self._queue.popleft()
            try:
                data = file_bytes(task.path)
            except CamtoolError as error:
                yield task, Made(error=str(error))
                continue
            future = self._client.submit(
                made_there,
                self._order.digest,
                self._order.work,
                pickle.dumps(task),
                data,
                pure=False,
                key=None,
            )
            self._busy[future] = task

    def done(self) -> Iterator[tuple[Task, Made]]:
        """The results that are ready; waits for the first one, `TICK_S` at most."""
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
    """The workers of the cluster, each checked for its camtool before it gets a drawing."""

    def __init__(self, client: Client, order: _Order, note: Callable[[str], None]) -> None:
        self._client = client
        self._order = order
        self._note = note
        self._known: set[str] = set()
        self._alone_since_s: float | None = None
        self._said = False

    def threads(self) -> int:
        """How many drawings they make at once; shows a message when there are none for long.

        CamtoolError when the scheduler was lost, or a worker has another camtool.
        """
        there = _threads(self._client)
        if new := sorted(there.keys() - self._known):
            self._known.update(self._same_camtool(new))
        threads = sum(there[worker] for worker in there.keys() & self._known)
        self._report(threads)
        return threads

    def _same_camtool(self, workers: list[str]) -> Iterator[str]:
        """The workers that have the same camtool, without those that have just left."""
        answers = self._client.run(
            asked_there,
            self._order.digest,
            self._order.work,
            workers=workers,
            on_error="return",
        )
        for worker, answer in answers.items():
            if answer is None:
                yield worker
            elif not isinstance(answer, OSError):
                raise _refused(worker, answer)

    def _report(self, threads: int) -> None:
        """A message when there have been no workers for long, and when they come."""
        if threads:
            if self._said:
                self._note("the cluster has workers now")
            self._alone_since_s, self._said = None, False
            return
        now = time.monotonic()
        self._alone_since_s = now if self._alone_since_s is None else self._alone_since_s
        if not self._said and now - self._alone_since_s >= ALONE_S:
            self._said = True
            self._note("the cluster has no workers; waiting for some (Ctrl-C ends this)")


def asked_there(digest: str, work: bytes) -> None:
    """Runs on a worker: OtherCodeError when its camtool is not the client's."""
    _work_of(digest, work)


def made_there(digest: str, work: bytes, task: bytes, data: bytes) -> Made:
    """Runs on a worker: the outputs of a drawing; OtherCodeError as above."""
    return made_of(_work_of(digest, work), pickle.loads(task), data)


@lru_cache(maxsize=1)
def _work_of(digest: str, work: bytes) -> Work:
    """The work, loaded once for all drawings of a run."""
    try:
        loaded: Work = pickle.loads(work)
        same = loaded.digest() == digest
    except Exception:  # anything may go wrong when an object of other code is loaded
        same = False
    if not same:
        raise OtherCodeError(f"it has camtool {__version__}")
    return loaded


@contextmanager
def _connected(address: str) -> Iterator[Client]:
    """A client; at the end, unfinished drawings are cancelled."""
    try:
        from distributed import Client
    except ImportError as error:
        raise OptionError(
            "needs the package distributed",
            where="--scheduler",
            mend="pip install 'camtool[distributed]'",
        ) from error
    with _silenced():
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
    """Threads by worker; CamtoolError when the scheduler was lost."""
    try:
        if client.status == "running":
            return dict(client.nthreads())
    except (OSError, TimeoutError):
        pass
    raise _lost()


def _lost() -> CamtoolError:
    return CamtoolError("the scheduler was lost", where="--scheduler", mend=_MEND)


def _refused(worker: str, error: Exception) -> CamtoolError:
    """The error for a worker whose camtool differs."""
    if isinstance(error, OtherCodeError):
        why = f"{error}, or other code or packages under that number, and this is {__version__}"
    else:
        why = f"it cannot run this camtool {__version__} ({error})"
    return CamtoolError(
        f"{worker} is refused: {why}",
        where="--scheduler",
        mend=f"install the same everywhere; {_MEND}",
    )


def _result(future: Future, task: Task) -> Made:
    """The result of a drawing; lost workers are its error. CamtoolError for what ends the run."""
    from distributed import KilledWorker

    try:
        made: Made = future.result()
    except KilledWorker as error:
        times = error.allowed_failures + 1
        return Made(error=f"{task.source}: {times} workers were lost over it, and it was given up")
    except CancelledError as error:
        raise _lost() from error
    except Exception as error:
        raise _refused("a worker", error) from error
    return made


@contextmanager
def _silenced() -> Iterator[None]:
    """Within the block, `distributed` logs nothing: our messages say it in one line."""
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
