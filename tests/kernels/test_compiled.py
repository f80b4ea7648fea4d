"""Kernels give the same when numba compiles them its own way, as with unknown versions."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SCRIPT = """
import sys
from camtool.kernels import compiled
if sys.argv[1] == "its own":
    compiled.OWN_COMPILERS_FOR = ()
assert compiled.own_compilers() == (sys.argv[1] == "ours")
from camtool.toolpath.builder import ToolpathBuilder
from camtool.verification.verify import verify
from tests.oracles.dense_moves import circle, pic_mmh, square
part = circle(square(ToolpathBuilder(), 1.0, 1.0, 0.5), 4.0, 4.0, 0.7)
print(verify(part.finish(), pic_mmh()).report.to_json())
"""


@pytest.mark.slow
def test_either_way_of_compiling_gives_the_same(tmp_path: Path) -> None:
    reports = []
    for way in ("ours", "its own"):
        done = subprocess.run(
            [sys.executable, "-c", SCRIPT, way],
            cwd=ROOT,
            env={"NUMBA_CACHE_DIR": str(tmp_path / way), "PYTHONPATH": str(ROOT)},
            capture_output=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        reports.append(done.stdout)
    assert reports[0] == reports[1]


KERNELS = ROOT / "camtool" / "kernels"
MAKERS = {
    "append", "arange", "argsort", "array", "column_stack", "concatenate", "copy", "cumsum",
    "diff", "empty", "empty_like", "flatnonzero", "full", "full_like", "linspace", "ones", "sort",
    "stack",
    "where", "zeros", "zeros_like",
}  # fmt: skip
"""What makes an array."""


def compiled_functions() -> dict[str, tuple[str, ast.FunctionDef]]:
    """All functions of the kernels that are compiled: by what decorator, and their code."""
    found = {}
    for file in sorted(KERNELS.glob("*.py")):
        for node in ast.parse(file.read_text(encoding="utf-8")).body:
            for mark in node.decorator_list if isinstance(node, ast.FunctionDef) else ():
                name = mark.func if isinstance(mark, ast.Call) else mark
                if isinstance(name, ast.Name) and name.id in (
                    "kernel",
                    "inner",
                    "bare",
                    "loose_bare",
                ):
                    assert isinstance(node, ast.FunctionDef)
                    found[node.name] = (name.id, node)
    return found


def test_bare_functions_call_nothing_that_makes_arrays() -> None:
    """Whether such a call compiles depends on what was compiled before it: with nothing on disk,
    the first command of a new installation may be the one that fails."""
    functions = compiled_functions()
    bare = [name for name, (mark, _) in functions.items() if "bare" in mark]
    assert len(bare) > 10
    for name in bare:
        waiting, seen = [name], {name}
        while waiting:
            calls = [
                node
                for node in ast.walk(functions[waiting.pop()][1])
                if isinstance(node, ast.Call)
            ]
            made = [call.func.attr for call in calls if isinstance(call.func, ast.Attribute)]
            assert not MAKERS & set(made), f"{name} comes to what makes an array: {made}"
            named = {call.func.id for call in calls if isinstance(call.func, ast.Name)}
            fresh = (named & functions.keys()) - seen
            waiting += fresh
            seen |= fresh
