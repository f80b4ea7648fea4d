"""The text of a user's machine file: what `camtool init` and `camtool targets new` write."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence

from camtool.errors import OptionError
from camtool.project import NAME
from camtool.target.contract import ControllerSetting

_TABLE = re.compile(r"\[([\w.-]+)\]")
_KEY = re.compile(r"(#\s*)?([\w-]+)\s*=")
_OWN = ("target", "needs")
_AXES = ("axes.x", "axes.y", "axes.z")
_BACKLASH = "# backlash_mm = 0.0         # measure yours: camtool coupon, camtool calibrate"

_ABOUT = {
    "axes.x": "What a step moves the slide, how far it can go, its highest rate and acceleration, "
    "and what is lost\n## when it reverses.",
    "feed": "The feed where a job says none, and the finest difference of feeds in a program.",
    "limits": "What bounds feeds and rapids besides the rates of the axes.",
    "defaults": "What a job takes where it says nothing: the height of rapids, the depth of cut, "
    "how far arcs may\n## be from drawn curves, which gaps of a drawing are closed.",
    "spindle": "Who switches it, its speeds, and how long it is waited for.",
    "coolant": "What the machine has: programs switch it where a job asks for it.",
    "controller": "How the controller computes; the model that verifies programs runs on it.",
    "dialect": "How programs are written.",
    "link": "The line that programs come down.",
    "mechanics": "The mechanics beyond single axes.",
    "uncertainty": "How well these numbers are known, as standard uncertainties: what is left out "
    "is unknown,\n## and a dimension that depends on it is undecided.\n## No values hold for all "
    "machines: take both # away, and give yours. camtool calibrate writes some.",
}
"""Comments for tables."""

_UNCERTAIN = {
    "uncertainty": {
        "process_mm": "mm, of the place of a machined edge: deflection, and what is not modelled",
        "z_zero_mm": "mm, of the height of zero: touching off",
        "stock_thickness_mm": "mm, of the stock as measured",
        "tool_diameter_mm": "mm, of the tool as measured",
        "runout_mm": "mm, of the diameter that it cuts, by run-out",
        "squareness_rad": "rad, of mechanics.squareness_rad",
        "temperature_k": "K, of the room, about 20 °C",
        "machine_expansion_per_k": "1/K: 11.5e-6 for steel, 23e-6 for aluminium",
        "part_expansion_per_k": "1/K",
    },
    **{
        f"uncertainty.{axis}": {
            "backlash_mm": f"mm, of axes.{axis}.backlash_mm",
            "scale": f"of axes.{axis}.real_step_mm, as a part of it",
            "compensation_mm": "mm; 0 where the controller adds just what it is set to",
        }
        for axis in "xyz"
    },
}
"""Keys that a target's own file may leave out: the uncertainty of its numbers, key by key."""


def machine_template(
    name: str,
    base: str,
    base_text: str,
    needs: Iterable[str] = (),
    settings: Sequence[ControllerSetting] = (),
    file: str = "",
) -> str:
    """Return the TOML text of a machine file `name` that extends the target `base`. `file`: how
    flags name the file if its name alone is not found.

    The `settings` stand in it with their sources, as comments where they are in doubt. Every other
    value of the target's own file (`base_text`) is a comment with its source, for the user to
    uncomment and change; every axis has `backlash_mm`, since every machine has backlash. `needs`
    are keys that the user must give. OptionError for a name that is not a word of small letters,
    digits and hyphens."""
    if not NAME.fullmatch(name):
        raise OptionError(
            f"{name!r} is no name for a machine", mend="use small letters, digits and hyphens"
        )
    settings_by_key = {each.key: each for each in settings}
    needed = [key for key in needs if key not in settings_by_key]
    text = "What is known of it stands here; every other" if settings else "Every"
    lines = [
        f"# {name}: a machine on {base}. {text} value is that of {base}, as a comment:",
        "# take its # away, and change what differs on your machine.",
        f"# camtool post drawing.dxf --machine {file or name}",
        "",
        f'extends = "{base}"',
        "",
        "[target]",
        f'name = "{name}"',
        f'title = "{name}"',
    ]
    tables = list(_tables(base_text))
    for table, keys in _UNCERTAIN.items():
        own_rows = next((rows for name, rows in tables if name == table), None)
        if own_rows is None:
            tables.append((table, own_rows := []))
        present = {key[2] for key in map(_KEY.match, own_rows) if key}
        own_rows += [
            f"## {key + ' =':<25} # {meaning}"
            for key, meaning in keys.items()
            if key not in present
        ]
    for table, rows in tables:
        lines += ["", f"[{table}]"]
        if table in _ABOUT:
            lines.append(f"## {_ABOUT[table]}")
        lines += [f"# {key} =     # you must say this" for key in _own_keys(table, needed)]
        lines += _rows(table, rows, settings_by_key, set(needs))
    for table in dict.fromkeys(key.rpartition(".")[0] for key in settings_by_key):
        lines += ["", f"[{table}]"]
        lines += [
            _line(settings_by_key.pop(f"{table}.{key}"), key)
            for key in _own_keys(table, settings_by_key)
        ]
    return "\n".join(lines) + "\n"


def joined_text(texts: Sequence[str]) -> str:
    """Return one text for a machine file and the files that it extends (`texts`, the lowest
    first): each key once, with the value of the highest file that has it."""
    if len(texts) == 1:
        return texts[0]
    tables: dict[str, dict[str, str]] = {}
    for text in texts:
        table = ""
        for line in text.splitlines():
            heading, key = _TABLE.match(line), _KEY.match(line)
            if heading:
                table = heading[1]
            elif key and table:
                rows = tables.setdefault(table, {})
                rows.setdefault(key[2], line)
                if key[1] is None:
                    rows[key[2]] = line
    lines = [f"[{table}]\n" + "\n".join(rows.values()) + "\n" for table, rows in tables.items()]
    return "\n".join(lines)


def _rows(
    table: str, rows: Iterable[str], settings: dict[str, ControllerSetting], needs: set[str]
) -> Iterator[str]:
    """Yield the lines of one table. Settings that belong to it are written in their place and
    removed from `settings` (changed in place)."""
    backlash = table not in _AXES or f"{table}.backlash_mm" in settings
    for row in rows:
        key = _KEY.match(row)
        path = f"{table}.{key[2]}" if key else ""
        backlash |= "backlash_mm" in row
        if key and path in settings:
            yield _line(settings.pop(path), key[2])
        elif row.startswith("#"):
            yield row
        elif key and path not in needs:
            yield f"# {row}"
    for name in _own_keys(table, tuple(settings)):
        yield _line(settings.pop(f"{table}.{name}"), name)
    if not backlash:
        yield _BACKLASH


def _line(setting: ControllerSetting, key: str) -> str:
    import json

    text = f"{key} = {json.dumps(setting.value)}"
    if setting.doubt:
        return f"{f'# {text}':<28}# {setting.said}: {setting.doubt}"
    return f"{text:<27} # {setting.said}"


def _own_keys(table: str, keys: Iterable[str]) -> list[str]:
    """Return the last parts of the dotted keys that belong directly to this table."""
    parts = (key.rpartition(".") for key in keys)
    return [name for head, _, name in parts if head == table]


def _tables(text: str) -> Iterator[tuple[str, list[str]]]:
    """Yield the tables that a user's machine file may change, each with its lines."""
    table, rows = "", list[str]()
    for line in (*text.splitlines(), "[target]"):
        heading = _TABLE.match(line)
        if heading:
            if table and table.partition(".")[0] not in _OWN:
                yield table, rows
            table, rows = heading[1], []
        elif line.strip():
            rows.append(line)
