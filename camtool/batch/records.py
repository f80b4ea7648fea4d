"""What goes to a worker and what comes back: small, plain, and good to send over a wire."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any, Protocol


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
