"""`camtool post`: drawing to verified program; `filter` and `stale` post as it does."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from msgspec import Struct, field

from camtool.cli.checks import CheckOutputs, check_outputs
from camtool.cli.files import STDOUT, check_ours, check_places, part_name, write_all
from camtool.cli.life_signs import progress, signs_of_command
from camtool.cli.messages import (
    REPORT_NAMES,
    report_marks,
    say,
    say_error,
    say_findings,
    show_facts,
)
from camtool.cli.options import (
    Command,
    DrawingFlags,
    GateFlags,
    InspectionFlags,
    JobFlags,
    MachineFlags,
    SectionedCommand,
    decorate,
    drawing_options,
    gate_options,
    inspection_options,
    job_options,
    machine_options,
    own_job,
    talk_options,
    with_flags,
)
from camtool.cli.picture_options import (
    RESULT,
    UNVERIFIED,
    Painter,
    PictureFlags,
    check_beside,
    picture_name,
    picture_options,
)
from camtool.cli.plot_options import PlotFlags, plot_options
from camtool.cli.report import ReportOutputs, report_option
from camtool.errors import CamtoolError, OptionError
from camtool.pictures.options import points_for
from camtool.records import replace

if TYPE_CHECKING:
    from camtool.pictures.scene import Scene
    from camtool.planning.job import Job
    from camtool.run import Run
    from camtool.target.registry import LoadedTarget
    from camtool.toolpath.wanted import ToolNote


def scenes_of(run: Run, *, before: bool) -> list[Scene]:
    """Return the scene of the predicted result in a list. With `before`, the scene of the same job
    without its measures against reversals and backlash comes first; OptionError if it has none."""
    if not before or run.failed:
        return [run.scene()]
    if run.before is None:
        raise OptionError(
            "the job does nothing against reversals or backlash",
            where="--before-after",
            mend="add --compensate, --minimise reversals or --approach, or drop it",
        )
    name = run.title
    return [run.before.scene(f"{name}, before"), run.scene(f"{name}, after")]


class Posting(Struct, frozen=True):
    """The flags of posting drawings."""

    machine: MachineFlags
    gates: GateFlags
    inspection: InspectionFlags
    job: JobFlags
    drawing: DrawingFlags
    no_verify: bool

    def load(self) -> LoadedTarget:
        """Load the target; a usage error when the flags contradict each other."""
        if self.no_verify and self.gates.given:
            raise click.UsageError("--no-verify leaves nothing to hold against limits")
        self.inspection.check(without="--no-verify" if self.no_verify else None)
        return self.machine.load()

    def make(
        self,
        source: str,
        target: LoadedTarget,
        *,
        on_read: Callable[[], None] | None = None,
        pictures: Sequence[str] = (),
    ) -> Run:
        """Post the drawing; `pictures` are the names of pictures that will be drawn of it, and
        `on_read` is called when the drawing has been read."""
        from camtool.pipeline import post_drawing

        job_used = self.job.job(self.drawing)
        read = self.drawing.read(source, target.machine, job_used)
        if on_read is not None:
            on_read()
        with self.job.name_job_file():
            run = post_drawing(read, job_used, target, **self._settings(pictures))
        return self.inspection.inspect_run(run)

    def make_parts(
        self,
        source: str,
        target: LoadedTarget,
        job: Job,
        *,
        by_tool: bool,
        pictures: Sequence[str] = (),
    ) -> tuple[Run, ...]:
        """Post the drawing as several programs: one for each set-up of the job, or (`by_tool`) one
        for each stretch between tool changes."""
        from camtool.pipeline import post_by_setup, post_by_tool

        read = self.drawing.read(source, target.machine, job)
        with self.job.name_job_file():
            parts = post_by_tool if by_tool else post_by_setup
            return parts(read, job, target, **self._settings(pictures))

    def _settings(self, pictures: Sequence[str]) -> dict[str, Any]:
        """Return the keyword arguments for the functions of `camtool.pipeline` that post."""
        return {
            "check": not self.no_verify,
            "gates": self.gates.gates(),
            "trace_points": points_for(pictures),
            "progress": progress(),
        }

    def files(self, source: str) -> list[str]:
        """Return the files that a program is made from: drawing, job, its tool table, tolerances,
        and machine."""
        return [source, *self.job.files(), *self.inspection.files(), *self.machine.files()]

    def of(self, source: str) -> Posting:
        """Return these flags with the drawing's own job file, if there is one, in place of
        `--job`; other flags override both."""
        own_file = own_job(Path(source))
        return (
            self if own_file is None else replace(self, job=replace(self.job, file=str(own_file)))
        )


def posting_options(command: Command) -> Command:
    """Add `posting: Posting`."""
    inner = with_flags(command, "posting", Posting, [])
    inner = inspection_options(job_options(drawing_options(inner)))
    inner = machine_options(gate_options(inner))
    return decorate(
        inner,
        [click.option("--no-verify", is_flag=True, help="Write without simulating the machine.")],
    )


@click.command(cls=SectionedCommand, short_help="Drawing to verified program.")
@click.argument("source", metavar="DRAWING")
@click.option("-o", "--output", metavar="FILE", help="The program; - is stdout.  [DRAWING.ext]")
@click.option(
    "--preview",
    metavar="FILE",
    callback=picture_name,
    help="Picture of the predicted result, .svg or .png; .html to pan, zoom and play.",
)
@click.option("--json", "report", metavar="FILE", help="The report; - is stdout.")
@report_option
@check_outputs
@click.option("--watch", "watching", is_flag=True, help="Again when a file has changed.")
@click.option(
    "--before-after",
    is_flag=True,
    help="The picture without and with --compensate, --minimise reversals and --approach.",
)
@click.option(
    "--split",
    type=click.Choice(["tool"]),
    help="A program for each tool in turn: DRAWING-1-mill.ext, DRAWING-2-drill.ext ...",
)
@posting_options
@plot_options
@picture_options
@talk_options
def post(
    source: str,
    output: str | None,
    preview: str | None,
    report: str | None,
    page: str | None,
    checks: CheckOutputs,
    watching: bool,
    before_after: bool,
    split: str | None,
    plots: PlotFlags,
    picture: PictureFlags,
    posting: Posting,
    quiet: bool,
    verbose: bool,
) -> int:
    """Turn DRAWING (- is stdin) into the program of a machine, verified before it is written.

    The program is read back from its bytes, run through a model of the machine's own controller
    and mechanics, and compared with the drawing. Exit code 1 (and no file) when something is
    wrong."""
    if watching and STDOUT in (source, output, report, page, *checks.names):
        raise click.UsageError("--watch works on files: neither reads stdin nor writes stdout")
    outputs = ReportOutputs(preview, report, page, checks, plots)
    plots.check(picture.given, pictures=bool(outputs.pictures))
    if posting.no_verify:
        plots.refuse("needs the simulated machine; drop --no-verify")
    if split is not None:
        plots.refuse("is of one program; drop --split, and verify a program of it with --plot")
    picture.check([*outputs.pictures, *plots.names], UNVERIFIED if posting.no_verify else RESULT)
    posting.inspection.check(without=None if split is None else "--split")
    if split is not None and STDOUT in (output or source, preview, page):
        raise click.UsageError("--split writes several files; name the one that they begin with")
    if before_after:
        if posting.no_verify:
            raise click.UsageError("--before-after needs the predicted path; drop --no-verify")
        check_beside("--before-after", outputs.pictures)

    def run_once() -> int:
        target = posting.load()
        reads = [*posting.files(source), str(target.file)]
        requested = RequestedOutputs(source, output, outputs, reads)
        requested.check(target.machine.target.extension, verified=not posting.no_verify)
        with checks.reporting_refusal(source):
            return _post(target, requested)

    def _post(target: LoadedTarget, requested: RequestedOutputs) -> int:
        job = posting.job.job(posting.drawing)
        if job.setups:
            _refuse_beside_setups(posting, plots, split, (output or source, preview, page), job)
        if split is not None or job.setups:
            runs = posting.make_parts(
                source, target, job, by_tool=split is not None, pictures=outputs.pictures
            )
            painters = [
                picture.painter(lambda run=run: scenes_of(run, before=before_after), quiet=quiet)  # type: ignore[misc]
                for run in runs
            ]
            return finish_parts(runs, requested, painters, quiet=quiet, verbose=verbose)
        run = posting.make(source, target, pictures=outputs.pictures)
        painter = picture.painter(lambda: scenes_of(run, before=before_after), quiet=quiet)
        return finish(run, requested, picture=painter, quiet=quiet, verbose=verbose)

    return watch(run_once, lambda: posting.files(source), quiet=quiet) if watching else run_once()


def _refuse_beside_setups(
    posting: Posting, plots: PlotFlags, split: str | None, names: Sequence[str | None], job: Job
) -> None:
    """Raise a usage error for flags and outputs that are not possible where a job gives several
    programs, one for each set-up."""
    plots.refuse("is of one program; name a set-up with --setup")
    setup_names = ", ".join(each.name for each in job.setups)
    one = f"name one of them with --setup: {setup_names}"
    if split is not None:
        raise click.UsageError(f"--split is for the tools of one set-up; {one}")
    if STDOUT in names:
        raise click.UsageError(f"a program is written for each set-up; name a file, or {one}")
    posting.inspection.check(without=f"[[setups]] without --setup; {one}")


# How `post` and `convert` end: all files or none, and a short summary.

MAX_PLACEHOLDERS = 2
"""Up to this many missing numbers, the user is advised to complete the machine file; if more are
missing, to make one with `camtool init`."""

SHORT = {"flat": "mill", "v": "bit"}
"""Short names of kinds of tools in names of files; other kinds keep their name."""


class RequestedOutputs(Struct, frozen=True):
    """The requested outputs: `source` is the drawing or program that is read, `output` the program
    that is written; `reads` are all files that are read."""

    source: str
    output: str | None
    outputs: ReportOutputs = field(default_factory=ReportOutputs)
    reads: Sequence[str] = ()

    def check(self, extension: str, *, verified: bool) -> None:
        """Raise OutputError, before any work is done, when a place cannot be written."""
        for flag, name in (("--json", self.outputs.report), ("--report", self.outputs.page)):
            if name is not None and not verified:
                raise click.UsageError(
                    f"{flag} is the report of the verification that --no-verify leaves out"
                )
        self.outputs.check(self.reads, self.program(extension))

    def places(self) -> list[str | None]:
        """Return all files to write whose names are known before posting."""
        outputs = self.outputs
        return [self.output, outputs.preview, outputs.report, outputs.page, outputs.beside]

    def program(self, extension: str) -> str:
        """Return the name of the program's file: as given, or the name of the source in the
        current folder; "-" (stdout) if the source is stdin."""
        if self.output is not None:
            return self.output
        return STDOUT if self.source == STDOUT else Path(self.source).stem + extension


def finish(
    run: Run, requested: RequestedOutputs, *, picture: Painter, quiet: bool, verbose: bool
) -> int:
    """Write the requested files of a run and report them; return the exit code. `picture` draws
    the pictures.

    If the run has an error, only the page of `--report` is written, which shows what is wrong."""
    outputs = requested.outputs
    say_findings(run.findings, quiet=quiet, verbose=verbose)
    if run.failed or run.program is None:
        unwritten = {**_page_alone(run, outputs, picture), **outputs.check_files([(run, None)])}
        write_all(unwritten)
        no = "nothing" if outputs.page is None else "no program"
        say(f"camtool: error: {requested.source}: {no} was written; fix the errors above")
        return 1
    # For a dialect with several forms (binary, listing) the extension is known only now.
    requested.check(run.program.extension, verified=True)
    output = requested.program(run.program.extension)
    if requested.output is None:
        _check_ours(run, output)
    files = {output: run.program.data, **outputs.files(run, picture)}
    write_all({**files, **outputs.check_files([(run, output)])})
    _say_written(run, output, quiet=quiet)
    return 0


def _check_ours(run: Run, name: str) -> None:
    """Raise OutputError if a file with the default name exists and was not written by camtool, for
    dialects whose programs contain their origin."""
    made_elsewhere = run.target.target.made_elsewhere
    assert run.program is not None
    if not made_elsewhere(run.program.data):
        check_ours(name, lambda old: not made_elsewhere(old))


def _say_written(run: Run, output: str, *, quiet: bool) -> None:
    """Show the summary of a written program."""
    assert run.program is not None
    if run.report is not None and not quiet:
        summary = run.report.to_text(findings=False)
        if run.target.placeholders:
            summary += f"\n{'machine':<10} {_placeholder_words(run.target.placeholders)}"
        show_facts(summary, REPORT_NAMES, report_marks(run.findings), err=True)
    place = "stdout" if output == STDOUT else output
    say(f"written: {place} ({len(run.program.data)} bytes)", quiet=quiet)


def finish_parts(
    runs: Sequence[Run],
    requested: RequestedOutputs,
    pictures: Sequence[Painter],
    *,
    quiet: bool,
    verbose: bool,
) -> int:
    """Write the programs of one drawing like `finish`, each with its own picture and page: all
    files or none. There is one JSON, which lists the programs."""
    findings = dict.fromkeys(finding for run in runs for finding in run.findings)
    say_findings(findings, quiet=quiet, verbose=verbose)
    parts = [_part(run, requested, number, len(runs)) for number, run in enumerate(runs, 1)]
    report, names = requested.outputs.report, [str(part.output) for part in parts]
    every = [name for part in parts for name in part.places()]
    checks = requested.outputs.checks
    check_places(requested.reads, [*every, report, *checks.names])
    for part in parts:
        part.outputs.check(())
    files: dict[str, bytes] = {}
    if any(run.failed or run.program is None for run in runs):
        for run, part, picture in zip(runs, parts, pictures, strict=True):
            files |= _page_alone(run, part.outputs, picture)
        no = "no program" if files else "nothing"
        write_all(files | requested.outputs.check_files((run, None) for run in runs))
        say(f"camtool: error: {requested.source}: {no} was written; fix the errors above")
        return 1
    for run, part, name, picture in zip(runs, parts, names, pictures, strict=True):
        assert run.program is not None
        _check_ours(run, name)
        files |= {name: run.program.data, **part.outputs.files(run, picture)}
    if report is not None:
        files[report] = _programs_json(runs, parts)
    write_all(files | requested.outputs.check_files(zip(runs, names, strict=True)))
    for run, name in zip(runs, names, strict=True):
        _say_written(run, name, quiet=quiet)
    return 0


def _placeholder_words(names: Sequence[str]) -> str:
    """Return a note about numbers of the machine that are still placeholders."""
    *first_names, last = names
    sentence = (
        f"{', '.join(first_names)} and {last} are placeholders"
        if first_names
        else f"{last} is a placeholder"
    )
    if names == ("backlash",):
        return f"{sentence}: camtool coupon lines, then camtool calibrate, give yours"
    if len(names) <= MAX_PLACEHOLDERS:
        return f"{sentence}: give them in your machine's file"
    return f"{sentence}: camtool init makes your machine's file"


def _part(run: Run, requested: RequestedOutputs, number: int, count: int) -> RequestedOutputs:
    """Return the outputs of program `number` of `count`: each file name gets the number and the
    set-up or tool, so that the files sort in the order of the programs."""
    from camtool.planning.naming import setup_name

    tool = _tool(run)
    kind = "tool" if tool is None else tool.name or SHORT.get(tool.kind, tool.kind)
    kind = (run.job and setup_name(run.job)) or kind

    def marked(name: str | None) -> str | None:
        return None if name is None else part_name(name, number, count, kind)

    machine = run.target.machine.target
    program = requested.program(
        machine.extension if run.program is None else run.program.extension
    )
    outputs = requested.outputs
    part_outputs = replace(
        outputs,
        preview=marked(outputs.preview),
        page=marked(outputs.page),
        report=None,
        checks=CheckOutputs(),
    )
    return RequestedOutputs(requested.source, marked(program), part_outputs, requested.reads)


def _tool(run: Run) -> ToolNote | None:
    """Return the tool of a program's first operation, None if its operations are not known. The
    programs of `--split` have one tool each."""
    operations = None if run.wanted is None else run.wanted.operations
    return None if operations is None else operations.notes[0].tool


def _programs_json(runs: Sequence[Run], parts: Sequence[RequestedOutputs]) -> bytes:
    """Return JSON that lists file, set-up, tool, picture, page and report of each program."""
    import json

    from camtool.planning.naming import setup_name

    programs = []
    for run, part in zip(runs, parts, strict=True):
        tool = _tool(run)
        programs.append(
            {
                "program": part.output,
                "setup": (run.job and setup_name(run.job)) or None,
                "tool": None if tool is None else {"number": tool.number, "name": tool.name},
                "preview": part.outputs.preview,
                "page": part.outputs.page,
                "report": None if run.report is None else json.loads(run.report.to_json()),
            }
        )
    return f"{json.dumps({'programs': programs}, indent=2, ensure_ascii=False)}\n".encode()


def _page_alone(run: Run, outputs: ReportOutputs, picture: Painter) -> dict[str, bytes]:
    """Return the files of the page of `--report`, with the picture of `--preview` if the page
    shows it."""
    files, linked = outputs.page_files(run, picture), outputs.linked
    return files if linked is None or linked in files else {**files, linked: picture(linked)}


# `--watch`: posts again whenever one of the files has changed. The content counts, not the time: a
# save without a change does nothing, and the clock of a network drive does not matter. A change
# counts when the content stays the same for a while: an editor may write in several steps.

POLL_S = 0.4

SETTLED_S = 0.2
"""Time for which files must stay the same before a change counts."""

Files = Callable[[], Sequence[str]]
Digests = dict[str, bytes | None]


def watch(
    action: Callable[[], int],
    files: Files,
    *,
    quiet: bool,
    wait: Callable[[float], None] = time.sleep,
) -> int:
    """Call `action` now and after each change of the `files`, until Ctrl-C; then 0.

    The list of files may change with their content: a job file names a tool table.
    An error is shown on one line, and watching goes on: the next save may fix it."""
    try:
        seen_digests = _digests(files)
        say(f"camtool: watching {', '.join(seen_digests)}; Ctrl-C ends", quiet=quiet)
        _try_once(action)
        while True:
            wait(POLL_S)
            digests = _wait_until_stable(files, seen_digests, wait)
            changed_files = [
                file
                for file in digests
                if file not in seen_digests or digests[file] != seen_digests[file]
            ]
            seen_digests = digests
            if changed_files:
                say(f"camtool: changed: {', '.join(changed_files)}", quiet=quiet)
                _try_once(action)
    except KeyboardInterrupt:
        say("camtool: watching ended", quiet=quiet)
        return 0


def _try_once(action: Callable[[], int]) -> None:
    try:
        with signs_of_command().counting():
            action()
    except CamtoolError as error:
        say_error(error)


def _wait_until_stable(
    files: Files, seen_digests: Digests, wait: Callable[[float], None]
) -> Digests:
    """Return the digests of the files. If they differ from `seen_digests`, wait until they no
    longer change, so that a file that is being saved is not read half-written."""
    digests = _digests(files)
    while digests != seen_digests:
        wait(SETTLED_S)
        before, digests = digests, _digests(files)
        if digests == before:
            break
    return digests


def _digests(files: Files) -> Digests:
    """Return the digest of each file; None when it cannot be read at the moment."""
    return {file: _digest(Path(file)) for file in files()}


def _digest(file: Path) -> bytes | None:
    import hashlib

    try:
        with file.open("rb") as stream:
            return hashlib.file_digest(stream, "sha256").digest()
    except OSError:
        return None
