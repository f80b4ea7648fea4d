"""The options of dialects, anywhere in their ranges: the loader refuses one, or all that follows
(writing, reading, following, comparing) takes the program that it makes."""

from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from camtool.errors import MachineError
from camtool.findings import Severity
from camtool.geometry.polylines import Polyline
from camtool.pipeline import post_drawing
from camtool.planning.job import job_of
from camtool.target.registry import load_target
from tests.drawings import drawing_of
from tests.strategies import examples

# A wave of half circles, which chains their ends; a lens; a nearly straight arc; a speck; a line.
SHAPES = [
    Polyline(np.array([[0.5 + k, 5.0, (-1.0) ** k] for k in range(9)])),
    Polyline(np.array([[2.0, 8.0, 0.9], [6.0, 8.5, 0.3]]), closed=True),
    Polyline(np.array([[1.0, 11.0, 1e-5], [9.0, 11.3, 0.0]])),
    Polyline(np.array([[5.0, 2.0, 1.0], [5.003, 2.0, 1.0]]), closed=True),
    Polyline(np.array([[0.7, 1.3, 0.0], [9.1, 2.1, 0.0], [3.3, 3.7, 0.0]])),
]


def lengths(low: int, high: int) -> st.SearchStrategy[float]:
    """From 10^low to 10^high, evenly by their logarithm, and just these two."""
    ends = st.sampled_from([10.0**low, 10.0**high])
    return ends | st.floats(low, high).map(lambda power: 10.0**power)


BOOLS = st.sampled_from(["true", "false"])
CIRCLES = st.sampled_from(["whole", "halves"])
OPTIONS: dict[str, dict[str, st.SearchStrategy[Any]]] = {
    "flashcut": {
        "decimals": st.integers(0, 5),
        "trailing_zeros": BOOLS,
        "feed_words": st.sampled_from(["syntax", "everywhere"]),
        "full_circles": CIRCLES,
        "rapids": st.sampled_from(["straight", "one-axis"]),
        "z_up": st.sampled_from(["+", "-"]),
        "arc_spread_mm": lengths(-5, 1),
    },
    "valcnc": {
        "coord_scale": st.sampled_from([0.125, 1.0, 0.1, 10.0]),
        "decimals": st.integers(0, 7),
        "max_sweep_deg": st.sampled_from([0.1, 1.0, 89.0, 90.0, 180.0]) | st.floats(1.0, 180.0),
        "full_circles": st.sampled_from(["refused", "whole"]),
        "missing_words": st.sampled_from(["refused", "keep", "zero"]),
        "z_order": st.sampled_from(["refused", "before", "after", "together"]),
        "arc_spread_mm": lengths(-5, 1),
    },
    "grbl": {
        "decimals": st.integers(2, 7),
        "strip_zeros": BOOLS,
        "full_circles": CIRCLES,
        "arc_most_radius_mm": lengths(-2, 4),
        "arc_difference_mm": lengths(-5, -2),
    },
    "linuxcnc": {
        "decimals": st.integers(2, 7),
        "strip_zeros": BOOLS,
        "full_circles": CIRCLES,
        "arc_most_radius_mm": lengths(-2, 4),
        "arc_difference_mm": lengths(-5, -2),
    },
    "pic-mmh": {"form": st.sampled_from(["example", "annex"]), "buffer_chars": st.integers(0, 60)},
}


@pytest.mark.parametrize("name", OPTIONS)
@examples(12)
@given(data=st.data())
def test_an_option_is_refused_or_holds(name: str, data: st.DataObject) -> None:
    chosen = data.draw(st.fixed_dictionaries({}, optional=OPTIONS[name]))
    try:
        target = load_target(name, settings=[f"dialect.{k}={v}" for k, v in chosen.items()])
    except MachineError as refused:
        message = str(refused)
    else:
        message = ""
    if message:
        assert "key " in message
        return
    assume(name != "pic-mmh" or chosen)
    shapes = SHAPES if name != "pic-mmh" else [_smaller(shape) for shape in SHAPES]
    posted = post_drawing(drawing_of(shapes), job_of(), target)
    errors = [each for each in posted.findings if each.severity == Severity.ERROR]
    assert not errors
    assert posted.program is not None


def _smaller(shape: Polyline) -> Polyline:
    return Polyline(shape.vertices * np.array([0.5, 0.5, 1.0]), shape.closed)
