"""`camtool stale`: which programs differ from what camtool would write now?"""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from camtool.cli.files import check_places, write_all
from camtool.cli.messages import say
from camtool.cli.options import OWN_JOB, SectionedCommand, talk_options
from camtool.cli.post import Posting, posting_options
from camtool.errors import CamtoolError, InputError
from camtool.findings import Severity
from camtool.importers.options import SUFFIXES
from camtool.plain import to_json
from camtool.records import replace

if TYPE_CHECKING:
    from camtool.target.registry import LoadedTarget


@click.command(cls=SectionedCommand, short_help="Programs that are out of date.")
@click.argument("files", metavar="FILE...", nargs=-1, required=True)
@posting_options
@click.option(
    "--programs",
    metavar="FOLDER",
    help="Where the programs are, in folders as the drawings: what camtool batch has as --out.  "
    "[beside the drawings]",
)
@click.option("--json", "report", metavar="FILE", help="Each with its state; - is stdout.")
@click.option("--missing", is_flag=True, help="A drawing without a program is an error too.")
@talk_options
def stale(
    files: tuple[str, ...],
    posting: Posting,
    programs: str | None,
    report: str | None,
    missing: bool,
    quiet: bool,
    verbose: bool,
) -> int:
    """Compare programs with what camtool would write now for their drawings.

    Each FILE is a drawing, its program or its job file (part.dxf, part.nc, part.toml), or a folder
    to search for drawings; with --programs a drawing or folder. Give the flags that the programs
    were posted with. Nothing is written; exit code 1 when a program is not byte for byte what
    camtool writes now."""
    target = posting.load()
    posting = replace(posting, no_verify=not posting.gates.given)
    drawings_by_name = (
        named_drawings(files) if programs is None else drawings_of(files, Path(programs))
    )
    check_places([*files, *posting.machine.files()], [report])
    rows: list[ComparedProgram] = []
    for name, drawings in drawings_by_name.items():
        rows.append(_compare(name, drawings, posting, target, missing=missing))
        if rows[-1].code:
            say(f"camtool: error: {rows[-1].why}")
        elif rows[-1].program is None:
            say(f"camtool: {rows[-1].why}", quiet=not verbose)
    if report is not None:
        write_all({report: to_json(rows).encode()})
    return max((row.code for row in rows), default=0)


@dataclass(frozen=True)
class ComparedProgram:
    """A program and the drawing that it was compared with (None if there is none). `state`:
    "current", "stale", "missing", or "unknown" if the drawing cannot be posted any more; `why` in
    words; `code`: the exit code."""

    drawing: str
    program: str | None
    state: str
    why: str = ""
    code: int = 0


def _compare(
    name: Path, drawings: Sequence[Path], posting: Posting, target: LoadedTarget, *, missing: bool
) -> ComparedProgram:
    """Compare the program of this name with its drawing. Of several drawings with the name, one
    that matches is enough."""
    if not missing and not _has_program(name):
        return ComparedProgram(str(drawings[0]), None, "missing", f"{name}: has no program")
    faults = []
    for drawing in drawings:
        row = _compare_with(drawing, name, posting, target, missing=missing)
        if not row.code:
            return row
        faults.append(row)
    return faults[0]


def named_drawings(files: Sequence[str]) -> dict[Path, list[Path]]:
    """Return the drawings for these files by their names without suffix: the files themselves,
    those beside a program or job file, or those in folders.

    An SVG beside a drawing may be a picture of its program, so one name may have several files;
    the likeliest drawing is first. InputError for files that do not exist."""
    names = dict.fromkeys(name for file in files for name in _names(Path(file)))
    drawings_by_name = {name: _ordered(_files_named(name)) for name in names}
    return {name: drawings for name, drawings in drawings_by_name.items() if drawings}


def drawings_of(files: Sequence[str], programs: Path) -> dict[Path, list[Path]]:
    """Return the drawings that a batch of these arguments would take, by the path of their
    programs in the folder `programs`.

    InputError for what does not exist or is no drawing, OutputError for two drawings with one
    output name, as in a batch."""
    if not programs.is_dir():
        raise InputError("is no folder", file=str(programs), mend="give the --out of the batch")

    from camtool.batches.inputs import find_tasks

    return {programs / task.stem: [task.path] for task in find_tasks(files, programs)}


def _names(file: Path) -> Iterator[Path]:
    if file.is_dir():
        for folder, folders, names in os.walk(file):
            folders.sort()
            yield from (
                Path(folder, name).with_suffix("")
                for name in sorted(names)
                if Path(name).suffix.lower() in SUFFIXES
            )
    elif not os.path.lexists(file):
        raise InputError("is not there", file=str(file), mend="check the path")
    else:
        yield file.with_suffix("")


def _ordered(files: list[Path]) -> list[Path]:
    drawings = [file for file in files if file.suffix.lower() in SUFFIXES]
    return sorted(drawings, key=lambda file: SUFFIXES.index(file.suffix.lower()))


def _files_named(name: Path) -> list[Path]:
    """Return the files with this name and any suffix, sorted."""
    if not name.parent.is_dir():
        return []
    return sorted(other for other in name.parent.iterdir() if other.with_suffix("") == name)


def _has_program(name: Path) -> bool:
    """Return True if a file of this name may be a program, by its suffix: a dialect may have
    several."""
    return any(file.suffix.lower() not in (*SUFFIXES, OWN_JOB) for file in _files_named(name))


def _compare_with(
    drawing: Path, name: Path, posting: Posting, target: LoadedTarget, *, missing: bool
) -> ComparedProgram:
    """Compare the program of this name with what camtool would write for the drawing now."""
    try:
        run = posting.of(str(drawing)).make(str(drawing), target)
    except CamtoolError as error:
        return ComparedProgram(str(drawing), None, "unknown", str(error), error.exit_code)
    program = run.program
    if run.failed or program is None:
        grave = next(each for each in run.findings if each.severity >= Severity.ERROR)
        why = f"{drawing}: cannot be posted any more: {grave}"
        return ComparedProgram(str(drawing), None, "unknown", why, 1)
    place = Path(f"{name}{program.extension}")
    if not place.is_file():
        if not missing:
            return ComparedProgram(str(drawing), None, "missing", f"{place}: is not there")
        why = f"{place}: is not there; post {drawing}"
        return ComparedProgram(str(drawing), None, "missing", why, 1)
    if place.read_bytes() == program.data:
        return ComparedProgram(str(drawing), str(place), "current")
    why = f"{place}: is not what camtool writes of {drawing} now; post it again"
    return ComparedProgram(str(drawing), str(place), "stale", why, 1)
