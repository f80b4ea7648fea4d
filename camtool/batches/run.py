"""A batch: what is up to date is passed over, the rest is made, written and noted."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any, Protocol

from camtool.batches.manifest import Entry, Manifest, content_digest, digest_of, file_digest
from camtool.errors import OutputError

# What goes to a worker and what comes back: small, plain, and good to send over a wire.


@dataclass(frozen=True)
class Task:
    """One drawing: its name as the user wrote it, and its outputs' common name.

    `stem` is relative to the output folder, with / between folders and without extension.
    `order` is whatever the Work wants to be told of this drawing (its job).
    """

    source: str
    stem: str
    order: Any = None

    @property
    def path(self) -> Path:
        """The drawing's file."""
        return Path(self.source)


@dataclass(frozen=True)
class Made:
    """What a Work made of a drawing. `files` by extension, none when there is an `error`;
    `content` is the digest of the drawing's bytes that it was made of; `figures` are a few
    numbers for the summary; `remarks` are findings, one line each, errors first; `code` is that
    of the finding which is the error, "" for another one."""

    content: str = ""
    files: Mapping[str, bytes] = field(default_factory=dict)
    error: str | None = None
    remarks: tuple[str, ...] = ()
    warnings: int = 0
    figures: Mapping[str, float] = field(default_factory=dict)
    seconds: float = 0.0
    code: str = ""


class Work(Protocol):
    """What is done to each drawing; it is sent to every worker."""

    def warm(self) -> None:
        """What a new worker does before its first drawing."""

    def make(self, task: Task, data: bytes | None) -> Made:
        """The outputs of a drawing; `data` is its content, None where the file can be read."""

    def digest(self) -> str:
        """The digest of all that outputs depend on but the drawing and its order: our code too."""


class Pool(Protocol):
    """Workers: tasks in, results out in any order. None is a moment in which nothing came."""

    def results(self, tasks: Sequence[Task]) -> Generator[tuple[Task, Made] | None]:
        """Every task's result once; closing the generator ends the workers."""


class State(StrEnum):
    """What became of a drawing."""

    MADE = "made"
    UP_TO_DATE = "up to date"
    FAILED = "failed"
    NOT_RUN = "not run"


@dataclass(frozen=True)
class Outcome:
    """What became of one drawing; `files` are relative to the output folder."""

    source: str
    stem: str
    state: State
    files: tuple[str, ...] = ()
    error: str | None = None
    remarks: tuple[str, ...] = ()
    warnings: int = 0
    figures: Mapping[str, float] = field(default_factory=dict)
    seconds: float = 0.0
    code: str = ""


# The run.

Writer = Callable[[dict[str, bytes]], None]
"""Writes all files or none; OutputError names the one that cannot be written."""

SCRIPT = ".py"
"""A script reads whatever it likes: whether what it makes is up to date cannot be known."""


@dataclass(frozen=True)
class Order:
    """Where outputs go, how they are written, the digest of all they depend on but the drawing
    (`base` for all, and each task's own in `own`), and whether all are made anew."""

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
    """The outcome of every task, in the order in which they come; None is an idle moment.

    Closing the generator stops the workers; whatever has been written is whole and noted.
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
    except OSError:  # making it says what is wrong with it
        return None
    return manifest.up_to_date(task.stem, order.key(task, content))


def _finished(task: Task, made: Made, order: Order, manifest: Manifest) -> Outcome:
    """A result, written."""
    error, remarks = made.error, made.remarks
    names: tuple[str, ...] = ()
    if error is None:
        files = {f"{task.stem}{extension}": data for extension, data in made.files.items()}
        error = _written(task, files, order)
        if error is None:
            names = tuple(files)
            entry = Entry(
                order.key(task, made.content),
                {name: content_digest(data) for name, data in files.items()},
                made.warnings,
                dict(made.figures),
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
        error,
        remarks,
        made.warnings,
        made.figures,
        made.seconds,
        made.code,
    )


def _written(task: Task, files: Mapping[str, bytes], order: Order) -> str | None:
    """Writes a drawing's files; what went wrong, None when nothing did."""
    places = {str(order.out / name): data for name, data in files.items()}
    try:
        (order.out / task.stem).parent.mkdir(parents=True, exist_ok=True)
        order.write(places)
    except OutputError as error:
        return f"{task.source}: {error}"
    except OSError as error:
        return f"{task.source}: {error.filename}: cannot be written ({error.strerror})"
    return None
