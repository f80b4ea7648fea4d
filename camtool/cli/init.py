"""`camtool init`: a machine file of one's own, by questions, by flags, or from the controller."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import click

from camtool.cli.files import STDOUT, check_new, check_places, display_name, read_bytes, write_all
from camtool.cli.messages import say
from camtool.cli.options import SectionedCommand, decorate, talk_options
from camtool.cli.settings import asked_settings
from camtool.errors import MachineError, OptionError
from camtool.project import FILE, MACHINES, NAME, names_machine, text_naming_machine, user_folder
from camtool.tables import parse_table
from camtool.target.contract import ControllerSetting
from camtool.target.registry import (
    each_target,
    find_target,
    list_target,
    load_target,
    loaded_target,
    own_names,
    target_names,
)
from camtool.target.template import machine_template
from camtool.units import parse_feed, parse_length

if TYPE_CHECKING:
    from camtool.target.contract import ControllerSetting

PROPOSED = "my-machine"
"""The default name of a machine."""

FLAG = "--{} at camtool init"
"""Source named in errors about a value from a flag or an answer."""


# Numbers of the three axes.


def _number(text: str) -> float:
    with suppress(ValueError):
        value = float(text)
        if math.isfinite(value):
            return value
    raise OptionError(f"{text[:MAX_SHOWN]!r} is no number")


MAX_SHOWN = 40
"""Number of characters of a wrong number that a message shows."""


def _step(text: str) -> float:
    steps = _number(text)
    if not steps > 0.0:
        raise OptionError(f"{text} steps per mm are none")
    return 1.0 / steps


AXES: dict[str, tuple[str, Callable[[str], float], str]] = {
    "steps": ("coded_step_mm", _step, "Steps per mm of X, Y and Z"),
    "travel": ("travel_mm", parse_length, "How far they go"),
    "max-rate": ("max_rate_mm_min", parse_feed, "Their highest rates, in mm/min"),
    "acceleration": ("acceleration_mm_s2", _number, "Their accelerations, in mm/s²"),
    "backlash": ("backlash_mm", parse_length, "What each loses when it reverses"),
}
"""Flag: (key of an axis, function that reads its values, meaning)."""


def axis_settings(flag: str, text: str) -> list[ControllerSetting]:
    """Parse values such as `300x180x45` for X, Y and Z, or one value for all three; OptionError
    for other text."""
    key, parse, _ = AXES[flag]
    values = [parse(part) for part in re.split(r"[x×]", text)]
    if len(values) not in (1, 3) or min(values) < 0.0:
        raise OptionError(
            f"{text!r} is neither one value nor three", mend="write 300x180x45, for X, Y and Z"
        )
    origin = FLAG.format(flag)
    values = values * 3 if len(values) == 1 else values
    return [
        ControllerSetting(f"axes.{axis}.{key}", value, origin, f"--{flag} {text}")
        for axis, value in zip("xyz", values, strict=True)
    ]


def spindle_setting(text: str) -> ControllerSetting:
    """Parse the answer about the spindle: a speed such as `10000`, `hand` or `none`."""
    origin, place = FLAG.format("spindle"), f"--spindle {text}"
    if text in ("hand", "none"):
        return ControllerSetting("spindle.switched", text, origin, place)
    return ControllerSetting("spindle.default_rpm", _number(text), origin, place)


def proposals(target: str, *, switches: bool) -> list[ControllerSetting]:
    """Return default settings for what a target leaves open about a milling machine; `switches`:
    the program switches the spindle."""
    if not find_target(target)[0].starts_spindle:
        return []
    return [
        ControllerSetting("defaults.feed_z_mm", 2.0, "ours: rapids end here, above warped stock"),
        ControllerSetting(
            "defaults.plunge_share", 0.3, "ours: end mills plunge slower than they cut"
        ),
        *(
            [ControllerSetting("spindle.spin_up_s", 2.0, "ours: until it has its speed")]
            if switches
            else []
        ),
    ]


# The command.


def _axis_flags(command: Callable[..., None]) -> Callable[..., None]:
    options = [
        click.option(f"--{flag}", flag.replace("-", "_"), metavar="XxYxZ", help=f"{meaning}.")
        for flag, (_, _, meaning) in AXES.items()
    ]
    return decorate(command, options)


@click.command(cls=SectionedCommand, short_help="A machine file of your own.")
@click.argument("name", required=False)
@click.option("--target", "-t", metavar="NAME", help="The controller; see camtool targets.")
@click.option(
    "--settings",
    metavar="FILE",
    help="What the controller says of itself: grbl's answer to $$, LinuxCNC's INI file.",
)
@click.option("--port", metavar="PORT", help="Ask the controller at this serial port instead.")
@_axis_flags
@click.option(
    "--spindle",
    metavar="SPEED",
    help="Its speed where a job says none, in rev/min; hand (switches it); or none.",
)
@click.option("--project", is_flag=True, help="Keep it here, for this folder alone.")
@click.option("-o", "--output", metavar="FILE", help="Only write this file; - is stdout.")
@click.option("--replace", is_flag=True, help="Replace a machine of this name; its file is kept.")
@click.option("--ask/--no-ask", default=None, help="Ask for what is not said.  [at a terminal]")
@talk_options
def init(
    name: str | None,
    target: str | None,
    settings: str | None,
    port: str | None,
    project: bool,
    output: str | None,
    spindle: str | None,
    replace: bool,
    ask: bool | None,
    quiet: bool,
    verbose: bool,
    **axes: str | None,
) -> None:
    """Make a file for your machine NAME: --machine NAME finds it from then on.

    \b
    camtool init                                   asks
    camtool init my-3018 --settings grbl.txt       what your grbl answers to $$
    camtool init my-3018 -t grbl --port /dev/ttyUSB0
    camtool init my-mill --settings my-mill.ini    LinuxCNC
    camtool init my-3018 -t grbl --travel 300x180x45 --max-rate 1000x1000x600

    Numbers are one for X, Y and Z, or three. What is not known stands in the file as a comment.
    It is kept in your configuration folder, or with --project in this one, whose camtool.toml
    then names it. The first machine is the one that commands without --target are for."""
    if settings is not None and port is not None:
        raise click.UsageError("--settings and --port contradict each other")
    if project and output is not None:
        raise click.UsageError("--project and -o contradict each other")
    questions = Questions(sys.stdin.isatty() and settings != STDOUT if ask is None else ask)
    if name is None:
        name = questions.ask("Name of the machine", PROPOSED)
    if name is None:
        raise click.UsageError("NAME is missing, such as my-3018")
    target, reported = _controller_settings(target, settings, port, questions)
    settings_by_key = {each.key: each for each in reported}
    for flag, (key, _, meaning) in AXES.items():
        text = axes[flag.replace("-", "_")]
        if text is None and any(f"axes.{axis}.{key}" not in settings_by_key for axis in "xyz"):
            text = questions.ask_axes(flag, f"{meaning} (such as 300x180x45)")
        if text is not None:
            settings_by_key |= {each.key: each for each in axis_settings(flag, text)}
    if spindle is None:
        spindle = questions.ask("Speed of the spindle, rev/min; hand; none; Enter: not known")
    if spindle is not None:
        settings_by_key |= {each.key: each for each in (spindle_setting(spindle),)}
    switched = settings_by_key.get("spindle.switched")
    proposed = proposals(target, switches=switched is None or switched.value == "program")
    settings_by_key = {each.key: each for each in proposed} | settings_by_key
    text = machine_text(name, target, list(settings_by_key.values()), settings or "")
    place = _place(name, output, project=project)
    files, names = {str(place): text.encode()}, Path() if project else user_folder()
    # The camtool.toml of a project always gets the new machine, the user's only if it names none.
    default = output is None and (project or not names_machine(names / FILE))
    if default:
        files[str(names / FILE)] = text_naming_machine(names / FILE, name).encode()
    old_file = _write(files, settings, is_replaced=replace)
    say(f"written: {display_name(str(place))}", quiet=quiet)
    if old_file is not None:
        say(f"the machine that it replaces is kept: {display_name(old_file)}", quiet=quiet)
    for each in settings_by_key.values():
        if each.doubt:
            value = f"{each.key} = {each.value} ({each.said})"
            say(f"{value} is not taken, but a comment in it: {each.doubt}", quiet=quiet)
    missing = [flag for flag, (key, *_) in AXES.items() if f"axes.x.{key}" not in settings_by_key]
    if missing:
        say(f"not known, and a comment in it: {', '.join(missing)}", quiet=quiet)
    if "backlash" in missing:
        say("to measure the backlash: camtool coupon lines, then camtool calibrate", quiet=quiet)
    if output is None:
        machine_flag = "" if default else f" --machine {name}"
        say(f"to use it: camtool post drawing.dxf{machine_flag}", quiet=quiet)


class Questions:
    """Questions to the user at a terminal; if not `allowed`, every answer is None."""

    def __init__(self, allowed: bool) -> None:
        self.allowed = allowed

    def ask(self, text: str, default: str = "") -> str | None:
        """Ask for a text and return the answer; None for an empty answer without a default, or if
        questions are not allowed."""
        if not self.allowed:
            return None
        answer = click.prompt(text, default, show_default=bool(default), err=True)
        return str(answer).strip() or None

    def ask_one_of(self, text: str, choices: Sequence[str]) -> str | None:
        """Ask for one of the choices and return it; None if questions are not allowed."""
        if not self.allowed:
            return None
        return str(click.prompt(text, type=click.Choice(choices), err=True))

    def ask_axes(self, flag: str, text: str) -> str | None:
        """Ask for numbers of the axes, in the form that `flag` takes, until they are valid; return
        the answer as text."""
        while True:
            answer = self.ask(f"{text}; Enter: not known")
            if answer is None:
                return None
            try:
                axis_settings(flag, answer)
            except OptionError as error:
                say(f"camtool: {error}")
                continue
            return answer

    def ask_lines(self, text: str) -> str:
        """Ask for lines up to an empty one and return them; if the only line is the name of a
        file, the content of the file is returned."""
        first = self.ask(f"{text}: paste it, end with an empty line; or the name of a file")
        if first is None:
            return ""
        if Path(first).is_file():
            return settings_text(first)
        rows = [first]
        while row := str(click.prompt("", "", show_default=False, prompt_suffix="", err=True)):
            rows.append(row)
        return "\n".join(rows)


# What the controller says of itself.


def settings_text(name: str) -> str:
    """Read a file with a controller's settings (`-` is stdin) as text."""
    return read_bytes(name).decode("utf-8", "replace")


def _controller_settings(
    target: str | None, settings: str | None, port: str | None, questions: Questions
) -> tuple[str, Sequence[ControllerSetting]]:
    """Return the name of the target, and the settings of the machine that its controller
    reports."""
    if port is not None:
        if target is None:
            raise click.UsageError("--port needs --target: which controller is there?")
        lines = asked_settings(load_target(target), port, None, quiet=True)
        settings, text = f"--port {port}", "\n".join(lines)
    elif settings is not None:
        text = settings_text(settings)
    else:
        target = target or questions.ask_one_of("Which controller has it", target_names())
        if target is None:
            raise click.UsageError("--target or --settings is missing: which controller has it?")
        listing = find_target(target)[0].settings_listing
        settings, text = "what was pasted", questions.ask_lines(listing) if listing else ""
        if not text:
            return target, ()
    targets = (
        each_target(find_target, names=own_names())
        if target is None
        else ((target, find_target(target)),)
    )
    listings = []
    for name, (each, _) in targets:
        listings.append(f"{each.settings_listing} for {name}") if each.settings_listing else None
        try:
            reported = each.settings_from(text)
        except MachineError as error:
            error.file = error.file or settings
            raise
        if reported is not None:
            return name, reported
    raise MachineError(
        "says nothing of a machine",
        file=settings,
        mend=f"give {' or '.join(listings)}" if listings else f"{target} has no settings to read",
    )


def machine_text(
    name: str, target: str, given_settings: Sequence[ControllerSetting], source: str
) -> str:
    """Return the TOML text of the machine file. MachineError for a value out of range, with the
    source of the value."""
    base = list_target(target)
    text = machine_template(name, target, base.text, base.needs, given_settings)
    try:
        loaded_target(target, (parse_table(text), f"{name}.toml"))
    except MachineError as error:
        culprit = next((each for each in given_settings if _is_about(error, each.key)), None)
        if culprit is not None:
            raise MachineError(
                f"{error.message} ({culprit.key})",
                file=source or None,
                where=culprit.where,
                mend=error.mend,
            ) from None
        if not base.needs:
            raise
    return text


def _is_about(error: MachineError, key: str) -> bool:
    """Return True if the error names this key of the machine file."""
    table, _, name = key.rpartition(".")
    return error.where == f"table [{table}], key {name}"


# Where it is kept.


def _place(name: str, output: str | None, *, project: bool) -> Path:
    """Return the path of the machine's file; OptionError for a name that cannot be a file name."""
    if not NAME.fullmatch(name) or name == Path(FILE).stem:
        raise OptionError(
            f"{name!r} is no name for a machine", mend="use small letters, digits and hyphens"
        )
    if output is not None:
        return Path(output)
    return (Path() if project else user_folder() / MACHINES) / f"{name}.toml"


def _write(files: dict[str, bytes], settings: str | None, *, is_replaced: bool) -> str | None:
    """Write the machine file and the `camtool.toml` that names it. An existing machine file is
    refused, or with `is_replaced` kept under another name, which is returned: its numbers may have
    been measured."""
    place, old_file = next(iter(files)), None
    if is_replaced and Path(place).is_file():
        old_file = f"{place}.old"
        files = {old_file: read_bytes(place), **files}
    else:
        check_new(place, "give another name, or --replace, which replaces it")
    if place != STDOUT:
        for name in files:
            Path(name).parent.mkdir(parents=True, exist_ok=True)
    check_places([settings], files)
    write_all(files)
    return old_file
