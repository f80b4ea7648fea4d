"""Flags that belong together become one record: the machinery of the decorators in `options`."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any


def gather(record: str, make: Callable[..., Any], names: tuple[str, ...]) -> Callable[..., Any]:
    """A wrapper that takes `names` out of a command's arguments and gives it one record."""

    def wrap(command: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(command)
        def called(**arguments: Any) -> Any:
            picked = {name: arguments.pop(name) for name in names}
            return command(**{record: make(**picked)}, **arguments)

        return called

    return wrap


def decorate(command: Any, options: list[Callable[..., Any]]) -> Any:
    """The command with these options, shown in their order."""
    for option in reversed(options):
        command = option(command)
    return command
