"""Verdicts on dimensions by ISO 14253-1, from predicted sizes and their uncertainty.

A dimension holds when its least local size is not below the lower limit and its largest not above
the upper one (ISO 14405-1: limits are of two-point sizes unless a drawing says otherwise). With P
the probability of that,

    in          P ≥ 95 %      the size is within the limits by a guard band of 1.645 u at least,
    out         P ≤ 5 %       or beyond them by as much,
    undecided   otherwise,

An unknown uncertainty is not zero. Where it is not known how certain an input is on which the
dimension depends, P is only known to lie between that of limits that are narrower, and that of
limits that are wider, by all that physics lets the input change the size (`Budget.at_most`): the
dimension is in, or out, if all of that range is. Where nothing bounds an input, it is undecided.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import Literal

import numpy as np
from msgspec import Struct

from camtool.findings import Finding, Severity
from camtool.importers.findings import ENTITY_SKIPPED
from camtool.inspection.dimensions import ZONES, Dimension
from camtool.inspection.features import CircleFeature, EdgeFeature
from camtool.inspection.findings import (
    DIMENSION_NOT_CUT_THERE,
    DIMENSION_NOT_IN_OUT,
    DIMENSION_NOT_IN_UNDECIDED,
    NOTHING_REQUIRED,
    InspectionCode,
)
from camtool.inspection.inspector import Inspected, Inspector
from camtool.inspection.sizes import MachinedSize
from camtool.inspection.uncertainty import Budget, Machined, inputs_of, propagate
from camtool.records import replace
from camtool.run import Run
from camtool.units import UM_PER_MM
from camtool.verification.report import (
    ContributionReport,
    InspectedReport,
    rounded,
    rounded_or_none,
)

SURE = 0.95
"""The probability of a verdict (ISO 14253-1: 95 % unless agreed otherwise)."""

GUARD = 1.6449
"""A size within one limit by this many standard uncertainties is within it with a probability of
95 %."""

Required = Literal["in", "not-out"]
"""Values of `--require`: the verdict that every dimension with limits must have."""


class Tolerances(Struct, frozen=True):
    """The dimensions to inspect, the findings of reading them, and the required verdict (None:
    they are only reported)."""

    dimensions: tuple[Dimension, ...]
    findings: tuple[Finding, ...] = ()
    require: Required | None = None


def inspect(run: Run, tolerances: Tolerances) -> Run:
    """Return the run with the verdicts of its dimensions in its report, and the findings about
    them.

    A run without a verification (of a program with errors) is returned unchanged. If a verdict is
    required and no dimension with limits was inspected, that is an error. Raises OptionError where
    the job scales the part."""
    if run.verification is None or run.drawing is None or run.job is None:
        return run
    inspector = Inspector(run, tolerances.dimensions)
    results = tuple(verdicts_of(inspector, run))
    verdicts = tuple(each for each in results if isinstance(each, InspectedReport))
    verdict_findings = _findings(verdicts, tolerances.require)
    unmeasured = (
        (inspected.bound.dimension, each)
        for inspected, each in zip(inspector.dimensions, results, strict=True)
        if isinstance(each, Finding)
    )
    gate = tolerances.require is not None
    left_out = (
        *(_as_error(each) if gate else each for each in tolerances.findings),
        *(
            _as_error(each) if gate and dimension.asks else each
            for dimension, each in (*inspector.left_out, *unmeasured)
        ),
    )
    if gate and not any(each.upper_mm is not None for each in verdicts):
        left_out = (*left_out, NOTHING_REQUIRED(where="tolerances"))
    findings = tuple(
        dict.fromkeys((*_without_read(run.findings, run), *left_out, *verdict_findings))
    )
    verification = run.verification.with_findings(findings)
    report = replace(verification.report, inspection=verdicts)
    return replace(run, verification=replace(verification, report=report), findings=findings)


def _without_read(findings: Iterable[Finding], run: Run) -> list[Finding]:
    """Return the findings without those that say that the drawing's dimensions were skipped: they
    are inspected now."""
    from camtool.importers.dxf.walk import CALLOUTS

    skipped = () if run.drawing is None else run.drawing.skipped
    read = [
        ENTITY_SKIPPED(
            severity=Severity.WARNING, measured=each.count, kind=each.kind, reason=each.reason
        )
        for each in skipped
        if each.kind in CALLOUTS
    ]
    return [each for each in findings if each not in read]


NOT_INSPECTED = (
    InspectionCode.DIMENSION_UNBOUND,
    InspectionCode.DIMENSION_NOT_CUT,
    InspectionCode.CALLOUT_TEXT,
)
"""Findings that become errors where a verdict is required of every dimension with limits: nothing
is known of these."""


def _as_error(finding: Finding) -> Finding:
    """Return the finding unchanged, or as an error if it says that a dimension is not
    inspected."""
    is_error = finding.code in NOT_INSPECTED
    return replace(finding, severity=Severity.ERROR) if is_error else finding


def verdicts_of(
    inspector: Inspector, run: Run, machined: Machined | None = None
) -> Iterator[InspectedReport | Finding]:
    """Yield the verdict of each dimension, in order, or a finding if the slides miss its feature,
    or may miss it on a machine that differs by an uncertainty. `machined` takes the
    place of `inspector.machined`, for callers that know some of its results already."""
    if not inspector.dimensions:
        return
    inputs = inputs_of(
        run.target.machine,
        inspector.tool_diameter_mm,
        depths=inspector.has_depths,
        flip_errors_mm=inspector.flip_errors_mm,
    )
    budget = propagate(
        machined or inspector.machined,
        inputs,
        inspector.edges,
        measure=inspector.measured,
        extremes=True,
    )
    sizes = budget.values.reshape(-1, 3)
    measured = np.isfinite([budget.values, budget.standards]).all(axis=0).reshape(-1, 3)
    for index, each in enumerate(inspector.dimensions):
        if measured[index].all():
            yield _verdict(each, MachinedSize(*sizes[index].tolist()), budget, 3 * index)
        else:
            yield DIMENSION_NOT_CUT_THERE(where=each.bound.dimension.source, name=each.name)


def _verdict(each: Inspected, size: MachinedSize, budget: Budget, first: int) -> InspectedReport:
    """Return the verdict of a dimension; its values in the budget are three, from the index
    `first` on."""
    bound, limits = each.bound, each.bound.dimension.limits
    zone = bound.dimension.kind in ZONES
    lower = upper = None
    if limits is not None:
        lower = None if zone else bound.nominal_mm + limits.lower_mm
        upper = (0.0 if zone else bound.nominal_mm) + limits.upper_mm
    deciding = _deciding(size, budget, (lower, upper), first)
    standard = float(budget.standards[deciding])
    max_change = float(budget.at_most[deciding].sum())
    unknown = budget.unknown(deciding)
    contributions = _contributions(budget, deciding)
    chance, verdict = None, "predicted"
    if upper is not None:
        chance, verdict = _decided(budget, first, (lower, upper))
    measure = ""
    if verdict == "undecided":
        # If the known inputs alone leave the verdict open, the largest contribution of all counts.
        open_by = [one for one in contributions if one.um is None] if chance is None else ()
        largest = max(open_by or contributions, key=_likely_um).input
        keys = {one.name: one.missing[0] for one in unknown}
        measure = keys.get(largest, largest)
    bounded = math.isfinite(max_change)
    return InspectedReport(
        name=each.name,
        kind=bound.dimension.kind,
        source=bound.dimension.source,
        places_mm=_shown_between(each),
        nominal_mm=rounded(bound.nominal_mm),
        limits="" if limits is None else limits.said,
        lower_mm=rounded_or_none(lower),
        upper_mm=rounded_or_none(upper),
        fit_mm=rounded(size.fit_mm),
        low_mm=rounded(size.low_mm),
        high_mm=rounded(size.high_mm),
        verdict=verdict,
        standard_um=rounded_or_none(standard, UM_PER_MM) if bounded else None,
        unknown_um=rounded_or_none(max_change, UM_PER_MM) if bounded else None,
        guard_um=rounded_or_none(GUARD * standard + max_change, UM_PER_MM) if bounded else None,
        probability=chance,
        contributions=contributions,
        unknown=tuple(key for one in unknown for key in one.missing),
        measure=measure,
    )


def _contributions(budget: Budget, value: int) -> tuple[ContributionReport, ...]:
    """Return the contributions of the inputs to a value: the known ones, the largest first, then
    the unknown ones, unbounded ones first."""
    known_rows = (
        ContributionReport(one.input.name, rounded_or_none(one.standard_mm, UM_PER_MM))
        for one in budget.contributions(value)
    )
    max_change = dict(zip(budget.inputs, budget.at_most[value].tolist(), strict=True))
    unknown = (
        ContributionReport(
            one.name,
            None,
            rounded_or_none(max_change[one], UM_PER_MM)
            if math.isfinite(max_change[one])
            else None,
            one.within,
        )
        for one in sorted(budget.unknown(value), key=lambda one: -max_change[one])
    )
    return (*known_rows, *unknown)


def _likely_um(one: ContributionReport) -> float:
    """Return the standard uncertainty of a contribution; if only a bound is known, that of a
    uniform distribution within it."""
    if one.um is None:
        return math.inf if one.at_most_um is None else one.at_most_um / math.sqrt(3.0)
    return one.um


def _decided(
    budget: Budget, first: int, limits: tuple[float | None, float]
) -> tuple[float | None, str]:
    """Return the probability that a dimension is within its limits, and the verdict that follows.

    Its values in the budget are three, from the index `first` on. With unknown inputs the
    probability is the least favourable one; None if they leave the verdict open."""
    low, high = first + 1, first + 2
    lower, upper = -math.inf if limits[0] is None else limits[0], limits[1]
    off_low, off_high = (float(budget.at_most[value].sum()) for value in (low, high))

    def chance(share: float) -> float:
        """Return the probability to be within the limits, widened by a share of the bounds of all
        unknown inputs."""
        wide = lower - share * off_low, upper + share * off_high
        return budget.probability(low, high, wide)

    probability_known = chance(0.0)
    if not off_low and not off_high:
        return probability_known, _word(probability_known)
    if math.isfinite(off_low + off_high):
        min_chance, max_chance = chance(-1.0), chance(1.0)
        if _word(min_chance) == "in":
            return min_chance, "in"
        if _word(max_chance) == "out":
            return max_chance, "out"
        if _word(probability_known) == "undecided":
            return probability_known, "undecided"
    return None, "undecided"


def _word(chance: float) -> str:
    if 1.0 - SURE < chance < SURE:
        return "undecided"
    return "in" if chance >= SURE else "out"


def _deciding(
    size: MachinedSize, budget: Budget, limits: tuple[float | None, float | None], first: int
) -> int:
    """Return the index of the value that decides a dimension's verdict: the one nearest to its
    limit, in standard uncertainties, after the worst change by unknown inputs.

    Without limits it is the best fit."""
    lower, upper = limits
    if upper is None:
        return first
    low, high = first + 1, first + 2
    inside = {high: upper - size.high_mm}
    if lower is not None:
        inside[low] = size.low_mm - lower
    max_change = budget.at_most.sum(axis=1)

    def sigmas(value: int) -> float:
        return float((inside[value] - max_change[value]) / max(budget.standards[value], 1e-12))

    return min(inside, key=sigmas)


def _shown_between(each: Inspected) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the two places in the work frame between which a picture draws the dimension."""
    bound = each.bound
    if each.floor is not None:
        return each.floor.place_mm, each.floor.place_mm
    first = bound.features[0]
    if bound.ends:
        one, other = bound.dimension.places_mm
        return one, other
    if isinstance(first, EdgeFeature):
        return first.start_mm, first.end_mm
    x, y = first.centre_mm
    offset = first.radius_mm * math.sqrt(0.5)
    if bound.dimension.kind in ("diameter", "roundness"):
        return (x - offset, y - offset), (x + offset, y + offset)
    if isinstance(first, CircleFeature) and bound.dimension.kind == "position":
        return (x, y), (x, y)
    start, sweep = first.arcs[0].tolist()
    middle = start + 0.5 * sweep
    edge = x + first.radius_mm * math.cos(middle), y + first.radius_mm * math.sin(middle)
    return (x, y), edge


def _findings(verdicts: Iterable[InspectedReport], require: Required | None) -> Iterator[Finding]:
    """Yield a finding for each dimension that is out or undecided; an error if a verdict is
    required."""
    for each in verdicts:
        if each.verdict not in ("out", "undecided") or each.upper_mm is None:
            continue
        excess = each.high_mm - each.upper_mm
        under = -math.inf if each.lower_mm is None else each.lower_mm - each.low_mm
        worst, limit = (each.high_mm, each.upper_mm)
        if under > excess and each.lower_mm is not None:
            worst, limit = each.low_mm, each.lower_mm
        is_out = each.verdict == "out"
        is_error = require == "in" or (require == "not-out" and is_out)
        severity = Severity.ERROR if is_error else Severity.WARNING
        if is_out:
            yield DIMENSION_NOT_IN_OUT(
                where=each.source, measured=worst, limit=limit, severity=severity, name=each.name
            )
            continue
        advice = f"measure {each.measure}"
        if each.measure in each.unknown:
            advice = f"[uncertainty] of the machine file does not say {', '.join(each.unknown)}"
        yield DIMENSION_NOT_IN_UNDECIDED(
            where=each.source,
            measured=worst,
            limit=limit,
            severity=severity,
            name=each.name,
            why=advice,
        )
