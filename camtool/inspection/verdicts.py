"""Whether dimensions hold: verdicts by ISO 14253-1, from predicted sizes and their uncertainty.

A dimension holds when its least local size is not below the lower limit and its largest not above
the upper one (ISO 14405-1: limits are of two-point sizes unless a drawing says otherwise). With P
the probability of that,

    in          P ≥ 95 %      the size is within the limits by a guard band of 1.645 u at least,
    out         P ≤ 5 %       or beyond them by as much,
    undecided   otherwise,

and undecided where it is not known how certain an input is on which the dimension depends: an
unknown uncertainty is not zero.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Literal

import msgspec
import numpy as np

from camtool.arrays import Floats
from camtool.findings import (
    DIMENSION_NOT_CUT_THERE,
    DIMENSION_NOT_IN_OUT,
    DIMENSION_NOT_IN_UNDECIDED,
    Code,
    Finding,
    Severity,
)
from camtool.inspection.dimensions import ZONES, Dimension
from camtool.inspection.features import Circle, Edge
from camtool.inspection.inspector import Inspected, Inspector
from camtool.inspection.sizes import Size
from camtool.inspection.uncertainty import Budget, inputs_of, probability, propagate
from camtool.run import Run
from camtool.units import UM_PER_MM
from camtool.verification.report import Contribution, InspectedReport, certain, number

SURE = 0.95
"""The probability of a verdict (ISO 14253-1: 95 % unless agreed otherwise)."""

GUARD = 1.6449
"""A size that is within one limit by this many standard uncertainties is so with 95 %."""

Required = Literal["in", "not-out"]
"""What `--require` asks of every dimension with limits."""


@dataclass(frozen=True)
class Tolerances:
    """The dimensions to inspect, the findings of reading them, and what is required of them (None:
    nothing; they are only told)."""

    dimensions: tuple[Dimension, ...]
    findings: tuple[Finding, ...] = ()
    require: Required | None = None


def inspect(run: Run, tolerances: Tolerances) -> Run:
    """The run with the verdicts of its dimensions in its report, and the findings about them. A
    run without a verification (of a program with errors) is returned as it is.

    Raises OptionError where the job scales the part.
    """
    if run.verification is None or run.drawing is None or run.job is None:
        return run
    inspector = Inspector(run, tolerances.dimensions)
    found = tuple(verdicts_of(inspector, run))
    verdicts = tuple(each for each in found if isinstance(each, InspectedReport))
    wrong = _findings(verdicts, tolerances.require)
    unmeasured = (each for each in found if isinstance(each, Finding))
    left_out = (*tolerances.findings, *inspector.findings, *unmeasured)
    if tolerances.require is not None:
        left_out = tuple(map(_as_error, left_out))
    findings = tuple(dict.fromkeys((*run.findings, *left_out, *wrong)))
    verification = run.verification.with_findings(findings)
    report = msgspec.structs.replace(verification.report, inspection=verdicts)
    return replace(run, verification=replace(verification, report=report), findings=findings)


NOT_INSPECTED = (Code.DIMENSION_UNBOUND, Code.DIMENSION_NOT_CUT, Code.CALLOUT_TEXT)
"""Errors where something is required of every dimension: nobody knows whether these hold."""


def _as_error(finding: Finding) -> Finding:
    """The finding, an error if a dimension is not inspected."""
    wrong = finding.code in NOT_INSPECTED
    return replace(finding, severity=Severity.ERROR) if wrong else finding


def verdicts_of(inspector: Inspector, run: Run) -> Iterator[InspectedReport | Finding]:
    """The verdicts of all dimensions, in order; a finding for one whose feature the slides leave,
    or may leave on a machine that differs by an uncertainty."""
    if not inspector.dimensions:
        return
    inputs = inputs_of(run.target.machine, inspector.tool_diameter_mm)
    budget = propagate(inspector.values, inputs, inspector.edges)
    sizes = budget.values.reshape(-1, 3)
    measured = np.isfinite([budget.values, budget.standards]).all(axis=0).reshape(-1, 3)
    for index, each in enumerate(inspector.dimensions):
        if measured[index].all():
            yield _verdict(each, Size(*sizes[index].tolist()), budget, 3 * index)
        else:
            yield DIMENSION_NOT_CUT_THERE(where=each.bound.dimension.source, name=each.name)


def _verdict(each: Inspected, size: Size, budget: Budget, first: int) -> InspectedReport:
    """The verdict of a dimension whose values are the three from `first` on in the budget."""
    bound, limits = each.bound, each.bound.dimension.limits
    zone = bound.dimension.kind in ZONES
    lower = upper = None
    if limits is not None:
        lower = None if zone else bound.nominal_mm + limits.lower_mm
        upper = (0.0 if zone else bound.nominal_mm) + limits.upper_mm
    low, high = first + 1, first + 2
    deciding = _deciding(size, budget.standards, (lower, upper), first)
    standard = float(budget.standards[deciding])
    unknown = budget.unknown(deciding)
    contributions = budget.contributions(deciding)
    chance, verdict = None, "predicted"
    if upper is not None:
        expected = budget.expected
        both = np.ix_([low, high], [low, high])
        allowed = -math.inf if lower is None else lower, upper
        inside = probability(
            float(expected[low]), float(expected[high]), budget.covariance[both], allowed
        )
        chance = None if unknown else inside
        verdict = _word(chance)
    measure = ""
    if verdict == "undecided":
        measure = unknown[0].name if unknown else contributions[0].input.name
    return InspectedReport(
        name=each.name,
        kind=bound.dimension.kind,
        source=bound.dimension.source,
        places_mm=_shown_between(each),
        nominal_mm=certain(bound.nominal_mm),
        limits="" if limits is None else limits.said,
        lower_mm=number(lower),
        upper_mm=number(upper),
        fit_mm=certain(size.fit_mm),
        low_mm=certain(size.low_mm),
        high_mm=certain(size.high_mm),
        verdict=verdict,
        standard_um=None if unknown else number(standard, UM_PER_MM),
        guard_um=None if unknown else number(GUARD * standard, UM_PER_MM),
        probability=chance,
        contributions=(
            *(
                Contribution(one.input.name, number(one.standard_mm, UM_PER_MM))
                for one in contributions
            ),
            *(Contribution(one.name, None) for one in unknown),
        ),
        unknown=tuple(one.name for one in unknown),
        measure=measure,
    )


def _word(chance: float | None) -> str:
    if chance is None or 1.0 - SURE < chance < SURE:
        return "undecided"
    return "in" if chance >= SURE else "out"


def _deciding(
    size: Size, standards: Floats, limits: tuple[float | None, float | None], first: int
) -> int:
    """Which of a dimension's values is nearest to its limit, in standard uncertainties; the best
    fit where there are no limits."""
    lower, upper = limits
    if upper is None:
        return first
    sides = [(upper - size.high_mm, first + 2)]
    if lower is not None:
        sides.append((size.low_mm - lower, first + 1))
    return min(sides, key=lambda side: side[0] / max(float(standards[side[1]]), 1e-12))[1]


def _shown_between(each: Inspected) -> tuple[tuple[float, float], tuple[float, float]]:
    """Two places in the work frame between which a picture shows the dimension."""
    bound, first = each.bound, each.bound.features[0]
    if bound.ends:
        one, other = bound.dimension.places_mm
        return one, other
    if isinstance(first, Edge):
        return first.start_mm, first.end_mm
    x, y = first.centre_mm
    away = first.radius_mm * math.sqrt(0.5)
    if bound.dimension.kind in ("diameter", "roundness"):
        return (x - away, y - away), (x + away, y + away)
    if isinstance(first, Circle) and bound.dimension.kind == "position":
        return (x, y), (x, y)
    start, sweep = first.arcs[0].tolist()
    middle = start + 0.5 * sweep
    edge = x + first.radius_mm * math.cos(middle), y + first.radius_mm * math.sin(middle)
    return (x, y), edge


def _findings(verdicts: Iterable[InspectedReport], require: Required | None) -> Iterator[Finding]:
    """A finding for each dimension that is out or undecided; an error where more is required."""
    for each in verdicts:
        if each.verdict not in ("out", "undecided") or each.upper_mm is None:
            continue
        over = each.high_mm - each.upper_mm
        under = -math.inf if each.lower_mm is None else each.lower_mm - each.low_mm
        worst, limit = (each.high_mm, each.upper_mm)
        if under > over and each.lower_mm is not None:
            worst, limit = each.low_mm, each.lower_mm
        out = each.verdict == "out"
        wrong = require == "in" or (require == "not-out" and out)
        severity = Severity.ERROR if wrong else Severity.WARNING
        if out:
            yield DIMENSION_NOT_IN_OUT(
                where=each.source, measured=worst, limit=limit, severity=severity, name=each.name
            )
            continue
        why = f"measure {each.measure}"
        if each.unknown:
            why = f"[uncertainty] of the machine file does not say {', '.join(each.unknown)}"
        yield DIMENSION_NOT_IN_UNDECIDED(
            where=each.source,
            measured=worst,
            limit=limit,
            severity=severity,
            name=each.name,
            why=why,
        )
