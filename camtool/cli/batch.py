"""`camtool batch`: many drawings, each as `post` would make it."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

import click

from camtool.cli.drawing import DrawingFlags, drawing_options
from camtool.cli.jobflags import JobFlags, job_options
from camtool.cli.judging import GateFlags, gate_options
from camtool.cli.options import MachineFlags, machine_options, talk_options
from camtool.cli.sections import SectionedCommand, option
from camtool.cli.talk import say
from camtool.cli.types import duration
from camtool.errors import CamtoolError, OutputError

if TYPE_CHECKING:
    from camtool.batch.manifest import Manifest
    from camtool.batch.records import Outcome, Pool, Task
    from camtool.cli.batchtalk import Loudness
    from camtool.cli.batchwork import PostWork

_RUN = "How the batch runs"


@dataclass(frozen=True)
class Running:
    """How a batch runs: processes here or a cluster, what stops it, what is made anew."""

    jobs: int | None
    scheduler: str | None
    timeout: float | None
    force: bool
    fail_fast: bool


@click.command(cls=SectionedCommand, short_help="Many drawings to verified programs.")
@click.argument("sources", metavar="DRAWINGS...", nargs=-1, required=True)
@machine_options
@click.option("-o", "--out", metavar="FOLDER", required=True, help="Where the programs go.")
@click.option(
    "--preview", type=click.Choice(("svg", "png")), help="A picture beside each program."
)
@click.option("--reports", is_flag=True, help="The report of each as JSON beside its program.")
@click.option("--json", "summary", metavar="FILE", help="What became of each; - is stdout.")
@click.option("--no-verify", is_flag=True, help="Write without simulating the machine.")
@click.option(
    "--compensate",
    is_flag=True,
    help="Bend the path against the machine's play, scale and squareness.",
)
@click.option("--no-own-jobs", is_flag=True, help="Pay no heed to part.toml beside part.dxf.")
@option(_RUN, "--jobs", "-j", type=click.IntRange(min=1), help="Processes.  [one for each core]")
@option(_RUN, "--scheduler", metavar="ADDRESS", help="Run on a Dask cluster, tcp://host:8786.")
@option(_RUN, "--timeout", callback=duration, metavar="TIME", help="Longest for one drawing, 60s.")
@option(_RUN, "--force", is_flag=True, help="Make what is up to date too.")
@option(_RUN, "--fail-fast", is_flag=True, help="Stop at the first that fails.")
@gate_options
@job_options
@drawing_options
@talk_options
def batch(
    sources: tuple[str, ...],
    machine: MachineFlags,
    out: str,
    preview: str | None,
    reports: bool,
    summary: str | None,
    no_verify: bool,
    compensate: bool,
    no_own_jobs: bool,
    jobs: int | None,
    scheduler: str | None,
    timeout: float | None,
    force: bool,
    fail_fast: bool,
    gates: GateFlags,
    job: JobFlags,
    drawing: DrawingFlags,
    quiet: bool,
    verbose: bool,
) -> int:
    """Turn DRAWINGS (files, folders, quoted patterns such as 'parts/**/*.dxf') into programs.

    Folders are kept below --out. What is up to date by content is passed over. A drawing that
    fails stops no other one; exit code 1 when any did. A job file beside a drawing, part.toml for
    part.dxf, is its job; --job is for those without one.
    """
    if no_verify and (gates.given or reports):
        raise click.UsageError("--no-verify leaves nothing to report or to hold against limits")
    if scheduler is not None and (jobs is not None or timeout is not None):
        raise click.UsageError("--jobs and --timeout are for processes here, not for a cluster")
    from camtool.cli.batchtalk import Loudness
    from camtool.cli.batchwork import PostWork
    from camtool.cli.output import check_writable

    check_writable([summary], list(sources))
    work = PostWork(
        machine.load(),
        drawing,
        gates.gates(),
        None if preview is None else f".{preview}",
        reports,
        not no_verify,
        compensate,
    )
    running = Running(jobs, scheduler, timeout, force, fail_fast)
    batched = Batched(work, Path(out), running, summary)
    return batched.run(sources, job, own_jobs=not no_own_jobs, loudness=Loudness(quiet, verbose))


@dataclass(frozen=True)
class Batched:
    """One run of the command."""

    work: PostWork
    out: Path
    running: Running
    summary: str | None

    def run(
        self, sources: Sequence[str], job: JobFlags, *, own_jobs: bool, loudness: Loudness
    ) -> int:
        """Find, make, say; the exit code."""
        from camtool.batch.inputs import find_tasks, refuse_overwriting
        from camtool.batch.lock import alone_in
        from camtool.batch.manifest import Manifest

        begin = time.monotonic()
        tasks = find_tasks(sources, self.out, Manifest(self.out).outputs())
        refuse_overwriting(tasks, self.out, self.work.extensions)
        _make_folder(self.out)
        with alone_in(self.out) as locked:
            if not locked:
                say(
                    "camtool: warning: the file system of --out has no locks: see that no other "
                    "batch writes there",
                    quiet=loudness.quiet,
                )
            return self._run(tasks, job, begin, own_jobs=own_jobs, loudness=loudness)

    def _run(
        self,
        tasks: Sequence[Task],
        job: JobFlags,
        begin: float,
        *,
        own_jobs: bool,
        loudness: Loudness,
    ) -> int:
        """The same with the output folder to itself."""
        from camtool.batch.manifest import Manifest

        manifest = Manifest(self.out)
        ordered, failed = self._ordered(tasks, job, own_jobs)
        outcomes, stopped = self._made(ordered, failed, manifest, loudness)
        seconds = time.monotonic() - begin
        self._end(outcomes, manifest, seconds, loudness)
        if stopped is not None:
            click.echo(
                "camtool: interrupted; what is written is whole, and the same command goes on",
                err=True,
            )
            return 128 + stopped
        return int(any(outcome.error is not None for outcome in outcomes))

    def _ordered(
        self, tasks: Sequence[Task], job: JobFlags, own_jobs: bool
    ) -> tuple[list[Task], list[Outcome]]:
        """The tasks with their jobs: a wrong job beside a drawing fails that drawing, a wrong one
        of --job or of the flags the whole command; flags count over both."""
        from camtool.batch.records import Outcome, State
        from camtool.cli.batchwork import JobOrder, own_job

        common: JobOrder | None = None
        ordered, failed = [], []
        for task in tasks:
            own = own_job(task.path) if own_jobs else None
            if own is None:
                common = common or JobOrder(job.job(self.work.drawing), job.file)
                ordered.append(replace(task, order=common))
                continue
            try:
                wanted = replace(job, file=str(own)).job(self.work.drawing)
                ordered.append(replace(task, order=JobOrder(wanted, str(own))))
            except CamtoolError as error:
                text = f"{task.source}: {error}"
                failed.append(Outcome(task.source, task.stem, State.FAILED, error=text))
        return ordered, failed

    def _made(
        self,
        tasks: Sequence[Task],
        failed: Sequence[Outcome],
        manifest: Manifest,
        loudness: Loudness,
    ) -> tuple[list[Outcome], int | None]:
        """The outcome of every drawing, sorted, and the signal that stopped the run, if any."""
        from camtool.batch.records import Outcome, State
        from camtool.batch.run import Order, run_batch
        from camtool.cli.batchstop import stoppable
        from camtool.cli.batchtalk import talking
        from camtool.cli.output import write_all

        own = {task.stem: repr(task.order.job) for task in tasks}
        order = Order(self.out, write_all, self.work.digest(), own, self.running.force)
        done: dict[str, Outcome] = {}
        with (
            stoppable() as stop,
            talking(len(tasks) + len(failed), loudness) as talk,
            closing(run_batch(tasks, order, manifest, self._pool(loudness))) as outcomes,
        ):
            for outcome in chain(failed, outcomes):
                if outcome is not None:
                    done[outcome.stem] = outcome
                    talk.heard(outcome)
                    if self.running.fail_fast and outcome.state is State.FAILED:
                        break
                if stop.signal is not None:
                    break
        for task in tasks:
            done.setdefault(task.stem, Outcome(task.source, task.stem, State.NOT_RUN))
        return [done[stem] for stem in sorted(done)], stop.signal

    def _pool(self, loudness: Loudness) -> Pool:
        if self.running.scheduler is not None:
            from camtool.batch.cluster import ClusterPool

            return ClusterPool(self.work, self.running.scheduler)
        from camtool.batch.pool import LocalPool, PoolOptions
        from camtool.cli.talk import first_run, say_first_run

        say_first_run(quiet=loudness.quiet)
        options = PoolOptions(
            jobs=self.running.jobs or os.cpu_count() or 1,
            timeout_s=self.running.timeout,
            first_alone=first_run(),
        )
        return LocalPool(self.work, options)

    def _end(
        self,
        outcomes: Sequence[Outcome],
        manifest: Manifest,
        seconds: float,
        loudness: Loudness,
    ) -> None:
        from camtool.cli.batchtalk import say_summary, summary_json
        from camtool.cli.output import write_all

        try:
            manifest.tidy(write_all)
        except OutputError as error:  # its lines so far are there
            click.echo(f"camtool: warning: {error}", err=True)
        say_summary(outcomes, seconds, quiet=loudness.quiet)
        if self.summary is not None:
            target = self.work.target.machine.target.name
            write_all({self.summary: summary_json(outcomes, target, seconds).encode()})


def _make_folder(out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(
            f"cannot be made ({error.strerror})", file=str(out), mend="choose another --out"
        ) from error
