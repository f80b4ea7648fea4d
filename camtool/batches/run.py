"""A batch: drawings that are up to date are skipped, the others are made, written and recorded."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any, Protocol

from camtool.batches.manifest import Entry, Manifest, content_digest, digest_of, file_digest
from camtool.errors import OutputError

# What goes to a worker and what comes back: small records that can be pickled.


@dataclass(frozen=True)
class Task:
    """One drawing: its name as the user wrote it, and its outputs' common name.

    `stem` is relative to the output folder, with / between folders and without extension.
    `order` is whatever the Work needs besides (the job of this drawing).
    """

    source: str
    stem: str
    order: Any = None

    @property
    def path(self) -> Path:
        """The drawing's file."""
        return Path(self.source)


@dataclass(frozen=True, kw_only=True)
class Result:
    """What the summary says of one drawing: `remarks` are findings, one line each, errors first;
    `figures` are a few numbers; `verdicts` counts those of inspected dimensions; `code` is that of
    the finding which is the error, "" for other errors."""

    error: str | None = None
    remarks: tuple[str, ...] = ()
    warnings: int = 0
    figures: Mapping[str, float] = field(default_factory=dict)
    verdicts: Mapping[str, int] = field(default_factory=dict)
    seconds: float = 0.0
    code: str = ""


@dataclass(frozen=True)
class Made(Result):
    """What a Work made of a drawing: `files` by extension, none when there is an `error`;
    `content` is the digest of the bytes of the drawing."""

    content: str = ""
    files: Mapping[str, bytes] = field(default_factory=dict)


class Work(Protocol):
    """What is done with each drawing; every worker gets it."""

    def warm(self) -> None:
        """Load what every drawing needs; a new worker does so before its first drawing."""

    def make(self, task: Task, data: bytes | None) -> Made:
        """The outputs of a drawing; `data` is its content, None to read the file."""

    def digest(self) -> str:
        """The digest of all that outputs depend on, except the drawing and its order."""


class Pool(Protocol):
    """Workers: tasks in, results out in any order; None when none has come for a moment."""

    def results(self, tasks: Sequence[Task]) -> Generator[tuple[Task, Made] | None]:
        """One result for each task; closing the generator ends the workers."""


class State(StrEnum):
    """What became of a drawing."""

    MADE = "made"
    UP_TO_DATE = "up to date"
    FAILED = "failed"
    NOT_RUN = "not run"


@dataclass(frozen=True)
class Outcome(Result):
    """What became of one drawing; `files` are relative to the output folder."""

    source: str
    stem: str
    state: State
    files: tuple[str, ...] = ()


# The run.

Writer = Callable[[dict[str, bytes]], None]
"""Writes all of some files or none; OutputError names the one that cannot be written."""

SCRIPT = ".py"
"""Scripts are made again in every run: they may read any file, so that nobody knows whether their
outputs are up to date."""


@dataclass(frozen=True)
class Order:
    """Where outputs go and how they are written; the digest of all that they depend on besides the
    drawing (`base` for all, `own` for each task by stem); `force` makes all of them again, and
    replaces files that no batch made."""

    out: Path
    write: Writer
    base: str
    own: Mapping[str, str]
    force: bool = False

    def key(self, task: Task, content: str) -> str:
        """The digest of all that a drawing's outputs depend on."""
        return digest_of(self.base, self.own.get(task.stem, ""), task.source, content)


def run_batch(
    tasks: Sequence[Task], order: Order, manifest: Manifest, pool: Pool
) -> Generator[Outcome | None]:
    """The outcome of every task, in the order in which they come; None as a Pool gives it.

    Closing the generator stops the workers; all files written by then are complete and recorded.
    """
    left: list[Task] = []
    for task in tasks:
        entry = None if order.force else _up_to_date(task, order, manifest)
        if entry is None:
            left.append(task)
            continue
        yield Outcome(
            task.source,
            task.stem,
            State.UP_TO_DATE,
            tuple(entry.files),
            warnings=entry.warnings,
            figures=entry.figures,
            verdicts=entry.verdicts,
        )
    if not left:
        return
    with closing(pool.results(left)) as results:
        for result in results:
            yield None if result is None else _finished(*result, order, manifest)


def _up_to_date(task: Task, order: Order, manifest: Manifest) -> Entry | None:
    if task.path.suffix.lower() == SCRIPT:
        return None
    try:
        content = file_digest(task.path)
    except OSError:  # making it gives the error
        return None
    return manifest.up_to_date(task.stem, order.key(task, content))


def _finished(task: Task, made: Made, order: Order, manifest: Manifest) -> Outcome:
    """Write a result; its outcome."""
    error, remarks = made.error, made.remarks
    names: tuple[str, ...] = ()
    if error is None:
        files = {f"{task.stem}{extension}": data for extension, data in made.files.items()}
        error = _written(task, files, order, manifest)
        if error is None:
            names = tuple(files)
            entry = Entry(
                order.key(task, made.content),
                {name: content_digest(data) for name, data in files.items()},
                made.warnings,
                dict(made.figures),
                dict(made.verdicts),
            )
            try:
                manifest.add(task.stem, entry)
            except OSError as fault:
                remarks = (*remarks, f"{task.source}: is not in the manifest ({fault.strerror})")
    return Outcome(
        task.source,
        task.stem,
        State.MADE if error is None else State.FAILED,
        names,
        error=error,
        remarks=remarks,
        warnings=made.warnings,
        figures=made.figures,
        verdicts=made.verdicts,
        seconds=made.seconds,
        code=made.code,
    )


def _written(
    task: Task, files: Mapping[str, bytes], order: Order, manifest: Manifest
) -> str | None:
    """Write the files of a drawing; the error, None without one."""
    for name, data in () if order.force else files.items():
        if not manifest.may_replace(task.stem, name, data):
            foreign = OutputError(
                "is there, and no batch made it, or it was changed since",
                file=str(order.out / name),
                mend="move it away, choose another --out, or --force, which replaces it",
            )
            return f"{task.source}: {foreign}"
    places = {str(order.out / name): data for name, data in files.items()}
    try:
        (order.out / task.stem).parent.mkdir(parents=True, exist_ok=True)
        order.write(places)
    except OutputError as error:
        return f"{task.source}: {error}"
    except OSError as error:
        return f"{task.source}: {error.filename}: cannot be written ({error.strerror})"
    return None
