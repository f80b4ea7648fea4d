"""Whole processes beside others' programs: start, reading, planning, writing, and for camtool also
verification, which the others do not do.

    pip install viaconstructor     # in an environment of its own
    pip install vpype vpype-gcode  # in another one
    VIACONSTRUCTOR="…/bin/python -m viaconstructor" VPYPE=…/bin/vpype \
        pytest -m benchmark -s tests/benchmarks/test_side_by_side.py

The commands run in turns on the same drawings, and the least time of each counts. A program that
is not there is left out, which the output says. docs/benchmarks.md holds results.
"""

from __future__ import annotations

import math
import os
import shlex
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import ezdxf
import numpy as np
import pytest

from tests.benchmarks.test_import import squares

pytestmark = pytest.mark.benchmark
ROUNDS = 3
ONCE_S, GIVEN_UP_S = 60.0, 600.0
"""What takes longer than the first is run once, and stopped after the second."""

CAMTOOL = f"{shlex.quote(sys.executable)} -m camtool"


def parts(path: Path) -> None:
    """Write 60 plates with round corners and a hole each, about 40 kB."""
    drawing = ezdxf.new(units=4)
    for number in range(60):
        x, y = 30.0 * (number % 10), 20.0 * (number // 10)
        quarter = 2.0**0.5 - 1.0
        corners = [(2, 0, 0), (23, 0, quarter), (25, 2, 0), (25, 13, quarter)]
        corners += [(23, 15, 0), (2, 15, quarter), (0, 13, 0), (0, 2, quarter)]
        rounded = [(x + right, y + up, bulge) for right, up, bulge in corners]
        drawing.modelspace().add_lwpolyline(rounded, format="xyb", close=True)
        drawing.modelspace().add_circle((x + 12.5, y + 7.5), 2.0 + 0.05 * number)
    drawing.saveas(path)


def lines(points: np.ndarray, path: Path) -> None:
    """Each of the lines (K, 2, 2) as an entity of its own."""
    drawing = ezdxf.new(units=4)
    for start, end in points.tolist():
        drawing.modelspace().add_line(start, end)
    drawing.saveas(path)


def strays(count: int, side_mm: float) -> np.ndarray:
    """Lines (count, 2, 2) of 1 mm anywhere in a square."""
    rng = np.random.default_rng(1)
    start, angle = rng.uniform(0.0, side_mm, (count, 2)), rng.uniform(0.0, 2.0 * np.pi, count)
    return np.stack([start, start + np.column_stack([np.cos(angle), np.sin(angle)])], axis=1)


def svg(elements: list[str], path: Path) -> None:
    """Elements in a page of 300 mm."""
    head = '<svg xmlns="http://www.w3.org/2000/svg" width="300mm" height="300mm" '
    text = f'{head}viewBox="0 0 300 300" fill="none" stroke="black">'
    path.write_text("\n".join([text, *elements, "</svg>"]))


def curves(path: Path) -> None:
    """900 quadratic Béziers of 5 to 50 mm."""
    rng = np.random.default_rng(1)
    numbers = np.hstack([rng.uniform(0, 250, (900, 2)), rng.uniform(5, 50, (900, 4))])
    row = '<path d="M{:.3f} {:.3f}q{:.3f} {:.3f} {:.3f} {:.3f}"/>'
    svg([row.format(*each) for each in numbers], path)


def scribble(path: Path) -> None:
    """500 polylines of 157 points anywhere: 78,000 lines that all cross."""
    points = np.random.default_rng(1).uniform(0.0, 300.0, (500, 157, 2))
    rows = (" ".join(f"{x:.3f},{y:.3f}" for x, y in each) for each in points.tolist())
    svg([f'<polyline points="{row}"/>' for row in rows], path)


def other(name: str, rest: str) -> str | None:
    """Somebody else's command, where the environment says how it is run."""
    return f"{os.environ[name]} {rest}" if name in os.environ else None


def seconds(command: str, folder: Path) -> float:
    """Wall-clock time of a whole process; infinite where it was given up."""
    begun = time.perf_counter()
    try:
        subprocess.run(
            shlex.split(command),
            cwd=folder,
            env={**os.environ, "QT_QPA_PLATFORM": "offscreen"},
            check=True,
            capture_output=True,
            timeout=GIVEN_UP_S,
        )
    except subprocess.TimeoutExpired:
        return math.inf
    return time.perf_counter() - begun


VIA = other("VIACONSTRUCTOR", "-o theirs.ngc {drawing}")
VPYPE = other("VPYPE", "read {drawing} gwrite -p gcodemm theirs.ngc")
FINE = other("VPYPE", "read -q 0.005mm {drawing} gwrite -p gcodemm theirs.ngc")
LOAD = f"{shlex.quote(sys.executable)} -c \"import ezdxf; ezdxf.readfile('{{drawing}}')\""
OFFSET = "--tool-diameter 0.5mm --side outside"

CASES: dict[str, tuple[str, Callable[[Path], None], str, dict[str, str | None]]] = {
    "60 plates, offset": ("parts.dxf", parts, "--tool-diameter 2mm", {"viaConstructor": VIA}),
    "10,000 loose lines that close to squares, offset": (
        "squares.dxf",
        lambda path: lines(squares(10_000), path),
        OFFSET,
        {"viaConstructor": VIA},
    ),
    "10,000 loose lines that meet no other": (
        "strays.dxf",
        lambda path: lines(strays(10_000, 500.0), path),
        "",
        {"viaConstructor": VIA},
    ),
    "900 quadratic Béziers, 5 µm": (
        "curves.svg",
        curves,
        "--tolerance 5um",
        {"vpype, chords of 0.1 mm": VPYPE, "vpype, chords of 5 µm": FINE},
    ),
    "500 polylines of 157 random points": ("scribble.svg", scribble, "", {"vpype": VPYPE}),
    "100,000 lines that meet no other": (
        "many.dxf",
        lambda path: lines(strays(100_000, 500.0), path),
        "",
        {"ezdxf.readfile": LOAD},
    ),
    "100,000 lines that close to squares": (
        "many_squares.dxf",
        lambda path: lines(squares(100_000), path),
        "",
        {"ezdxf.readfile": LOAD},
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_whole_processes(name: str, tmp_path: Path) -> None:
    drawing, make, flags, others = CASES[name]
    make(tmp_path / drawing)
    post = f"{CAMTOOL} post {drawing} -t linuxcnc {flags} -o ours.ngc"
    commands = {"camtool": post, "camtool --no-verify": f"{post} --no-verify"}
    missing = [each for each, command in others.items() if command is None]
    found = {each: text.format(drawing=drawing) for each, text in others.items() if text}
    commands |= found
    least: dict[str, float] = {}
    for _ in range(ROUNDS):
        for each, command in commands.items():
            if each not in least or least[each] < ONCE_S:
                least[each] = min(least.get(each, math.inf), seconds(command, tmp_path))
    size = (tmp_path / drawing).stat().st_size / 1e3
    print(f"\n{name}, {size:.0f} kB")
    for each, took in least.items():
        print(f"  {took:8.2f} s  {least['camtool'] / took:6.2f}  {each}")
    for each in missing:
        print(f"  not there: {each}")
    assert (tmp_path / "ours.ngc").stat().st_size > 10_000
