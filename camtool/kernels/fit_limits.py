"""Every number that decides how curves become arcs. No numba here: anyone may import it."""

import math

POSITION_EPS_MM = 1e-6
"""Two positions nearer than this are one, as in `camtool.geometry.polylines`."""

SPAN_TURN_RAD = math.pi * (1.0 + 1e-9)
"""A biarc covers no more turning than a half circle (and rounding)."""

SINGLE_TURN_RAD = 4e-4
"""One arc or line takes the place of a biarc when both its ends leave the curve's own tangents by
no more; two of them make a joint of less than 1e-3 rad."""

STRAIGHT_SAGITTA_MM = 1e-7
"""An arc that leaves its chord by no more is a line."""

MAX_RADIUS_MM = 1e6
"""An arc of a larger radius is written as lines: a centre a kilometre away has no digits left."""

FLAT_SHARE = 0.02
"""Those lines leave the arc by no more than this share of the tolerance."""

MAX_LINES = 100_000
"""No arc is cut into more lines."""

SAME_ARC_MM = 1e-8
"""Neighbours that leave a common arc or line by no more become one."""

CANDIDATES = 2
"""Nodes kept for each number of arcs: the furthest, and others evenly short of it."""

SEARCH_SHARE = 0.97
"""The share of the tolerance that the search may use up: errors peak between nodes."""

MEASURE_STEPS = 8
"""Points per step between nodes at which the final error is measured."""

ACCEPTED_SHARE = 0.995
"""A fit is accepted when its measured error is within this share of the tolerance: what lies
between the points at which it is measured may be a little more."""

ATTEMPTS = 8
"""How often a fit whose measured error is too large is done again, each time finer."""

REFINING = 1.0 / 8.0
"""The share of its error that a step between nodes may keep at each further attempt."""

CORNER_ANGLE_RAD = 1e-6
"""Tangents before and after a node that differ by more make it a corner."""

STEP_TURN_RAD = 0.5
"""No step between two nodes turns by more, save at a corner."""

STEP_ERROR_SHARE = 1.0 / 4096.0
"""A step's biarc is off by no more than this share of the tolerance: some 16 steps an arc pair."""

VANISHING_TANGENT = 1e-9
"""Shorter than this share of the longest tangent, a tangent has no direction: look beside it."""

ASIDE_FROM = -9
"""Power of ten: how far aside (share of the way to the next break) to look for a direction."""

ASIDE_TO = -2
"""The power of ten at which that look aside gives up."""

MIN_STEPS = 32
"""Steps that every curve is cut into at first."""

MAX_NODES = 200_000
"""No more refining above this many nodes."""

SLOW_SHARE = 0.5
"""Where a piece moves at less than this share of its largest speed, its slowest point is looked
for: tips and cusps."""

GOLDEN_ROUNDS = 60
"""Rounds of that search: they shrink a bracket by 3e-13."""
