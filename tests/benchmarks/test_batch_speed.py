"""How a batch of 500 drawings grows with processes, and what a second run costs.

    pytest -m benchmark tests/benchmarks/test_batch_speed.py -s

Prints its figures; docs/scale.md holds results. Two jobs can only be nearly twice as fast where
two cores are free: on a busy machine the ratio is that of what others leave.
"""

import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.benchmarks.batch_drawings import make_drawings

pytestmark = pytest.mark.benchmark
COUNT = 500
ROUNDS = 1
"""More of them on a machine that is not idle: the fastest of each counts."""


def seconds(folder: Path, out: str, *flags: str) -> tuple[float, str]:
    """Return the duration of the whole command, s, and its last line."""
    command = [sys.executable, "-m", "camtool", "batch", "drawings", "-t", "pic-mmh"]
    begin = time.perf_counter()
    done = subprocess.run(
        [*command, "--preview", "png", "-o", out, *flags],
        cwd=folder,
        check=True,
        capture_output=True,
        text=True,
    )
    return time.perf_counter() - begin, done.stderr.strip().splitlines()[-1]


def test_five_hundred_drawings(tmp_path: Path) -> None:
    assert make_drawings(tmp_path / "drawings", COUNT) == COUNT
    seconds(tmp_path, "warm")
    alone, pairs, again = [], [], []
    for turn in range(ROUNDS):  # by turns, so that what else runs here meets both alike
        alone.append(seconds(tmp_path, f"one{turn}", "--jobs", "1")[0])
        pairs.append(seconds(tmp_path, f"two{turn}", "--jobs", "2")[0])
        took, said = seconds(tmp_path, f"two{turn}", "--jobs", "2")
        assert f"{COUNT} up to date" in said
        again.append(took)
    one, two = sorted(tmp_path.glob("one0/**/*.p*")), sorted(tmp_path.glob("two0/**/*.p*"))
    assert len(one) == 2 * COUNT
    assert [path.read_bytes() for path in one] == [path.read_bytes() for path in two]
    first, both, second = min(alone), min(pairs), min(again)
    print(f"\n--jobs 1: {first:.1f} s, {COUNT / first:.1f} a second")
    print(f"--jobs 2: {both:.1f} s, {COUNT / both:.1f} a second: {first / both:.2f} times")
    print(f"again: {second:.2f} s, {100 * second / both:.1f} % of --jobs 2")
    assert first / both >= 1.8
    assert second < 0.02 * both


def test_memory_of_the_parent(tmp_path: Path) -> None:
    """Its peak over 500 drawings is that of a process of its own, without its workers."""
    make_drawings(tmp_path / "drawings", COUNT)
    code = (
        "import sys; sys.argv[0] = 'camtool'\n"
        "from camtool.batches.pool import peak_mib\n"
        "from camtool.cli.main import main\n"
        "try:\n    main()\n"
        "finally:\n    print(peak_mib())"
    )
    flags = ("-t", "pic-mmh", "-o", "out", "--preview", "png", "-q")
    done = subprocess.run(
        [sys.executable, "-c", code, "batch", "drawings", *flags],
        cwd=tmp_path,
        check=True,
        capture_output=True,
        text=True,
    )
    peak_mib = float(done.stdout)
    print(f"\npeak memory of the parent: {peak_mib:.0f} MiB")
    assert 0.0 < peak_mib < 300.0
