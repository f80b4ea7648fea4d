"""Where arc blocks end: the compiled search against the literal one."""

import math

import numpy as np
import pytest
from camtool_postprocessors.pic_mmh.steps import land
from hypothesis import given
from hypothesis import strategies as st

from tests.oracles.arc_landings import Arc, Form, landing

pytestmark = pytest.mark.checked

FORMS = [
    Form(100_000 * 0.00014, 9_999_999, 1.0),
    Form(1_000 * 0.00014, 99_999, 1.0 / 0.14),
    Form(100_000 * 0.000139509, 9_999_999, 1.0),
    Form(1_000 * 0.00001, 99_999, 100.0),
]


@st.composite
def arcs(draw: st.DrawFn) -> Arc:
    """An arc about anywhere that starts on a step, sweeps anything, and ends beside the circle."""
    radius = math.exp(draw(st.floats(math.log(0.8), math.log(900.0))))
    angle = draw(st.one_of(st.floats(-math.pi, math.pi), st.sampled_from([0.0, math.pi / 2])))
    start = round(radius * math.cos(angle)), round(radius * math.sin(angle))
    if start == (0, 0):
        start = (1, 0)
    clockwise = draw(st.booleans())
    sweep = draw(st.one_of(st.floats(1e-3, 2.0 * math.pi), st.just(2.0 * math.pi)))
    to = math.atan2(start[1], start[0]) + (-sweep if clockwise else sweep)
    away = draw(st.tuples(st.integers(-3, 3), st.integers(-3, 3)))
    size = math.hypot(*start)
    end = round(size * math.cos(to)) + away[0], round(size * math.sin(to)) + away[1]
    centre = draw(st.tuples(st.integers(-500, 500), st.integers(-500, 500)))
    return Arc(start, end, centre, clockwise, sweep)


def found(arc: Arc, form: Form) -> tuple[tuple[int, int], int] | None:
    """Return the result of the compiled search."""
    table = np.array([[*arc.start, *arc.end, *arc.centre, int(arc.clockwise)]], dtype=np.int64)
    sweep = np.array([arc.sweep_rad])
    x, y, iteration = land(
        table, sweep, form.units_per_step, form.most_units, form.sagitta
    ).tolist()[0]
    return ((x, y), iteration) if iteration >= 0 else None


@given(arcs(), st.sampled_from(FORMS))
def test_landings_are_those_of_the_literal_search(arc: Arc, form: Form) -> None:
    wanted = landing(arc, form) if math.hypot(*arc.start) >= 4.0 else None
    assert found(arc, form) == wanted


@given(arcs(), st.booleans())
def test_a_mirrored_arc_lands_at_the_mirrored_step(arc: Arc, swapped: bool) -> None:
    def image(point: tuple[int, int]) -> tuple[int, int]:
        return (point[1], point[0]) if swapped else (-point[0], point[1])

    other = Arc(
        image(arc.start), image(arc.end), image(arc.centre), not arc.clockwise, arc.sweep_rad
    )
    one, two = found(arc, FORMS[0]), found(other, FORMS[0])
    assert two == (one and (image(one[0]), one[1]))


def test_arcs_land_in_columns_as_alone() -> None:
    rng = np.random.default_rng(31)
    table = rng.integers(-4000, 4000, (300, 7))
    table[:, 6] &= 1
    sweeps = rng.uniform(0.01, 6.0, 300)
    form = FORMS[0]
    rules = (form.units_per_step, form.most_units, form.sagitta)
    together = land(table, sweeps, *rules)
    for k in range(300):
        alone = land(table[k : k + 1].copy(), sweeps[k : k + 1].copy(), *rules)
        assert np.array_equal(alone[0], together[k])
    assert (together[:, 2] >= 0).any()
