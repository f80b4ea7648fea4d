"""`camtool batch`: many drawings, each as `post` would make it."""

from __future__ import annotations

from pathlib import Path

import click

from camtool.cli.checks import CheckOutputs, check_outputs
from camtool.cli.files import check_places
from camtool.cli.options import (
    DrawingFlags,
    GateFlags,
    InspectionFlags,
    JobFlags,
    MachineFlags,
    SectionedCommand,
    drawing_options,
    duration,
    gate_options,
    inspection_options,
    job_options,
    machine_options,
    option,
    talk_options,
)
from camtool.cli.picture_options import RESULT, UNVERIFIED, PictureFlags, picture_options

_RUN = "How the batch runs"


@click.command(cls=SectionedCommand, short_help="Many drawings to verified programs.")
@click.argument("sources", metavar="DRAWINGS...", nargs=-1, required=True)
@machine_options
@click.option("-o", "--out", metavar="FOLDER", required=True, help="Where the programs go.")
@click.option(
    "--preview", type=click.Choice(("svg", "png")), help="A picture beside each program."
)
@click.option("--reports", is_flag=True, help="The report of each as JSON beside its program.")
@click.option("--json", "summary", metavar="FILE", help="The result of each drawing; - is stdout.")
@click.option("--no-verify", is_flag=True, help="Write without simulating the machine.")
@click.option(
    "--no-own-jobs",
    is_flag=True,
    help="Ignore part.toml and part.tolerances.toml beside part.dxf.",
)
@check_outputs
@option(_RUN, "--jobs", "-j", type=click.IntRange(min=1), help="Processes.  [one for each core]")
@option(_RUN, "--scheduler", metavar="ADDRESS", help="Run on a Dask cluster, tcp://host:8786.")
@option(
    _RUN,
    "--timeout",
    callback=duration,
    metavar="TIME",
    help="Time limit for each drawing, such as 60s.",
)
@option(_RUN, "--force", is_flag=True, help="Make all again; replace files of others.")
@option(_RUN, "--again", "retries", is_flag=True, help="Try unchanged drawings again that failed.")
@option(_RUN, "--fail-fast", is_flag=True, help="Stop at the first that fails.")
@picture_options
@gate_options
@inspection_options
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
    checks: CheckOutputs,
    no_verify: bool,
    no_own_jobs: bool,
    jobs: int | None,
    scheduler: str | None,
    timeout: float | None,
    force: bool,
    retries: bool,
    fail_fast: bool,
    picture: PictureFlags,
    gates: GateFlags,
    inspection: InspectionFlags,
    job: JobFlags,
    drawing: DrawingFlags,
    quiet: bool,
    verbose: bool,
) -> int:
    """Turn DRAWINGS (files, folders, quoted patterns such as 'parts/**/*.dxf') into programs.

    Folders are kept below --out. Drawings that are up to date by content are skipped, and so are
    those that failed and did not change, unless --again. A drawing that fails does not stop the
    others; exit code 1 when any failed. Files that no batch made, or
    that were changed since, are replaced only with --force. A job file beside a drawing,
    part.toml for part.dxf, is its job, and part.tolerances.toml has its dimensions; --job and
    --tolerances are for those without one."""
    if no_verify and (gates.given or reports):
        raise click.UsageError("--no-verify leaves nothing to report or to hold against limits")
    if scheduler is not None and (jobs is not None or timeout is not None):
        raise click.UsageError("--jobs and --timeout are for processes here, not for a cluster")
    picture.check([preview and f".{preview}"], UNVERIFIED if no_verify else RESULT)
    inspection.check(without="--no-verify" if no_verify else None)
    check_places([*machine.files(), *job.files(), *inspection.files()], [summary, *checks.names])

    from camtool.cli.batch_messages import Verbosity
    from camtool.cli.batch_run import BatchFlags, BatchRun, RunSettings
    from camtool.cli.batch_work import PostWork

    work = PostWork(
        machine.load(),
        drawing,
        gates.gates(),
        preview=None if preview is None else f".{preview}",
        reports=reports,
        check=not no_verify,
        looks=picture,
        require=inspection.require,
    )
    running = RunSettings(jobs, scheduler, timeout, force, retries, fail_fast)
    run = BatchRun(work, Path(out), running, summary, checks, Verbosity(quiet, verbose))
    flags = BatchFlags(job, inspection, own=not no_own_jobs, inspects=not no_verify)
    return run.run(sources, flags, machine.files())
