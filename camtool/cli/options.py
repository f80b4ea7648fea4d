"""The flags that several commands share, each group of them as one record.

    machine_options   MachineFlags    which machine
    drawing_options   DrawingFlags    how a drawing is read, and which part of it
    job_options       JobFlags        what is cut, and how: every key of a job file
    gate_options      GateFlags       limits
    talk_options                      --quiet, --verbose, --debug

Each is a decorator that gives a command its flags and hands it the record. A job file says the
same as the flags of the job (`camtool.jobs.keys` has both); flags override it. The flags of
pictures are in `picture_options`.
"""

from __future__ import annotations

import functools
import math
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeVar, cast

import click
from msgspec import Struct, field
from msgspec.structs import astuple

from camtool.cli.files import STDOUT
from camtool.cli.life_signs import progress
from camtool.errors import DrawingError, MachineError, OptionError
from camtool.importers.formats import NoDrawingError, find_format
from camtool.importers.options import Flag, ReadOptions, Selection, flags_of, options_of
from camtool.importers.read import content, file_bytes, read_bytes
from camtool.jobs.build import JobTables, build_job, read_job_file, tables_of_flags
from camtool.jobs.keys import FLAGS, flag_name
from camtool.jobs.tools import Shop
from camtool.keys import Given, Key, engagement_angle
from camtool.project import project_of
from camtool.records import replace
from camtool.tables import read_table
from camtool.units import parse_feed, parse_length, parse_time

if TYPE_CHECKING:
    from camtool.geometry.drawing import Drawing
    from camtool.machine.model import Machine
    from camtool.planning.job import Job
    from camtool.project import Project
    from camtool.run import Run
    from camtool.tables import Table
    from camtool.target.registry import LoadedTarget
    from camtool.verification.report import Gates


# Help in sections.

Command = TypeVar("Command", bound=Callable[..., Any])
Option = Callable[..., Any]

GENERAL = "Options"


class SectionOption(click.Option):
    """An option that stands under the heading `section`."""

    def __init__(self, *args: Any, section: str = GENERAL, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.section = section


class SectionedCommand(click.Command):
    """A command whose help shows the options by section, in the order of the first of each. An
    option with a value is given once, unless it collects several."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the arguments; a usage error for an option that is given twice, since click would
        silently keep the last one."""
        order = self.make_parser(ctx).parse_args(list(args))[2]
        for param, count in Counter(order).items():
            several = param.multiple or not isinstance(param, click.Option) or param.is_flag
            if count > 1 and not several and not ctx.resilient_parsing:
                reason = f"{max(param.opts, key=len)} is given {count} times, but takes one value"
                raise click.UsageError(reason, ctx)
        return super().parse_args(ctx, args)

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options into the help text, section by section."""
        sections: dict[str, list[tuple[str, str]]] = {GENERAL: []}
        for param in self.get_params(ctx):
            record = param.get_help_record(ctx)
            if record is not None and isinstance(param, click.Option):
                sections.setdefault(getattr(param, "section", GENERAL), []).append(record)
        for heading, rows in sections.items():
            with formatter.section(heading):
                formatter.write_dl(rows)


def option(section: str, *names: str, **settings: Any) -> Option:
    """Return a `click.option` that the help shows under the heading `section`."""
    return click.option(*names, cls=SectionOption, section=section, **settings)


# Groups of flags as records.

_GROUPS = "gathered_groups"
"""Attribute of a wrapped command: the records that it is called with, and their flags."""


def gather(
    record: str, make: Callable[..., Any], names: Sequence[str]
) -> Callable[[Command], Command]:
    """Return a decorator that replaces the arguments `names` of a command by one argument
    `record`, made of them by `make`.

    The records of a command that is wrapped several times are made in one call.
    """

    def wrap(command: Command) -> Command:
        groups = {**getattr(command, _GROUPS, {}), record: (make, names)}
        body = getattr(command, "__wrapped__", command) if len(groups) > 1 else command

        @functools.wraps(body)
        def renamed(**arguments: Any) -> Any:
            for each, (record_of, flags) in reversed(groups.items()):
                arguments[each] = record_of(**{flag: arguments.pop(flag) for flag in flags})
            return body(**arguments)

        vars(renamed).update(vars(command))
        setattr(renamed, _GROUPS, groups)
        return cast("Command", renamed)

    return wrap


def decorate(command: Command, options: Sequence[Option]) -> Command:
    """Return the command with these options, in their order."""
    for option in reversed(options):
        command = option(command)
    return command


def with_flags(
    command: Command, record: str, make: type[Any], options: Sequence[Option]
) -> Command:
    """Return the command with these options, which are passed to it as one argument `record`: a
    struct whose fields have the names of the options."""
    names = make.__struct_fields__
    return decorate(gather(record, make, names)(command), options)


# Values of flags, as callbacks of click: text in, a number out, a usage error otherwise.


def engagement_limit(text: str) -> float:
    """Read a limit of engagement, rad; OptionError unless it is above 0 and at most π."""
    angle_rad = engagement_angle(text)
    if not 0.0 < angle_rad <= math.pi:
        raise OptionError(
            f"an engagement of {math.degrees(angle_rad):.3g}° is not above 0° and up to 180°",
            mend='give a part of the diameter such as "15%", or an angle such as "60deg"',
        )
    return angle_rad


def _number_by(parse: Callable[[str], float]) -> Callable[..., float | None]:
    def value(ctx: click.Context, param: click.Parameter, text: str | None) -> float | None:
        try:
            return None if text is None else parse(text)
        except OptionError as error:
            raise click.BadParameter(str(error), ctx, param) from error

    return value


length = _number_by(parse_length)
"""`0.2mm`, `1/8in`, `200um` or a bare number (mm) as mm."""

feed = _number_by(parse_feed)
"""`0.8`, `0.8mm/min`, `0.01mm/s` as mm/min."""

duration = _number_by(parse_time)
"""`90min`, `1h`, `200ms` or a bare number (s) as s."""


_engagement = _number_by(engagement_limit)
"""`15%` or `0.15` of the diameter, or `60deg`, as rad."""


# The machine.

_MACHINE = "Machine"


class MachineFlags(Struct, frozen=True):
    """The values of `--target`, `--machine` (a file) and `--set`. `by_default`: a `camtool.toml`
    names the machine, and no flag does."""

    target: str | None
    machine: str | None
    settings: tuple[str, ...]
    by_default: bool = False

    @classmethod
    def of(
        cls, target: str | None, machine: str | None, settings: tuple[str, ...]
    ) -> MachineFlags:
        """Return the flags with names resolved: the name of a machine is replaced by its file, and
        so is the name of a target if the user has a machine of that name. Without either flag the
        default of the project applies, else that of the user."""
        from camtool.target.registry import target_names

        project = project_of(Path.cwd())
        if machine is not None:
            return cls(target, str(project.machine_named(machine)), settings)
        if target is None:
            file = project.machine
            by_default = file is not None or project.target is not None
            return cls(project.target, None if file is None else str(file), settings, by_default)
        file = project.find(target)
        if file is not None and target not in target_names():
            return cls(None, str(file), settings)
        return cls(target, None, settings)

    def load(self) -> LoadedTarget:
        """Load the target with the user's machine file and `--set` over its values."""
        from camtool.target.registry import load_target

        name = self.name()
        if name is None:
            raise click.UsageError(
                "--target is missing; `camtool targets` lists the machines, `camtool init` makes "
                "yours the default"
            )
        file = Path(self.machine) if self.machine else None
        return load_target(name, machine_file=file, settings=self.settings)

    def files(self) -> list[str]:
        """Return the user's machine file in a list, [] without one."""
        return [] if self.machine is None else [self.machine]

    def name(self) -> str | None:
        """Return the target's name, as given or by the machine file; None without either."""
        if self.target is not None or self.machine is None:
            return self.target
        from camtool.target.loader import extended_by

        return extended_by(Path(self.machine))


def machine_options(command: Command) -> Command:
    """Give a command the flags of the machine; it gets them as `machine: MachineFlags`."""
    options = [
        option(
            _MACHINE, "--target", "-t", metavar="NAME", help="The machine; see camtool targets."
        ),
        option(
            _MACHINE,
            "--machine",
            metavar="NAME",
            help="Your own machine, by its name or its TOML file; see camtool init.",
        ),
        option(
            _MACHINE,
            "--set",
            "settings",
            multiple=True,
            metavar="KEY=VALUE",
            help="Change one value of the machine, such as axes.x.backlash_mm=0.2.",
        ),
    ]
    names = ["target", "machine", "settings"]
    return decorate(gather("machine", MachineFlags.of, names)(command), options)


def talk_options(command: Command) -> Command:
    """Add `quiet: bool` and `verbose: bool`, and `--debug`, which main() reads itself."""
    return decorate(
        command,
        [
            click.option("-q", "--quiet", is_flag=True, help="Only errors."),
            click.option("-v", "--verbose", is_flag=True, help="Remarks too."),
            click.option(
                "--debug", is_flag=True, expose_value=False, help="Traceback on an error."
            ),
        ],
    )


# Limits.

_LIMITS = "Limits (exit code 1 beyond them)"


class GateFlags(Struct, frozen=True):
    """`--max-error` (mm), `--max-reversals`, `--max-time` (s), `--max-gouge` and `--max-leftover`
    (mm), `--max-engagement` (rad)."""

    max_error: float | None
    max_reversals: int | None
    max_time: float | None
    max_gouge: float | None = None
    max_leftover: float | None = None
    max_engagement: float | None = None

    @property
    def given(self) -> bool:
        """True if there is any limit."""
        return any(value is not None for value in astuple(self))

    def gates(self) -> Gates | None:
        """Return the limits; None if there are none."""
        if not self.given:
            return None
        from camtool.verification.report import Gates

        return Gates(*astuple(self))


def gate_options(command: Command) -> Command:
    """Give a command the flags that limit what a report may say (error, time …); beyond one the
    command fails. It gets them as `gates: GateFlags`."""
    return with_flags(
        command,
        "gates",
        GateFlags,
        [
            option(
                _LIMITS,
                "--max-error",
                callback=length,
                metavar="LENGTH",
                help="Largest predicted error, such as 20um.",
            ),
            option(
                _LIMITS,
                "--max-reversals",
                type=click.IntRange(min=0),
                metavar="COUNT",
                help="Reversals of X and Y while cutting.",
            ),
            option(
                _LIMITS,
                "--max-time",
                callback=duration,
                metavar="TIME",
                help="Time of the whole program, such as 90min or 1h.",
            ),
            option(
                _LIMITS,
                "--max-gouge",
                callback=length,
                metavar="LENGTH",
                help="Largest proved gouge of the part, in depth.",
            ),
            option(
                _LIMITS,
                "--max-leftover",
                callback=length,
                metavar="LENGTH",
                help="Largest proved height of material that is left.",
            ),
            option(
                _LIMITS,
                "--max-engagement",
                callback=_engagement,
                metavar="PART|ANGLE",
                help="Largest proved engagement of a tool outside of entries, such as 15% or "
                "60deg.",
            ),
        ],
    )


# Dimensions that must hold.


class InspectionFlags(Struct, frozen=True):
    """`--tolerances` and `--require`."""

    tolerances: str | None = None
    require: Literal["in", "not-out"] | None = None

    def check(self, *, without: str | None) -> None:
        """Raise a usage error for `--require` without `--tolerances`, and for both beside a flag
        (`without`) that leaves nothing to inspect."""
        if self.require is not None and self.tolerances is None:
            raise click.UsageError("--require needs --tolerances")
        if self.tolerances is not None and without is not None:
            raise click.UsageError(f"{without} leaves nothing to inspect; drop --tolerances")

    def files(self) -> list[str]:
        """Return the file of tolerances in a list, [] without one."""
        return [] if self.tolerances in (None, DRAWING) else [str(self.tolerances)]

    def inspect_run(self, run: Run) -> Run:
        """Return the run with a verdict on each of its dimensions."""
        if self.tolerances is None or run.drawing is None:
            return run
        from camtool.inspection.tolerances import dimensions_of
        from camtool.inspection.verdicts import Tolerances, inspect

        progress().begin("inspecting dimensions")
        file = None if self.tolerances == DRAWING else Path(self.tolerances)
        dimensions, findings = dimensions_of(run.drawing, file)
        return inspect(run, Tolerances(dimensions, findings, self.require))


DRAWING = "drawing"
"""`--tolerances drawing` is for the dimensions of the drawing alone."""


def inspection_options(command: Command) -> Command:
    """Give a command the flags of tolerances and uncertainty; it gets them as
    `inspection: InspectionFlags`."""
    return with_flags(
        command,
        "inspection",
        InspectionFlags,
        [
            option(
                _LIMITS,
                "--tolerances",
                metavar="FILE",
                help="Dimensions with limits, and whether they will hold: a tolerances.toml with "
                "those of the drawing, or 'drawing' for these alone.",
            ),
            option(
                _LIMITS,
                "--require",
                type=click.Choice(["in", "not-out"]),
                help="What every dimension with limits must be.",
            ),
        ],
    )


# How a drawing is read, and which part of it.

_READ, _CHOSEN = "How the drawing is read", "Which part of it"

_OF_READING = "read_"
"""Prefix of the names of these parameters, since flags of pictures have `layers` too."""


class DrawingFlags(Struct, frozen=True):
    """Flags of reading drawings: patterns that select what is read (`--layer` to `--line-type`),
    and fields of ReadOptions, None for flags that are not given."""

    given: Mapping[str, Any] = field(default_factory=dict)

    @property
    def layers(self) -> tuple[str, ...]:
        """The patterns of `--layer`."""
        return tuple(self.given.get("layers", ()))

    @property
    def format(self) -> str | None:
        """The format that `--format` names."""
        return self.given.get("format")

    def read(
        self,
        name: str,
        machine: Machine | None = None,
        job: Job | None = None,
        data: bytes | None = None,
    ) -> Drawing:
        """Read the drawing (`-` is stdin), restricted to the layers of the job's operations.

        `data` is the content of the file if it has been read already. OptionError for a layer or
        colour of the job that the drawing does not have, unless flags select layers.
        """
        from camtool.jobs.drawing import read_for_job

        job_options = {"text": job.text} if job is not None and job.text else {}
        options = options_of({**job_options, **self.given}, machine)
        progress().begin(f"reading {Path(name).name}")
        data, file = content(Path(name)) if data is None else (data, name)
        if job is None:
            return read_bytes(data, file, options)
        return read_for_job(functools.partial(read_bytes, data, file), options, job)

    def is_program(self, name: str, target: LoadedTarget) -> bool:
        """Return True if the file has the extension of the target's programs, or a content that is
        no drawing. Stdin, and a file for which `--format` is given, count as drawings."""
        suffix = Path(name).suffix
        if suffix.lower() == target.machine.target.extension:
            return True
        if name == STDOUT or self.format is not None:
            return False
        data = file_bytes(Path(name))
        try:
            find_format(data, suffix, name)
        except NoDrawingError:
            return True
        except DrawingError:  # a drawing with something wrong: its reader says what
            return False
        return False


def drawing_options(command: Command) -> Command:
    """Give a command the flags of reading a drawing; it gets them as `drawing: DrawingFlags`."""

    def options_type(**values: Any) -> DrawingFlags:
        named = ((name.removeprefix(_OF_READING), value) for name, value in values.items())
        return DrawingFlags({name: value for name, value in named if value not in (None, ())})

    rows = [
        (section, *row)
        for section, record in ((_READ, ReadOptions), (_CHOSEN, Selection))
        for row in flags_of(record)
    ]
    options = [_read_flag(section, name, flag, kind) for section, name, flag, kind in rows]
    return decorate(
        gather("drawing", options_type, [_OF_READING + row[1] for row in rows])(command), options
    )


def _read_flag(section: str, name: str, flag: Flag, kind: Any) -> Option:
    """Return the flag for one option of reading drawings; its value is None unless given, so that
    the defaults of ReadOptions apply."""
    settings: dict[str, Any] = {"metavar": flag.metavar}
    if kind is bool:
        settings = {"is_flag": True, "default": None}
    elif flag.choices:
        settings = {"type": click.Choice(flag.choices)}
    elif section == _CHOSEN:
        settings["multiple"] = True
    elif name.endswith("_mm"):
        settings["callback"] = length
    elif kind in (float, float | None):
        settings["type"] = float
    return option(section, flag.name, _OF_READING + name, help=flag.help, **settings)


# The job: each key of a job file by its name with hyphens for underscores.


ReadJob = Callable[["Table"], "Job"]
"""The function that makes a job of the tables of its file."""


class JobFlags(Struct, frozen=True, dict=True):
    """The values of `--job`, `--operation` and `--setup`, and in `given` those of the flags for
    keys of the job, as far as given. `project`: the defaults of the project."""

    file: str | None = None
    operations: tuple[str, ...] = ()
    given: Mapping[str, Any] = field(default_factory=dict)
    project: Project | None = None
    setup: str | None = None

    @property
    def is_given(self) -> bool:
        """True if a flag sets anything of the job."""
        own_file = (
            None if self.project is None or self.project.job is None else str(self.project.job)
        )
        has_operation = self.operations or self.setup is not None
        return bool(has_operation or self.given) or self.file not in (None, own_file)

    def job(self, drawing: DrawingFlags) -> Job:
        """Return the job of the file with the given flags over it.

        `--layer` restricts the reading of the drawing; the operation of a job with only one takes
        just these layers.
        """
        file = JobTables()
        if self.file is not None:
            file = read_job_file(Path(self.file), self._piped_content)
        job = build_job(
            file, tables_of_flags(self.given), self.operations, self._tools_and_defaults()
        )
        if drawing.layers and len(job.operations) == 1:
            job = replace(job, operations=(replace(job.operations[0], layers=drawing.layers),))
        return job if self.setup is None else job.setup(self.setup)

    def as_file(self, drawing: DrawingFlags, place: Path) -> tuple[Job, Table, ReadJob]:
        """Return the job, the tables of one job file at `place` that says the same, and a function
        that reads a job from such tables.

        If the job has one operation, `--layer` becomes a key of it. A usage error for
        `--operation` and `--setup`, which leave out a part of the job.
        """
        from camtool.jobs.changes import job_of_tables, merged_tables

        if self.operations or self.setup is not None:
            flag = "--operation" if self.operations else "--setup"
            raise click.UsageError(f"{flag} leaves a part of the job; this needs all of it")
        job_used = self.job(drawing)
        file = (
            JobTables()
            if self.file is None
            else read_job_file(Path(self.file), self._piped_content)
        )
        tables = merged_tables(file, tables_of_flags(self.given), place.parent)
        if drawing.layers and len(job_used.operations) == 1:
            tables["operations"][0]["layers"] = list(drawing.layers)
        read = functools.partial(job_of_tables, place=place, shop=self._tools_and_defaults())
        assert read(tables) == job_used, "a job is not what its file says"
        return job_used, tables, read

    def _tools_and_defaults(self) -> Shop:
        """Return the tool libraries, and the default tool and material, of the project and the
        user."""
        if self.project is None:
            return Shop()
        defaults = {key: self.project.value_of(key) for key in ("tool", "material")}
        shop_values = {
            key: None if each is None else Given(each[0], f"key {key}", str(each[1]))
            for key, each in defaults.items()
        }
        return Shop(self.project.libraries, **shop_values)

    def beyond(self, names: Collection[str]) -> list[str]:
        """Return the given flags of the job (`--job` included) that are not the flags of the keys
        `names`, for commands that take only these."""
        flags = [flag_name(name) for name in self.given if name not in names]
        return [*(["--job"] if self.file is not None else []), *flags]

    def files(self) -> list[str]:
        """Return all files that the job is read from: its job file, tool libraries and
        tool table."""
        named = (self.file, self._named_file("tool_library"), self._named_file("tool_table"))
        libraries = () if self.project is None else self.project.libraries
        return [*(file for file in named if file is not None), *map(str, libraries)]

    def _named_file(self, key: str) -> str | None:
        """Return the path that a flag or a key of the job file names. None if neither does, and if
        the job file cannot be read, which `job` reports."""
        if self.file is None or key in self.given:
            return self.given.get(key)

        try:
            name = read_table(Path(self.file), self._piped_content).get(key)
        except MachineError:
            return None
        return str(Path(self.file).parent / name) if isinstance(name, str) else None

    @cached_property
    def _piped_content(self) -> bytes | None:
        """Return the content of a job file that can be read only once, such as `<(...)`; None for
        others."""
        file = Path(str(self.file))
        is_readable = not file.exists() or file.is_file() or file.is_dir()
        return None if is_readable else file.read_bytes()

    @contextmanager
    def name_job_file(self) -> Iterator[None]:
        """Add the name of the job file to errors of planning that name an operation."""
        try:
            yield
        except OptionError as error:
            if not error.file and str(error.where).startswith("operation"):
                error.file = self.file
            raise


OWN_JOB = ".toml"
"""`part.toml` beside `part.dxf` is its job."""


def own_job(drawing: Path) -> Path | None:
    """Return the job file beside a drawing, None if there is none."""
    if not drawing.name:  # the folder ., which is an error later
        return None
    job_file = drawing.with_suffix(OWN_JOB)
    return job_file if job_file.is_file() else None


OWN_TOLERANCES = ".tolerances.toml"
"""`part.tolerances.toml` beside `part.dxf` has its dimensions."""


def own_tolerances(drawing: Path) -> Path | None:
    """Return the file of tolerances beside a drawing, None if there is none."""
    tolerances_file = drawing.parent / f"{drawing.stem}{OWN_TOLERANCES}"
    return tolerances_file if tolerances_file.is_file() else None


def job_options(command: Command) -> Command:
    """Give a command the flags of the job; it gets them as `job: JobFlags`."""

    def make_flags(
        job: str | None, operation: tuple[str, ...], setup: str | None, **keys: Any
    ) -> JobFlags:
        given_keys = {name: value for name, value in keys.items() if value is not None}
        project = project_of(Path.cwd())
        default = project.job if job is None else None
        file = job if default is None else str(default)
        return JobFlags(file, operation, given_keys, project, setup)

    names = ["job", "operation", "setup", *(name for keys in FLAGS.values() for name in keys)]
    of_job = next(iter(FLAGS))
    options = [
        option(of_job, "--job", metavar="FILE", help="A TOML file with values for these flags."),
        option(
            of_job,
            "--operation",
            multiple=True,
            metavar="NAME",
            help="Only this operation of the file, by name or number.",
        ),
        option(of_job, "--setup", metavar="NAME", help="Only this set-up of the file."),
        *(
            _key_flag(head, name, key)
            for head, keys in FLAGS.items()
            for name, key in keys.items()
        ),
    ]
    return decorate(gather("job", make_flags, names)(command), options)


MAX_CHOICES_SHOWN = 100
"""Characters of the choices of a flag, up to which they stand in its own column of the help, which
click never breaks; longer ones stand in its sentence."""


def _key_flag(section: str, name: str, key: Key) -> Option:
    """Return the flag of a key of job files; its value is None unless given, so that defaults
    apply."""
    settings: dict[str, Any] = {"is_flag": True, "default": None}
    text = key.help
    if key.value.choices:
        settings = {"type": click.Choice(key.value.choices)}
        if len("|".join(key.value.choices)) > MAX_CHOICES_SHOWN:
            settings["metavar"] = name.upper()
            text += f" One of {', '.join(key.value.choices)}."
    elif key.value.metavar:
        settings = {"metavar": key.value.metavar}
    return option(section, flag_name(name), name, help=text, **settings)
