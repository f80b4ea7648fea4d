"""Writers and readers share no code: what one gets wrong, the other must be able to see."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2] / "postprocessors"
# Options of the [dialect] table are what both must agree on.
SHARED = {"_gcode_options"}


def neighbours(module: str) -> set[str]:
    """The modules beside it that a module imports."""
    tree = ast.parse((ROOT / f"{module}.py").read_text(encoding="utf-8"))
    return {
        str(node.module)
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and node.level == 1
    }


def reached(module: str) -> set[str]:
    """All modules of this room that a module needs, itself too."""
    found, waiting = set(), {module}
    while waiting:
        module = waiting.pop()
        found.add(module)
        waiting |= neighbours(module) - found
    return found


@pytest.mark.parametrize("name", ["grbl", "linuxcnc"])
def test_what_both_need_are_options_only(name: str) -> None:
    both = reached(f"_{name}_write") & reached(f"_{name}_read")
    assert both == SHARED | {f"_{name}_options"}


@pytest.mark.parametrize(("name", "other"), [("grbl", "linuxcnc"), ("linuxcnc", "grbl")])
def test_no_dialect_needs_another(name: str, other: str) -> None:
    assert not any(f"_{other}_" in module for module in reached(name))
    assert {f"_{name}_write", f"_{name}_read"} <= reached(name)
