"""A machine file to fill in: what `camtool targets new` writes."""

from __future__ import annotations

import re
from collections.abc import Iterable

from camtool.errors import OptionError

_NAME = re.compile(r"[a-z0-9][a-z0-9-]*")
_TABLE = re.compile(r"\[([\w.-]+)\]")
_KEY = re.compile(r"([\w-]+)\s*=")
_OWN = ("target", "needs")
_AXES = ("axes.x", "axes.y", "axes.z")
_BACKLASH = "# backlash_mm = 0.0         # measure yours: camtool coupon, camtool calibrate"


def machine_template(name: str, base: str, base_text: str, needs: Iterable[str] = ()) -> str:
    """TOML text of the machine `name`, which extends the target `base`.

    Every value of the target's own file (`base_text`) is a comment in it, with its source, for the
    user to uncomment and change; every axis has `backlash_mm`, since every machine has backlash.
    `needs` are keys that the user must give. OptionError for a name that is not a word of small
    letters, digits and hyphens.
    """
    if not _NAME.fullmatch(name):
        raise OptionError(
            f"{name!r} is no name for a machine", mend="use small letters, digits and hyphens"
        )
    needed = list(needs)
    lines = [
        f"# {name}: a machine like {base}. Each value of {base} stands here as a comment;",
        "# take the # away from what differs on your machine, and change it.",
        f"# camtool post drawing.dxf --machine {name}.toml",
        "",
        f'extends = "{base}"',
        "",
        "[target]",
        f'name = "{name}"',
        f'title = "{name}"',
    ]
    table = ""
    said: set[str] = set()
    for line in _own_part(base_text):
        heading, key = _TABLE.match(line), _KEY.match(line)
        if heading:
            if table in _AXES and "backlash_mm" not in said:
                lines.append(_BACKLASH)
            table, said = heading[1], set()
            lines += ["", line]
            given = f"{table}."
            lines += [
                f"# {key[len(given) :]} =     # you must say this"
                for key in needed
                if key.startswith(given) and "." not in key[len(given) :]
            ]
        elif key and f"{table}.{key[1]}" not in needed:
            lines.append(f"# {line}")
            said.add(key[1])
        elif line.startswith("#") and table:
            lines.append(line)
            said.update(word for word in ("backlash_mm",) if word in line)
    return "\n".join(lines) + "\n"


def _own_part(text: str) -> Iterable[str]:
    """The lines of the tables that a user's machine file may change."""
    table = ""
    for line in text.splitlines():
        heading = _TABLE.match(line)
        table = heading[1] if heading else table
        if table and table.partition(".")[0] not in _OWN and line.strip():
            yield line
