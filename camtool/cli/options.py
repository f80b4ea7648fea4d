"""Help in sections: a command of many options shows them under headings."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any, TypeVar, cast

import click

from camtool.errors import OptionError
from camtool.jobs.keys import OPERATION, PLACE, TOOL_KEYS, TOOL_NAME, WHOLE, Given, Key, Table
from camtool.units import parse_feed, parse_length, parse_time

if TYPE_CHECKING:
    from camtool.comparison import Way
    from camtool.geometry.drawing import Drawing
    from camtool.machine.model import Machine
    from camtool.machine.registry import LoadedTarget
    from camtool.pipeline import Judging
    from camtool.planning.job import Job
    from camtool.simulation.motion import Effects
    from camtool.verification.report import Gates


GENERAL = "Options"


class SectionOption(click.Option):
    """An option that stands under the heading `section`."""

    def __init__(self, *args: Any, section: str = GENERAL, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.section = section


class SectionedCommand(click.Command):
    """A command that shows its options section by section, in the order of the first of each."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options into the help."""
        sections: dict[str, list[tuple[str, str]]] = {GENERAL: []}
        for param in self.get_params(ctx):
            record = param.get_help_record(ctx)
            if record is not None and isinstance(param, click.Option):
                sections.setdefault(getattr(param, "section", GENERAL), []).append(record)
        for heading, rows in sections.items():
            with formatter.section(heading):
                formatter.write_dl(rows)


def option(section: str, *names: str, **settings: Any) -> Callable[..., Any]:
    """`click.option` under a heading."""
    return click.option(*names, cls=SectionOption, section=section, **settings)


# Flags that belong together become one record: the machinery of the decorators in `options`.

Command = TypeVar("Command", bound=Callable[..., Any])
Option = Callable[..., Any]


def gather(
    record: str, make: Callable[..., Any], names: Sequence[str]
) -> Callable[[Command], Command]:
    """A wrapper that takes `names` out of a command's arguments and gives it one record."""

    def wrap(command: Command) -> Command:
        @functools.wraps(command)
        def called(**arguments: Any) -> Any:
            picked = {name: arguments.pop(name) for name in names}
            return command(**{record: make(**picked)}, **arguments)

        return cast("Command", called)

    return wrap


def decorate(command: Command, options: Sequence[Option]) -> Command:
    """The command with these options, shown in their order."""
    for option in reversed(options):
        command = option(command)
    return command


def with_flags(
    command: Command, record: str, make: type[Any], options: Sequence[Option]
) -> Command:
    """The command with these options, which reach it as `record`, a dataclass whose fields are
    named after them."""
    names = [field.name for field in fields(make)]
    return decorate(gather(record, make, names)(command), options)


# Command-line values: lengths, feeds and picture names are checked at this door.
#
# These are click callbacks: text in, float (mm, mm/min) or name out, a usage error otherwise.

PICTURES = (".svg", ".png", ".html")
PAGES = (".html", ".md", ".json")


def length(ctx: click.Context, param: click.Parameter, value: str | None) -> float | None:
    """`0.2mm`, `1/8in`, `200um` or a bare number (mm) as mm."""
    try:
        return None if value is None else parse_length(value)
    except OptionError as error:
        raise click.BadParameter(str(error), ctx, param) from error


def feed(ctx: click.Context, param: click.Parameter, value: str | None) -> float | None:
    """`0.8`, `0.8mm/min`, `0.01mm/s` as mm/min."""
    try:
        return None if value is None else parse_feed(value)
    except OptionError as error:
        raise click.BadParameter(str(error), ctx, param) from error


def duration(ctx: click.Context, param: click.Parameter, value: str | None) -> float | None:
    """`90min`, `1h`, `200ms` or a bare number (s) as s."""
    try:
        return None if value is None else parse_time(value)
    except OptionError as error:
        raise click.BadParameter(str(error), ctx, param) from error


def is_viewer(name: str) -> bool:
    """Whether a picture of this name is a page to pan, zoom and play."""
    return PurePath(name).suffix.lower() == ".html"


def picture_name(ctx: click.Context, param: click.Parameter, value: str | None) -> str | None:
    """The name of a picture that we can make."""
    if value is not None and PurePath(value).suffix.lower() not in PICTURES:
        raise click.BadParameter(f"{value!r} ends in none of .svg, .png and .html", ctx, param)
    return value


def page_name(ctx: click.Context, param: click.Parameter, value: str | None) -> str | None:
    """The name of a page that we can make; - is Markdown on stdout."""
    if value not in (None, "-") and PurePath(str(value)).suffix.lower() not in PAGES:
        raise click.BadParameter(f"{value!r} ends in none of {', '.join(PAGES)}", ctx, param)
    return value


# The flags that several commands share, and what they stand for.
#
# Each is a decorator that gives the command one record: `machine_options` (which machine) here,
# `job_options` (what is cut, and how) in `jobflags`, `drawing_options` (how a drawing is read) in
# `drawing`. A job file says the same as the job flags; flags override it.

_MACHINE = "Machine"
INTERPOLATORS = ("dsm", "dda", "stairs")


@dataclass(frozen=True)
class MachineFlags:
    """`--target`, `--machine`, `--set`."""

    target: str | None
    machine: str | None
    settings: tuple[str, ...]

    def load(self) -> LoadedTarget:
        """The target with the user's file and settings over it."""
        from camtool.machine.registry import load_target

        name = self.name()
        if name is None:
            raise click.UsageError("--target is missing; `camtool targets` lists the machines")
        file = Path(self.machine) if self.machine else None
        return load_target(name, machine_file=file, settings=self.settings)

    def files(self) -> list[str]:
        """The files that say what the machine is."""
        return [] if self.machine is None else [self.machine]

    def name(self) -> str | None:
        """The target's name: as given, or as the machine file says; None when nobody does."""
        if self.target is not None or self.machine is None:
            return self.target
        from camtool.machine.loader import extended_by

        return extended_by(Path(self.machine))


def machine_options(command: Command) -> Command:
    """Adds `machine: MachineFlags`."""
    return with_flags(
        command,
        "machine",
        MachineFlags,
        [
            option(
                _MACHINE,
                "--target",
                "-t",
                metavar="NAME",
                help="The machine; see camtool targets.",
            ),
            option(
                _MACHINE,
                "--machine",
                metavar="FILE",
                help="A TOML file that extends the target's machine.",
            ),
            option(
                _MACHINE,
                "--set",
                "settings",
                multiple=True,
                metavar="KEY=VALUE",
                help="Change one value of the machine, such as axes.x.backlash_mm=0.2.",
            ),
        ],
    )


def talk_options(command: Command) -> Command:
    """Adds `quiet: bool` and `verbose: bool`, and `--debug`, which main() looks for itself."""
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


# The flags that say how a program is judged: limits, parts of the mechanics, comparisons.

_LIMITS = "Limits (exit code 1 beyond them)"


@dataclass(frozen=True)
class GateFlags:
    """`--max-error` (mm), `--max-reversals`, `--max-time` (s)."""

    max_error: float | None
    max_reversals: int | None
    max_time: float | None

    @property
    def given(self) -> bool:
        """Whether there is any limit."""
        return (self.max_error, self.max_reversals, self.max_time) != (None, None, None)

    def gates(self) -> Gates | None:
        """The limits; None when there are none."""
        if not self.given:
            return None
        from camtool.verification.report import Gates

        return Gates(self.max_error, self.max_reversals, self.max_time)


def gate_options(command: Command) -> Command:
    """Adds `gates: GateFlags`."""
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
        ],
    )


def ways_to_compare(spec: str, machine: MachineFlags, judging: Judging) -> list[Way]:
    """What `--compare SPEC` stands for; OptionError when it is nothing."""
    from camtool.comparison import ways_of

    def load(more: Sequence[str]) -> LoadedTarget:
        return replace(machine, settings=(*machine.settings, *more)).load()

    return ways_of(spec, load, judging)


def left_out(names: Sequence[str]) -> Effects:
    """The mechanics without these effects; OptionError for others."""
    from camtool.comparison import left_out as without

    return without(names)


# The flags that say how a drawing is read, and which part of it.

FORMATS = ("dxf", "svg", "points", "solid")
_READ, _CHOSEN = "How the drawing is read", "Which part of it"
TEXTS = ("skip", "outline", "stroke")


@dataclass(frozen=True)
class DrawingFlags:
    """How a drawing is read: `given` are fields of ReadOptions, None where no flag says."""

    layers: tuple[str, ...]
    exclude_layers: tuple[str, ...]
    colours: tuple[str, ...]
    line_types: tuple[str, ...]
    given: dict[str, Any]

    def read(
        self,
        name: str,
        machine: Machine | None = None,
        job: Job | None = None,
        data: bytes | None = None,
    ) -> Drawing:
        """The drawing (`-` is stdin), of the layers that the job's operations take.

        `data` is the file's content where it has been read already. Tolerances that no flag
        gives are the machine's, or else the importer's; they are of the part, whose scale the
        job says. OptionError for a layer or colour of
        the job that the drawing has not, unless flags restrict it.
        """
        from camtool.importers.options import ReadOptions, Selection
        from camtool.importers.pieces import NoMatchError, colour_named
        from camtool.importers.read import content, read_bytes
        from camtool.jobs.drawing import layers_of, read_to_scale, refuse_unmatched, unmatched

        settings: dict[str, Any] = {}
        if machine is not None:
            settings["tolerance_mm"] = machine.defaults.fit_tolerance_mm
            settings["gap_mm"] = machine.defaults.gap_mm
        settings.update({key: value for key, value in self.given.items() if value is not None})
        settings["select"] = Selection(
            layers=self.layers or (() if job is None else layers_of(job)),
            exclude_layers=self.exclude_layers,
            colours=tuple(colour_named(colour) for colour in self.colours),
            line_types=self.line_types,
        )
        try:
            options = ReadOptions(**settings)
            data, file = content(Path(name)) if data is None else (data, name)
            drawing = read_to_scale(
                lambda scale: read_bytes(data, file, replace(options, scale=scale)), job
            )
        except NoMatchError as error:
            if job is None or error.pattern not in layers_of(job) or self.layers:
                raise
            raise unmatched(error, job) from error
        if job is not None and not (self.layers or self.exclude_layers or self.colours):
            refuse_unmatched(drawing, job)
        return drawing


def drawing_options(command: Command) -> Command:
    """Adds `drawing: DrawingFlags`."""
    names = (*_SELECTION_FLAGS, *_READ_FIELDS)
    wrapped = gather("drawing", _make_drawing, names)(command)
    return decorate(wrapped, [*_read_flags(), *_selection_flags()])


def _make_drawing(
    layer: tuple[str, ...],
    exclude_layer: tuple[str, ...],
    colour: tuple[str, ...],
    line_type: tuple[str, ...],
    **given: Any,
) -> DrawingFlags:
    return DrawingFlags(layer, exclude_layer, colour, line_type, given)


def _read_flags() -> list[Callable[..., Any]]:
    """How geometry is read."""
    tolerance, gap = (
        "How near arcs come to curves of the part.",
        "Ends nearer than this are joined.",
    )
    return [
        option(_READ, "--format", type=click.Choice(FORMATS), help="Do not guess it."),
        option(_READ, "--units", metavar="UNIT", help="Unit of the drawing: mm, in, um, px ..."),
        option(
            _READ,
            "--dpi",
            type=float,
            help="Pixels per inch of an SVG.  [96, or what its program took]",
        ),
        option(
            _READ, "--tolerance", "tolerance_mm", callback=length, metavar="LENGTH", help=tolerance
        ),
        option(_READ, "--gap", "gap_mm", callback=length, metavar="LENGTH", help=gap),
        _switch("--across-layers", "across_layers", "Join ends of different layers too."),
        _switch("--recognise-arcs", "recognise_arcs", "Chords on one circle become arcs again."),
        option(_READ, "--text", type=click.Choice(TEXTS), help="What to do with text.  [skip]"),
        _switch("--dimensions", "dimensions", "Read the lines of dimensions too."),
        option(_READ, "--layout", metavar="NAME", help="A layout of a DXF, not model space."),
        option(
            _READ,
            "--section-z",
            "section_z_mm",
            callback=length,
            metavar="HEIGHT",
            help="Cut a solid at this height.",
        ),
        _switch("--allow-scripts", "allow_scripts", "Run a build123d script, with your rights."),
    ]


def _selection_flags() -> list[Callable[..., Any]]:
    """What of it is read."""
    return [
        _patterns("--layer", "Only these layers (CUT, ENG*)."),
        _patterns("--exclude-layer", "Not these layers."),
        _patterns("--colour", "Only this colour (#ff0000, red, or 1 to 255)."),
        _patterns("--line-type", "Only these line types (DASHED, CENTER*)."),
    ]


def _switch(flag: str, name: str, text: str) -> Callable[..., Any]:
    """A flag that is None unless given, so that a default stays one."""
    return option(_READ, flag, name, is_flag=True, default=None, help=text)


def _patterns(flag: str, text: str) -> Callable[..., Any]:
    return option(_CHOSEN, flag, multiple=True, metavar="PATTERN", help=text)


_SELECTION_FLAGS = ("layer", "exclude_layer", "colour", "line_type")
_READ_FIELDS = (
    "format",
    "units",
    "dpi",
    "tolerance_mm",
    "gap_mm",
    "across_layers",
    "recognise_arcs",
    "text",
    "dimensions",
    "layout",
    "section_z_mm",
    "allow_scripts",
)


# The flags that say what a job file says: each key by its name with hyphens for underscores.

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
        from camtool.jobs.build import Said, build_job, read_job_file

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
            {
                name: Given(value, flag_name(name))
                for name, value in self.given.items()
                if name in keys
            }
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
        *(_key_flag(_JOB, name, key) for name, key in WHOLE.items()),
        *(_key_flag(_PLACE, name, key) for name, key in _ACTING.items()),
        tool,
        *(_key_flag(_TOOL, name, key) for name, key in TOOL_KEYS.items()),
        *(_key_flag(_CUT, name, key) for name, key in OPERATION.items() if key.help),
    ]


def _key_flag(section: str, name: str, key: Key) -> Any:
    """The flag of a key; None unless given, so that a default stays one."""
    import click

    if key.choices:
        choice = click.Choice(key.choices)
        return option(section, flag_name(name), name, type=choice, help=key.help)
    if not key.metavar:
        return option(section, flag_name(name), name, is_flag=True, default=None, help=key.help)
    return option(section, flag_name(name), name, metavar=key.metavar, help=key.help)


def flag_name(name: str) -> str:
    return _RENAMED.get(name, f"--{name.replace('_', '-')}")


_ACTING = {name: PLACE[name] for name in (*(n for n in PLACE if n != "origin"), "origin")}
_NAMES = (
    *WHOLE,
    *_ACTING,
    TOOL_NAME,
    *TOOL_KEYS,
    *(name for name, key in OPERATION.items() if key.help),
)
