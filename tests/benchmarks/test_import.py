"""How long reading takes, as ratios within one run: `pytest -m benchmark tests/benchmarks`.

The group's name says what is wanted; the ratio is the one that pytest-benchmark prints behind each
figure. docs/benchmarks.md holds results. Every benchmark also asserts a property of its result.
"""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from camtool.geometry.chain import chain
from camtool.geometry.drawing import Drawing, Units
from camtool.geometry.facts import drawing_facts
from camtool.geometry.polylines import Polylines
from camtool.importers.assemble import assemble
from camtool.importers.options import ReadOptions
from camtool.importers.pieces import Piece
from camtool.importers.read import read_drawing

pytestmark = pytest.mark.benchmark
SEGMENTS = 100_000
GAP_MM = 0.01


def shuffled(lines: np.ndarray) -> np.ndarray:
    """Lines (K, 2, 2) in any order, each drawn in either direction."""
    rng = np.random.default_rng(7)
    lines = lines[rng.permutation(len(lines))]
    back = rng.random(len(lines)) < 0.5
    lines[back] = lines[back, ::-1]
    return lines


def squares(count: int) -> np.ndarray:
    """Shuffled sides (count, 2, 2) of squares of 1 mm on a grid."""
    number = np.arange(count // 4)
    side = int(np.ceil(np.sqrt(len(number))))
    place = 2.0 * np.column_stack([number % side, number // side])[:, None, :]
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]], dtype=np.float64)
    begin, end = place + corners[:4], place + corners[1:]
    return shuffled(np.stack([begin, end], axis=2).reshape(-1, 2, 2))


def stroke(count: int) -> np.ndarray:
    """Shuffled lines (count, 2, 2) of one long random stroke."""
    points = np.cumsum(np.random.default_rng(3).normal(size=(count + 1, 2)), axis=0)
    return shuffled(np.stack([points[:-1], points[1:]], axis=1))


def branches(count: int) -> np.ndarray:
    """Shuffled edges of a grid, four of which meet at each node."""
    side = int(np.sqrt(count / 2))
    node = np.stack(np.meshgrid(np.arange(side), np.arange(side)), axis=2).reshape(-1, 2)
    steps = [np.stack([node, node + step], axis=1) for step in ([1, 0], [0, 1])]
    return shuffled(np.concatenate(steps).astype(np.float64))


def strays(count: int) -> np.ndarray:
    """Short lines (count, 2, 2) that hardly meet."""
    rng = np.random.default_rng(5)
    begin = 100.0 * rng.random((count, 2))
    return np.stack([begin, begin + rng.normal(scale=0.1, size=(count, 2))], axis=1)


def columns(lines: np.ndarray) -> Polylines:
    vertices = np.concatenate([lines, np.zeros((len(lines), 2, 1))], axis=2).reshape(-1, 3)
    return Polylines(vertices, np.arange(0, len(vertices) + 1, 2), np.zeros(len(lines), bool))


def pieces(lines: np.ndarray) -> list[Piece]:
    return [
        Piece(path.vertices, False, "0", "#000000", f"LINE {number:X}")
        for number, path in enumerate(columns(lines))
    ]


def assembled(parts: list[Piece]) -> Drawing:
    return assemble(
        parts,
        file="t.dxf",
        units=Units("mm", 1.0, "in a benchmark"),
        used={},
        skipped=[],
        findings=[],
        options=ReadOptions(),
    )


@pytest.mark.benchmark(group="100,000 segments chained: below 1.5 s")
@pytest.mark.parametrize("lines", [squares, stroke, branches, strays], ids=lambda f: f.__name__)
def test_chain(benchmark: Any, lines: Any) -> None:
    columnar = columns(lines(SEGMENTS))
    found = benchmark.pedantic(lambda: chain(columnar, GAP_MM), rounds=3, warmup_rounds=1)
    assert sum(map(len, found.members)) == len(columnar)
    if lines is squares:
        assert len(found.lines) == SEGMENTS // 4
        assert found.lines.closed.all()


@pytest.mark.benchmark(group="pieces to contours, healed and judged: 10,000 below 0.15 s")
@pytest.mark.parametrize("count", [10_000, SEGMENTS])
def test_assemble(benchmark: Any, count: int) -> None:
    parts = pieces(squares(count))
    drawing = benchmark.pedantic(lambda: assembled(parts), rounds=3, warmup_rounds=1)
    assert len(drawing.paths) == count // 4


@pytest.mark.benchmark(group="facts of 100,000 segments")
def test_facts(benchmark: Any) -> None:
    drawing = assembled(pieces(squares(SEGMENTS)))
    facts = benchmark.pedantic(lambda: drawing_facts(drawing), rounds=3, warmup_rounds=1)
    assert facts["smallest"]["distance"]["size_mm"] == pytest.approx(1.0)


def dxf(count: int) -> bytes:
    """The shuffled sides of squares as LINE entities."""
    import ezdxf

    document = ezdxf.new("R2013")
    document.units = 4
    space = document.modelspace()
    for begin, end in squares(count).tolist():
        space.add_line(begin, end)
    stream = io.StringIO()
    document.write(stream)
    return stream.getvalue().encode()


@pytest.mark.benchmark(group="a DXF of 10,000 loose lines: at most 1.3 times ezdxf's loading")
@pytest.mark.parametrize("reader", ["ezdxf.readfile", "read_drawing"])
def test_dxf(benchmark: Any, reader: str, tmp_path: Path) -> None:
    read_dxf(benchmark, reader, tmp_path, 10_000)


@pytest.mark.benchmark(group="a DXF of 100,000 loose lines: at most 1.3 times ezdxf's loading")
@pytest.mark.parametrize("reader", ["ezdxf.readfile", "read_drawing"])
def test_large_dxf(benchmark: Any, reader: str, tmp_path: Path) -> None:
    read_dxf(benchmark, reader, tmp_path, 100_000)


def read_dxf(benchmark: Any, reader: str, tmp_path: Path, count: int) -> None:
    """So many lines read by either."""
    import ezdxf

    file = tmp_path / "lines.dxf"
    file.write_bytes(dxf(count))
    if reader == "read_drawing":
        drawing = benchmark.pedantic(lambda: read_drawing(file), rounds=3, warmup_rounds=1)
        assert len(drawing.paths) == count // 4
        assert drawing.paths.closed.all()
    else:
        document = benchmark.pedantic(lambda: ezdxf.readfile(file), rounds=3, warmup_rounds=1)
        assert len(document.modelspace()) == count


def svg(count: int) -> bytes:
    """Random quadratic Béziers of 5 to 50 mm, one path."""
    rng = np.random.default_rng(1)
    sizes = rng.uniform(5.0, 50.0, count)
    place = 60.0 * np.column_stack([np.arange(count) % 30, np.arange(count) // 30])
    curves = rng.uniform(0.0, 1.0, (count, 3, 2)) * sizes[:, None, None] + place[:, None, :]
    data = " ".join(
        "M{:.4f} {:.4f}Q{:.4f} {:.4f} {:.4f} {:.4f}".format(*row)
        for row in curves.reshape(count, 6)
    )
    page = 'xmlns="http://www.w3.org/2000/svg" width="1800mm" viewBox="0 0 1800 1800"'
    return f'<svg {page}><path d="{data}"/></svg>'.encode()


@pytest.mark.benchmark(group="an SVG of 900 quadratic Béziers: below 0.5 s")
@pytest.mark.parametrize("reader", ["svgpathtools", "read_drawing"])
def test_svg(benchmark: Any, reader: str, tmp_path: Path) -> None:
    import svgpathtools

    file = tmp_path / "curves.svg"
    file.write_bytes(svg(900))
    if reader == "svgpathtools":
        paths, _ = benchmark.pedantic(
            lambda: svgpathtools.svg2paths(str(file)), rounds=5, warmup_rounds=1
        )
        assert sum(map(len, paths)) == 900
        return
    drawing = benchmark.pedantic(lambda: read_drawing(file), rounds=5, warmup_rounds=1)
    assert len(drawing.paths) == 900
    benchmark.extra_info["moves"] = len(drawing.paths.vertices) - 900
