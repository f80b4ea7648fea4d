"""Kernels give the same when numba compiles them its own way, as with unknown versions."""

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
