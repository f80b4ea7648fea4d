"""`camtool ports`: the serial ports of this computer."""

from __future__ import annotations

import json
from dataclasses import asdict

import click

from camtool.cli.messages import say, show_text
from camtool.cli.options import talk_options
from camtool.plain import one_line


@click.command(short_help="List the serial ports.")
@click.option("--json", "as_json", is_flag=True, help="As JSON, on stdout.")
@talk_options
def ports(as_json: bool, quiet: bool, verbose: bool) -> int:
    """List the serial ports of this computer, for `camtool send --port`."""
    from camtool.sending.line import list_serial_ports

    port_list = list_serial_ports()
    if as_json:
        show_text(json.dumps([asdict(each) for each in port_list], indent=2, ensure_ascii=False))
        return 0
    width = max((len(each.name) for each in port_list), default=0)
    for each in port_list:
        text = each.description + (f" [{each.hardware}]" if verbose and each.hardware else "")
        show_text(one_line(f"{each.name:<{width}}  {text}".rstrip()))
    if not port_list:
        say("camtool: no serial port is here; is the cable in?", quiet=quiet)
    return 0
