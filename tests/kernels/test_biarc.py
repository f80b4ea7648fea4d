"""Biarcs and distances to arcs, against the plain forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from camtool.kernels.fits import biarc, distance_to_arc, longest_span, span_error
from tests.oracles import arcs

pytestmark = pytest.mark.checked

number = st.floats(-10.0, 10.0, allow_subnormal=False)
point = st.tuples(number, number)
angle = st.floats(-math.pi, math.pi)

EQUAL_MM = 1e-7
"""The plain form loses digits on flat arcs: their centres are far away."""


@given(p=point, a=point, b=point, bulge=st.floats(-1.0, 1.0))
def test_distance_is_the_one_by_centre_and_angles(p, a, b, bulge):
    assume(math.dist(a, b) > 1e-3)
    assume(bulge == 0.0 or abs(bulge) > 1e-7)
    found = distance_to_arc(*p, *a, *b, bulge)
    plain = arcs.arc_distances(np.array([p]), np.array(a), np.array(b), bulge)
    assert abs(found - plain[0]) <= EQUAL_MM


def test_distance_to_a_very_flat_arc_keeps_all_digits():
    # sagitta = bulge · chord / 2 = 5e-12 mm; the centre is 1e13 mm away.
    assert distance_to_arc(50.0, 1.0, 0.0, 0.0, 100.0, 0.0, 1e-13) == 1.0 + 5e-12


def test_distance_to_a_half_circle_from_its_centre_and_beside_it():
    assert distance_to_arc(0.0, 0.0, 1.0, 0.0, -1.0, 0.0, 1.0) == 1.0
    assert distance_to_arc(0.0, -1.0, 1.0, 0.0, -1.0, 0.0, 1.0) == math.sqrt(2.0)


@given(a=point, b=point, leave=angle, arrive=angle)
def test_a_biarc_is_tangent_at_its_ends_and_at_its_joint(a, b, leave, arrive):
    assume(math.dist(a, b) > 1e-2)
    out = np.array([math.cos(leave), math.sin(leave)])
    into = np.array([math.cos(arrive), math.sin(arrive)])
    jx, jy, first, second = biarc(*a, *out, *b, *into)
    assume(not math.isnan(jx))
    assume(math.dist(a, (jx, jy)) > 1e-3 < math.dist(b, (jx, jy)))
    ahead = (a[0] - out[0], a[1] - out[1], 0.0)
    behind = (b[0] + into[0], b[1] + into[1], 0.0)
    rows = np.array([ahead, (*a, first), (jx, jy, second), (*b, 0.0), behind])
    assert arcs.kinks(rows).max() < 1e-6


def test_no_biarc_between_equal_points_nor_over_more_than_half_circles():
    here, right, left = np.zeros(2), np.array([1.0, 0.0]), np.array([-1.0, 0.0])
    assert math.isnan(biarc(*here, *right, *here, *left)[0])
    assert math.isnan(biarc(*here, *left, *right, *left)[0])


def test_the_longest_span_is_the_longest_one():
    t = np.linspace(0.0, 3.0, 200)
    nodes = np.column_stack([t, t**3 / 6.0])
    slope = np.column_stack([np.ones_like(t), t**2 / 2.0])
    slope /= np.hypot(*slope.T)[:, None]
    for target in (1e-3, 1e-5, 1e-7):
        for guess in (1, 7, 150):
            found = longest_span(nodes, slope, slope, 5, 190, guess, target)
            errors = [span_error(nodes, slope, slope, 5, high) for high in range(6, 191)]
            longest = 5 + max(k for k, error in enumerate(errors, 1) if error <= target)
            assert found == max(longest, 6)
