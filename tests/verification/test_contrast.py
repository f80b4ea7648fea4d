"""What a comparison draws: the samples within a window, as unbroken runs."""

import numpy as np
import pytest

from camtool.plain import to_json
from camtool.simulation.motion import Chunk, one_row
from camtool.verification import contrast
from camtool.verification.contrast import contrast_row, contrast_table, paths_within
from tests.oracles.judged import judged, sample_part

WINDOW = np.array([[0.0, 1.0], [0.0, 1.0]])
CUTS = np.array([True, True, False])


def chunks_of(points: list[tuple[float, float]], rows: list[int], size: int) -> list[Chunk]:
    """Samples of these rows, cut into chunks of at most `size`; slides 10 mm above."""
    found = []
    for row in sorted(set(rows)):
        own = [point for point, number in zip(points, rows, strict=True) if number == row]
        for low in range(0, len(own), size):
            part = np.array([(*point, 0.0) for point in own[low : low + size]])
            found.append(one_row(row, part, part + np.array([0.0, 10.0, 0.0])))
    return found


@pytest.mark.parametrize("size", [1, 2, 3, 100])
def test_runs_do_not_depend_on_chunks_and_begin_where_they_come_from(size: int) -> None:
    points = [(-1.0, 0.5), (0.2, 0.5), (0.4, 0.5), (2.0, 0.5), (0.6, 0.5), (0.7, 0.7)]
    runs = paths_within(chunks_of(points, [0] * 6, size), CUTS, WINDOW, commanded=True)
    assert [run.tolist() for run in runs] == [
        [[-1.0, 0.5], [0.2, 0.5], [0.4, 0.5]],
        [[2.0, 0.5], [0.6, 0.5], [0.7, 0.7]],
    ]


def test_what_does_not_cut_is_left_out_but_for_where_a_cut_begins() -> None:
    points = [(0.1, 0.1), (0.2, 0.2), (0.3, 0.3), (0.4, 0.4)]
    chunks = chunks_of(points, [1, 1, 2, 2], 10)
    (run,) = paths_within(chunks, CUTS, WINDOW, commanded=True)
    assert run.tolist() == [[0.1, 0.1], [0.2, 0.2]]
    (run,) = paths_within(chunks[::-1], CUTS, WINDOW, commanded=True)
    assert run.tolist() == [[0.4, 0.4], [0.1, 0.1], [0.2, 0.2]]


def test_slides_are_taken_unless_commanded_positions_are_asked_for() -> None:
    chunks = chunks_of([(0.1, 0.1), (0.2, 0.2)], [0, 0], 10)
    assert paths_within(chunks, CUTS, WINDOW, commanded=False) == []
    high = WINDOW + np.array([[0.0], [10.0]])
    (run,) = paths_within(chunks, CUTS, high, commanded=False)
    assert run.tolist() == [[0.1, 10.1], [0.2, 10.2]]


def test_pictures_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(contrast, "MAX_SHOWN_SAMPLES", 7)
    points = [(0.01 * number, 0.5) for number in range(50)]
    runs = paths_within(chunks_of(points, [0] * 50, 3), CUTS, WINDOW, commanded=True)
    assert sum(len(run) for run in runs) == 7


def test_the_table_and_its_json_say_the_same() -> None:
    part = sample_part().finish()
    row = contrast_row(
        "as it is", judged(part, part, lambda p: p + np.array([0.003, 0.004])).report
    )
    assert row.mechanics_max_um == pytest.approx(5.0)
    head, line = contrast_table([row]).splitlines()
    cells = line.removeprefix("as it is").split()
    assert cells[1] == f"{row.mechanics_max_um:.3f}"
    assert len(cells) == len(head.split()) - 1
    assert '"name": "as it is"' in to_json([row])
