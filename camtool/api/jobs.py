"""Jobs from Python: values as numbers, or as texts with units, as a job file has them."""

from __future__ import annotations

from typing import Any

from camtool.jobs.keys import OPERATION, PLACE, TOOL_KEYS, WHOLE, Given, Key, layers
from camtool.planning.job import Job
from camtool.planning.job import job_of as made


def job_of(**settings: Any) -> Job:
    """The job of one operation: fields of Operation, Job and Placement by name, those of its
    Tool with `tool_` before them (`tool_diameter_mm=0.2`).

    A text or a list is read as a job file reads it: `depth_mm="1/8in"`, `tabs="4:3mm:1mm"`,
    `layers="CUT"` (one layer; commas part several); so are the numbers of `tabs`, `lead_in` and
    the like. Other numbers are mm, rad, s and mm/min. TypeError for a name that none of them has,
    OptionError that names the field for a value that it cannot have.
    """
    return made(**{name: _read(name, value) for name, value in settings.items()})


def _read(name: str, value: Any) -> Any:
    """The value of a field: texts, and what only a table of a job file can say, are read."""
    key = _KEYS.get(name)
    if name == "layers" and isinstance(value, str):
        return layers(value)
    if key is None or isinstance(value, bool):
        return value
    number_of_table = name in _TABLES and isinstance(value, int | float)
    if number_of_table or isinstance(value, str | list | tuple | dict):
        return key.read(Given(value, name))
    return value


_KEYS: dict[str, Key] = {
    **{key.field: key for keys in (OPERATION, WHOLE, PLACE) for key in keys.values()},
    **{f"tool_{key.field}": key for key in TOOL_KEYS.values()},
}
_TABLES = ("tabs", "lead_in", "lead_out", "entry")
