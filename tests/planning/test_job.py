"""What a job may say."""

from __future__ import annotations

import math
from typing import Any

import pytest

from camtool.errors import OptionError
from camtool.planning.job import job_of

BAD = [
    ("tool_diameter_mm", -0.1),
    ("tool_diameter_mm", math.nan),
    ("tool_diameter_mm", math.inf),
    *[
        (name, value)
        for name in (
            "feed_mm_min",
            "plunge_feed_mm_min",
            "safe_z_mm",
            "depth_mm",
            "spindle_rpm",
        )
        for value in (0.0, -1.0, math.nan, math.inf)
    ],
    ("side", "left"),
    ("side", ""),
    ("origin", "upper-right"),
]


@pytest.mark.parametrize(("name", "value"), BAD)
def test_what_no_job_can_be_is_refused_with_a_mend(name: str, value: Any) -> None:
    with pytest.raises(OptionError) as caught:
        job_of(**{name: value})
    assert caught.value.mend
    assert "\n" not in str(caught.value)


def test_a_job_says_nothing_unless_told() -> None:
    job = job_of()
    assert (job.tool_diameter_mm, job.side, job.origin, job.layers) == (0.0, "auto", "drawing", ())
    assert job.feed_mm_min is job.depth_mm is job.safe_z_mm is job.spindle_rpm is None


def test_the_known_words_are_told() -> None:
    with pytest.raises(OptionError, match="on, outside, inside, auto"):
        job_of(side="left")


@pytest.mark.parametrize(
    ("patterns", "layer", "taken"),
    [
        ((), "anything", True),
        (("CUT",), "CUT", True),
        (("CUT",), "cut", True),
        (("CUT",), "CUTS", False),
        (("ENG*", "CUT"), "ENGRAVE 2", True),
        (("?",), "0", True),
    ],
)
def test_layers_are_chosen_by_pattern(patterns: tuple[str, ...], layer: str, taken: bool) -> None:
    assert job_of(layers=patterns).takes(layer) is taken
