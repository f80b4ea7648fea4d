"""`camtool targets`: the machines it knows, and everything about one."""

from __future__ import annotations

import json
import math
from typing import Any

import click

from camtool.cli.options import talk_options


@click.command(short_help="The machines, and everything about one.")
@click.argument("name", required=False)
@click.option("--machine", metavar="FILE", help="A TOML file that extends the target's machine.")
@click.option("--set", "settings", multiple=True, metavar="KEY=VALUE", help="Change one value.")
@click.option("--json", "as_json", is_flag=True, help="As JSON on stdout.")
@talk_options
def targets(
    name: str | None,
    machine: str | None,
    settings: tuple[str, ...],
    as_json: bool,
    quiet: bool,
    verbose: bool,
) -> None:
    """List the machines, or show everything about the one called NAME."""
    if name is None:
        _list(as_json)
    else:
        _show(name, machine, settings, as_json)


def _list(as_json: bool) -> None:
    from camtool.errors import MachineError
    from camtool.machine.registry import list_target, target_names

    rows: list[dict[str, Any]] = []
    for name in target_names():
        try:
            listed = list_target(name)
        except MachineError as error:  # a broken plug-in is named and harms nothing else
            click.echo(f"camtool: warning: {error}", err=True)
            continue
        target = listed.target
        row = {"name": name, "title": target.title, "extension": target.extension}
        rows.append({**row, "needs": list(listed.needs)})
    if as_json:
        click.echo(json.dumps({"targets": rows}, indent=2, ensure_ascii=False))
        return
    width = max((len(row["name"]) for row in rows), default=0)
    for row in rows:
        needs = f" (needs --machine FILE: {', '.join(row['needs'])})" if row["needs"] else ""
        click.echo(f"{row['name']:<{width}}  {row['extension']:<6}  {row['title']}{needs}")


def _show(name: str, machine: str | None, settings: tuple[str, ...], as_json: bool) -> None:
    from pathlib import Path

    import msgspec

    from camtool.machine.registry import load_target

    loaded = load_target(name, machine_file=Path(machine) if machine else None, settings=settings)
    values: dict[str, Any] = msgspec.to_builtins(loaded.machine)
    if as_json:
        click.echo(json.dumps(values, indent=2, ensure_ascii=False))
        return
    for key, value in _flat("", values):
        click.echo(f"{key} = {json.dumps(value, ensure_ascii=False)}")
    click.echo(
        f"\nhighest feed {_speed(loaded.machine.max_feed_mm_min)}, "
        f"rapids {_speed(loaded.machine.rapid_mm_min)}; "
        "every number's source is in the target's own file:",
        err=True,
    )
    click.echo(f"{loaded.file}", err=True)


def _speed(mm_min: float) -> str:
    return f"{mm_min:.4g} mm/min" if math.isfinite(mm_min) else "not said"


def _flat(prefix: str, table: dict[str, Any]) -> list[tuple[str, Any]]:
    """Nested tables as `axes.x.travel_mm` lines, as --set takes them."""
    rows: list[tuple[str, Any]] = []
    for key, value in table.items():
        name = f"{prefix}.{key}" if prefix else key
        rows.extend(_flat(name, value) if isinstance(value, dict) else [(name, value)])
    return rows
