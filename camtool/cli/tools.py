"""`camtool tools`: the tools that jobs may name, and a library of them to begin with."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from camtool.cli.files import STDOUT, check_new, check_places, write_all
from camtool.cli.messages import say, show_text
from camtool.cli.options import SectionedCommand, talk_options
from camtool.errors import OptionError
from camtool.jobs.keys import PRESET, TOOL
from camtool.jobs.tools import read_library, tool_of
from camtool.patterns import guess
from camtool.plain import one_line, to_json
from camtool.project import FILE, TOOLS, project_of, user_folder

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

    from camtool.jobs.tools import Described
    from camtool.planning.job import Tool


class _Tools(click.Group):
    """`new` is a command; every other word is the name of a tool to show."""

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return the command of this name, or for any other word the command that shows
        the tool."""
        return super().get_command(ctx, cmd_name) or show

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Return the commands and tools that complete the word."""
        return [*super().shell_complete(ctx, incomplete), *_items(incomplete)]


@click.group(
    cls=_Tools,
    short_help="The tools that jobs may name.",
    invoke_without_command=True,
    subcommand_metavar="[NAME | new] [OPTIONS]",
)
@click.option("--json", "as_json", is_flag=True, help="As JSON on stdout.")
@talk_options
@click.pass_context
def tools(context: click.Context, as_json: bool, quiet: bool, verbose: bool) -> None:
    """List the tools of the project and of the user, show everything about the one called NAME, or
    begin a library of them.

    \b
    camtool tools             all of them
    camtool tools mill        one, with its presets by material
    camtool tools new         a library of yours, where all jobs find it"""
    if context.invoked_subcommand is not None:
        return
    every = _all_tools()
    if as_json:
        rows = [_row(name, *each) for name, each in every.items()]
        write_all({STDOUT: to_json({"tools": rows}).encode()})
        return
    width = max(map(len, every), default=0)
    for name, (described, file) in every.items():
        show_text(one_line(f"{name:<{width}}  {_summary(name, described)}  ({file})"))
    if not every:
        say("no tools yet; camtool tools new begins a library of them", quiet=quiet)


@click.command(cls=SectionedCommand, short_help="Everything about one tool.")
@click.option("--json", "as_json", is_flag=True, help="As JSON on stdout.")
@talk_options
@click.pass_context
def show(context: click.Context, as_json: bool, quiet: bool, verbose: bool) -> None:
    """Show everything about one tool."""
    name, every = str(context.info_name), _all_tools()
    if name not in every:
        names = f"known are {', '.join(every)}" if every else "camtool tools new begins a library"
        raise OptionError(f"there is no tool {name!r}", mend=guess(name, every) + names)
    described, file = every[name]
    row = _row(name, described, file)
    if as_json:
        write_all({STDOUT: to_json(row).encode()})
        return
    show_text(one_line(f"{name}: {_summary(name, described)}"))
    for material, preset in row["presets"].items():
        show_text(one_line(f"  {material}: {_preset_words(preset)}"))
    say(str(file), quiet=quiet)


@tools.command(cls=SectionedCommand, short_help="Begin a library of tools.")
@click.option("--project", is_flag=True, help="Keep it here, for this folder alone.")
@click.option("-o", "--output", metavar="FILE", help="Only write this file; - is stdout.")
@talk_options
def new(project: bool, output: str | None, quiet: bool, verbose: bool) -> None:
    """Write a library of tools: usual ones, with presets and where their numbers are from.

    It is kept where all jobs find it, or with --project beside camtool.toml in this folder."""
    from importlib import resources

    text = resources.files("camtool.jobs").joinpath(TOOLS).read_bytes()
    place = str((Path() if project else user_folder()) / TOOLS) if output is None else output
    check_new(place)
    files = {place: text}
    if project and output is None and not Path(FILE).exists():
        files[FILE] = b"# What camtool takes where no flag says otherwise; see docs/machines.md.\n"
    if place != STDOUT:
        Path(place).parent.mkdir(parents=True, exist_ok=True)
    check_places([], files)
    write_all(files)
    place_name = "stdout" if place == STDOUT else place
    say(f"written: {place_name}; put in the tools that you have", quiet=quiet)


def _all_tools() -> dict[str, tuple[Described, Path]]:
    """Return all tools of the project and the user by name, each with its file; of equal names the
    nearest."""
    every: dict[str, tuple[Described, Path]] = {}
    for file in project_of(Path.cwd()).libraries:
        tools = {name: (each, file) for name, each in read_library(file).items()}
        every = {**tools, **every}
    return dict(sorted(every.items()))


def _items(incomplete: str) -> Iterator[CompletionItem]:
    from click.shell_completion import CompletionItem

    for name, (described, _) in _all_tools().items():
        if name.startswith(incomplete):
            yield CompletionItem(name, help=_summary(name, described))


def _row(name: str, described: Described, file: Path) -> dict[str, Any]:
    """Return a tool as data for JSON: the values of its keys in mm, rad, mm/min, rev/min and
    m/min."""
    given_keys = described.keys.given
    presets = {}
    for material, preset in described.presets.items():
        values = {PRESET[key].field: PRESET[key].read(each) for key, each in preset.given.items()}
        presets[material] = {**values, **_derived(_tool(name, described), values)}
    values = {TOOL[key].field: TOOL[key].read(each) for key, each in given_keys.items()}
    return {"name": name, "file": str(file), **values, "presets": presets}


def _tool(name: str, described: Described) -> Tool:
    return tool_of(name, described)


def _derived(tool: Tool, preset: Mapping[str, Any]) -> dict[str, float]:
    """Return the figures that follow from a preset: feed per tooth (mm) and cutting speed
    (m/min)."""
    feed, rpm = preset.get("feed_mm_min"), preset.get("spindle_rpm")
    figures = {
        "feed_per_tooth_mm": None if feed is None else tool.feed_per_tooth_mm(feed, rpm),
        "edge_m_min": tool.edge_speed_m_min(rpm),
    }
    return {key: value for key, value in figures.items() if value is not None}


def _summary(name: str, described: Described) -> str:
    """Return one line about a tool, such as `tool 1, end mill 3.175 mm, 2 flutes; for plywood`."""
    from camtool.planning.naming import tool_words

    tool = _tool(name, described)
    number = f"tool {tool.number}, " if tool.number is not None else ""
    materials = f"; for {', '.join(tool.materials)}" if tool.materials else ""
    return number + tool_words(tool) + materials


_WORDS = {
    "spindle_rpm": "spindle {:g}",
    "edge_m_min": "({:.3g} m/min)",
    "feed_mm_min": "feed {:g} mm/min",
    "feed_per_tooth_mm": "({:.2g} mm per tooth)",
    "plunge_feed_mm_min": "plunge {:g} mm/min",
    "step_down_mm": "step down {:g} mm",
    "step_over": "step-over {:.0%}",
    "peck_mm": "peck {:g} mm",
    "coolant": "coolant {}",
}


def _preset_words(preset: Mapping[str, Any]) -> str:
    texts = [words.format(preset[key]) for key, words in _WORDS.items() if key in preset]
    return ", ".join(texts).replace(", (", " (")
