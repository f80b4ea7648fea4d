"""Flags that belong together become one record: the machinery of the decorators in `options`."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import fields
from typing import Any, TypeVar, cast

Command = TypeVar("Command", bound=Callable[..., Any])
Option = Callable[..., Any]


def gather(
    record: str, make: Callable[..., Any], names: Sequence[str]
) -> Callable[[Command], Command]:
    """A wrapper that takes `names` out of a command's arguments and gives it one record."""

    def wrap(command: Command) -> Command:
        @functools.wraps(command)
        def called(**arguments: Any) -> Any:
            picked = {name: arguments.pop(name) for name in names}
            return command(**{record: make(**picked)}, **arguments)

        return cast("Command", called)

    return wrap


def decorate(command: Command, options: Sequence[Option]) -> Command:
    """The command with these options, shown in their order."""
    for option in reversed(options):
        command = option(command)
    return command


def with_flags(
    command: Command, record: str, make: type[Any], options: Sequence[Option]
) -> Command:
    """The command with these options, which reach it as `record`, a dataclass whose fields are
    named after them."""
    names = [field.name for field in fields(make)]
    return decorate(gather(record, make, names)(command), options)
