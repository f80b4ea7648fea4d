"""What the importers tell of a drawing besides its lines: findings, each with its place."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from camtool.findings import Code, Finding, Severity
from camtool.geometry.drawing import Drawing, Gap, Healing, SelfCrossing, Skipped
from camtool.geometry.facts import drawing_extents

SMALLEST_MM = 0.05
"""A drawing whose longer side is below this was probably read in the wrong unit."""

LARGEST_MM = 2000.0
"""A drawing whose longer side is above this was probably read in the wrong unit."""

MAX_GAP_FINDINGS = 20
"""So many gaps get a finding of their own, largest first; the others are counted in one."""

MAX_PLACES = 20
"""So many branches, and so many crossing paths, get a finding of their own."""


def counted(skipped: Sequence[Skipped]) -> list[Skipped]:
    """One row for each kind and reason, in order of first appearance."""
    counts: Counter[tuple[str, str]] = Counter()
    for item in skipped:
        counts[item.kind, item.reason] += item.count
    return [Skipped(kind, count, reason) for (kind, reason), count in counts.items()]


def skip_findings(skipped: Sequence[Skipped], dropped: Sequence[Skipped]) -> list[Finding]:
    """What was left out: the reader's part as warnings, what has no length as information."""
    return [
        Finding(
            Code.ENTITY_SKIPPED,
            severity,
            f"{item.count} {item.kind} left out: {item.reason}",
            measured=float(item.count),
        )
        for severity, items in ((Severity.WARNING, skipped), (Severity.INFO, dropped))
        for item in counted(items)
    ]


def font_findings(lacking: Counter[str]) -> list[Finding]:
    """FONT_SUBSTITUTED for what texts wanted and could not have, and how many texts did."""
    return [
        Finding(
            Code.FONT_SUBSTITUTED,
            Severity.WARNING,
            f"{count} texts: {what}",
            measured=float(count),
        )
        for what, count in lacking.items()
    ]


def size_findings(drawing: Drawing) -> list[Finding]:
    """IMPLAUSIBLE_SIZE when the longer side fits a wrong unit better than a part."""
    units, box = drawing.units, drawing_extents(drawing)
    width, height = (float(side) for side in box[:, 1] - box[:, 0])
    longest = max(width, height)
    if len(drawing.paths) == 0 and len(drawing.marks) < 2:
        return []
    if SMALLEST_MM <= longest <= LARGEST_MM:
        return []
    small = longest < SMALLEST_MM
    return [
        Finding(
            Code.IMPLAUSIBLE_SIZE,
            Severity.WARNING,
            f"the drawing is {width:.6g} x {height:.6g} mm with unit {units.name} ({units.why}); "
            "if that is wrong, name the unit with --units",
            measured=longest,
            limit=SMALLEST_MM if small else LARGEST_MM,
            unit="mm",
        )
    ]


def gap_findings(gaps: Sequence[Gap], gap_mm: float, *, closed: bool) -> list[Finding]:
    """A finding for each gap, largest first, and one for all that are more than are read."""
    code, severity = (
        (Code.GAP_CLOSED, Severity.INFO) if closed else (Code.GAP_OPEN, Severity.WARNING)
    )
    ranked = sorted(gaps, key=lambda gap: -gap.size_mm if closed else gap.size_mm)
    found = [
        Finding(
            code,
            severity,
            f"a gap of {gap.size_mm * 1000.0:.4g} µm was closed"
            if closed
            else f"two open ends are {gap.size_mm * 1000.0:.4g} µm apart and stay open",
            where=_where(gap.layer, gap.at_mm),
            measured=gap.size_mm,
            limit=gap_mm,
            unit="mm",
        )
        for gap in ranked[:MAX_GAP_FINDINGS]
    ]
    rest = ranked[MAX_GAP_FINDINGS:]
    if rest:
        verb = "were closed" if closed else "stay open"
        found.append(
            Finding(
                code,
                severity,
                f"{len(rest)} more gaps {verb}, of {min(g.size_mm for g in rest) * 1000.0:.4g} to "
                f"{max(g.size_mm for g in rest) * 1000.0:.4g} µm",
                measured=max(gap.size_mm for gap in rest),
                limit=gap_mm,
                unit="mm",
            )
        )
    return found


def healing_findings(healed: Healing, tolerance_mm: float) -> list[Finding]:
    """What was mended, one finding of each kind; branches and crossings with their places."""
    found: list[Finding] = []
    if healed.duplicates or healed.overlaps:
        length = healed.duplicates_mm + healed.overlaps_mm
        found.append(
            Finding(
                Code.DRAWN_TWICE,
                Severity.INFO,
                f"{healed.duplicates} drawn twice and {healed.overlaps} lying on others in whole "
                f"or in part: {length:.6g} mm left out",
                measured=length,
                unit="mm",
            )
        )
    if healed.tiny_merged:
        found.append(
            Finding(
                Code.TINY_MERGED,
                Severity.INFO,
                f"{healed.tiny_merged} segments too short to matter were merged",
                measured=float(healed.tiny_merged),
                limit=tolerance_mm,
            )
        )
    if healed.arcs_recognised:
        found.append(
            Finding(
                Code.ARCS_RECOGNISED,
                Severity.INFO,
                f"chords became {healed.arcs_recognised} arcs",
                measured=float(healed.arcs_recognised),
                limit=tolerance_mm,
            )
        )
    return [*found, *_branch_findings(healed), *_crossing_findings(healed.crossings)]


def _branch_findings(healed: Healing) -> list[Finding]:
    """Branches where the most ends meet first, the rest counted."""
    ranked = sorted(healed.branches, key=lambda branch: -branch.ends)
    found = [
        Finding(
            Code.BRANCHED,
            Severity.WARNING,
            f"{branch.ends} ends meet; the straightest were joined",
            where=_where(branch.layer, branch.at_mm),
            measured=float(branch.ends),
            limit=2.0,
        )
        for branch in ranked[:MAX_PLACES]
    ]
    more = len(ranked) - MAX_PLACES
    if more > 0:
        message = f"more than two ends meet at {more} more places"
        found.append(Finding(Code.BRANCHED, Severity.WARNING, message, measured=float(more)))
    return found


def _crossing_findings(crossings: Sequence[SelfCrossing]) -> list[Finding]:
    """One finding for each path that crosses itself, with its first place; the rest counted."""
    times = Counter(crossing.path for crossing in crossings)
    first = {crossing.path: crossing for crossing in reversed(crossings)}
    found = []
    for path, count in sorted(times.items())[:MAX_PLACES]:
        at = first[path]
        often = "" if count == 1 else f" at {count} places"
        found.append(
            Finding(
                Code.SELF_CROSSING,
                Severity.WARNING,
                f"a closed contour crosses itself{often}",
                where=_where(at.layer, at.at_mm),
                measured=float(count),
                limit=0.0,
            )
        )
    more = len(times) - MAX_PLACES
    if more > 0:
        message = f"{more} more closed contours cross themselves"
        found.append(Finding(Code.SELF_CROSSING, Severity.WARNING, message, measured=float(more)))
    return found


def _where(layer: str, at_mm: tuple[float, float]) -> str:
    return f"layer {layer}, x {at_mm[0]:.4f} y {at_mm[1]:.4f} mm"
