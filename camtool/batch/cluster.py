"""The same on a Dask cluster: drawings are sent, results come back, files are written here.

The workers need camtool of the same version, and nothing of ours: no shared disk.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Generator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from camtool import __version__
from camtool.batch.pool import TICK_S
from camtool.batch.records import Made, Task, Work
from camtool.batch.worker import made_of
from camtool.errors import CamtoolError, OptionError

if TYPE_CHECKING:
    from distributed import Client, Future

CONNECT_S = 10.0
"""How long the scheduler may take to answer."""

AHEAD = 2
"""So many drawings for each thread of the cluster are under way: one made, one waiting. More
would only keep their bytes in memory."""


class ClusterPool:
    """The workers of the scheduler at `address` for one Work."""

    def __init__(self, work: Work, address: str) -> None:
        self._work = work
        self._address = address

    def results(self, tasks: Sequence[Task]) -> Generator[tuple[Task, Made] | None]:
        """Every task's result once, None every `TICK_S` without one; closing cancels the rest.

        OptionError without `distributed` or a scheduler at the address.
        """
        client = _client(self._address)
        queue = deque(tasks)
        busy: dict[Future, Task] = {}
        try:
            while queue or busy:
                unreadable = list(self._send(client, queue, busy))
                yield from unreadable
                done = _done(client, busy)
                for future in done:
                    yield busy.pop(future), _result(future)
                if not (done or unreadable):
                    yield None
        finally:
            client.cancel(list(busy), force=True)
            client.close()

    def _send(
        self, client: Client, queue: deque[Task], busy: dict[Future, Task]
    ) -> Generator[tuple[Task, Made]]:
        """As many drawings as the cluster has use for; those that cannot be read come back."""
        from camtool.importers.read import file_bytes

        threads = sum(client.nthreads().values())
        while queue and len(busy) < max(1, AHEAD * threads):
            task = queue.popleft()
            try:
                data = file_bytes(task.path)
            except CamtoolError as error:
                yield task, Made(error=str(error))
                continue
            future = client.submit(
                made_there, self._work, task, data, __version__, pure=False, key=None
            )
            busy[future] = task


def made_there(work: Work, task: Task, data: bytes, version: str) -> Made:
    """What a worker of the cluster does; it must have the client's version."""
    if version != __version__:
        return Made(
            error=f"{task.source}: the worker has camtool {__version__}, this is {version}; "
            "install the same everywhere"
        )
    return made_of(work, task, data)


def _client(address: str) -> Client:
    try:
        from distributed import Client
    except ImportError as error:
        raise OptionError(
            "needs the package distributed",
            where="--scheduler",
            mend="pip install 'camtool[distributed]'",
        ) from error
    try:
        return Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise OptionError(
            f"no scheduler answers at {address!r} ({type(error).__name__})",
            where="--scheduler",
            mend="start one with dask scheduler, and give the address that it prints",
        ) from error


def _done(client: Client, busy: dict[Future, Task]) -> list[Any]:
    """Those that are done, waiting a tick for the first. CamtoolError when the scheduler went."""
    from distributed import wait

    if not busy:
        return []
    try:
        with client.as_current():
            wait(list(busy), timeout=TICK_S, return_when="FIRST_COMPLETED")
    except TimeoutError:
        if client.status != "running" and client.status != "connecting":
            raise CamtoolError(
                f"the scheduler was lost ({client.status})",
                where="--scheduler",
                mend="what is written is whole; the same command goes on",
            ) from None
    return [future for future in busy if future.done()]


def _result(future: Future) -> Made:
    """A result; what kept the cluster from giving one is the error of this drawing."""
    try:
        made: Made = future.result()
    except Exception as error:
        return Made(error=f"lost on the cluster ({type(error).__name__}: {error})")
    return replace(made)
