"""No kernel looks or writes outside its arrays: their tests again, with every index checked."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]
CHECKED = ("kernels", "simulation/test_mechanics.py", "verify/test_verify_judge.py")


@pytest.mark.slow
def test_every_index_of_a_kernel_is_within_its_array(tmp_path: Path) -> None:
    env = {**os.environ, "NUMBA_BOUNDSCHECK": "1", "NUMBA_CACHE_DIR": str(tmp_path)}
    words = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider"]
    done = subprocess.run(
        [*words, *(str(TESTS / name) for name in CHECKED)],
        env=env,
        cwd=TESTS.parent,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-3000:]
    assert "passed" in done.stdout


def test_an_index_beyond_its_array_would_be_seen(tmp_path: Path) -> None:
    """The same switch on a loop that goes one too far."""
    script = tmp_path / "astray.py"
    script.write_text(
        "import numpy as np\n"
        "from camtool.kernels.compiled import kernel\n"
        "@kernel\n"
        "def fill(out):\n"
        "    for k in range(len(out) + 1):\n"
        "        out[k] = 1.0\n"
        "fill(np.empty(5))\n"
    )
    env = {**os.environ, "NUMBA_BOUNDSCHECK": "1", "NUMBA_CACHE_DIR": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, str(script)], env=env, capture_output=True, text=True, check=False
    )
    assert done.returncode != 0
    assert "IndexError" in done.stderr
