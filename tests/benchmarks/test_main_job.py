"""How long the main job takes, as ratios within one run: `pytest -m benchmark tests/benchmarks`.

pytest-benchmark prints, in brackets behind each figure, the ratio to the fastest of its group;
the groups are chosen so that this ratio is the answer. docs/benchmarks.md holds results. Every
benchmark also asserts a property of what it made.
"""

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from camtool.importers.options import ReadOptions
from camtool.importers.read import read_drawing
from camtool.pipeline import post_drawing, verify_program
from camtool.planning.job import job_of
from camtool.target.registry import load_target

pytestmark = pytest.mark.benchmark
ROOT = Path(__file__).parents[2]
LOGO = ROOT / "samples" / "logo.dxf"


def process(*command: str) -> int:
    return subprocess.run(command, cwd=ROOT, capture_output=True, check=False).returncode


@pytest.mark.benchmark(group="start-up: the help is at most 4 times the import of click")
@pytest.mark.parametrize(
    "command",
    [("-c", "import click"), ("-m", "camtool", "--help")],
    ids=["import click", "camtool --help"],
)
def test_start_up(benchmark: Any, command: tuple[str, ...]) -> None:
    assert benchmark.pedantic(process, (sys.executable, *command), rounds=15) == 0


@pytest.mark.benchmark(group="logo, stages in one process, kernels compiled")
@pytest.mark.parametrize("stage", ["read", "post --no-verify", "post", "verify --against"])
def test_stages(benchmark: Any, stage: str) -> None:
    target = load_target("pic-mmh")
    options = ReadOptions(tolerance_mm=target.machine.defaults.fit_tolerance_mm)
    drawing = read_drawing(LOGO, options=options)
    program = post_drawing(drawing, job_of(), target).program
    assert program is not None
    work = {
        "read": lambda: read_drawing(LOGO, options=options),
        "post --no-verify": lambda: post_drawing(drawing, job_of(), target, check=False),
        "post": lambda: post_drawing(drawing, job_of(), target),
        "verify --against": lambda: verify_program(
            program.data, target, source="logo.pic", drawing=drawing
        ),
    }[stage]
    result = benchmark.pedantic(work, rounds=7, warmup_rounds=1)
    assert result is not None


@pytest.mark.benchmark(group="logo, whole process")
@pytest.mark.parametrize("flags", [("--no-verify",), ()], ids=["post --no-verify", "post"])
def test_whole_process(benchmark: Any, flags: tuple[str, ...], tmp_path: Path) -> None:
    command = [sys.executable, "-m", "camtool", "post", str(LOGO), "-t", "pic-mmh", "-q"]
    output = tmp_path / "logo.pic"
    code = benchmark.pedantic(
        process, (*command, "-o", str(output), *flags), rounds=7, warmup_rounds=1
    )
    assert code == 0
    assert output.read_bytes().endswith(b"M30;\n")


def strokes(count: int) -> bytes:
    """`count` closed squares of 40 µm on a grid inside the table, as CSV."""
    rows = []
    for index in range(count):
        x, y = 0.06 * (index % 100), 0.06 * (index // 100)
        corners = [(0, 0), (0.04, 0), (0.04, 0.04), (0, 0.04), (0, 0)]
        rows.append("\n".join(f"{x + dx:.4f},{y + dy:.4f}" for dx, dy in corners))
    return "\n\n".join(rows).encode()


@pytest.mark.benchmark(group="growth: post of 100, 1,000 and 10,000 squares")
@pytest.mark.parametrize("count", [100, 1_000, 10_000])
def test_growth(benchmark: Any, count: int, tmp_path: Path) -> None:
    file = tmp_path / "squares.csv"
    file.write_bytes(strokes(count))
    target = load_target("pic-mmh")

    def work() -> int:
        posted = post_drawing(read_drawing(file), job_of(), target, check=False)
        assert posted.program is not None
        return len(posted.program.row_of_block)

    blocks = benchmark.pedantic(work, rounds=3, warmup_rounds=1)
    assert blocks >= 7 * count
