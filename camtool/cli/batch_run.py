"""The run of `camtool batch`: finds the drawings, makes those that are not up to date, and reports
the outcome of each.

It stands apart from the command, so that `camtool --help`, which loads all commands, loads
nothing of batches."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Collection, Generator, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from functools import cache, partial
from itertools import chain
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING

from camtool.batches.inputs import find_tasks
from camtool.batches.lock import NAME as LOCK
from camtool.batches.lock import lock_folder
from camtool.batches.manifest import NAME as MANIFEST
from camtool.batches.manifest import Manifest, RealPaths
from camtool.batches.run import (
    BatchSettings,
    DrawingTask,
    Outcome,
    OutcomeState,
    Outputs,
    Pool,
    run_batch,
)
from camtool.cli.batch_messages import Display, Verbosity, display, say_summary, summary_json
from camtool.cli.batch_work import SVG, JobOrder, PostWork
from camtool.cli.checks import CheckOutputs
from camtool.cli.files import is_foreign, refuse_same, write_all
from camtool.cli.messages import say
from camtool.cli.options import InspectionFlags, JobFlags, own_job, own_tolerances
from camtool.errors import CamtoolError, OutputError
from camtool.records import replace

if TYPE_CHECKING:
    from camtool.cli.check_formats import CheckedFile
    from camtool.inspection.tolerances import Asked

EXIT_SIGNAL = 128
"""Added to the number of the signal that ended a run."""


@dataclass(frozen=True)
class RunSettings:
    """Settings of a run: local processes or a cluster, the limits, and whether all drawings are
    made again, or those that failed."""

    jobs: int | None
    scheduler: str | None
    timeout: float | None
    force: bool
    retries: bool
    fail_fast: bool


@dataclass(frozen=True)
class BatchFlags:
    """Job and tolerances for drawings that have none beside them. `own`: files beside drawings
    count; `inspects`: dimensions are inspected."""

    job: JobFlags
    inspection: InspectionFlags
    own: bool
    inspects: bool


@dataclass(frozen=True)
class OrderedTasks:
    """Tasks with their jobs and tolerances; by stem a text that identifies these, as a part of the
    key in the manifest; the drawings whose own job or tolerances are wrong; and all files beside
    drawings that are read."""

    tasks: list[DrawingTask]
    own: dict[str, str]
    failed: list[Outcome]
    reads: list[str]


@dataclass(frozen=True)
class EndedBatch:
    """The outcome of every drawing, sorted, and the reason why the run ended early, if it did."""

    outcomes: Sequence[Outcome]
    error: CamtoolError | None


@dataclass(frozen=True)
class LazyPool:
    """A pool that is created when it gets its first task."""

    pool: Callable[[], Pool]
    begin: Callable[[], None]

    def results(
        self, tasks: Sequence[DrawingTask]
    ) -> Generator[tuple[DrawingTask, Outputs] | None]:
        """Create the pool, begin the display, and yield the results of the tasks."""
        pool = self.pool()
        self.begin()
        yield from pool.results(tasks)


@dataclass(frozen=True)
class BatchRun:
    """A run of `camtool batch`."""

    work: PostWork
    out: Path
    running: RunSettings
    summary: str | None
    checks: CheckOutputs
    verbosity: Verbosity

    def run(self, sources: Sequence[str], flags: BatchFlags, reads: Sequence[str]) -> int:
        """Find the drawings, make those that are not up to date, and report; return the exit code.

        `reads` are files that are read besides drawings and jobs. CamtoolError for errors that
        belong to no single drawing."""
        try:
            batch_end, number = self._run(sources, flags, reads)
        except KeyboardInterrupt:  # before the first drawing, or for the second time
            batch_end, number = EndedBatch((), None), int(signal.SIGINT)
        if number is not None:
            text = "interrupted; written files are complete, and the same command continues"
            say(f"camtool: {text}")
            return EXIT_SIGNAL + number
        if batch_end.error is not None:
            raise batch_end.error
        return int(any(outcome.error is not None for outcome in batch_end.outcomes))

    def _run(
        self, sources: Sequence[str], flags: BatchFlags, reads: Sequence[str]
    ) -> tuple[EndedBatch, int | None]:
        """Return the outcomes, and the number of the signal that stopped the run (None if none
        did)."""
        begin = time.monotonic()
        earlier_outputs = Manifest(self.out).outputs()
        tasks = find_tasks(sources, self.out, earlier_outputs)
        with record_signals() as stop:
            ordered = self._order_tasks(tasks, flags)
            reads = [*reads, *flags.job.files(), *flags.inspection.files(), *ordered.reads]
            self._refuse_overwriting(ordered, reads, earlier_outputs)
            _make_folder(self.out)
            with lock_folder(self.out) as locked:
                if not locked:
                    text = "warning: --out has no locks: see that no other batch writes there"
                    self._note(text)
                manifest = Manifest(self.out)  # again: another batch may have written it until now
                batch_end = self._made(ordered, manifest, stop)
                self._end(batch_end.outcomes, manifest, time.monotonic() - begin)
        return batch_end, stop.signal

    def _refuse_overwriting(
        self, ordered: OrderedTasks, reads: Sequence[str], earlier_outputs: Collection[Path]
    ) -> None:
        """Raise OutputError when an output would replace a file that is read or another output, or
        a picture would replace a file that no batch wrote (`earlier_outputs`)."""
        job_files = {task.order.file for task in ordered.tasks} - {None}
        jobs = chain.from_iterable(JobFlags(file).files() for file in sorted(job_files))
        own_files = [str(self.out / name) for name in (MANIFEST, LOCK)]
        makes = [
            str(self.out / f"{task.stem}{extension}")
            for task in ordered.tasks
            for extension in self.work.extensions
        ]
        sources = [task.source for task in ordered.tasks]
        sources += [failed.source for failed in ordered.failed]
        refuse_same(
            [*sources, *reads, *jobs], [*own_files, self.summary, *self.checks.names, *makes]
        )
        places = RealPaths()
        for task in ordered.tasks if self.work.preview == SVG else ():
            picture = self.out / f"{task.stem}{SVG}"
            if is_foreign(picture, task.stem) and places.of(picture) not in earlier_outputs:
                raise OutputError(
                    f"is there, and is no picture of {task.source}",
                    file=str(picture),
                    mend="choose another --out, or --preview png",
                )

    def _note(self, text: str) -> None:
        say(f"camtool: {text}", quiet=self.verbosity.quiet)

    def _order_tasks(self, tasks: Sequence[DrawingTask], flags: BatchFlags) -> OrderedTasks:
        """Return the tasks with their jobs and tolerances. An error in a file beside a drawing
        fails that drawing; an error in --job, --tolerances or the flags fails the whole command.
        Flags override both jobs."""
        ordered = OrderedTasks([], {}, [], [])
        common_job = cache(partial(_order, flags.job, self.work))
        common_limits = cache(partial(_read_tolerances_file, flags.inspection.files()))
        for task in tasks:
            job = own_job(task.path) if flags.own else None
            limits = own_tolerances(task.path) if flags.own and flags.inspects else None
            ordered.reads.extend(str(each) for each in (job, limits) if each is not None)
            common = None if job is not None else common_job()
            requested = None if limits is not None else common_limits()
            try:
                if common is None:
                    common = _order(replace(flags.job, file=str(job)), self.work)
                if limits is not None:
                    requested = _read_tolerances_file([str(limits)])
            except CamtoolError as error:
                text = f"{task.source}: {error}"
                ordered.failed.append(
                    Outcome(task.source, task.stem, OutcomeState.FAILED, error=text)
                )
            else:
                inspects = limits is not None or flags.inspection.tolerances is not None
                common = replace(common, asked=requested, inspects=inspects)
                ordered.tasks.append(replace(task, order=common))
                ordered.own[task.stem] = repr(replace(common, file=None))
        return ordered

    def _made(self, ordered: OrderedTasks, manifest: Manifest, stop: Stop) -> EndedBatch:
        outcomes_by_stem: dict[str, Outcome] = {}
        fault: CamtoolError | None = None
        total = len(ordered.tasks) + len(ordered.failed)
        with (
            display(total, self.verbosity) as shown,
            closing(self._outcomes(ordered, manifest, stop, shown)) as outcomes,
        ):
            try:
                for outcome in outcomes:
                    outcomes_by_stem[outcome.stem] = outcome
                    shown.add(outcome)
            except CamtoolError as error:
                fault = error
        for task in ordered.tasks:
            outcomes_by_stem.setdefault(
                task.stem, Outcome(task.source, task.stem, OutcomeState.NOT_RUN)
            )
        return EndedBatch([outcomes_by_stem[stem] for stem in sorted(outcomes_by_stem)], fault)

    def _outcomes(
        self, ordered: OrderedTasks, manifest: Manifest, stop: Stop, shown: Display
    ) -> Generator[Outcome]:
        """Yield the outcomes until something stops the run."""
        force, retries = self.running.force, self.running.retries
        order = BatchSettings(self.out, write_all, self.work.digest(), ordered.own, force, retries)
        pool = LazyPool(lambda: pool_for(self, shown.note), shown.begin)
        with closing(run_batch(ordered.tasks, order, manifest, pool)) as outcomes:
            for outcome in chain(ordered.failed, outcomes):
                if outcome is not None:
                    yield outcome
                    if self.running.fail_fast and outcome.state is OutcomeState.FAILED:
                        return
                if stop.signal is not None:
                    return

    def _end(self, outcomes: Sequence[Outcome], manifest: Manifest, seconds: float) -> None:
        try:
            manifest.tidy(write_all)
        except OutputError as error:  # the lines written so far are there
            say(f"camtool: warning: {error}")
        say_summary(outcomes, seconds, quiet=self.verbosity.quiet)
        target = self.work.target
        files: dict[str, bytes] = {}
        if self.checks.names:
            checked = [self._checked(each) for each in outcomes]
            files = self.checks.files(checked, target.target.codes)
        if self.summary is not None:
            files[self.summary] = summary_json(outcomes, target.machine.target.name, seconds)
        write_all(files)

    def _checked(self, outcome: Outcome) -> CheckedFile:
        """Return the outcome of a drawing as a CheckedFile, for SARIF, JUnit and annotations."""
        from camtool.cli.check_formats import CheckedFile, refused_file

        name, error = outcome.source, outcome.error
        findings = tuple(
            each.at(str(self.out / each.file), each.line) if each.file in outcome.files else each
            for each in outcome.findings
        )
        checked = CheckedFile(name, findings)
        if error is not None and not checked.errors:
            return refused_file(CamtoolError(error.removeprefix(f"{name}: ")), name)
        passed_over = "not run" if outcome.state is OutcomeState.NOT_RUN else ""
        return replace(checked, passed_over=passed_over)


def pool_for(batch: BatchRun, note: Callable[[str], None]) -> Pool:
    """Return the workers of a run: local processes or a cluster."""
    work, running = batch.work, batch.running
    if running.scheduler is not None:
        from camtool.batches.cluster import ClusterPool

        return ClusterPool(work, running.scheduler, note)
    from camtool.batches.pool import LocalPool, PoolOptions

    options = PoolOptions(jobs=running.jobs or os.cpu_count() or 1, timeout_s=running.timeout)
    return LocalPool(work, options)


def _order(job: JobFlags, work: PostWork) -> JobOrder:
    """Return the job of one drawing, with the options of the batch, as its JobOrder."""
    return JobOrder(job.job(work.drawing), job.file)


def _read_tolerances_file(files: Sequence[str]) -> Asked | None:
    """Return the dimensions of the file of tolerances, None if there is no file. Nothing is
    imported in that case, since many batches have none."""
    if not files:
        return None
    from camtool.inspection.tolerances import read_tolerances

    return read_tolerances(Path(files[0]))


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(
            f"cannot be made ({error.strerror})", file=str(folder), mend="choose another --out"
        ) from error


@dataclass
class Stop:
    """The signal that requested a stop; None before one did."""

    signal: int | None = None


@contextmanager
def record_signals() -> Iterator[Stop]:
    """Record the first signal within the block without acting on it, so that no file is left
    half-written; a second Ctrl-C raises KeyboardInterrupt at once."""
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
