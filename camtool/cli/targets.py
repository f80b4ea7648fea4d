"""`camtool targets`: the machines it knows, and everything about one."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from camtool.cli.files import STDOUT, check_new, check_places, read_bytes, write_all
from camtool.cli.messages import in_colour, say, show_text
from camtool.cli.options import MachineFlags, SectionedCommand, talk_options
from camtool.errors import CamtoolError, OptionError, ProgramError
from camtool.plain import one_line, to_json
from camtool.project import project_of
from camtool.tables import parse_table
from camtool.target.contract import ControllerSetting
from camtool.target.loader import extended_by
from camtool.target.registry import each_target, find_target, list_target, loaded_target, own_names
from camtool.target.template import machine_template

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

    from camtool.machine.model import Machine, PlayCells
    from camtool.target.contract import OpenKey, SampledDialect
    from camtool.target.registry import LoadedTarget


class _Targets(click.Group):
    """`new` is a command; every other word is the name of a target to show."""

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return the command of this name, or for any other word the command that shows the
        target."""
        return super().get_command(ctx, cmd_name) or show

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Return the commands and targets that complete the word."""
        return [*super().shell_complete(ctx, incomplete), *target_items(incomplete)]


@click.group(
    cls=_Targets,
    short_help="The machines, and everything about one.",
    invoke_without_command=True,
    subcommand_metavar="[NAME | new NAME] [OPTIONS]",
)
@click.option("--json", "as_json", is_flag=True, help="As JSON on stdout.")
@talk_options
@click.pass_context
def targets(context: click.Context, as_json: bool, quiet: bool, verbose: bool) -> None:
    """List the machines, show everything about the one called NAME, or begin a machine file;
    camtool init makes one that has its numbers.

    \b
    camtool targets                             all machines, yours too
    camtool targets grbl                        everything about one
    camtool targets new my-mill --extends grbl  my-mill.toml, to fill in
    camtool targets new my-mill --from-program part.nc"""
    if context.invoked_subcommand is None:
        _list(as_json)


@click.command(cls=SectionedCommand, short_help="Everything about one machine.")
@click.option("--machine", metavar="NAME", help="Your own machine, by its name or TOML file.")
@click.option("--set", "settings", multiple=True, metavar="KEY=VALUE", help="Change one value.")
@click.option("--json", "as_json", is_flag=True, help="As JSON on stdout.")
@talk_options
@click.pass_context
def show(
    context: click.Context,
    machine: str | None,
    settings: tuple[str, ...],
    as_json: bool,
    quiet: bool,
    verbose: bool,
) -> None:
    """Show everything about one machine."""
    _show(str(context.info_name), machine, settings, as_json)


@targets.command(cls=SectionedCommand, short_help="Begin a machine file.")
@click.argument("name")
@click.option("--extends", metavar="TARGET", help="The machine that it is like.")
@click.option(
    "--from-program", metavar="FILE", help="A program of its controller, which shows its dialect."
)
@click.option(
    "--ask/--no-ask", default=None, help="Ask what is not known.  [default: at a terminal]"
)
@click.option("--set", "values", multiple=True, metavar="KEY=VALUE", help="Say one value.")
@click.option("-o", "--output", metavar="FILE", help="The file; - is stdout.  [NAME.toml]")
@talk_options
def new(
    name: str,
    extends: str | None,
    from_program: str | None,
    ask: bool | None,
    values: tuple[str, ...],
    output: str | None,
    quiet: bool,
    verbose: bool,
) -> None:
    """Write a machine file for NAME that extends TARGET, with every value as a comment.

    With --from-program, what a program of the controller shows of its dialect of G-code stands in
    it, and what it leaves open is asked; --extends alone asks for the dialect where TARGET is one
    whose dialect a file describes."""
    data = b"" if from_program is None else read_bytes(from_program) or b"\n"
    if extends is None:
        if from_program is None:
            raise click.UsageError("--extends or --from-program is missing: what is it like?")
        extends = _described_by_files()
    base = list_target(extends)
    asks = (sys.stdin.isatty() and output != STDOUT) if ask is None else ask
    wants_dialect = from_program is not None or ask is True
    try:
        dialect = find_target(extends)[0].dialect_from(data) if wants_dialect or asks else None
    except ProgramError as error:
        error.file = error.file or from_program
        raise
    if dialect is None and wants_dialect:
        raise OptionError(
            f"the dialect of {extends} is not described by a file",
            where="--from-program" if from_program else "--ask",
            mend=f"use --extends {_described_by_files()}, or leave it out",
        )
    said_keys = [setting_of(text) for text in values]
    settings = [] if dialect is None else _dialect_settings(dialect, asks=asks)
    keys = {each.key for each in said_keys}
    settings = [*(each for each in settings if each.key not in keys), *said_keys]
    output = output or f"{name}.toml"
    file = f"{name}.toml" if output == STDOUT else one_line(output)
    text = machine_template(name, extends, base.text, base.needs, settings, file)
    check_places([str(base.file), *([from_program] if from_program else [])], [output])
    check_new(output)
    remark = "take the # away from what differs"
    if from_program is not None:
        remark = _read_back(text, f"{name}.toml", extends, data, from_program)
    elif settings:
        loaded_machine(text, f"{name}.toml", extends)
    write_all({output: text.encode()})
    place = "stdout" if output == STDOUT else output
    say(f"written: {place}; {remark}", quiet=quiet)


def _described_by_files() -> str:
    """Return the name of the target whose dialect machine files describe."""
    found_targets = each_target(find_target, names=own_names())
    return next(name for name, (each, _) in found_targets if each.dialect_from(b"") is not None)


def _dialect_settings(dialect: SampledDialect, *, asks: bool) -> list[ControllerSetting]:
    """Return the settings that a program reveals of its dialect, and the answers to the open
    questions; questions that nobody answers get their default and a comment."""
    settings = list(dialect.settings)
    for each in dialect.questions:
        answer: Any = each.default
        if asks:
            answer = _answer_to(each)
        value = [answer] if each.is_list else answer
        doubt = "" if asks else f"{each.question}?"
        settings.append(ControllerSetting(each.key, value, "asked" if asks else "ours", "", doubt))
    return settings


def _answer_to(open_key: OpenKey) -> Any:
    """Ask the user for the value of an open setting and return it; an empty text is offered as
    "none"."""
    if not open_key.choices:
        return click.prompt(
            open_key.question, default=open_key.default, type=type(open_key.default), err=True
        )
    names = {each or "none": each for each in open_key.choices}
    default = open_key.default or "none"
    kind = click.Choice(tuple(names))
    return names[str(click.prompt(open_key.question, default=default, type=kind, err=True))]


def setting_of(text: str) -> ControllerSetting:
    """Parse a `KEY=VALUE` flag; the value is TOML or a bare word."""
    key, equals, value = text.partition("=")
    if not equals or "." not in key:
        raise OptionError(
            f"{text!r} is no setting", where="--set", mend="such as --set dialect.words.decimals=4"
        )
    try:
        parsed = parse_table(f"v = {value.strip()}")["v"]
    except ValueError:
        parsed = value.strip()
    return ControllerSetting(key.strip(), parsed, "--set")


def loaded_machine(text: str, file: str, extends: str) -> LoadedTarget:
    """Return the target with a machine file of this text; MachineError if the file contradicts
    itself."""
    return loaded_target(extends, (parse_table(text), file))


def _read_back(text: str, file: str, extends: str, data: bytes, program: str) -> str:
    """Return a sentence on how the new machine reads the program from which its file was made."""
    try:
        loaded = loaded_machine(text, file, extends)
        path = loaded.target.read(data, loaded.machine)
    except CamtoolError as error:
        return f"{program} is not read yet: {error}"
    moves, arcs = int(path.is_motion.sum()), int(path.is_arc.sum())
    return f"{program} is read with it: {moves} moves, {arcs} of them arcs"


GRADES: dict[str, str] = {
    "step-true": "each step of its controller is computed",
    "timed": "its speeds and corners are computed, not its steps",
    "path only": "its programs are written, read and judged; its controller follows them exactly",
}
"""The grades of models of controllers, with explanations, in the order of the list."""


def target_items(incomplete: str) -> Iterator[CompletionItem]:
    """Yield the names of targets and machines for completion, each with its title as help."""
    from click.shell_completion import CompletionItem

    for name, listed in each_target(list_target, prefix=incomplete):
        yield CompletionItem(name, help=listed.target.title)
    for row in _own_machines([]):
        if row["name"].startswith(incomplete):
            yield CompletionItem(row["name"], help=f"yours, on {row['extends']}")


def _list(as_json: bool) -> None:
    rows: list[dict[str, Any]] = []
    broken: list[CamtoolError] = []
    for name, listed in each_target(list_target, broken=broken):
        target = listed.target
        row = {"name": name, "title": target.title, "extension": target.extension}
        row |= {"grade": listed.grade, "rests_on": target.rests_on}
        rows.append({**row, "needs": list(listed.needs)})
    rows.sort(key=lambda row: list(GRADES).index(row["grade"]))
    machines = list(_own_machines(broken))
    for error in broken:
        say(f"camtool: warning: {error}")
    if as_json:
        write_all({STDOUT: to_json({"targets": rows, "machines": machines}).encode()})
        return
    if in_colour(sys.stdout):
        _table(rows, machines)
        return
    width = max((len(row["name"]) for row in [*rows, *machines]), default=0)
    grade = ""
    for row in rows:
        if row["grade"] != grade:
            grade = row["grade"]
            show_text(f"# {grade}: {GRADES[grade]}")
        needs = f" (needs --machine FILE: {', '.join(row['needs'])})" if row["needs"] else ""
        show_text(
            one_line(f"{row['name']:<{width}}  {row['extension']:<6}  {row['title']}{needs}")
        )
        if row["rests_on"]:
            show_text(one_line(f"{'':<{width}}  {'':<6}  by {row['rests_on']}"))
    if machines:
        show_text("# yours")
    for row in machines:
        default = ", the default" if row["default"] else ""
        show_text(
            one_line(f"{row['name']:<{width}}  yours{default}, on {row['extends']}: {row['file']}")
        )


def _own_machines(broken: list[CamtoolError]) -> Iterator[dict[str, Any]]:
    """Yield the user's machines as rows of the list; errors are appended to `broken`."""
    try:
        project = project_of(Path.cwd())
        default = project.machine
    except CamtoolError as error:
        broken.append(error)
        return
    for name, file in project.machines():
        row = {"name": name, "extends": extended_by(file), "file": str(file)}
        yield {**row, "default": file == default}


def _table(rows: list[dict[str, Any]], machines: list[dict[str, Any]]) -> None:
    """Format the list as a table, for terminals."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, pad_edge=False)
    for heading in ("target", "file", "machine", "model", "by", "needs --machine FILE with"):
        table.add_column(heading)
    for row in rows:
        # Titles and keys come from files: they are text, no markup.
        name, cells = Text(row["name"], style="bold"), (row["extension"], one_line(row["title"]))
        model_cells = (row["grade"], one_line(row["rests_on"]), ", ".join(row["needs"]))
        table.add_row(name, *map(Text, (*cells, *model_cells)))
    for row in machines:
        name, default = Text(row["name"], style="bold"), ", the default" if row["default"] else ""
        table.add_row(
            name, "", Text(one_line(f"yours{default}, on {row['extends']}: {row['file']}"))
        )
    Console().print(table)


def _show(name: str, machine: str | None, settings: tuple[str, ...], as_json: bool) -> None:
    target = MachineFlags.of(name, machine, settings).load()
    values = target.values()
    if as_json:
        write_all({STDOUT: to_json(values).encode()})
        return
    for key, value in flat_lines("", values):
        show_text(f"{key} = {to_json(value, indent=0)}".rstrip("\n"))
    for name, cells in (("x", target.machine.play_map.x), ("y", target.machine.play_map.y)):
        if cells is not None:
            show_text("\n" + "\n".join(_backlash_table(name, cells, target.machine)), err=True)
    unknown = [key for key, value in flat_lines("", values["uncertainty"]) if value is None]
    if unknown:
        show_text(f"\nuncertainties that are not known: {', '.join(unknown)}", err=True)
    for code in target.target.codes:
        grave = " or ".join(severity.name.lower() for severity in code.severities)
        show_text(f"\n{code.name} ({grave}): {code.means}; to fix it: {code.mend}", err=True)
    show_text(
        f"\nhighest feed {_speed(target.machine.max_feed_mm_min)}, "
        f"rapids {_speed(target.machine.rapid_mm_min)}; "
        "every number's source is in the target's own file:",
        err=True,
    )
    say(f"{target.file}")


def _backlash_table(name: str, cells: PlayCells, machine: Machine) -> Iterator[str]:
    """Yield the lines of a table of backlash by region, laid out like the machine's table: +X to
    the right, +Y up."""
    mean_um = getattr(machine.axes, name).backlash_mm * 1000.0
    instead = "" if machine.play_map.use else f", not used: play_map.use; {mean_um:g} everywhere"
    yield f"backlash of {name.upper()} by region of the table, µm{instead}"
    rows = [("y \\ x mm", *_spans(cells.x_mm))]
    for span, plays in zip(_spans(cells.y_mm), cells.play_mm, strict=True):
        rows.insert(1, (span, *(f"{play * 1000.0:g}" for play in plays)))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        yield "  " + "  ".join(f"{text:>{w}}" for text, w in zip(row, widths, strict=True))


def _spans(edges_mm: tuple[float, ...]) -> list[str]:
    return [f"{a:g}…{b:g}" for a, b in pairwise(edges_mm)]


def _speed(mm_min: float) -> str:
    return f"{mm_min:.4g} mm/min" if math.isfinite(mm_min) else "not known"


def flat_lines(prefix: str, table: dict[str, Any]) -> list[tuple[str, Any]]:
    """Return nested tables as (`axes.x.travel_mm`, value) pairs, the keys that `--set` takes."""
    rows: list[tuple[str, Any]] = []
    for key, value in table.items():
        name = f"{prefix}.{key}" if prefix else key
        rows.extend(flat_lines(name, value) if isinstance(value, dict) else [(name, value)])
    return rows
