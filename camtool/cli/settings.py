"""`camtool settings`: what a controller keeps in its own memory, compared, backed up, restored."""

from __future__ import annotations

import json
import math

import click

from camtool.cli.files import display_name, read_bytes, refuse_same, write_all
from camtool.cli.home import BAUD, carried
from camtool.cli.messages import say, show_text
from camtool.cli.options import MachineFlags, SectionedCommand, machine_options, talk_options
from camtool.cli.probe import asked_to_begin
from camtool.errors import InputError, MachineError, OptionError
from camtool.plain import one_line
from camtool.sending.line import manner_of, wire_of
from camtool.target.registry import LoadedTarget
from camtool.target.wire import NoWire

WORDS = ("read", "compare", "backup", "restore")


@click.command(
    cls=SectionedCommand, short_help="A controller's own settings: read, compare, restore."
)
@click.argument("what", type=click.Choice(WORDS), metavar="WHAT")
@click.argument("file", required=False, metavar="[FILE]")
@machine_options
@click.option("--port", metavar="PORT", help="Such as /dev/ttyUSB0.")
@BAUD
@click.option("--json", "as_json", is_flag=True, help="read, compare: as JSON, on stdout.")
@click.option("--yes", is_flag=True, help="restore: write without asking.")
@talk_options
def settings(
    what: str,
    file: str | None,
    machine: MachineFlags,
    port: str | None,
    baud: int | None,
    as_json: bool,
    yes: bool,
    quiet: bool,
    verbose: bool,
) -> int:
    """Read, compare, back up or restore the settings that a controller keeps ($$ of grbl).

    \b
    read              all of them, with what they mean
    compare           with the machine file; exit code 1 where they differ
    backup FILE       writes them to FILE
    restore FILE      shows what would change, asks, writes it, and reads all of it again

    read and compare take a FILE instead of --port: what grbl answered to $$, or LinuxCNC's INI."""
    target = machine.load()
    if what in ("backup", "restore") and (file is None or port is None):
        raise OptionError("FILE and --port are needed", where=f"settings {what}")
    if what in ("read", "compare") and (file is None) == (port is None):
        raise OptionError("give a FILE or --port", where=f"settings {what}")
    if what == "restore":
        assert file is not None
        assert port is not None
        return _restore(target, file, port, baud, yes=yes, quiet=quiet)
    if port is None:
        assert file is not None
        lines = _text(file).splitlines()
    else:
        lines = asked_settings(target, port, baud, quiet=quiet)
    if what == "backup":
        assert file is not None
        refuse_same(list(machine.files()), [file])
        write_all({file: "".join(f"{line}\n" for line in lines).encode()})
        say(f"camtool: {file}: {len(lines)} settings", quiet=quiet)
        return 0
    if what == "read":
        meanings = {line: _meaning(target, line) for line in lines}
        if as_json:
            rows = [dict(_pair(line), means=meaning) for line, meaning in meanings.items()]
            show_text(json.dumps(rows, indent=2, ensure_ascii=False))
        else:
            width = max(map(len, lines), default=0)
            for line, meaning in meanings.items():
                show_text(one_line(f"{line:<{width}}  {meaning}".rstrip()))
        return 0
    try:
        errors, remarks = target.target.compare_settings("\n".join(lines), target.machine)
    except MachineError as error:
        error.file = error.file or file or port or ""
        raise
    if as_json:
        show_text(json.dumps({"errors": errors, "remarks": remarks}, indent=2, ensure_ascii=False))
    for text in (*errors, *remarks):
        say(f"camtool: {text}", quiet=quiet and text in remarks)
    if not errors and not remarks:
        say("camtool: settings compare: they are those of the machine file", quiet=quiet)
    return 1 if errors else 0


def _text(file: str) -> str:
    return read_bytes(file).decode("utf-8", "replace")


def _meaning(target: LoadedTarget, line: str) -> str:

    wire = target.target.wire()
    return "" if isinstance(wire, NoWire) else wire.terminal(target.machine).meaning(line)


def _pair(line: str) -> dict[str, str]:
    name, _, value = line.partition("=")
    return {"setting": name.strip(), "value": value.strip()}


def asked_settings(target: LoadedTarget, port: str, baud: int | None, *, quiet: bool) -> list[str]:
    """Read the settings of the controller at a port twice and return them as lines; InputError if
    it does not list them or both readings differ."""
    conversation = wire_of(target).settings(target.machine, manner_of(target))
    reason = carried(conversation, target, port, baud, quiet=quiet)
    if reason:
        raise InputError(reason, file=port)
    return list(conversation.after)


def _restore(
    target: LoadedTarget, file: str, port: str, baud: int | None, *, yes: bool, quiet: bool
) -> int:
    """Write to the controller the settings of a file that differ from its own; return the exit
    code."""
    new_values = _settings_of(file)
    now = dict(map(_name_value, asked_settings(target, port, baud, quiet=quiet)))
    unknown = new_values.keys() - now.keys()
    if unknown:
        raise InputError(
            f"{', '.join(sorted(unknown))}: the controller has no such setting",
            file=display_name(file),
            mend="take the line out, or is it of another controller?",
        )
    changes = {name: value for name, value in new_values.items() if not _is_same(value, now[name])}
    if not changes:
        say("camtool: settings restore: nothing differs, and nothing was written", quiet=quiet)
        return 0
    for name, value in changes.items():
        meaning = _meaning(target, f"{name}={value}")
        say(one_line(f"camtool: {name}: {now[name]} becomes {value}  {meaning}"))
    if not yes and not asked_to_begin(f"Write {len(changes)} settings?"):
        return 1
    lines = [f"{name}={value}" for name, value in changes.items()]
    conversation = wire_of(target).settings(target.machine, manner_of(target), lines)
    reason = carried(conversation, target, port, baud, quiet=quiet)
    written = list(conversation.written)
    if not reason:
        say(f"camtool: settings restore: {len(written)} written and read back", quiet=quiet)
        return 0
    rest = [line for line in lines if line not in written]
    say(
        f"camtool: error: settings restore: {reason}; taken: {', '.join(written) or 'none'}; not, "
        f"or not for certain: {', '.join(rest) or 'none'}"
    )
    return 1


def _name_value(line: str) -> tuple[str, str]:
    pair = _pair(line)
    return pair["setting"], pair["value"]


def _settings_of(file: str) -> dict[str, str]:
    """Parse lines such as `$110=500.000`, with or without an explanation in brackets after them;
    InputError for other lines, and for a setting that is given twice."""
    values: dict[str, str] = {}
    for number, line in enumerate(_text(file).splitlines(), 1):
        text = line.partition("(")[0].strip()
        if not text or text in ("ok", ">"):
            continue
        name, value = _name_value(text)
        try:
            is_setting = name[:1] == "$" and int(name[1:]) >= 0 and math.isfinite(float(value))
        except ValueError:
            is_setting = False
        if not is_setting or name in values:
            raise InputError(
                f"{one_line(text[:40])!r} is no setting, or is given twice",
                file=display_name(file),
                where=f"line {number}",
                mend="write lines such as $110=500.000, as camtool settings backup does",
            )
        values[name] = value
    if not values:
        raise InputError("has no settings", file=display_name(file))
    return values


def _is_same(value: str, other: str) -> bool:
    try:
        return abs(float(value) - float(other)) < SAME
    except ValueError:
        return value == other


SAME = 5e-4
"""Settings that differ by no more than this are equal, since they are listed with three
decimals."""
