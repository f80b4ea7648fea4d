"""A job that fits its drawing into a size reads it twice, at first for its box alone."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from camtool.importers.options import ReadOptions
from camtool.importers.read import read_bytes
from camtool.jobs.drawing import read_to_scale
from camtool.planning.job import Job, Operation, Placement
from camtool.planning.place import part_scale
from camtool.records import replace

PAGE = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="300mm" height="300mm" '
    'viewBox="0 0 300 300" stroke="black">'
)
RAGGED = "M10 20q30 60 60 5t80 30t70 -60c-20 -70 -90 40 -120 -40z"


def _curves(seed: int) -> bytes:
    """Quadratic and cubic Béziers anywhere, one of which is a point far away."""
    rng = np.random.default_rng(seed)
    starts, steps = rng.uniform(0.0, 250.0, (60, 2)), rng.uniform(-30.0, 50.0, (60, 6))
    paths = []
    for k, ((x, y), row) in enumerate(zip(starts.tolist(), steps.tolist(), strict=True)):
        numbers = " ".join(f"{number:.3f}" for number in row[: 4 + 2 * (k % 2)])
        paths.append(f"M{x:.3f} {y:.3f}{'qc'[k % 2]}{numbers}")
    every = ["M900 900q0 0 0 0", *paths, RAGGED]
    return (PAGE + "".join(f'<path d="{each}"/>' for each in every) + "</svg>").encode()


@pytest.mark.parametrize("rotate_rad", [0.0, 0.5 * np.pi, 0.3])
@pytest.mark.parametrize("seed", range(4))
def test_the_box_gives_the_scale_that_all_curves_give(seed: int, rotate_rad: float) -> None:
    read = partial(read_bytes, _curves(seed), "a.svg")
    job = Job(
        operations=(Operation(),), placement=Placement(fit_mm=(70.0, 50.0), rotate_rad=rotate_rad)
    )
    asked: list[ReadOptions] = []

    def reading(options: ReadOptions) -> object:
        asked.append(options)
        return read(options)

    got = read_to_scale(reading, ReadOptions(), job)
    scale = part_scale(read(ReadOptions()), job)
    wanted = read(ReadOptions(scale=scale))
    assert got.made_for == scale
    assert np.array_equal(got.paths.vertices, wanted.paths.vertices)
    assert [each.box_only for each in asked] == [rotate_rad != 0.3, False]


def test_a_drawing_that_fits_already_is_not_left_as_chords() -> None:
    read = partial(read_bytes, _curves(0), "a.svg")
    whole = read(ReadOptions())
    job = Job(operations=(Operation(),), placement=Placement(fit_mm=(1.0, 0.0)))
    scale = part_scale(whole, job)
    fitting = replace(job, placement=Placement(fit_mm=(1.0 / scale, 0.0)))
    got = read_to_scale(read, ReadOptions(), fitting)
    assert np.array_equal(got.paths.vertices, whole.paths.vertices)


def test_a_fit_that_is_impossible_leaves_the_drawing_as_it_is() -> None:
    line = (PAGE + '<path d="M5 5H90q5 0 10 0"/></svg>').encode()
    read = partial(read_bytes, line, "a.svg")
    job = Job(operations=(Operation(),), placement=Placement(fit_mm=(0.0, 20.0)))
    got = read_to_scale(read, ReadOptions(), job)
    assert np.array_equal(got.paths.vertices, read(ReadOptions()).paths.vertices)


def test_layers_of_the_job_have_their_own_box() -> None:
    inner = '<g id="A"><path d="M50 50q40 80 60 0"/></g>'
    outer = '<g id="B"><path d="M0 0q5 200 290 290"/></g>'
    data = (PAGE + outer + inner + "</svg>").encode()
    read = partial(read_bytes, data, "a.svg")
    job = Job(operations=(Operation(layers=("A",)),), placement=Placement(fit_mm=(10.0, 0.0)))
    got = read_to_scale(read, ReadOptions(), job)
    assert got.made_for == pytest.approx(10.0 / 60.0)
