"""Places and tools as messages of planning name them."""

from __future__ import annotations

from collections.abc import Sequence

from camtool.planning.job import Operation, Tool


def at_place(name: str, point: Sequence[float]) -> str:
    """A path's name and a place (x, y) mm of it."""
    return f"{name} at X {point[0]:.4f} Y {point[1]:.4f}"


def tool_name(tool: Tool) -> str:
    """The tool by its diameter, and its name if it has one."""
    called = f" ({tool.name})" if tool.name else ""
    return f"a tool of {tool.diameter_mm:g} mm{called}"


def key_of(operation: Operation, key: str) -> str:
    """Where a setting of an operation stands in its job."""
    return f"{operation_name(operation)}, key {key}"


def operation_name(operation: Operation) -> str:
    """An operation by its name, or by its kind when it has none."""
    return f"operation {operation.name or operation.kind!r}"
