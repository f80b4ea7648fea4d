"""A batch: drawings that are up to date are skipped, the others are made, written and recorded."""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any, Protocol

from camtool.batches.manifest import (
    Manifest,
    ManifestEntry,
    content_digest,
    digest_of,
    file_digest,
)
from camtool.errors import OutputError
from camtool.findings import FoundAt

# Messages to and from workers: small records that can be pickled.


@dataclass(frozen=True)
class DrawingTask:
    """One drawing: its name as the user wrote it, and the common name of its outputs.

    `stem` is relative to the output folder, with / between folders and without extension.
    `order` is further input of the BatchWork (the job of this drawing)."""

    source: str
    stem: str
    order: Any = None

    @property
    def path(self) -> Path:
        """File of the drawing."""
        return Path(self.source)


@dataclass(frozen=True, kw_only=True)
class DrawingResult:
    """The entry of one drawing in the summary. `remarks`: its findings, one line each, errors
    first; `figures`: a few numbers; `verdicts`: counts of inspected dimensions by verdict; `code`:
    the code of the finding that is the error, "" for other errors; `findings`: the worst of its
    findings."""

    error: str | None = None
    remarks: tuple[str, ...] = ()
    warnings: int = 0
    figures: Mapping[str, float] = field(default_factory=dict)
    verdicts: Mapping[str, int] = field(default_factory=dict)
    seconds: float = 0.0
    code: str = ""
    findings: tuple[FoundAt, ...] = ()


@dataclass(frozen=True)
class Outputs(DrawingResult):
    """The outputs of a drawing. `files`: content by extension, empty if there is an `error`;
    `content`: digest of the drawing's bytes, "" if another run with the same drawing and job may
    give another result."""

    content: str = ""
    files: Mapping[str, bytes] = field(default_factory=dict)


class BatchWork(Protocol):
    """The function from a drawing to its outputs; every worker gets a copy."""

    def warm(self) -> None:
        """Load the modules that every drawing needs; called once in each new worker."""

    def make(self, task: DrawingTask, data: bytes | None) -> Outputs:
        """Make the outputs of a drawing; `data` is its content, None to read the file."""

    def digest(self) -> str:
        """Return the digest of everything that outputs depend on, except the drawing and its
        order."""


class Pool(Protocol):
    """Workers that turn tasks into results, in any order; while no result is ready, None is
    yielded now and then."""

    def results(
        self, tasks: Sequence[DrawingTask]
    ) -> Generator[tuple[DrawingTask, Outputs] | None]:
        """Yield a result for each task; closing the generator ends the workers."""


class OutcomeState(StrEnum):
    """Outcome of a drawing."""

    MADE = "made"
    UP_TO_DATE = "up to date"
    FAILED = "failed"
    NOT_RUN = "not run"


@dataclass(frozen=True)
class Outcome(DrawingResult):
    """The outcome of one drawing. `files` are relative to the output folder; `remembered`: it
    failed in an earlier run, and nothing that it depends on has changed since, so it was not tried
    again."""

    source: str
    stem: str
    state: OutcomeState
    files: tuple[str, ...] = ()
    remembered: bool = False


# The run.

Writer = Callable[[dict[str, bytes]], None]
"""A function that writes all files or none; OutputError names the one that cannot be written."""

SCRIPT = ".py"
"""Scripts run again in every batch: they may read any file, so that their outputs are never known
to be up to date."""


@dataclass(frozen=True)
class BatchSettings:
    """Settings of a batch: the output folder `out` and the function `write`; digests of everything
    that outputs depend on besides the drawing (`base` for all drawings, `own` for each by stem).
    `force`: make all outputs again, and replace files that no batch made; `retries`: also try
    drawings that failed and have not changed."""

    out: Path
    write: Writer
    base: str
    own: Mapping[str, str]
    force: bool = False
    retries: bool = False

    def key(self, task: DrawingTask, content: str) -> str:
        """Return the digest of everything that the outputs of a drawing depend on."""
        return digest_of(self.base, self.own.get(task.stem, ""), task.source, content)


def run_batch(
    tasks: Sequence[DrawingTask], order: BatchSettings, manifest: Manifest, pool: Pool
) -> Generator[Outcome | None]:
    """Yield the outcome of every task as soon as it is known, and None as the pool does.

    Closing the generator stops the workers; all files written by then are complete and recorded.
    """
    outdated: list[DrawingTask] = []
    for task in tasks:
        entry = None if order.force else _up_to_date(task, order, manifest)
        if entry is None or (entry.error and order.retries):
            outdated.append(task)
            continue
        yield Outcome(
            task.source,
            task.stem,
            OutcomeState.FAILED if entry.error else OutcomeState.UP_TO_DATE,
            tuple(entry.files),
            remembered=bool(entry.error),
            error=entry.error or None,
            remarks=tuple(f"{task.source}: {each.to_line()}" for each in entry.findings)
            if entry.error
            else (),
            warnings=entry.warnings,
            figures=entry.figures,
            verdicts=entry.verdicts,
            code=entry.code,
            findings=entry.findings,
        )
    if not outdated:
        return
    with closing(pool.results(outdated)) as results:
        for result in results:
            yield None if result is None else _record(*result, order, manifest)


def _up_to_date(
    task: DrawingTask, order: BatchSettings, manifest: Manifest
) -> ManifestEntry | None:
    if task.path.suffix.lower() == SCRIPT:
        return None
    try:
        content = file_digest(task.path)
    except OSError:  # reading fails again when it is made, which gives the error
        return None
    return manifest.up_to_date(task.stem, order.key(task, content))


def _record(
    task: DrawingTask, outputs: Outputs, order: BatchSettings, manifest: Manifest
) -> Outcome:
    """Write the files of a result and return its outcome."""
    error, remarks = outputs.error, outputs.remarks
    files = {f"{task.stem}{extension}": data for extension, data in outputs.files.items()}
    if error is None:
        error = _write_files(task, files, order, manifest)
    if outputs.content and error == outputs.error:
        entry = ManifestEntry(
            order.key(task, outputs.content),
            {name: content_digest(data) for name, data in files.items()},
            outputs.warnings,
            dict(outputs.figures),
            dict(outputs.verdicts),
            error=error or "",
            code=outputs.code,
            findings=outputs.findings,
        )
        try:
            manifest.add(task.stem, entry)
        except OSError as fault:
            remarks = (*remarks, f"{task.source}: is not in the manifest ({fault.strerror})")
    return Outcome(
        task.source,
        task.stem,
        OutcomeState.MADE if error is None else OutcomeState.FAILED,
        tuple(files) if error is None else (),
        error=error,
        remarks=remarks,
        warnings=outputs.warnings,
        figures=outputs.figures,
        verdicts=outputs.verdicts,
        seconds=outputs.seconds,
        code=outputs.code,
        findings=outputs.findings,
    )


def _write_files(
    task: DrawingTask, files: Mapping[str, bytes], order: BatchSettings, manifest: Manifest
) -> str | None:
    """Write the files of a drawing; return the error as text, or None."""
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
