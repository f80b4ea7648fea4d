"""The flags that say what a job file says: each key by its name with hyphens for underscores."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from camtool.cli.drawing import DrawingFlags
from camtool.cli.gather import Command, decorate, gather
from camtool.cli.sections import option
from camtool.errors import OptionError
from camtool.jobs.given import Given, Key, Table
from camtool.jobs.keys import OPERATION, PLACE, TOOL_KEYS, TOOL_NAME, WHOLE

if TYPE_CHECKING:
    from camtool.planning.job import Job

_JOB = "Job (every key of docs/jobs.md is a flag)"
_PLACE = "Where the drawing lies, in this order"
_TOOL = "Tool"
_CUT = "How it is cut"

_RENAMED = {"tool_tip_angle": "--tool-angle"}


@dataclass(frozen=True)
class JobFlags:
    """`--job`, `--operation` and the flags that say the same as keys; `given` holds the values of
    those that were given."""

    file: str | None
    operations: tuple[str, ...]
    given: Mapping[str, Any]

    def job(self, drawing: DrawingFlags) -> Job:
        """The job of the file, with the given flags over it.

        `--layer` restricts the drawing; a job of one operation takes just that of it.
        """
        from camtool.jobs.build import build_job
        from camtool.jobs.file import Said, read_job_file

        file = Said() if self.file is None else read_job_file(Path(self.file))
        flags = Said(
            whole=self._table(WHOLE),
            place=self._table(PLACE),
            defaults=self._table({**OPERATION, TOOL_NAME: None, **TOOL_KEYS}),
        )
        job = build_job(file, flags, self.operations)
        if drawing.layers and len(job.operations) == 1:
            return replace(job, operations=(replace(job.operations[0], layers=drawing.layers),))
        return job

    def files(self) -> list[str]:
        """The job file, and its tool table."""
        return [file for file in (self.file, self.tool_table()) if file is not None]

    def tool_table(self) -> str | None:
        """The file of the tool table that the flag or the job file names; None without any, and
        where the job file cannot be read: `job` says why."""
        if self.file is None or "tool_table" in self.given:
            return self.given.get("tool_table")
        from camtool.machine.loader import parsed_table

        try:
            name = parsed_table(Path(self.file).read_text(encoding="utf-8")).get("tool_table")
        except (OSError, ValueError):
            return None
        return str(Path(self.file).parent / name) if isinstance(name, str) else None

    @contextmanager
    def blamed(self) -> Iterator[None]:
        """Errors of planning that name an operation name its file too."""
        try:
            yield
        except OptionError as error:
            if not error.file and str(error.where).startswith("operation"):
                error.file = self.file
            raise

    def _table(self, keys: Mapping[str, Key | None]) -> Table:
        return Table(
            {name: Given(value, _flag(name)) for name, value in self.given.items() if name in keys}
        )


def job_options(command: Command) -> Command:
    """Adds `job: JobFlags`."""
    wrapped = gather("job", _make_job, ("job", "operation", *_NAMES))(command)
    return decorate(wrapped, [*_file_flags(), *_key_flags()])


def _make_job(job: str | None, operation: tuple[str, ...], **given: Any) -> JobFlags:
    return JobFlags(
        job, operation, {name: value for name, value in given.items() if value is not None}
    )


def _file_flags() -> list[Any]:
    return [
        option(_JOB, "--job", metavar="FILE", help="A TOML file that says what these flags say."),
        option(
            _JOB,
            "--operation",
            multiple=True,
            metavar="NAME",
            help="Only this operation of the file, by name or number.",
        ),
    ]


def _key_flags() -> list[Any]:
    tool = option(_TOOL, "--tool", metavar="NAME", help="A tool of the file, or its number.")
    return [
        *(_flag_of(_JOB, name, key) for name, key in WHOLE.items()),
        *(_flag_of(_PLACE, name, key) for name, key in _ACTING.items()),
        tool,
        *(_flag_of(_TOOL, name, key) for name, key in TOOL_KEYS.items()),
        *(_flag_of(_CUT, name, key) for name, key in OPERATION.items() if key.help),
    ]


def _flag_of(section: str, name: str, key: Key) -> Any:
    """The flag of a key; None unless given, so that a default stays one."""
    import click

    if key.choices:
        choice = click.Choice(key.choices)
        return option(section, _flag(name), name, type=choice, help=key.help)
    if not key.metavar:
        return option(section, _flag(name), name, is_flag=True, default=None, help=key.help)
    return option(section, _flag(name), name, metavar=key.metavar, help=key.help)


def _flag(name: str) -> str:
    return _RENAMED.get(name, f"--{name.replace('_', '-')}")


_ACTING = {name: PLACE[name] for name in (*(n for n in PLACE if n != "origin"), "origin")}
_NAMES = (
    *WHOLE,
    *_ACTING,
    TOOL_NAME,
    *TOOL_KEYS,
    *(name for name, key in OPERATION.items() if key.help),
)
