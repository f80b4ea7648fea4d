"""Every number that a machine file may hold, found in the records themselves."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from msgspec import inspect as known

from camtool.calibration.measurements import KINDS, _Head
from camtool.machine.model import Machine
from camtool.target.registry import find_target, load_target, target_names

DIALECTS: dict[str, type] = {name: find_target(name)[0].dialect for name in target_names()}

FILES = {"i8751": Path(__file__).parents[2] / "samples" / "i8751-sample.toml"}
"""Machine files for targets that need one."""

MEASUREMENTS: tuple[type, ...] = (_Head, *KINDS)


def numbers_of(about: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """(path, what is known of it) of every number within a type, lists as `key[]`."""
    if isinstance(about, known.StructType):
        for field in about.fields:
            name = f"{path}.{field.encode_name}" if path else field.encode_name
            yield from numbers_of(field.type, name)
    elif isinstance(about, known.UnionType):
        for one in about.types:
            yield from numbers_of(one, path)
    elif isinstance(about, known.TupleType):
        for one in about.item_types:
            yield from numbers_of(one, f"{path}[]")
    elif isinstance(about, known.VarTupleType | known.ListType):
        yield from numbers_of(about.item_type, f"{path}[]")
    elif isinstance(about, known.IntType | known.FloatType):
        yield path, about


def loaded(target: str, *settings: str) -> Machine:
    """The machine of a target, with settings."""
    return load_target(target, machine_file=FILES.get(target), settings=settings).machine


def machine_numbers(target: str) -> dict[str, Any]:
    """Every number that the machine file of a target may hold, of the controller that it has and
    of its dialect, by its key; of lists the key of the list."""
    whole = known.type_info(Machine)
    assert isinstance(whole, known.StructType)
    found = dict(
        one
        for field in whole.fields
        if field.name not in ("controller", "dialect")
        for one in numbers_of(field.type, field.name)
    )
    found.update(numbers_of(known.type_info(type(loaded(target).controller)), "controller"))
    found.update(numbers_of(known.type_info(DIALECTS[target]), "dialect"))
    return found
