"""Memory of whole processes above that of the same command on a tiny file, over the size of the
file (`pytest -m benchmark -s` on this file; the aim is at most 10).

A process says its own peak (VmHWM of /proc/self/status, so on Linux alone). A busy machine changes
nothing of it. docs/benchmarks.md holds results.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from camtool.target.registry import load_target, target_names
from camtool.toolpath.moves import Kind, Toolpath
from tests.benchmarks.test_side_by_side import lines, strays

pytestmark = pytest.mark.benchmark
SAMPLES = Path(__file__).parents[2] / "samples"
PEAK = """
import atexit, re, runpy, sys
atexit.register(lambda: print(re.search("VmHWM.*", open("/proc/self/status").read())[0]))
runpy.run_module("camtool", run_name="__main__")
"""

MOVES = 1_000_000
ROUTER = "controller.machine_zero_mm=[0,0,9.5]"
# The lines' length, how far they go, mm; how many of all moves; options.
PROGRAMS: dict[str, tuple[float, float, int, tuple[str, ...]]] = {
    "linuxcnc": (0.02, 60.0, MOVES, ()),
    "grbl": (0.2, 60.0, MOVES, ()),
    "flashcut": (0.02, 3.0, MOVES, ()),
    "pic-mmh": (0.02, 3.0, MOVES, ()),
    "valcnc": (0.1, 3.0, MOVES, ()),
    "i8751": (0.1, 60.0, MOVES, ("--machine", str(SAMPLES / "i8751-sample.toml"))),
    "matlab-router": (1.0, 60.0, 300_000, ("--set", ROUTER)),
}


def walk(count: int, step_mm: float, reach_mm: float) -> np.ndarray:
    """Points (count, 2) mm of a path that bends at random and stays in a square."""
    way = np.cumsum(np.random.default_rng(3).normal(0.0, 0.3, count))
    points = step_mm * np.cumsum(np.column_stack([np.cos(way), np.sin(way)]), axis=0)
    folded = np.abs((points + reach_mm) % (4.0 * reach_mm) - 2.0 * reach_mm)
    return np.round(0.5 * folded + 1.0, 3)


def path(points: np.ndarray, feed: float, z_mm: float) -> Toolpath:
    """A rapid to the first of the points (K, 2), lines to the others, and the end."""
    kind = np.full(len(points) + 2, Kind.LINE, dtype=np.int8)
    kind[0], kind[-1] = Kind.RAPID, Kind.END
    end = np.column_stack([points[[0, *range(len(points)), -1]], np.full(len(kind), z_mm)])
    end[0, 2] = max(-5.0 * z_mm, 0.0)
    empty, unknown = np.full(len(kind), np.nan), np.full(len(kind), -1)
    feeds = np.where(kind == Kind.LINE, feed, np.nan)
    nowhere = np.full((len(kind), 2), np.nan)
    return Toolpath(kind, end, nowhere, feeds, empty, unknown, unknown, np.zeros(3))


def peak_mb(*words: str) -> float:
    """The most memory that `camtool` takes, MB."""
    command = [sys.executable, "-c", PEAK, *words]
    done = subprocess.run(command, check=True, capture_output=True, text=True)
    found = re.search(r"VmHWM:\s*(\d+) kB", done.stdout)
    assert found is not None
    return int(found[1]) * 1024e-6


def compare(name: str, tiny: Path, large: Path, *words: str) -> None:
    """Print what a large file takes more than a tiny one."""
    least, most = (peak_mb(words[0], str(file), *words[1:], "-q") for file in (tiny, large))
    size, more = large.stat().st_size * 1e-6, most - least
    print(f"\n{name}: {size:.1f} MB, {more:.0f} MB more, {more / size:.1f} times")


@pytest.mark.parametrize("name", sorted(set(PROGRAMS) & set(target_names())))
def test_a_program_is_judged(name: str, tmp_path: Path) -> None:
    step_mm, reach_mm, count, options = PROGRAMS[name]
    machine = SAMPLES / "i8751-sample.toml" if name == "i8751" else None
    target = load_target(name, machine_file=machine)
    files = []
    for many in (50, count):
        depth_mm = -1.0 if name == "matlab-router" else 0.0
        moves = path(walk(many, step_mm, reach_mm), target.machine.feed.default_mm_min, depth_mm)
        files.append(tmp_path / f"{many}.{target.machine.target.extension}")
        files[-1].write_bytes(target.target.write(moves, target.machine).data)
    compare(name, *files, "verify", "-t", name, *options)


@pytest.mark.parametrize("more", [(), ("--no-verify",)])
@pytest.mark.parametrize("what", ["100,000 loose lines", "a path of 1,000,000 points"])
def test_a_drawing_is_posted(what: str, more: tuple[str, ...], tmp_path: Path) -> None:
    files = []
    for many in (10, 100_000 if "lines" in what else MOVES):
        if "lines" in what:
            files.append(tmp_path / f"{many}.dxf")
            lines(strays(many, 500.0), files[-1])
        else:
            files.append(tmp_path / f"{many}.csv")
            rows = (f"{x:.3f},{y:.3f}" for x, y in walk(many, 0.2, 200.0).tolist())
            files[-1].write_text("\n".join(rows))
    out = str(tmp_path / "out.ngc")
    compare(" ".join([what, *more]), *files, "post", "-t", "linuxcnc", "-o", out, *more)
