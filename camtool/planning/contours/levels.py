"""At which depths a contour or a carving is cut: the z of its passes."""

from __future__ import annotations

import math
from itertools import pairwise

from camtool.errors import OptionError

PASS_SLACK = 1e-9
"""Steps may exceed the step down by this part of it, by rounding, before a pass is added."""

MOST_PASSES = 10_000
"""More passes than this are taken as a mistake."""


def levels(
    depth_mm: float, step_down_mm: float | None = None, last_pass_mm: float | None = None
) -> tuple[float, ...]:
    """The z of all passes, mm, downwards from the first one to −depth.

    Steps are equal and no larger than `step_down_mm` (None: one step); with `last_pass_mm` the
    last one is that, and the others are equal. OptionError for numbers not above 0, a last pass
    above the step down or the depth, and more than MOST_PASSES.

    >>> levels(1.0, 0.4)
    (-0.3333333333333333, -0.6666666666666666, -1.0)
    >>> levels(1.0, 0.5, 0.1)
    (-0.45, -0.9, -1.0)
    """
    for name, value in (
        ("depth", depth_mm),
        ("step_down", step_down_mm),
        ("last_pass", last_pass_mm),
    ):
        if value is not None and not (math.isfinite(value) and value > 0.0):
            raise OptionError(
                f"{value:g} mm is not above 0", where=f"key {name}", mend="give a number above 0"
            )
    rest_mm = depth_mm
    if last_pass_mm is not None:
        _check_last(depth_mm, step_down_mm, last_pass_mm)
        rest_mm = depth_mm - last_pass_mm
    step = math.inf if step_down_mm is None else step_down_mm
    # What rounding alone leaves above the last pass is no pass.
    if rest_mm <= PASS_SLACK * depth_mm:
        return (-depth_mm,)
    passes = rest_mm / step * (1.0 - PASS_SLACK)
    if passes > MOST_PASSES:
        raise OptionError(
            f"{step:g} mm makes more than {MOST_PASSES} passes of {depth_mm:g} mm",
            where="key step_down",
            mend="give a larger step",
        )
    count = max(1, math.ceil(passes))
    above = tuple(-rest_mm * step / count for step in range(1, count))
    return (*above, -depth_mm) if last_pass_mm is None else (*above, -rest_mm, -depth_mm)


def carved_levels(
    depth_mm: float, step_down_mm: float | None = None, last_pass_mm: float | None = None
) -> tuple[float, ...]:
    """The z of all passes of a V bit, which goes inwards from the wall as it goes down.

    A pass whose tip is d deeper than the one before runs d·tan α farther in (α the half angle of
    the bit). Under its tip the earlier one has cut d less deep than its own depth, so that the
    tip takes 2 d: passes after the first are no deeper than half the step down.

    >>> carved_levels(0.9, 0.3)
    (-0.3, -0.45, -0.6, -0.75, -0.9)
    """
    whole = levels(depth_mm, step_down_mm, last_pass_mm)
    passes = list(whole[:1])
    for above, z in pairwise(whole):
        if step_down_mm is not None and 2.0 * (above - z) > step_down_mm * (1.0 + PASS_SLACK):
            passes.append(0.5 * (above + z))
        passes.append(z)
    return tuple(passes)


def _check_last(depth_mm: float, step_down_mm: float | None, last_pass_mm: float) -> None:
    for name, limit in (("depth", depth_mm), ("step down", step_down_mm)):
        if limit is not None and last_pass_mm > limit * (1.0 + PASS_SLACK):
            raise OptionError(
                f"a last pass of {last_pass_mm:g} mm is above the {name} of {limit:g} mm",
                where="key last_pass",
                mend=f"give {limit:g} mm or less",
            )
