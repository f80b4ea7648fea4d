"""Uncertainties are propagated as they are elsewhere, and as many draws say."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
import uncertainties
from hypothesis import example, given
from hypothesis import strategies as st

from camtool.arrays import Floats
from camtool.inspection.uncertainty import (
    Budget,
    Inputs,
    MachineVariant,
    both_below,
    edges_of,
    inputs_of,
    monte_carlo,
    normal_below,
    opposite_edges,
    probability,
    propagate,
    without_scatter,
)
from camtool.machine.model import AxisUncertainty, Machine, Uncertainty
from camtool.records import replace
from camtool.target.registry import load_target
from tests.strategies import examples

NAMES = (
    "x.backlash_mm",
    "x.compensation_mm",
    "x.scale",
    "y.backlash_mm",
    "y.scale",
    "squareness_rad",
    "tool_diameter_mm",
    "runout_mm",
)
STANDARDS = (0.004, 0.003, 2e-4, 0.002, 3e-4, 5e-4, 0.006, 0.001)
PAIRS = (
    ("x.backlash_mm", "x.scale", 0.6),
    ("x.scale", "y.scale", -0.3),
    ("squareness_rad", "y.backlash_mm", 0.5),
    ("tool_diameter_mm", "runout_mm", 0.2),
)


def machine_of(
    standards: Sequence[float | None] = STANDARDS,
    pairs: tuple[tuple[str, str, float], ...] = PAIRS,
    **more: Any,
) -> Machine:
    """A machine with these uncertainties of `NAMES`."""
    machine = load_target(
        "grbl",
        settings=[
            "axes.x.backlash_mm=0.05",
            "axes.x.compensation_mm=0.03",
            "axes.x.real_step_mm=0.00401",
            "axes.y.backlash_mm=0.08",
            "mechanics.squareness_rad=0.001",
        ],
    ).machine
    known = dict(zip(NAMES, standards, strict=True))
    x = AxisUncertainty(
        backlash_mm=known["x.backlash_mm"],
        compensation_mm=known["x.compensation_mm"],
        scale=known["x.scale"],
    )
    y = AxisUncertainty(backlash_mm=known["y.backlash_mm"], scale=known["y.scale"])
    rest = {key: known[key] for key in NAMES[5:]}
    said = Uncertainty(x=x, y=y, correlations=pairs, **rest, **more)
    said.check()
    return replace(machine, uncertainty=said)


def directions_of(variant: MachineVariant, machine: Machine) -> Floats:
    """(6,) by how much a variant is off the machine: lost motion of X and Y, relative scales,
    squareness, tool."""
    ours, its = variant.machine, machine
    return np.array(
        [
            ours.axes.x.backlash_mm - its.axes.x.backlash_mm,
            ours.axes.y.backlash_mm - its.axes.y.backlash_mm,
            ours.axes.x.real_step_mm / its.axes.x.real_step_mm - 1.0,
            ours.axes.y.real_step_mm / its.axes.y.real_step_mm - 1.0,
            ours.mechanics.squareness_rad - its.mechanics.squareness_rad,
            variant.wider_mm,
        ]
    )


def linear(machine: Machine, slopes: Floats) -> Callable[[MachineVariant], Floats]:
    """Values that are linear in all that varies: (K, 6) slopes."""

    def values(variant: MachineVariant) -> Floats:
        found: Floats = np.arange(len(slopes)) + slopes @ directions_of(variant, machine)
        return found

    return values


def no_edges(rows: int) -> Floats:
    return np.zeros((rows, 0, 2))


SLOPES = st.integers(1, 4).flatmap(
    lambda rows: st.lists(
        st.lists(st.floats(-50.0, 50.0), min_size=6, max_size=6), min_size=rows, max_size=rows
    )
)


@given(SLOPES)
def test_linear_cases_are_those_of_the_package(slopes: list[list[float]]) -> None:
    machine = machine_of()
    table = np.array(slopes)
    inputs = inputs_of(machine, 3.0)
    budget = propagate(linear(machine, table), inputs, no_edges(len(table)))
    known = {each.name: each for each in inputs.each}
    order = [next(k for k, each in enumerate(inputs.each) if each.name == name) for name in NAMES]
    covariance = inputs.covariance[np.ix_(order, order)]
    free = uncertainties.correlated_values([0.0] * len(NAMES), covariance)
    own = dict(zip(NAMES, free, strict=True))
    ratio = known["x.scale"].value
    moved = [
        own["x.backlash_mm"] - ratio * own["x.compensation_mm"],
        own["y.backlash_mm"],
        own["x.scale"],
        own["y.scale"],
        own["squareness_rad"],
        own["tool_diameter_mm"] + own["runout_mm"],
    ]
    theirs = [
        k + sum(a * b for a, b in zip(row, moved, strict=True)) for k, row in enumerate(table)
    ]
    assert np.allclose(
        budget.covariance, uncertainties.covariance_matrix(theirs), rtol=1e-7, atol=1e-12
    )
    assert np.allclose(budget.values, np.arange(len(table)), atol=1e-12)
    assert np.allclose(budget.shifts, 0.0, atol=1e-12)
    for row, each in enumerate(theirs):
        assert budget.standards[row] == pytest.approx(each.std_dev, rel=1e-6, abs=1e-9)


def bent(variant: MachineVariant) -> Floats:
    """Sizes as machines make them: widths, a diagonal, a roundness with a sharp bend, a hole."""
    axes, lean = variant.machine.axes, math.tan(variant.machine.mechanics.squareness_rad)
    kx, ky = (axis.real_step_mm / axis.coded_step_mm for axis in (axes.x, axes.y))
    ex = axes.x.backlash_mm - kx * axes.x.compensation_mm
    ey = axes.y.backlash_mm - ky * axes.y.compensation_mm
    width, height = 20.0 * kx - ex, 10.0 * ky - ey
    return np.array(
        [
            width,
            height,
            math.hypot(width + lean * height, height),
            10.0 * math.hypot(kx, ky) + variant.wider_mm - 0.3 * (ex + ey),
            abs(ex - 0.02) + 0.2 * abs(lean),
            0.4 * math.sin(60.0 * ey) + 20.0 * ex * ex,
        ]
    )


EDGES = edges_of(
    [
        (1, opposite_edges(0.0)),
        (1, opposite_edges(0.5 * math.pi)),
        (2, opposite_edges(0.4)),
        (2, np.array([[1.0, 0.0]])),
    ]
)


@given(
    st.lists(st.one_of(st.none(), st.floats(0.0, 1.0)), min_size=8, max_size=8),
    st.one_of(st.none(), st.floats(0.0, 0.1)),
    st.booleans(),
)
def test_a_budget_adds_up(
    shares: list[float | None], process: float | None, expands: bool
) -> None:
    standards = [
        None if share is None else share * most
        for share, most in zip(shares, STANDARDS, strict=True)
    ]
    known = dict(zip(NAMES, standards, strict=True))
    pairs = tuple(p for p in PAIRS if known[p[0]] is not None and known[p[1]] is not None)
    more: dict[str, Any] = {"process_mm": process, "temperature_k": 2.0}
    if expands:
        more |= {"machine_expansion_per_k": 1.1e-5, "part_expansion_per_k": 2.3e-5}
    budget = propagate(bent, inputs_of(machine_of(standards, pairs, **more), 3.0), EDGES)
    assert np.linalg.eigvalsh(budget.covariance).min() > -1e-12
    assert np.array_equal(budget.covariance, budget.covariance.T) or np.allclose(
        budget.covariance, budget.covariance.T, rtol=1e-12, atol=0.0
    )
    assert budget.runs <= 10
    for row in range(len(budget.values)):
        parts = budget.contributions(row)
        total = sum(each.variance_mm2 for each in parts)
        assert total == pytest.approx(budget.covariance[row, row], rel=1e-9, abs=1e-18)
        sizes = [abs(each.variance_mm2) for each in parts]
        assert sizes == sorted(sizes, reverse=True)
        alone = propagate(bent, inputs_of(machine_of(standards, (), **more), 3.0), EDGES)
        squares = sum(each.standard_mm**2 for each in alone.contributions(row))
        # What bends is drawn at random together, and at even quantiles alone.
        close = 1e-9 if alone.linear[row] else 0.1
        assert squares == pytest.approx(alone.covariance[row, row], rel=close, abs=1e-18)
        named = {each.input.name for each in parts} | {u.name for u in budget.unknown(row)}
        assert len(named) == len(parts) + len(budget.unknown(row))
        assert ("process_mm" in {u.name for u in budget.unknown(row)}) == (process is None)


def test_what_is_not_known_is_named_where_something_depends_on_it() -> None:
    inputs = inputs_of(machine_of([None] * 8, ()), 3.0)
    budget = propagate(bent, inputs, EDGES)

    def names(row: int) -> set[str]:
        return {each.name for each in budget.unknown(row)}

    x = {"x.backlash_mm", "x.compensation_mm", "x.scale"}
    assert names(0) == x | {"temperature_k", "process_mm"}
    assert names(1) == {"y.backlash_mm", "y.scale", "temperature_k", "process_mm"}
    assert names(2) >= {*x, "y.scale", "squareness_rad"}
    assert "tool_diameter_mm" not in names(2)
    assert {"tool_diameter_mm", "runout_mm"} <= names(3)
    assert budget.standards.tolist() == [0.0] * 6
    assert budget.contributions(0) == ()
    exact = propagate(bent, inputs_of(machine_of([0.0] * 8, (), process_mm=0.0), 3.0), EDGES)
    assert {each.name for row in range(6) for each in exact.unknown(row)} == {"temperature_k"}


def test_what_nothing_depends_on_is_no_input() -> None:
    machine = machine_of()
    names = {each.name for each in inputs_of(machine, 0.0).each}
    assert not names & {"tool_diameter_mm", "runout_mm", "y.compensation_mm", "x.repeatability_mm"}
    assert "x.compensation_mm" in names
    scattering = with_scatter(machine, 0.003, 0.0)
    assert {each.name for each in inputs_of(scattering, 3.0).each} - names == {
        "tool_diameter_mm", "runout_mm", "x.repeatability_mm"
    }  # fmt: skip


def with_axis_x(machine: Machine, **values: float) -> Machine:
    x = replace(machine.axes.x, **values)
    return replace(machine, axes=replace(machine.axes, x=x))


def with_scatter(machine: Machine, x: float, y: float) -> Machine:
    axes = machine.axes
    own = {"x": replace(axes.x, repeatability_mm=x), "y": replace(axes.y, repeatability_mm=y)}
    return replace(machine, axes=replace(axes, **own))


def test_sizes_are_predicted_without_scatter_and_edges_have_it() -> None:
    machine = with_scatter(machine_of([0.0] * 8, (), process_mm=0.004), 0.003, 0.001)
    seen: list[MachineVariant] = []

    def values(variant: MachineVariant) -> Floats:
        seen.append(variant)
        return bent(variant)

    budget = propagate(values, inputs_of(machine, 3.0), EDGES)
    assert all(axis.repeatability_mm == 0.0 for each in seen for axis in each.machine.axes)
    width, height = budget.standards[:2]
    assert width == pytest.approx(math.sqrt(2.0) * math.hypot(0.004, 0.003))
    assert height == pytest.approx(math.sqrt(2.0) * math.hypot(0.004, 0.001))
    names = [each.input.name for each in budget.contributions(0)]
    assert names == ["process_mm", "x.repeatability_mm"]
    # Values of one feature share its edges, those of two features none.
    assert budget.covariance[2, 3] == pytest.approx(budget.covariance[2, 2])
    assert budget.covariance[0, 1] == 0.0


def test_the_tool_alone_needs_no_other_motion() -> None:
    machine = machine_of()
    seen: list[MachineVariant] = []

    def values(variant: MachineVariant) -> Floats:
        seen.append(variant)
        return bent(variant)

    budget = propagate(values, inputs_of(machine, 3.0), EDGES)
    wider = [each for each in seen if each.wider_mm]
    assert len(wider) == 1
    assert wider[0].machine is seen[0].machine
    assert seen[1] is wider[0]  # whoever keeps the last motion has it
    assert len({id(each.machine) for each in seen}) == 9  # simulations
    assert budget.runs == 10


def test_backlash_does_not_go_below_zero() -> None:
    machine = machine_of((0.2, 0.003, 2e-4, 0.002, 3e-4, 5e-4, 0.006, 0.001), ())
    seen: list[float] = []

    def values(variant: MachineVariant) -> Floats:
        seen.append(variant.machine.axes.x.backlash_mm)
        return bent(variant)

    inputs = inputs_of(machine, 3.0)
    budget = propagate(values, inputs, EDGES)
    assert min(seen) == 0.0
    lost = [each.name for each in inputs.each].index("x.backlash_mm")
    assert budget.sensitivities[0, lost] == pytest.approx(-1.0)  # linear: any step does
    # Of a normal B the mean of max(B, 0) is B Φ(B/s) + s φ(B/s); the width is less by as much.
    b, s = 0.05, math.hypot(0.2, 0.003 * 0.00401 / 0.004)
    mean = b * normal_below(b / s) + s * math.exp(-0.5 * (b / s) ** 2) / math.sqrt(2.0 * math.pi)
    assert budget.shifts[0] == pytest.approx(b - mean, rel=0.01)
    monte_carlo(values, inputs, EDGES, 50, 1)
    assert min(seen) == 0.0


def test_cells_of_a_map_err_together() -> None:
    machine = load_target(
        "pic-mmh", settings=["play_map.use=true", "uncertainty.x.backlash_mm=0.01"]
    ).machine
    seen: list[Any] = []

    def values(variant: MachineVariant) -> Floats:
        cells = variant.machine.play_map.x
        assert cells is not None
        seen.append(cells.play_mm[0])
        return np.array([cells.play_mm[0][1]])

    budget = propagate(values, inputs_of(machine, 0.0), no_edges(1))
    assert budget.standards[0] == pytest.approx(0.01)
    offs = {tuple(np.round(np.array(row) - (0.190, 0.201, 0.187), 9)) for row in seen}
    step = round(0.01 * math.sqrt(3.0), 9)
    axis = machine.axes.x
    kink = axis.compensation_mm * axis.real_step_mm / axis.coded_step_mm
    kink = round(kink - (0.190 + 0.201 + 0.187) / 3.0, 9)
    assert offs == {(0.0,) * 3, (step,) * 3, (-step,) * 3, (kink,) * 3}


def test_a_bend_is_not_taken_for_flat() -> None:
    """At compensation = backlash roundness is least: its derivative says nothing."""
    machine = machine_of((0.01, *[0.0] * 7), ())
    base = machine.axes.x.backlash_mm

    def machined(variant: MachineVariant) -> Floats:
        return np.array([variant.machine.axes.x.backlash_mm - base])

    def measure(nodes: Floats, weights: Floats) -> Floats:
        off = weights @ nodes
        return np.hstack([np.abs(off), off * off, np.maximum(off - 0.004, 0.0)])

    def values(variant: MachineVariant) -> Floats:
        return np.asarray(measure(machined(variant)[None], np.ones((1, 1)))[0])

    inputs = inputs_of(machine, 3.0)
    budget = propagate(machined, inputs, no_edges(3), measure=measure)
    drawn = monte_carlo(values, inputs, no_edges(3), 20000, 3)
    assert budget.values.tolist() == [0.0, 0.0, 0.0]
    assert not budget.linear.any()
    # |x|: 0.798 and 0.603 standard uncertainties; x²: 1 and √2 of their squares.
    for means, standards, close in (
        (budget.expected, budget.standards, 0.03),
        (drawn.values.mean(axis=0), drawn.standards, 0.03),
    ):
        assert means[:2] == pytest.approx([0.00798, 1e-4], rel=close)
        assert standards[:2] == pytest.approx([0.00603, math.sqrt(2.0) * 1e-4], rel=close)
    assert budget.expected == pytest.approx(drawn.values.mean(axis=0), rel=0.05)
    for limit in (0.002, 0.01, 0.02):
        assert budget.probability(0, 0, (-math.inf, limit)) == pytest.approx(
            math.erf(limit / 0.01 / math.sqrt(2.0)), abs=0.02
        )


def test_an_edge_has_a_node_at_its_kink() -> None:
    """Beside a reversal an edge follows what backlash exceeds compensation by, and nothing else:
    the kink is at 0.03, off the machine by two thirds of a standard uncertainty."""
    machine = machine_of((0.03, 0.0, *[0.0] * 6), ())
    machine = with_axis_x(machine, backlash_mm=0.05, compensation_mm=0.03)
    kink = 0.03 * machine.axes.x.real_step_mm / machine.axes.x.coded_step_mm
    seen: list[float] = []

    def machined(variant: MachineVariant) -> Floats:
        lost = variant.machine.axes.x.backlash_mm
        seen.append(lost)
        return np.array([min(lost - kink, 0.0)])

    budget = propagate(machined, inputs_of(machine, 3.0), no_edges(1))
    assert any(lost == pytest.approx(kink, abs=1e-12) for lost in seen)
    random = np.random.default_rng(5).normal(0.05, 0.03, 200_000)
    true = np.minimum(np.maximum(random, 0.0) - kink, 0.0)
    assert budget.expected[0] == pytest.approx(true.mean(), rel=0.05)
    assert budget.standards[0] == pytest.approx(true.std(), rel=0.05)


def test_draws_say_what_the_budget_says() -> None:
    more = {
        "process_mm": 0.004, "temperature_k": 3.0,
        "machine_expansion_per_k": 1.1e-5, "part_expansion_per_k": 8e-5,
    }  # fmt: skip
    inputs = inputs_of(machine_of(**more), 3.0)
    budget = propagate(bent, inputs, EDGES)
    drawn = monte_carlo(bent, inputs, EDGES, 4000, 7)
    plain = slice(0, 4)  # the others bend
    assert np.allclose(drawn.standards[plain], budget.standards[plain], rtol=0.06)
    off = drawn.values.mean(axis=0) - budget.expected
    assert (np.abs(off[plain]) < 4.0 * budget.standards[plain] / math.sqrt(4000)).all()
    corner = np.corrcoef(drawn.values.T)[:4, :4]
    ours = budget.covariance / np.outer(budget.standards, budget.standards)
    assert np.abs(corner - ours[:4, :4]).max() < 0.07
    again = monte_carlo(bent, inputs, EDGES, 5, 7).values
    assert np.array_equal(again, drawn.values[:5])
    for limits in ((19.99, 20.05), (-math.inf, 20.03), (20.0, 20.04)):
        said = probability(
            *budget.expected[[0, 0]], budget.covariance[np.ix_((0, 0), (0, 0))], limits
        )
        seen = drawn.probability(0, 0, limits)
        assert abs(said - seen) < 4.0 * math.sqrt(max(said * (1.0 - said), 1e-3) / 4000)


def test_draws_scatter_as_their_axes_do() -> None:
    """Each draw has a seed of its own, where the machine scatters."""
    seeds: list[int] = []

    def values(variant: MachineVariant) -> Floats:
        seeds.append(variant.machine.mechanics.seed)
        return np.zeros(1)

    quiet = machine_of([0.0] * 8, ())
    monte_carlo(values, inputs_of(quiet, 3.0), no_edges(1), 20, 1)
    assert set(seeds) == {0}
    monte_carlo(values, inputs_of(with_scatter(quiet, 0.01, 0.0), 3.0), no_edges(1), 20, 1)
    assert len(set(seeds)) == 21
    assert without_scatter(MachineVariant(quiet)).machine is quiet


@given(st.floats(0.1, 10.0), SLOPES)
def test_in_other_units_the_uncertainties_are_the_same(
    factor: float, slopes: list[list[float]]
) -> None:
    """Values that are twice as large are twice as uncertain, in any order."""
    machine, table = machine_of(), np.array(slopes)
    inputs, rows = inputs_of(machine, 3.0), len(table)
    one = propagate(linear(machine, table), inputs, no_edges(rows))
    other = propagate(linear(machine, factor * table[::-1]), inputs, no_edges(rows))
    assert np.allclose(
        factor**2 * one.covariance, other.covariance[::-1, ::-1], rtol=1e-6, atol=1e-11
    )


def exchanged(machine: Machine) -> Machine:
    """The machine with X and Y exchanged; its squareness is the same to the first order."""
    axes, said = machine.axes, machine.uncertainty
    other = {"x": "y", "y": "x"}

    def named(key: str) -> str:
        return other[key[0]] + key[1:] if key[1] == "." else key

    pairs = tuple((named(a), named(b), r) for a, b, r in said.correlations)
    return replace(
        machine,
        axes=replace(axes, x=axes.y, y=axes.x),
        uncertainty=replace(said, x=said.y, y=said.x, correlations=pairs),
    )


def test_exchanged_axes_exchange_the_budget() -> None:
    machine = machine_of(process_mm=0.002)
    back = lambda variant: MachineVariant(exchanged(variant.machine), variant.wider_mm)  # noqa: E731
    one = propagate(bent, inputs_of(machine, 3.0), EDGES)
    other = propagate(
        lambda variant: bent(back(variant)), inputs_of(exchanged(machine), 3.0), EDGES[:, :, ::-1]
    )
    both = np.ix_(one.linear, one.linear)
    assert one.linear.sum() == 3
    assert np.allclose(one.covariance[both], other.covariance[both], rtol=1e-12, atol=1e-18)
    # What bends has other draws, by a few per cent.
    assert one.standards == pytest.approx(other.standards, rel=0.03)
    assert one.expected == pytest.approx(other.expected, abs=2e-4)


# Normal distributions.


@given(st.floats(-8.0, 8.0))
def test_one_normal_variable(z: float) -> None:
    assert normal_below(z) == pytest.approx(uniform_below(z), abs=1e-12)
    assert normal_below(z) + normal_below(-z) == pytest.approx(1.0, abs=1e-15)


def uniform_below(z: float) -> float:
    """By a sum of the density, which converges fast for a smooth function."""
    at = np.linspace(-10.0, z, 4001)
    density = np.exp(-0.5 * at * at) / math.sqrt(2.0 * math.pi)
    step = (z + 10.0) / 4000
    weights = np.where(np.arange(4001) % 2, 4.0, 2.0)
    weights[[0, -1]] = 1.0
    return float(density @ weights * step / 3.0)


CLOSE = st.floats(0.0, 12.0).map(lambda power: 1.0 - 10.0**-power)


@examples(300)
@given(
    st.floats(-6.0, 6.0),
    st.floats(-6.0, 6.0),
    st.one_of(st.floats(-1.0, 1.0), CLOSE, CLOSE.map(lambda r: -r)),
)
@example(a=2.2e-309, b=2.2e-309, r=1.0 - 1e-11)
def test_two_normal_variables(a: float, b: float, r: float) -> None:
    assert both_below(a, b, r) == pytest.approx(owen(a, b, r), abs=2e-11)
    assert both_below(a, b, r) == pytest.approx(both_below(b, a, r), abs=2e-11)
    whole = both_below(a, b, r) + both_below(a, -b, -r)
    assert whole == pytest.approx(normal_below(a), abs=2e-11)


def owen(a: float, b: float, r: float) -> float:
    """The same by Owen's T, of scipy."""
    from scipy.special import owens_t

    rest = math.sqrt((1.0 - r) * (1.0 + r))
    if rest < 1e-9:
        if r > 0.0:
            return normal_below(min(a, b))
        return max(0.0, normal_below(a) - normal_below(-b))
    if a == 0.0 and b == 0.0:
        return 0.25 + math.asin(r) / (2.0 * math.pi)
    parts = 0.5 * (normal_below(a) + normal_below(b))
    for h, k in ((a, b), (b, a)):
        if h:
            # (k − r h) / h without cancelling, near r = ±1 and for the smallest of numbers
            slope = (k - h) / h + (1.0 - r) if r > 0.0 else (k + h) / h - (1.0 + r)
            parts -= float(owens_t(h, slope / rest))
        else:
            parts -= math.copysign(0.25, k)
    apart = (a < 0.0) != (b < 0.0)
    return parts - (0.5 if apart else 0.0)


def test_probabilities_of_one_size() -> None:
    def within(size: float, standard: float, limits: tuple[float, float]) -> float:
        return probability(size, size, np.full((2, 2), standard**2), limits)

    assert within(10.0, 0.01, (9.9804, 10.0196)) == pytest.approx(0.95, abs=1e-4)
    assert within(10.0, 0.01, (-math.inf, 10.0)) == pytest.approx(0.5)
    assert within(10.0, 0.01, (10.0, math.inf)) == pytest.approx(0.5)
    assert within(10.0, 0.01, (-math.inf, math.inf)) == 1.0
    assert within(10.0, 0.01, (10.1, 10.2)) < 1e-20
    for size, sure in ((9.99, 0.0), (10.0, 1.0), (10.02, 1.0), (10.021, 0.0)):
        assert within(size, 0.0, (10.0, 10.02)) == sure


@examples(25)
@given(
    st.floats(-0.03, 0.03), st.floats(0.0, 0.03), st.floats(0.001, 0.03), st.floats(0.0, 0.03),
    st.floats(-1.0, 1.0), st.integers(0, 1000),
)  # fmt: skip
def test_probabilities_of_two_sizes_are_those_of_draws(
    low: float, wider: float, s_low: float, s_high: float, r: float, seed: int
) -> None:
    joint = np.array([[s_low**2, r * s_low * s_high], [r * s_low * s_high, s_high**2]])
    said = probability(low, low + wider, joint, (-0.02, 0.02))
    sizes, axes = np.linalg.eigh(joint)
    free = np.random.default_rng(seed).standard_normal((20000, 2))
    drawn = (low, low + wider) + free @ (axes * np.sqrt(np.clip(sizes, 0.0, None))).T
    seen = float(((drawn[:, 0] >= -0.02) & (drawn[:, 1] <= 0.02)).mean())
    assert abs(said - seen) < 5.0 * math.sqrt(max(said * (1.0 - said), 1e-4) / 20000)


def test_nothing_heavy_is_imported() -> None:
    import subprocess
    import sys

    code = "import sys, camtool.inspection.uncertainty; sys.exit('scipy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def budget_of(machine: Machine) -> tuple[Inputs, Budget]:
    inputs = inputs_of(machine, 3.0)
    return inputs, propagate(bent, inputs, EDGES)


def coverage(machine: Machine, cases: int, seed: int) -> Floats:
    """(K,) the share of true machines, drawn about this one, whose sizes lie in the 95 % bands
    that are predicted from it."""
    inputs, budget = budget_of(machine)
    true = monte_carlo(bent, inputs, EDGES, cases, seed).values
    half = 1.959964 * budget.standards
    return np.asarray((np.abs(true - budget.expected) <= half).mean(axis=0))


FAIR = slice(0, 4)
"""The values of `bent` that bend little."""


def test_bands_cover_the_truth() -> None:
    share = coverage(machine_of(process_mm=0.003), 2000, 11)
    assert (share[FAIR] > 0.93).all()
    assert (share[FAIR] < 0.97).all()
    assert (share > 0.90).all()  # normal bands of what is not normal
