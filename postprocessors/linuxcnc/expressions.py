"""Expressions of RS274/NGC: `[…]`, functions, parameters (`#1`, `#<name>`).

A value is compiled once and evaluated as often as its line is executed: a plain number is a float,
all else a function of the parameters. Text is that of `lines.closed`: small letters, no blanks.
Operators of one rank go from left to right, `**` too; the ranks are those of LinuxCNC
(`precedence` in interp_internal.cc): `**`, then `* / mod`, `+ -`, comparisons, `and or xor`.
Angles are in degrees; two numbers are `eq` when they differ by less than 0.0001."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Final

import numpy as np

from ..gcode.faults import LineFault
from .parameters import MAX_PARAMETERS, Parameters

Function = Callable[[Parameters], float]
Value = float | Function

EQUAL: Final = 1e-4
"""Two numbers are equal to EQ and NE when they differ by less (TOLERANCE_EQUAL)."""

WHOLE: Final = 1e-4
"""A number that differs from a whole one by no more counts as it, where a whole one is wanted."""

MAX_ROUNDED: Final = 2.0**31
"""ROUND of LinuxCNC goes through a 32-bit integer."""

MAX_NESTING: Final = 60
"""Brackets within brackets, deeper than a line has room for."""

NUMBER: Final = re.compile(r"[+-]*[0-9.]*")
_PLAIN: Final = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)")


class Scanner:
    """Parses values from a text, from `at` on."""

    def __init__(self, text: str, begin: int = 0) -> None:
        self.text, self.at = text, begin
        self._depth = 0

    def value(self) -> Value:
        """Parse a number, an expression, a parameter or a function."""
        text, begin = self.text, self.at
        sign, after = text[begin : begin + 1], text[begin + 1 : begin + 2]
        if sign == "[":
            return self.expression()
        if sign == "#":
            return self.parameter()
        if sign in ("+", "-") and after and not after.isdigit() and after != ".":
            self.at += 1
            inner = self.value()
            if sign == "+":
                return inner
            if isinstance(inner, float):
                return -inner
            function = inner
            return lambda parameters: -function(parameters)
        if "a" <= sign <= "z":
            return self._function()
        return self.number()

    def number(self) -> float:
        """Read a plain number."""
        match = NUMBER.match(self.text, self.at)
        assert match is not None  # the pattern also matches an empty text
        text = match[0]
        if _PLAIN.fullmatch(text) is None:
            raise LineFault(f"{text!r} is no number" if text else "no number", self.at)
        self.at = match.end()
        return float(text)

    def whole_number(self) -> Callable[[Parameters], int] | int:
        """Parse a value that must be an integer."""
        begin = self.at
        value = self.value()
        if isinstance(value, float):
            return whole_number(value, begin)
        function = value
        return lambda parameters: whole_number(function(parameters), begin)

    def expression(self) -> Value:
        """Parse [value operator value …]."""
        begin = self.at
        self.at += 1
        self._depth += 1
        if self._depth > MAX_NESTING:
            raise LineFault("brackets are nested too deeply", begin)
        result = self._ranked(self.value(), 1)
        self._operator_at(self.at)  # the bracket
        self.at += 1
        self._depth -= 1
        if isinstance(result, float):
            return finite(result, begin)
        function = result
        return lambda parameters: finite(function(parameters), begin)

    def _ranked(self, left_value: Value, rank: int) -> Value:
        """Parse operators of this precedence and above, up to the closing bracket, with
        `left_value` on the left of the first."""
        while True:
            name = self._operator_at(self.at)
            if name == "]" or RANKS[name] < rank:
                return left_value
            begin = self.at
            self.at += len(name)
            right = self._ranked(self.value(), RANKS[name] + 1)
            left_value = _apply_operator(OPERATORS[name], left_value, right, begin)

    def _operator_at(self, begin: int) -> str:
        for name in _BY_LENGTH:
            if self.text.startswith(name, begin):
                return name
        if begin >= len(self.text):
            raise LineFault("an expression without its closing bracket", begin)
        raise LineFault(f"{self.text[begin]!r} is no operator", begin)

    def parameter(self) -> Value:
        """Parse a parameter: #5, #[…], ##5 or #<name>."""
        begin = self.at
        self.at += 1
        if self.text[self.at : self.at + 1] == "<":
            name = self.name()
            return lambda parameters: parameters.value_of_name(name, begin)
        index = self.whole_number()
        if isinstance(index, int):
            fixed = check_index(index, begin)
            return lambda parameters: parameters.value_of_number(fixed, begin)
        computed = index
        return lambda parameters: parameters.value_of_number(
            check_index(computed(parameters), begin), begin
        )

    def name(self) -> str:
        """Read the name between < and >."""
        end = self.text.find(">", self.at)
        if end < 0:
            raise LineFault("a name without its closing >", self.at)
        name = self.text[self.at + 1 : end]
        self.at = end + 1
        return name

    def _function(self) -> Value:
        begin = self.at
        for name in FUNCTIONS:
            if self.text.startswith(name, begin):
                break
        else:
            raise LineFault(f"no function begins with {self.text[begin]!r}", begin)
        self.at += len(name)
        if self.text[self.at : self.at + 1] != "[":
            raise LineFault(f"{name} without its [", self.at)
        if name == "exists":
            return self._exists()
        first = self.expression()
        if name == "atan":
            if self.text[self.at : self.at + 2] != "/[":
                raise LineFault("atan wants two expressions: atan[y]/[x]", self.at)
            self.at += 1
            return _apply_operator(_atan, first, self.expression(), begin)
        return _apply_function(FUNCTIONS[name], first, begin)

    def _exists(self) -> Value:
        """Parse exists[#<name>], which is 1 if the name has a value, else 0."""
        self.at += 1
        if self.text[self.at : self.at + 1] != "#":
            raise LineFault("exists wants a parameter", self.at)
        begin = self.at
        self.at += 1
        if self.text[self.at : self.at + 1] == "<":
            name = self.name()
            result: Value = lambda parameters: parameters.has(name, begin)  # noqa: E731 - it is a value
        else:
            index = self.whole_number()
            computed = index if callable(index) else lambda parameters, fixed=index: fixed
            result = lambda parameters: float(1 <= computed(parameters) < MAX_PARAMETERS)  # noqa: E731
        if self.text[self.at : self.at + 1] != "]":
            raise LineFault("exists wants a closing bracket behind its parameter", self.at)
        self.at += 1
        return result


def evaluate(value: Value, parameters: Parameters) -> float:
    """Return the number of a value that may contain parameters."""
    return value if isinstance(value, float) else value(parameters)


def finite(value: float, column: int) -> float:
    """Return a number as it is; LineFault for inf and NaN."""
    if value - value != 0.0:
        raise LineFault("the result of a calculation is no number", column)
    return value


def whole_number(value: float, column: int) -> int:
    """Return the integer within `WHOLE` of a value; LineFault for a fraction."""
    low = math.floor(value)
    if value - low > 1.0 - WHOLE:
        return low + 1
    if value - low > WHOLE:
        raise LineFault(f"{value:g} is no whole number", column)
    return low


def check_index(index: int, column: int) -> int:
    """Return the index of a numbered parameter; LineFault for one that does not exist."""
    if not 1 <= index < MAX_PARAMETERS:
        raise LineFault(f"there is no parameter #{index} (1 to {MAX_PARAMETERS - 1})", column)
    return index


Binary = Callable[[float, float, int], float]


def _apply_operator(operator: Binary, left_value: Value, right: Value, column: int) -> Value:
    """Return the result of an operator if both sides are numbers, else a function that computes it
    when the line is executed."""
    if isinstance(left_value, float):
        if isinstance(right, float):
            return operator(left_value, right, column)
        one, second = left_value, right
        return lambda parameters: operator(one, second(parameters), column)
    first = left_value
    if isinstance(right, float):
        constant = right
        return lambda parameters: operator(first(parameters), constant, column)
    other = right
    return lambda parameters: operator(first(parameters), other(parameters), column)


def _apply_function(function: Callable[[float, int], float], inner: Value, column: int) -> Value:
    if isinstance(inner, float):
        return finite(function(inner, column), column)
    argument = inner
    return lambda parameters: finite(function(argument(parameters), column), column)


def _divide(dividend: float, right: float, column: int) -> float:
    if right == 0.0:
        raise LineFault("a division by zero", column)
    return dividend / right


def _modulo(dividend: float, right: float, _: int) -> float:
    if right == 0.0:  # only a result that is no number is an error, at the closing bracket
        return math.nan
    remainder = math.fmod(dividend, right)
    return remainder + abs(right) if remainder < 0.0 else remainder


def _power(base: float, right: float, column: int) -> float:
    if base < 0.0 and math.floor(right) != right:
        raise LineFault("a negative number to a power that is not whole", column)
    try:
        return math.pow(base, right)
    except (OverflowError, ValueError):
        return math.inf


def _atan(y: float, x: float, _: int) -> float:
    return _degrees(math.atan2(y, x))


_HALF_TURN: Final = np.longdouble(180.0)
_PI: Final = np.longdouble("3.14159265358979323846264338327950288")
"""LinuxCNC computes angles in C's long double, whose 64 bits of mantissa make sin[30] exactly 0.5
(fix[2 * sin[30]] is 1) and sin[180] no number above 0."""


def _degrees(angle_rad: float) -> float:
    return float(np.longdouble(angle_rad) * _HALF_TURN / _PI)


def _of_degrees(
    function: Callable[[np.longdouble], np.longdouble],
) -> Callable[[float, int], float]:
    return lambda value, _: float(function(np.longdouble(value) * _PI / _HALF_TURN))


def _arc(name: str, function: Callable[[float], float]) -> Callable[[float, int], float]:
    def applied(value: float, column: int) -> float:
        if not -1.0 <= value <= 1.0:
            raise LineFault(f"{name} of {value:g}, which is not from -1 to 1", column)
        return _degrees(function(value))

    return applied


def _ln(value: float, column: int) -> float:
    if value <= 0.0:
        raise LineFault(f"ln of {value:g}, which is not above 0", column)
    return math.log(value)


def _sqrt(value: float, column: int) -> float:
    if value < 0.0:
        raise LineFault(f"sqrt of {value:g}, which is below 0", column)
    return math.sqrt(value)


def _exp(value: float, column: int) -> float:
    try:
        return math.exp(value)
    except OverflowError:
        raise LineFault("the result of a calculation is no number", column) from None


def _round(value: float, column: int) -> float:
    """Return the nearest integer, halves away from zero."""
    if abs(value) >= MAX_ROUNDED:
        raise LineFault(f"round of {value:g}, which is too large", column)
    return float(math.trunc(value + (-0.5 if value < 0.0 else 0.5)))


_TRUTH: Final = {False: 0.0, True: 1.0}

OPERATORS: Final[dict[str, Binary]] = {
    "**": _power,
    "*": lambda a, b, _: a * b,
    "/": _divide,
    "mod": _modulo,
    "+": lambda a, b, _: a + b,
    "-": lambda a, b, _: a - b,
    "eq": lambda a, b, _: _TRUTH[abs(a - b) < EQUAL],
    "ne": lambda a, b, _: _TRUTH[abs(a - b) >= EQUAL],
    "lt": lambda a, b, _: _TRUTH[a < b],
    "le": lambda a, b, _: _TRUTH[a <= b],
    "gt": lambda a, b, _: _TRUTH[a > b],
    "ge": lambda a, b, _: _TRUTH[a >= b],
    "and": lambda a, b, _: _TRUTH[a != 0.0 and b != 0.0],
    "or": lambda a, b, _: _TRUTH[a != 0.0 or b != 0.0],
    "xor": lambda a, b, _: _TRUTH[(a == 0.0) != (b == 0.0)],
}

RANKS: Final = {
    "**": 6,
    **dict.fromkeys(("*", "/", "mod"), 5),
    **dict.fromkeys(("+", "-"), 4),
    **dict.fromkeys(("eq", "ne", "lt", "le", "gt", "ge"), 3),
    **dict.fromkeys(("and", "or", "xor"), 2),
    "]": 1,
}
"""Precedence of operators; higher ones bind more tightly."""

_BY_LENGTH: Final = sorted(RANKS, key=len, reverse=True)

FUNCTIONS: Final[dict[str, Callable[[float, int], float]]] = {
    "abs": lambda value, _: abs(value),
    "acos": _arc("acos", math.acos),
    "asin": _arc("asin", math.asin),
    "atan": lambda value, _: value,  # `Scanner._function` reads its second expression
    "cos": _of_degrees(np.cos),
    "exists": lambda value, _: value,  # ... and its parameter
    "exp": _exp,
    "fix": lambda value, _: float(math.floor(value)),
    "fup": lambda value, _: float(math.ceil(value)),
    "ln": _ln,
    "round": _round,
    "sin": _of_degrees(np.sin),
    "sqrt": _sqrt,
    "tan": _of_degrees(np.tan),
}
