"""Parameters of a program: numbered (`#1`), named (`#<name>`, `#<_global>`), and those that show
the state of the interpreter.

A numbered parameter that nobody has set is 0 (those of 31 to 5000 may be stored on the machine); a
named one is an error. What only the machine knows has no value here: results of probing, inputs,
values of the INI file and of HAL."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import cached_property
from typing import Final

from ..gcode.faults import LineFault

MAX_PARAMETERS: Final = 5602
"""Numbers of parameters are below this (RS274NGC_MAX_PARAMETERS)."""

ARGUMENTS: Final = range(1, 31)
"""Numbers of the parameters that a call gives and a return gives back."""

CURRENT: Final = range(5420, 5429)
"""The position, X Y Z A B C U V W in the units and the frame of the program."""

READ_ONLY: Final = frozenset((*range(5400, 5414), *CURRENT))

UNKNOWN: Final = {
    **dict.fromkeys(range(5061, 5071), "a result of probing"),
    5399: "the result of M66",
}
"""Parameters whose values only the machine knows."""

DEBUG: Final = 5599
"""1 at first: `(debug,…)` is shown where it is above 0."""


class Parameters:
    """Values by number and by name; `state` gives the names that show the
    interpreter's state.

    `unset`: the numbers that were read before anybody set them, and where; `known`: numbers with
    a value from the beginning on."""

    def __init__(
        self,
        stored: Mapping[int, float],
        state: Callable[[], Mapping[str, Callable[[], float]]],
        position: Callable[[], Iterable[float]],
    ) -> None:
        self.unset: dict[int, int] = {}
        self.compensating = False
        """True while the cutter's radius is compensated; the position cannot be read then."""
        self.line = 0
        """Number of the line that is executed."""
        self._values = {DEBUG: 1.0, 5600: 0.0, 5601: 0.0, **stored}
        self._names_of = state
        self._more: dict[str, Callable[[], float]] = {}
        self._position = position
        self._globals: dict[str, float] = {}
        self._locals: list[dict[str, float]] = [{}]

    def show(self, names: Mapping[str, Callable[[], float]]) -> None:
        """Add names that show the state of the interpreter."""
        self._more |= names

    @cached_property
    def _state(self) -> dict[str, Callable[[], float]]:
        return {**self._names_of(), **self._more}

    def value_of_number(self, index: int, column: int) -> float:
        """Return the value of a numbered parameter; 0 if it has none yet."""
        value = self._values.get(index)
        if value is not None:
            return value
        if index in CURRENT:
            if self.compensating:
                message = "the position cannot be read while the cutter's radius is compensated"
                raise LineFault(message, column)
            return list(self._position())[index - CURRENT.start]
        if index in UNKNOWN:
            raise LineFault(f"#{index} is {UNKNOWN[index]}, which only the machine knows", column)
        self.unset.setdefault(index, self.line)
        return 0.0

    def stored_value(self, index: int) -> float:
        """Return the value of a numbered parameter, for the interpreter's own use."""
        return self._values.get(index, 0.0)

    def value_of_name(self, name: str, column: int) -> float:
        """Return the value of a named parameter."""
        if name in self._state:
            return self._state[name]()
        value = self._of(name).get(name)
        if value is None:
            if name.startswith(("_ini[", "_hal[")):
                where = "the machine's INI file" if name[1] == "i" else "HAL"
                raise LineFault(
                    f"#<{name}> is a value of {where}, which only the machine knows", column
                )
            mend = "set it first" if name[:1] == "_" else "names without _ are known in one sub"
            raise LineFault(f"nobody has set #<{name}>", column, mend)
        return value

    def has(self, name: str, column: int) -> float:
        """Return 1 if a name has a value, else 0."""
        if name.startswith(("_ini[", "_hal[")):
            return float(bool(self.value_of_name(name, column)))
        return float(name in self._state or name in self._of(name))

    def declare(self, name: str, column: int) -> None:
        """Create a name when a line sets it, so that it exists while the rest of the line is
        read."""
        if name in self._state:
            raise LineFault(f"#<{name}> cannot be set", column)
        self._of(name).setdefault(name, 0.0)

    def set_named(self, name: str, value: float) -> None:
        """Set the value of a name."""
        self._of(name)[name] = value

    def set_numbered(self, index: int, value: float) -> None:
        """Set the value of a numbered parameter."""
        self._values[index] = value

    def enter(self, arguments: Iterable[float] | None) -> dict[int, float | None] | None:
        """Begin a call: create its local names, and put its arguments into #1 to #30 (M98 has
        none). Return the values that #1 to #30 had before, None without arguments."""
        self._locals.append({})
        if arguments is None:
            return None
        before = {index: self._values.get(index) for index in ARGUMENTS}
        self._values.update(dict.fromkeys(ARGUMENTS, 0.0))
        self._values.update(zip(ARGUMENTS, arguments, strict=False))
        return before

    def leave(self, before: dict[int, float | None] | None) -> None:
        """End a call: restore the local parameters of the caller."""
        self._locals.pop()
        for index, value in (before or {}).items():
            if value is None:
                self._values.pop(index, None)
            else:
                self._values[index] = value

    def _of(self, name: str) -> dict[str, float]:
        return self._globals if name[:1] == "_" else self._locals[-1]
