"""`camtool ports`: the serial ports of this computer, and what stands behind them."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Any

import click
import msgspec

from camtool.cli.messages import say, show_text
from camtool.cli.options import SectionedCommand, talk_options
from camtool.errors import InputError, OptionError
from camtool.plain import one_line
from camtool.sending.asking import Answer, ask, questions
from camtool.sending.line import list_serial_ports
from camtool.target.registry import each_target, find_target, own_names
from camtool.target.wire import Wire


@click.command(cls=SectionedCommand, short_help="List the serial ports.")
@click.argument("names", nargs=-1, metavar="[PORT...]")
@click.option("--ask", is_flag=True, help="Ask what stands behind each; nothing moves by it.")
@click.option("--json", "as_json", is_flag=True, help="As JSON, on stdout.")
@talk_options
def ports(names: tuple[str, ...], ask: bool, as_json: bool, quiet: bool, verbose: bool) -> int:
    """List the serial ports of this computer, for `camtool send --port`.

    --ask opens each of them, or each PORT, at the rates that are known, sends the bytes that it
    lists, and says what answers. These bytes move nothing, but a board that is reset when its port
    is opened stops what it does: ask only where no program runs."""
    if names and not ask:
        raise OptionError("a PORT is for --ask", where="ports")
    port_list = [each for each in list_serial_ports() if not names or each.name in names]
    rows: list[dict[str, Any]] = [asdict(each) for each in port_list]
    listed = {row["name"] for row in rows}
    rows += [
        {"name": name, "description": "", "hardware": ""} for name in names if name not in listed
    ]
    if ask:
        wires = _wires()
        for row in rows:
            row["answers"] = _asked(row["name"], wires)
    if as_json:
        show_text(json.dumps(rows, indent=2, ensure_ascii=False))
        return 0
    width = max((len(row["name"]) for row in rows), default=0)
    for row in rows:
        hardware = f" [{row['hardware']}]" if verbose and row["hardware"] else ""
        show_text(one_line(f"{row['name']:<{width}}  {row['description']}{hardware}".rstrip()))
        for answer in row.get("answers", ()):
            show_text(one_line(f"{'':<{width}}  {_words(answer)}"))
    if not rows:
        say("camtool: no serial port is here; is the cable in?", quiet=quiet)
    return 0


def _wires() -> list[Wire]:
    """Return the wires (serial protocols) of all targets that have one."""
    wires = [target.wire() for _, (target, _) in each_target(find_target, names=own_names())]
    return [wire for wire in wires if isinstance(wire, Wire)]


def _asked(name: str, wires: list[Wire]) -> list[dict[str, Any]]:
    """Ask at one port, wire by wire, until a controller is recognised; return the answers
    as data."""
    answers: list[dict[str, Any]] = []
    for wire, port in questions(name, wires):
        try:
            answer: Answer = ask(port, wire)
        except InputError as error:
            return [*answers, {"error": error.message}]
        answers.append(msgspec.to_builtins(answer))
        if answer.controller:
            break
    return answers


def _words(answer: dict[str, Any]) -> str:
    if "error" in answer:
        return f"not asked: {answer['error']}"
    rate = f"at {answer['baud']} baud" if answer["baud"] else "asked"
    heard = " ".join(answer["heard"].split())[:60]
    words = answer["controller"] or (f"it says {heard!r}" if heard else "nothing answers")
    return f"{rate}, sent {answer['sent']}: {words}"
