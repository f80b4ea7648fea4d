"""What a job's numbers make together is estimated, and refused with the number that asks."""

import pytest

from camtool.errors import OptionError
from camtool.planning.job import MAX_MOVES, Tabs, refuse_endless
from camtool.planning.plan import plan
from camtool.records import replace
from tests.oracles.path_machine import path_machine
from tests.planning.test_place import drawing_of, job_of, rectangle


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"depth_mm": 1.0, "step_down_mm": 1e-5}, ["key step_down", "more than 10000 passes"]),
        ({"overlap_mm": 81.0}, ["key overlap", "20.2 times round a contour of 4 mm", "80 mm or"]),
        ({"depth_mm": 1.0, "tabs": Tabs(spacing_mm=1e-6)}, ["key tabs", "4e+06 moves"]),
    ],
)
def test_too_much_work_is_refused(settings: dict[str, object], words: list[str]) -> None:
    with pytest.raises(OptionError) as caught:
        plan(drawing_of([rectangle(0, 0, 1, 1)]), job_of(**settings), path_machine())
    for word in words:
        assert word in str(caught.value), str(caught.value)


def test_a_pocket_of_too_many_lines_is_refused_by_the_name_of_its_drawing() -> None:
    drawing = replace(drawing_of([rectangle(0, 0, 90, 90)]), file="plate.svg")
    job = job_of(kind="pocket", pattern="zigzag", tool_diameter_mm=0.01, step_over=0.4)
    with pytest.raises(OptionError, match=r"^plate.svg: operation 'pocket', key step_over: "):
        plan(drawing, job, path_machine())


def test_many_passes_of_much_are_too_much_where_few_of_little_are_not() -> None:
    many = [rectangle(2 * k, 0, 2 * k + 1, 1) for k in range(60)]
    settings = {"depth_mm": 1.0, "step_down_mm": 2e-4, "side": "on"}
    with pytest.raises(OptionError, match=r"key step_down: 5000 passes would make 1.2e\+06 moves"):
        plan(drawing_of(many), job_of(**settings), path_machine())
    toolpath = plan(drawing_of(many), job_of(**{**settings, "step_down_mm": 0.1}), path_machine())
    assert toolpath.is_feed.sum() >= 60 * 4 * 10


def test_the_limit_itself_is_allowed() -> None:
    refuse_endless(MAX_MOVES, "key depth", "it", "less")
    with pytest.raises(OptionError, match="1,000,000"):
        refuse_endless(MAX_MOVES + 1, "key depth", "it", "less")
