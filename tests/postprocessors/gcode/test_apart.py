"""Writers and readers share no code: what one gets wrong, the other must be able to see."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3] / "postprocessors"
# What both must agree on: options of the [dialect] table; and the table of what is said of them.
SHARED = {"gcode.dialect", "gcode.findings"}


OTHERS = [("grbl", "linuxcnc"), ("linuxcnc", "grbl"), ("iso", "grbl"), ("iso", "linuxcnc")]


def neighbours(module: str) -> set[str]:
    """The modules of this room that a module imports."""
    folder, _, name = module.partition(".")
    file = ROOT / folder / f"{name}.py"
    if not file.exists():  # a kernel, which imports other kernels alone
        assert file.with_suffix(".pyx").exists()
        return set()
    text = file.read_text(encoding="utf-8")
    imported = {
        f"{folder}.{node.module or alias.name}" if node.level == 1 else str(node.module)
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.ImportFrom) and node.level
        for alias in node.names
    }
    # Functions of a target are named by text.
    return imported | set(re.findall(r'"camtool_postprocessors\.([\w.]+):\w+"', text))


def reached(module: str) -> set[str]:
    """All modules of this room that a module needs, itself too."""
    found, waiting = set(), {module}
    while waiting:
        module = waiting.pop()
        found.add(module)
        waiting |= neighbours(module) - found
    return found


@pytest.mark.parametrize("name", ["grbl", "linuxcnc", "iso"])
def test_what_both_need_are_options_only(name: str) -> None:
    both = reached(f"{name}.write") & reached(f"{name}.read")
    assert both == SHARED | {f"{name}.dialect"} | ({f"{name}.findings"} & both)


@pytest.mark.parametrize(("name", "other"), OTHERS)
def test_no_dialect_needs_another(name: str, other: str) -> None:
    needed = reached(f"{name}.__init__")
    assert not any(module.startswith(f"{other}.") for module in needed)
    assert {f"{name}.write", f"{name}.read"} <= needed
