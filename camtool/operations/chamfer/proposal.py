"""Countersinks that `camtool job new` proposes: a chamfer of each hole whose screw has a
countersunk head."""

from __future__ import annotations

import math
from collections import defaultdict

from camtool.jobs.template import Part, Remaining
from camtool.operations.bore.proposal import counterbore


def propose(remaining: Remaining) -> list[Part]:
    """Return one proposed operation for the countersinks of each width and V bit; the holes in
    them are left to the kinds that follow."""
    groups = defaultdict(list)
    for row, sink in remaining.steps.sunk.items():
        if sink.hole in remaining.rows:
            groups[round(sink.width_mm, 3), sink.bit.name, sink.is_named].append((row, sink))
    parts = []
    for (width, name, is_named), pairs in groups.items():
        wide = tuple(row for row, _ in pairs)
        holes = tuple(sink.hole for _, sink in pairs)
        angle = math.degrees(pairs[0][1].bit.tip_angle_rad or 0.0)
        keys = (
            ("side", '"inside"', "of the hole"),
            ("chamfer", f'"{width:g}mm"', "from the hole to the wider circle"),
        )
        reason = (
            "they are called so"
            if is_named
            else "heads of countersunk screws have such widths; a counterbore would take more away"
        )
        explanation = (
            f"two circles about one centre are a countersink of {angle:.3g}° with {name}, since"
            f" {reason}"
        )
        title = f"{remaining.title} countersunk"
        part = Part(title, "chamfer", holes, 0, keys, "", name, explanation, is_shared=True)
        if not is_named and set(wide) <= set(remaining.sunk):
            part = part.in_doubt(counterbore(remaining, wide))
        parts.append(part)
    return parts
