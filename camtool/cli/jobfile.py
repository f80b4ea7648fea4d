"""Job files: a flat TOML table that says what the job flags say, read as strictly as a machine.

tool_diameter = "0.2mm"     # lengths and feeds take units, bare numbers are mm and mm/min
side = "auto"
layers = ["CUT", "ENG*"]
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from camtool.errors import MachineError, OptionError
from camtool.machine.loader import read_table
from camtool.units import parse_feed, parse_length


def read_job_file(path: Path) -> dict[str, Any]:
    """Fields of `camtool.planning.job.Job`; OptionError names file, key and mend."""
    try:
        table = read_table(path)
    except MachineError as error:
        raise OptionError(error.message, file=error.file, mend=error.mend) from error
    job: dict[str, Any] = {}
    for key, value in table.items():
        if key not in _KEYS:
            raise OptionError(
                "unknown key",
                file=str(path),
                where=f"key {key}",
                mend=f"known: {', '.join(_KEYS)}",
            )
        field, convert = _KEYS[key]
        try:
            job[field] = convert(value)
        except (OptionError, TypeError, ValueError) as error:
            message = error.message if isinstance(error, OptionError) else str(error)
            raise OptionError(message, file=str(path), where=f"key {key}") from error
    return job


def _length(value: object) -> float:
    return parse_length(_number_text(value))


def _feed(value: object) -> float:
    return parse_feed(_number_text(value))


def _number_text(value: object) -> str:
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise TypeError(f"{value!r} is no number")
    return value if isinstance(value, str) else repr(value)


def _word(value: object) -> str:
    if not isinstance(value, str):
        raise TypeError(f"{value!r} is no text")
    return value


def _speed(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError(f"{value!r} is no number of rev/min")
    return float(value)


def _words(value: object) -> tuple[str, ...]:
    if not isinstance(value, list):
        raise TypeError(f"{value!r} is no list of layers")
    return tuple(_word(item) for item in value)


_KEYS: dict[str, tuple[str, Callable[[object], Any]]] = {
    "tool_diameter": ("tool_diameter_mm", _length),
    "side": ("side", _word),
    "feed": ("feed_mm_min", _feed),
    "plunge_feed": ("plunge_feed_mm_min", _feed),
    "depth": ("depth_mm", _length),
    "safe_z": ("safe_z_mm", _length),
    "spindle": ("spindle_rpm", _speed),
    "origin": ("origin", _word),
    "layers": ("layers", _words),
}
