"""One run of `camtool batch`: finds the drawings, makes those that are not up to date, and reports
the outcome of each.

It stands apart from the command, so that `camtool --help`, which loads all commands, loads
nothing of batches.
"""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Collection, Generator, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from types import FrameType

from camtool.batches.inputs import find_tasks
from camtool.batches.lock import NAME as LOCK
from camtool.batches.lock import alone_in
from camtool.batches.manifest import NAME as MANIFEST
from camtool.batches.manifest import Manifest, RealPaths
from camtool.batches.run import Made, Order, Outcome, Pool, State, Task, run_batch
from camtool.cli.batch_messages import Display, Verbosity, display, say_summary, summary_json
from camtool.cli.batch_work import SVG, JobOrder, PostWork
from camtool.cli.files import is_foreign, refuse_same, write_all
from camtool.cli.messages import say
from camtool.cli.options import JobFlags, own_job
from camtool.errors import CamtoolError, OutputError

EXIT_SIGNAL = 128
"""Added to the number of the signal that ended a run."""


@dataclass(frozen=True)
class Running:
    """How a batch runs: processes here or a cluster, what stops it, what is made anew."""

    jobs: int | None
    scheduler: str | None
    timeout: float | None
    force: bool
    fail_fast: bool


@dataclass(frozen=True)
class Ordered:
    """Tasks with their jobs, a text that identifies each job (by stem), and the drawings whose own
    job is wrong."""

    tasks: list[Task]
    jobs: dict[str, str]
    failed: list[Outcome]


@dataclass(frozen=True)
class Ended:
    """The outcome of every drawing, sorted, and what kept the run from its end, if anything."""

    outcomes: Sequence[Outcome]
    error: CamtoolError | None


@dataclass(frozen=True)
class LazyPool:
    """A pool that is made when it has something to do."""

    pool: Callable[[], Pool]
    begins: Callable[[], None]

    def results(self, tasks: Sequence[Task]) -> Generator[tuple[Task, Made] | None]:
        """The results of the pool."""
        pool = self.pool()
        self.begins()
        yield from pool.results(tasks)


@dataclass(frozen=True)
class BatchRun:
    """One run of the command."""

    work: PostWork
    out: Path
    running: Running
    summary: str | None
    verbosity: Verbosity

    def run(
        self, sources: Sequence[str], job: JobFlags, reads: Sequence[str], *, own_jobs: bool
    ) -> int:
        """Find the drawings, make what is not up to date, report; the exit code. CamtoolError for
        errors that belong to no single drawing.

        `reads` are files that are read besides drawings and jobs.
        """
        try:
            ended, number = self._run(sources, job, reads, own_jobs=own_jobs)
        except KeyboardInterrupt:  # before the first drawing, or for the second time
            ended, number = Ended((), None), int(signal.SIGINT)
        if number is not None:
            text = "interrupted; written files are complete, and the same command continues"
            say(f"camtool: {text}", quiet=False)
            return EXIT_SIGNAL + number
        if ended.error is not None:
            raise ended.error
        return int(any(outcome.error is not None for outcome in ended.outcomes))

    def _run(
        self, sources: Sequence[str], job: JobFlags, reads: Sequence[str], *, own_jobs: bool
    ) -> tuple[Ended, int | None]:
        """The outcomes, and the signal that stopped the run."""
        begin = time.monotonic()
        made = Manifest(self.out).outputs()
        tasks = find_tasks(sources, self.out, made)
        with stoppable() as stop:
            ordered = self._ordered(tasks, job, own_jobs)
            self._refuse_overwriting(ordered, [*reads, *job.files()], made)
            _make_folder(self.out)
            with alone_in(self.out) as locked:
                if not locked:
                    text = "warning: --out has no locks: see that no other batch writes there"
                    self._note(text)
                manifest = Manifest(self.out)  # again: another batch may have written it until now
                ended = self._made(ordered, manifest, stop)
                self._end(ended.outcomes, manifest, time.monotonic() - begin)
        return ended, stop.signal

    def _refuse_overwriting(
        self, ordered: Ordered, reads: Sequence[str], made: Collection[Path]
    ) -> None:
        """OutputError when an output would replace a file that is read or another output, or a
        picture would replace a file that no batch has `made` there."""
        own = {task.order.file for task in ordered.tasks} - {None, *reads}
        jobs = chain.from_iterable(JobFlags(file).files() for file in sorted(own))
        ours = [str(self.out / name) for name in (MANIFEST, LOCK)]
        makes = [
            str(self.out / f"{task.stem}{extension}")
            for task in ordered.tasks
            for extension in self.work.extensions
        ]
        sources = [task.source for task in ordered.tasks]
        refuse_same([*sources, *reads, *jobs], [*ours, self.summary, *makes])
        places = RealPaths()
        for task in ordered.tasks if self.work.preview == SVG else ():
            picture = self.out / f"{task.stem}{SVG}"
            if is_foreign(picture, task.stem) and places.of(picture) not in made:
                raise OutputError(
                    f"is there, and is no picture of {task.source}",
                    file=str(picture),
                    mend="choose another --out, or --preview png",
                )

    def _note(self, text: str) -> None:
        say(f"camtool: {text}", quiet=self.verbosity.quiet)

    def _ordered(self, tasks: Sequence[Task], job: JobFlags, own_jobs: bool) -> Ordered:
        """The tasks with their jobs. A wrong job beside a drawing fails that drawing; a wrong job
        of --job or of the flags fails the whole command. Flags override both."""
        ordered = Ordered([], {}, [])
        common: tuple[JobOrder, str] | None = None
        for task in tasks:
            own = own_job(task.path) if own_jobs else None
            try:
                if own is not None:
                    wanted = _order(replace(job, file=str(own)), self.work)
                else:
                    wanted = common = common or _order(job, self.work)
            except CamtoolError as error:
                if own is None:
                    raise
                text = f"{task.source}: {error}"
                ordered.failed.append(Outcome(task.source, task.stem, State.FAILED, error=text))
            else:
                ordered.tasks.append(replace(task, order=wanted[0]))
                ordered.jobs[task.stem] = wanted[1]
        return ordered

    def _made(self, ordered: Ordered, manifest: Manifest, stop: Stop) -> Ended:
        done: dict[str, Outcome] = {}
        fault: CamtoolError | None = None
        total = len(ordered.tasks) + len(ordered.failed)
        with (
            display(total, self.verbosity) as shown,
            closing(self._outcomes(ordered, manifest, stop, shown)) as outcomes,
        ):
            try:
                for outcome in outcomes:
                    done[outcome.stem] = outcome
                    shown.add(outcome)
            except CamtoolError as error:
                fault = error
        for task in ordered.tasks:
            done.setdefault(task.stem, Outcome(task.source, task.stem, State.NOT_RUN))
        return Ended([done[stem] for stem in sorted(done)], fault)

    def _outcomes(
        self, ordered: Ordered, manifest: Manifest, stop: Stop, shown: Display
    ) -> Generator[Outcome]:
        """The outcomes until something stops the run."""
        force = self.running.force
        order = Order(self.out, write_all, self.work.digest(), ordered.jobs, force)
        pool = LazyPool(lambda: pool_for(self, shown.note), shown.begins)
        with closing(run_batch(ordered.tasks, order, manifest, pool)) as outcomes:
            for outcome in chain(ordered.failed, outcomes):
                if outcome is not None:
                    yield outcome
                    if self.running.fail_fast and outcome.state is State.FAILED:
                        return
                if stop.signal is not None:
                    return

    def _end(self, outcomes: Sequence[Outcome], manifest: Manifest, seconds: float) -> None:
        try:
            manifest.tidy(write_all)
        except OutputError as error:  # the lines written so far are there
            say(f"camtool: warning: {error}", quiet=False)
        say_summary(outcomes, seconds, quiet=self.verbosity.quiet)
        if self.summary is not None:
            target = self.work.target.machine.target.name
            write_all({self.summary: summary_json(outcomes, target, seconds)})


def pool_for(batch: BatchRun, note: Callable[[str], None]) -> Pool:
    """What makes the drawings of a run: processes here, or a cluster."""
    work, running = batch.work, batch.running
    if running.scheduler is not None:
        from camtool.batches.cluster import ClusterPool

        return ClusterPool(work, running.scheduler, note)
    from camtool.batches.pool import LocalPool, PoolOptions

    options = PoolOptions(
        jobs=running.jobs or os.cpu_count() or 1,
        timeout_s=running.timeout,
    )
    return LocalPool(work, options)


def _order(job: JobFlags, work: PostWork) -> tuple[JobOrder, str]:
    """A job, and the text that identifies it."""
    wanted = job.job(work.drawing)
    return JobOrder(wanted, job.file), repr(wanted)


def _make_folder(out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(
            f"cannot be made ({error.strerror})", file=str(out), mend="choose another --out"
        ) from error


@dataclass
class Stop:
    """The signal that asked to stop; None as long as none did."""

    signal: int | None = None


@contextmanager
def stoppable() -> Iterator[Stop]:
    """Within the block, the first signal is only recorded, so that no file is left half-written; a
    second Ctrl-C raises KeyboardInterrupt at once."""
    stop = Stop()
    if threading.current_thread() is not threading.main_thread():
        yield stop
        return

    def note(number: int, frame: FrameType | None) -> None:
        if stop.signal is not None and number == signal.SIGINT:
            raise KeyboardInterrupt
        stop.signal = number

    old = {each: signal.signal(each, note) for each in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield stop
    finally:
        for each, handler in old.items():
            signal.signal(each, handler)
