"""Uncertainty of predicted sizes: from uncertain inputs of a machine to a budget of each size.

    machine ─inputs_of─▶ Inputs ─propagate─▶ Budget      finite differences of simulations
                              └─monte_carlo─▶ Draws      a simulation for each draw

The caller passes `machined`, a function that simulates a program on a `MachineVariant` (a
machine, and by how much its tool is wider) and returns where the T machined edges of its part lie,
mm; and `measure`, which takes K sizes from such edges, mm. All inputs act on a machine along few
*directions*, in which the simulation is repeated:

    direction      what is moved                   inputs that move along it, with their factors
    backlash       of an axis, by region too       backlash: 1; compensation: −(real / coded step)
    scale          real step of an axis, relative  scale: 1
    growth         all scales at once              temperature: α_machine − α_part
    squareness     of X and Y                      squareness: 1
    tool           its diameter                    tool diameter: 1; run-out: 1
    Z zero         all cuts, downwards             zero of Z: 1
    stock          its thickness                   thickness as measured: 1

Depths depend on the play and scale of Z, its zero, temperature and process, thicknesses of floors
on that of the stock too; these inputs are there where depths are inspected.

Compensation. At a reversal the motor moves by C more, of which the mechanics lose B: only B − k·C
matters (camtool/calibration/model.py), and to add δ more is to lose k·δ less.
Temperature. The slides of a machine that is warmer by T grow by α_machine·T, and so does all that
is cut; the part shrinks by α_part·T until it is measured at 20 °C.

The spread of the values. A size is the least or the largest of many: of the diameters of a circle
the play of X makes some less and the scale of Y makes others more, and the least of all is not the
sum of both. What is close to linear is where each machined edge lies. So the edges are simulated
at a few *nodes* along each direction, and between and beyond the nodes an edge lies on straight
lines; the directions add up. `DRAWS` machines are drawn from the normal distribution of the
inputs, each with its edges, and the sizes of each are measured: their mean, covariance and shares
within limits are those of the sizes. The draws have exactly the mean 0 and the covariance of the
inputs, so that of sizes that are linear the mean and the covariance are exact; the probability of
linear sizes is in closed form. Other probabilities scatter, by less than independent draws do:
0.5 / √DRAWS = 0.008, and 0.0034 at 95 %.

Nodes are differences over a step h of one standard uncertainty s, no infinitesimal one, for
controllers round to steps. Backlash has nodes on both sides, at h = √3 s, and one where
compensation equals it, if that is near: there an edge beside a reversal has its kink. Where sizes
are extremes, so have scale and squareness.

Edges. The process and the scatter of an axis shift each machined edge by itself. `edges`
(K, E, 2), or (K, E, 3) where depths are among them, says by how much the values change with the
place of E edges in X, Y and Z: a width in X has (1, 0) for one edge and (−1, 0) for the other, a
depth (0, 0, 1) for its floor. With the process u, and the repeatability u_x, u_y and u_z of the
axes, their covariance is the sum over E of (u² + u_x²) w_x w_xᵀ + (u² + u_y²) w_y w_yᵀ +
(u² + u_z²) w_z w_zᵀ.

An input that is not known has no part in a covariance; `Budget.unknown` names those on which a
value depends, which a single step shows. Where physics bounds what is not known, `Budget.at_most`
says by how much it can change each value; nothing is assumed of where within that it lies. Only
the temperature is so bounded: of a room ±ROOM_K, of the materials EXPANSIONS_OF_MACHINES and
EXPANSIONS_OF_PARTS, where [uncertainty] does not say them. Not modelled: distributions other than
normal ones (a backlash is cut off at 0 in draws), products of two directions, and directions
whose scale or squareness depend on the place."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import Struct

from camtool.machine.model import Machine, PlayCells
from camtool.records import replace

if TYPE_CHECKING:
    from camtool.arrays import Bools, Floats

PROBE_MM = 0.01
"""Steps of inputs whose standard uncertainty is unknown, which show the values that depend on
them."""

PROBE_SCALE = 1e-3

PROBE_RAD = 1e-3

PROBE_K = 5.0

ROOM_K = 15.0
"""A workshop is within 20 ± 15 °C, whatever it is: the bound of a temperature that is not known.
Sizes hold at 20 °C (ISO 1)."""

EXPANSIONS_OF_MACHINES = (0.0, 3e-5)
"""Range of expansion, 1/K, of the screws, belts and scales by which machines place their slides:
from Invar (1e-6) over steel (11e-6) to aluminium (24e-6) and zinc (30e-6)."""

EXPANSIONS_OF_PARTS = (0.0, 2e-4)
"""Range of expansion, 1/K, of parts: glass, wood and metals, and plastics up to polyethylene of
high density (1.06e-4 to 1.98e-4; Callister, Materials Science and Engineering, table B.6). Softer
materials expand more: their number must be given."""

MAX_SIGMAS = 3.0
"""A temperature with a known standard uncertainty is assumed to be off by at most this many of
them."""

NEGLIGIBLE_MM = 1e-5
"""A value depends on an input if the input's step changes it by more than this, mm."""

CERTAIN = 1e-12
"""Standard deviations below this are taken as 0."""


@dataclass(frozen=True)
class MachineVariant:
    """A machine that differs from the original, in its own values or in those of a cut.

    Its tool is wider by `wider_mm` than in the job, cuts deeper by `deeper_mm`, and its stock is
    thicker by `thicker_mm`; features of other set-ups lie `beside_mm` (x, y) of their places.
    Variants of these alone share the machine object of the original, so that its motion is not
    simulated again."""

    machine: Machine
    wider_mm: float = 0.0
    deeper_mm: float = 0.0
    thicker_mm: float = 0.0
    beside_mm: tuple[float, float] = (0.0, 0.0)


STEP_IN_BENDS = math.sqrt(3.0)
"""Steps where edges bend, in standard uncertainties: the outer nodes of Gauss and Hermite's rule
of three points."""

KINK_NEAR = (0.05, 3.0)
"""A kink nearer than the first of these to the machine itself, or farther than the second, gets no
node of its own, in standard uncertainties: it changes an edge by less than 0.05 of one, or matters
to 1 draw in 700."""

DRAWS = 4096

SEED = 20
"""The draws are the same for every part, so that a budget is deterministic."""

QUANTILES = 64
"""Number of equally likely values of one input, from which its own contribution is computed."""

LINEAR_MM = 1e-7
"""A size counts as linear if all its draws lie within this of a linear function of the inputs,
mm."""

Machined = Callable[[MachineVariant], "Floats"]
"""Function that simulates a variant and returns the positions (T,) mm of the edges of its part."""

Measure = Callable[["Floats", "Floats"], "Floats"]
"""Function that measures the K sizes of N parts, (N, K) mm, from the edges of M simulated ones (M,
T) mm and the weights (N, M) with which each part mixes these."""

Values = Callable[[MachineVariant], "Floats"]
"""Function that simulates a variant and measures K sizes of its part: (K,) mm."""

Moved = Callable[[MachineVariant, float], MachineVariant]


class Direction(Struct, frozen=True):
    """A direction in the space of machines. `moved` returns the variant shifted along it, down to
    `lowest`. `bends`: edges may be far from linear in it, with a kink at `kink`; `distorts`: it
    turns circles into ellipses, and affects their least and largest diameters."""

    name: str
    moved: Moved
    lowest: float = -math.inf
    kink: float = 0.0
    bends: bool = False
    distorts: bool = False


class Input(Struct, frozen=True):
    """An uncertain input of a prediction.

    `name` as in `[uncertainty]` ("x.backlash_mm", "process_mm"), `value` on the machine,
    `standard` uncertainty in the same unit (None: unknown), and a `probe`, a step that reveals the
    values that depend on it. It moves the machine along `along`, (direction, factor), or the
    machined edges: then `edges` are its shares in X, Y and Z. If it is not known, `missing` are
    the keys that would tell it, and `most` is an upper bound of its error, explained by the words
    `within` (infinite and "": nothing bounds it)."""

    name: str
    unit: str
    value: float
    standard: float | None
    probe: float
    along: tuple[tuple[Direction, float], ...] = ()
    edges: tuple[float, float, float] = (0.0, 0.0, 0.0)
    missing: tuple[str, ...] = ()
    most: float = math.inf
    within: str = ""


class Inputs(Struct, frozen=True, dict=True):
    """The uncertain inputs of one machine; `correlation` (P, P) in their order."""

    variant: MachineVariant
    each: tuple[Input, ...]
    correlation: Floats

    @property
    def directions(self) -> tuple[Direction, ...]:
        """Directions along which any of the inputs moves the machine."""
        return tuple(dict.fromkeys(one for each in self.each for one, _ in each.along))

    @property
    def factors(self) -> Floats:
        """Shift (D, P) of the machine along each direction, per unit of each input."""
        factors, directions = np.zeros((len(self.directions), len(self.each))), self.directions
        for column, each in enumerate(self.each):
            for direction, factor in each.along:
                factors[directions.index(direction), column] += factor
        return factors

    @property
    def standards(self) -> Floats:
        """Standard uncertainties (P,), 0 for unknown ones."""
        return np.array([each.standard or 0.0 for each in self.each])

    @property
    def probes(self) -> Floats:
        """Steps (P,) that reveal the dependence on unknown inputs, 0 for others."""
        return np.array([each.probe if each.standard is None else 0.0 for each in self.each])

    @property
    def covariance(self) -> Floats:
        """Covariance (P, P); 0 for unknown inputs."""
        joint: Floats = self.correlation * np.outer(self.standards, self.standards)
        return joint

    @cached_property
    def root(self) -> Floats:
        """Matrix (P, P) that turns N independent standard normal draws into draws of the inputs:
        (N, P) @ root. Diagonal for uncorrelated inputs."""
        sizes, axes = np.linalg.eigh(self.correlation)
        square = axes * np.sqrt(np.clip(sizes, 0.0, None)) @ axes.T
        return np.asarray(square * self.standards)


# From a machine to its inputs.


def inputs_of(
    machine: Machine,
    tool_diameter_mm: float,
    *,
    depths: bool = False,
    flip_errors_mm: Sequence[float | None] = (),
) -> Inputs:
    """Return the uncertain inputs of this machine with a tool of this diameter (0: no width); with
    `depths` those of Z and of the stock too.

    `flip_errors_mm`: how far set-ups may lie beside each other, one for each that is turned over
    (None: not known). What nothing depends on is left out: the uncertainty of a compensation of 0,
    that of a tool without width, and scatter that is not modelled. Sizes are predicted without
    scatter."""
    stated = machine.uncertainty
    inputs: list[Input] = []
    axes = [
        ("x", machine.axes.x, stated.x, machine.play_map.used[0]),
        ("y", machine.axes.y, stated.y, machine.play_map.used[1]),
    ]
    if depths:
        axes.append(("z", machine.axes.z, stated.z, None))
    length, part, angle = (
        partial(_input, unit, probe)
        for unit, probe in (("mm", PROBE_MM), ("", PROBE_SCALE), ("rad", PROBE_RAD))
    )
    # The tool comes first: the motion of the machine itself is still known then.
    if tool_diameter_mm > 0.0:
        wider = Direction("tool", _with_tool), 1.0
        inputs.append(length("tool_diameter_mm", tool_diameter_mm, stated.tool_diameter_mm, wider))
        inputs.append(length("runout_mm", 0.0, stated.runout_mm, wider))
    if depths:
        lower, thicker = Direction("z.zero", _with_depth), Direction("stock", _with_stock)
        inputs.append(length("z_zero_mm", 0.0, stated.z_zero_mm, (lower, 1.0)))
        thickness = length("stock_thickness_mm", 0.0, stated.stock_thickness_mm, (thicker, 1.0))
        inputs.append(thickness)
    if flip_errors_mm:
        inputs += _flip_inputs(flip_errors_mm)
    for name, axis, standards, cells in axes:
        plays = [play for row in cells.play_mm for play in row] if cells else [axis.backlash_mm]
        scale = Direction(f"{name}.scale", _with_scale(name), distorts=True)
        ratio = axis.real_step_mm / axis.coded_step_mm
        mean, added = sum(plays) / len(plays), axis.compensation_mm
        backlash = Direction(
            f"{name}.backlash",
            _with_backlash(name),
            lowest=-max(plays),
            kink=ratio * added - mean if added > 0.0 else 0.0,
            bends=True,
        )
        inputs.append(length(f"{name}.backlash_mm", mean, standards.backlash_mm, (backlash, 1.0)))
        if added > 0.0:
            signed = backlash, -ratio
            inputs.append(
                length(f"{name}.compensation_mm", added, standards.compensation_mm, signed)
            )
        inputs.append(part(f"{name}.scale", ratio, standards.scale, (scale, 1.0)))
    lean = Direction("squareness", _with_squareness, distorts=True), 1.0
    value = machine.mechanics.squareness_rad
    inputs.append(angle("squareness_rad", value, stated.squareness_rad, lean))
    inputs.append(_temperature(machine))
    inputs.append(length("process_mm", 0.0, stated.process_mm, edges=(1.0, 1.0, 1.0)))
    for name, axis, *_ in axes:
        shares = (float(name == "x"), float(name == "y"), float(name == "z"))
        if axis.repeatability_mm > 0.0:
            scatter = axis.repeatability_mm
            inputs.append(length(f"{name}.repeatability_mm", 0.0, scatter, edges=shares))
    correlation = stated.correlation([each.name for each in inputs])
    return Inputs(MachineVariant(machine), tuple(inputs), correlation)


def _input(
    unit: str,
    probe: float,
    name: str,
    value: float,
    standard: float | None,
    *along: tuple[Direction, float],
    edges: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Input:
    missing = (name,) if standard is None else ()
    return Input(name, unit, value, standard, probe, along, edges, missing)


def _flip_inputs(errors_mm: Sequence[float | None]) -> Iterator[Input]:
    """Yield the inputs of a part that is turned over, in X and in Y. `flip_error` is a bound, so
    all that lies within counts as equally likely: 1/√3 of it is the standard uncertainty (JCGM
    100:2008, 4.3.7)."""
    stated_mm = [each for each in errors_mm if each is not None]
    standard = None
    if len(stated_mm) == len(errors_mm):
        standard = math.sqrt(sum(each * each for each in stated_mm) / 3.0)
    missing = () if standard is not None else ("flip_error",)
    for column, axis in enumerate("xy"):
        direction = Direction(f"flip.{axis}", _with_flip(column))
        name = f"flip_error.{axis}"
        yield Input(name, "mm", 0.0, standard, PROBE_MM, ((direction, 1.0),), missing=missing)


def _temperature(machine: Machine) -> Input:
    """Return the input of the room temperature, K from 20 °C; unknown unless both expansions are
    known. Unknown expansions may differ as much as those of all materials do."""
    stated = machine.uncertainty
    expansions = stated.part_expansion_per_k, stated.machine_expansion_per_k
    usual = EXPANSIONS_OF_PARTS, EXPANSIONS_OF_MACHINES
    part, slides = (
        every if own_expansion is None else (own_expansion, own_expansion)
        for own_expansion, every in zip(expansions, usual, strict=True)
    )
    differ = max(slides[1] - part[0], part[1] - slides[0], key=abs)
    if None not in expansions:
        differ = slides[0] - part[0]
    every_key = (
        ("part_expansion_per_k", expansions[0]),
        ("machine_expansion_per_k", expansions[1]),
        ("temperature_k", stated.temperature_k),
    )
    missing = tuple(key for key, value in every_key if value is None)
    if not missing or stated.temperature_k == 0.0:
        standard, missing = stated.temperature_k, ()
    else:
        standard = None
    warmer = ROOM_K
    if stated.temperature_k is not None:
        warmer = min(ROOM_K, MAX_SIGMAS * stated.temperature_k)
    conditions = [f"the room is within 20 ± {warmer:g} °C"]
    for body, own_expansion, (low, high) in zip(
        ("part", "machine"), expansions, usual, strict=True
    ):
        if own_expansion is None:
            conditions.append(f"the {body} grows by {low * 1e6:g} to {high * 1e6:g} µm/m per K")
    return Input(
        name="temperature_k",
        unit="K",
        value=0.0,
        standard=standard,
        probe=PROBE_K,
        along=((Direction("growth", _grown), differ),),
        missing=missing,
        most=warmer if missing else math.inf,
        within=", ".join(conditions) if missing else "",
    )


def _with_backlash(name: str) -> Moved:
    def shift_backlash(variant: MachineVariant, by_mm: float) -> MachineVariant:
        machine = variant.machine
        index = "xyz".index(name)
        cells = machine.play_map.used[index]
        if cells is not None:
            changes: dict[str, Any] = {name: _more_play(cells, by_mm)}
            return _varied(variant, play_map=replace(machine.play_map, **changes))
        axis = tuple(machine.axes)[index]
        own_axis = replace(axis, backlash_mm=max(0.0, axis.backlash_mm + by_mm))
        return _varied(variant, axes=replace(machine.axes, **{name: own_axis}))

    return shift_backlash


def _more_play(cells: PlayCells, by_mm: float) -> PlayCells:
    rows = tuple(tuple(max(0.0, play + by_mm) for play in row) for row in cells.play_mm)
    return replace(cells, play_mm=rows)


def _with_scale(name: str) -> Moved:
    def shift_scale(variant: MachineVariant, factor: float) -> MachineVariant:
        axes = variant.machine.axes
        axis = tuple(axes)["xyz".index(name)]
        axis = replace(axis, real_step_mm=axis.real_step_mm * (1.0 + factor))
        return _varied(variant, axes=replace(axes, **{name: axis}))

    return shift_scale


def _grown(variant: MachineVariant, factor: float) -> MachineVariant:
    for name in "xyz":
        variant = _with_scale(name)(variant, factor)
    return variant


def _with_squareness(variant: MachineVariant, by_rad: float) -> MachineVariant:
    mechanics = variant.machine.mechanics
    lean = mechanics.squareness_rad + by_rad
    return _varied(variant, mechanics=replace(mechanics, squareness_rad=lean))


def _with_tool(variant: MachineVariant, by_mm: float) -> MachineVariant:
    return replace(variant, wider_mm=variant.wider_mm + by_mm)


def _with_depth(variant: MachineVariant, by_mm: float) -> MachineVariant:
    return replace(variant, deeper_mm=variant.deeper_mm + by_mm)


def _with_flip(column: int) -> Moved:
    def shift_face(variant: MachineVariant, by_mm: float) -> MachineVariant:
        x, y = variant.beside_mm
        beside_mm = (x, y + by_mm) if column else (x + by_mm, y)
        return replace(variant, beside_mm=beside_mm)

    return shift_face


def _with_stock(variant: MachineVariant, by_mm: float) -> MachineVariant:
    return replace(variant, thicker_mm=variant.thicker_mm + by_mm)


def _varied(variant: MachineVariant, **records: Any) -> MachineVariant:
    return replace(variant, machine=replace(variant.machine, **records))


def without_scatter(variant: MachineVariant) -> MachineVariant:
    """Return the variant without scatter: its axes always arrive at their mean positions."""
    axes = variant.machine.axes
    if not any(axis.repeatability_mm for axis in axes):
        return variant
    mean_axes = {
        name: replace(axis, repeatability_mm=0.0) for name, axis in zip("xyz", axes, strict=True)
    }
    return _varied(variant, axes=replace(axes, **mean_axes))


# The weights of edges.


def opposite_edges(direction_rad: float) -> Floats:
    """Return the weights (2, 2) of a width or a diameter measured along a direction: its two edges
    in X and Y."""
    along = math.cos(direction_rad), math.sin(direction_rad)
    return np.array([along, (-along[0], -along[1])])


def edges_of(features: Sequence[tuple[int, Floats]]) -> Floats:
    """Return the weights (K, E, 2), or (K, E, 3) if one has Z, of the edges of all features
    together.

    Each feature has weights (E_f, 2) or (E_f, 3), and a number of values, such as 2 for a least
    and a greatest diameter. Features share no edges."""
    axes = max((own_weights.shape[1] for _, own_weights in features), default=2)
    rows = sum(count for count, _ in features)
    weights = np.zeros((rows, sum(len(own_weights) for _, own_weights in features), axes))
    row = column = 0
    for count, own_weights in features:
        weights[row : row + count, column : column + len(own_weights), : own_weights.shape[1]] = (
            own_weights
        )
        row, column = row + count, column + len(own_weights)
    return weights


# Propagation by finite differences.


class InputContribution(Struct, frozen=True):
    """The contribution of one input to the uncertainty of a value. `standard_mm`: standard
    uncertainty of the value if only this input were uncertain, |sensitivity| × that of the input,
    and the effect of bends; `variance_mm2`: its share of the variance with its covariances; these
    shares add up, and may be negative."""

    input: Input
    sensitivity: float
    standard_mm: float
    variance_mm2: float


class Budget(Struct, frozen=True, eq=False, dict=True):
    """The uncertainty of K values from P inputs.

    `values` (K,) mm: as simulated on the machine itself; `shifts` (K,) mm: by how much their
    expectations differ from that, where they bend. `sensitivities` (K, P): of edges the root of
    the sum of their squares; 0 for what is known exactly. `covariance` (K, K) mm²; `variances` (K,
    P) mm² its diagonal by input, and `alone` (K, P) mm² that of each input if only it were
    uncertain. `probed` (K, P) mm: the change of a value by the probe of an unknown input, else 0.
    `runs`: number of variants that were simulated. `drawn` (N, K) mm: the values of machines drawn
    at random, without what shifts single edges, of which `scatter` (K,) mm is the standard
    deviation; `linear` (K,): True where a value is linear in all inputs."""

    inputs: tuple[Input, ...]
    values: Floats
    shifts: Floats
    sensitivities: Floats
    covariance: Floats
    variances: Floats
    alone: Floats
    probed: Floats
    runs: int
    drawn: Floats
    scatter: Floats
    linear: Bools

    @property
    def expected(self) -> Floats:
        """Expected values (K,) mm."""
        return self.values + self.shifts

    @cached_property
    def standards(self) -> Floats:
        """Standard uncertainties (K,) mm from the known inputs."""
        return np.sqrt(np.clip(np.diag(self.covariance), 0.0, None))

    @cached_property
    def at_most(self) -> Floats:
        """Upper bounds (K, P) mm of the change of a value by an unknown input: infinite without a
        bound, 0 if the value does not depend on it."""
        max_change = np.array([each.most / each.probe for each in self.inputs])
        matters = self.probed > NEGLIGIBLE_MM
        return np.where(matters, np.where(matters, self.probed, 1.0) * max_change, 0.0)

    def probability(self, low: int, high: int, limits: tuple[float, float]) -> float:
        """Return the probability that value `low` is not below the lower limit and value `high`
        not above the upper one, mm. The two are of one feature, so that they share its edges. A
        limit may be infinite."""
        rows = [low, high]
        if self.linear[rows].all():
            low_value, high_value = self.expected[rows].tolist()
            return probability(low_value, high_value, self.covariance[np.ix_(rows, rows)], limits)
        above, below = self.drawn[:, low] - limits[0], limits[1] - self.drawn[:, high]
        scatter = float(self.scatter[low])
        if scatter < CERTAIN:
            return float(((above >= 0.0) & (below >= 0.0)).mean())
        # The edges shift both values by the same normal z: inside where −above ≤ z ≤ below.
        inside = normals_below(below / scatter) - normals_below(-above / scatter)
        return float(np.maximum(inside, 0.0).mean())

    def contributions(self, value: int) -> tuple[InputContribution, ...]:
        """Return the contributions of the known inputs to a value, the largest first, without
        those of 0."""
        contributions = [
            InputContribution(
                each,
                float(self.sensitivities[value, column]),
                math.sqrt(self.alone[value, column]),
                float(self.variances[value, column]),
            )
            for column, each in enumerate(self.inputs)
            if each.standard
        ]
        contributions = [each for each in contributions if each.standard_mm or each.variance_mm2]
        return tuple(
            sorted(contributions, key=lambda each: (-abs(each.variance_mm2), -each.standard_mm))
        )

    def unknown(self, value: int) -> tuple[Input, ...]:
        """Return the inputs on which a value depends and whose uncertainty is unknown."""
        return tuple(
            each
            for column, each in enumerate(self.inputs)
            if each.standard is None and self.probed[value, column] > NEGLIGIBLE_MM
        )


def _edges_as_sizes(nodes: Floats, weights: Floats) -> Floats:
    """Return the mixed edges (N, T) themselves: the measurement of values that are edges."""
    return np.asarray(weights @ nodes)


def propagate(
    machined: Machined,
    inputs: Inputs,
    edges: Floats,
    *,
    measure: Measure = _edges_as_sizes,
    extremes: bool = False,
) -> Budget:
    """Return the budget of K values, from simulations of a few variants of the machine.

    There are at most eleven, fourteen where the values are `extremes` (minima and maxima along a
    feature), and one more measurement where the tool has a width. `edges` (K, E, 2 or 3) are the
    weights of the values' edges."""
    base = without_scatter(inputs.variant)
    factors, covariance = inputs.factors, inputs.covariance
    spread = np.sqrt(np.clip(np.diag(factors @ covariance @ factors.T), 0.0, None))
    places: list[Floats] = []  # of the nodes of each direction, ascending
    simulated = [np.asarray(machined(base), dtype=np.float64)]
    rows: list[list[int]] = []  # the simulation of each node
    for column, direction in enumerate(inputs.directions):
        probe = float(max(np.abs(factors[column]) * inputs.probes))
        places.append(_nodes(direction, float(spread[column]), probe, extremes))
        rows.append([])
        for place in places[-1].tolist():
            rows[-1].append(len(simulated) if place else 0)
            if place:
                simulated.append(np.asarray(machined(direction.moved(base, place))))
    nodes = np.stack(simulated)
    one = np.ones((1, 1))
    at_nodes = np.concatenate([measure(each[None], one) for each in nodes])
    centre = at_nodes[0]
    slopes = np.zeros((len(centre), len(places)))
    reach = np.zeros_like(slopes)
    for column, (positions, node_rows) in enumerate(zip(places, rows, strict=True)):
        if len(positions) > 1:
            first, last = at_nodes[node_rows[0]], at_nodes[node_rows[-1]]
            slopes[:, column] = (last - first) / (positions[-1] - positions[0])
            for row, x in zip(node_rows, positions.tolist(), strict=True):
                if x:
                    change = np.abs(at_nodes[row] - centre) / abs(x)
                    reach[:, column] = np.maximum(reach[:, column], change)
    sensitivities = slopes @ factors

    draws = _normals(len(inputs.each), DRAWS) @ inputs.root
    offsets = draws @ factors.T
    # Each input by itself, with the values that are equally likely.
    quantiles = _quantiles(QUANTILES)
    for own_factors, standard in zip(factors.T, inputs.standards, strict=True):
        offsets = np.concatenate([offsets, np.outer(quantiles * standard, own_factors)])
    measured = measure(nodes, _weights_of(offsets, inputs.directions, places, rows, len(nodes)))
    drawn, single = measured[:DRAWS], measured[DRAWS:].reshape(len(inputs.each), QUANTILES, -1)
    shifts = drawn.mean(axis=0) - centre
    # The draws of a linear value follow from its sensitivities exactly.
    straight = draws @ sensitivities.T
    linear = np.abs(drawn - centre - straight).max(axis=0, initial=0.0) <= LINEAR_MM
    shifts[linear] = 0.0
    residual = np.where(linear, straight, drawn - centre - shifts)
    joint = residual.T @ residual / DRAWS
    single_variance = single.var(axis=1).T
    single_variance[single_variance < CERTAIN**2] = 0.0
    single_variance[linear] = (sensitivities[linear] * inputs.standards) ** 2
    # The part of a value that is proportional to each input; the rest comes from bends.
    variances = sensitivities * (residual.T @ draws / DRAWS)
    remainder = np.diag(joint) - variances.sum(axis=1)
    bent = np.maximum(single_variance - (sensitivities * inputs.standards) ** 2, 0.0)
    total = bent.sum(axis=1, keepdims=True)
    bent = np.where(total > 0.0, bent, single_variance)
    total = bent.sum(axis=1, keepdims=True)
    shares = np.divide(bent, total, out=np.zeros_like(bent), where=total > 0.0)
    variances += remainder[:, None] * shares
    largest = reach @ np.abs(factors)
    scatter = np.zeros(len(centre))
    for column, each in enumerate(inputs.each):
        if any(each.edges):
            weights = _weights(edges, each)
            sensitivities[:, column] = np.sqrt((weights**2).sum(axis=1))
            largest[:, column] = sensitivities[:, column]
            own_factors = (each.standard or 0.0) ** 2 * weights @ weights.T
            joint += own_factors
            variances[:, column] = single_variance[:, column] = np.diag(own_factors)
            scatter += np.diag(own_factors)
    return Budget(
        inputs=inputs.each,
        values=centre,
        shifts=shifts,
        sensitivities=sensitivities,
        covariance=joint,
        variances=variances,
        alone=single_variance,
        probed=largest * inputs.probes,
        runs=len(nodes),
        drawn=drawn,
        scatter=np.sqrt(scatter),
        linear=linear,
    )


def _nodes(direction: Direction, standard: float, probe: float, extremes: bool) -> Floats:
    """Return the ascending offsets (J,) of an uncertain value of the machine for which it is
    simulated, in the unit of the value, 0 among them; only 0 if the value is certain."""
    is_bent = direction.bends or (extremes and direction.distorts)
    step = (standard or probe) * (STEP_IN_BENDS if is_bent and standard else 1.0)
    if not step:
        return np.zeros(1)
    places = {0.0, step}
    if is_bent:
        step_back = min(step, -direction.lowest)
        if step_back > CERTAIN:
            places.add(-step_back)
        if KINK_NEAR[0] * standard < abs(direction.kink) < KINK_NEAR[1] * standard:
            places.add(max(direction.kink, direction.lowest))
    return np.array(sorted(places))


def _weights_of(
    offsets: Floats,
    directions: Sequence[Direction],
    places: Sequence[Floats],
    rows: Sequence[Sequence[int]],
    count: int,
) -> Floats:
    """Return the weights (N, M) with which M simulated machines are mixed into N machines at
    `offsets` (N, D) along the directions.

    They are piecewise linear between the nodes, and extrapolated beyond the outer ones."""
    weights = np.zeros((len(offsets), count))
    weights[:, 0] = 1.0
    each = np.arange(len(offsets))
    for column, (positions, node_rows) in enumerate(zip(places, rows, strict=True)):
        if len(positions) < 2:
            continue
        x = np.maximum(offsets[:, column], directions[column].lowest)
        low_index = np.clip(np.searchsorted(positions, x, side="right") - 1, 0, len(positions) - 2)
        share = (x - positions[low_index]) / (positions[low_index + 1] - positions[low_index])
        row = np.asarray(node_rows)
        np.add.at(weights, (each, row[low_index]), 1.0 - share)
        np.add.at(weights, (each, row[low_index + 1]), share)
        weights[:, 0] -= 1.0
    return weights


def _normals(count: int, draws: int) -> Floats:
    """Return standard normal samples (N, P), whose covariance is exactly the unit matrix.

    Each column holds the middles of N equally likely intervals in random order (a Latin hypercube)
    before it is transformed."""
    random, middles = np.random.default_rng(SEED), _quantiles(draws)
    columns = [random.permutation(middles) for _ in range(count)]
    every = np.column_stack(columns) if columns else np.zeros((draws, 0))
    lower = np.linalg.cholesky(every.T @ every / draws)
    return np.asarray(np.linalg.solve(lower, every.T).T)


def _quantiles(count: int) -> Floats:
    """Return the middles (Q,) of Q equally likely intervals of a standard normal distribution,
    scaled to a standard deviation of 1."""
    from statistics import NormalDist

    middles = [NormalDist().inv_cdf((k + 0.5) / count) for k in range(count)]
    normalised = np.array(middles)
    return np.asarray(normalised / normalised.std())


def _weights(edges: Floats, each: Input) -> Floats:
    """Return the weights (K, 2E) or (K, 3E) of the edges multiplied by an input's shares in X, Y
    and Z."""
    shared: Floats = edges * np.array(each.edges[: edges.shape[2]])
    return shared.reshape(len(edges), -1)


# Monte Carlo.


class Draws(Struct, frozen=True, eq=False):
    """Values (N, K) mm of N draws of the known inputs, each simulated."""

    values: Floats

    @property
    def standards(self) -> Floats:
        """Standard deviations (K,) mm."""
        return np.asarray(self.values.std(axis=0, ddof=1))

    def probability(self, low: int, high: int, limits: tuple[float, float]) -> float:
        """Return the share of the draws in which value `low` is not below the lower limit and
        value `high` not above the upper one."""
        lower, upper = limits
        inside = (self.values[:, low] >= lower) & (self.values[:, high] <= upper)
        return float(inside.mean())


def monte_carlo(values: Values, inputs: Inputs, edges: Floats, draws: int, seed: int) -> Draws:
    """Return the values of variants drawn from the joint normal distribution of the inputs, each
    simulated with its own scatter of the axes.

    Unknown inputs keep their value; a backlash below 0 becomes 0."""
    random = np.random.default_rng(seed)
    process = next((each for each in inputs.each if all(each.edges)), None)
    samples = []
    for _ in range(draws):
        offsets = inputs.factors @ (random.standard_normal(len(inputs.each)) @ inputs.root)
        variant = inputs.variant
        for direction, shift in zip(inputs.directions, offsets.tolist(), strict=True):
            if shift:
                variant = direction.moved(variant, max(shift, direction.lowest))
        mechanics = replace(variant.machine.mechanics, seed=int(random.integers(1 << 32)))
        if without_scatter(variant) is not variant:
            variant = _varied(variant, mechanics=mechanics)
        drawn = np.asarray(values(variant), dtype=np.float64)
        if process is not None and process.standard:
            weights = _weights(edges, process)
            shifts = random.standard_normal(weights.shape[1])
            drawn = drawn + process.standard * weights @ shifts
        samples.append(drawn)
    return Draws(np.array(samples))


# Normal distributions.


def normal_below(z: float) -> float:
    """Return the probability that a standard normal variable is at most z; relative error
    1e-15."""
    return 0.5 * math.erfc(-z / math.sqrt(2.0))


def normals_below(z: Floats) -> Floats:
    """Return the probabilities (N,) that a standard normal variable is at most each z (N,)."""
    return np.array([normal_below(each) for each in z.tolist()])


FAR = 9.0
"""Beyond this many standard deviations a normal variable has a probability below 2e-19."""

NODES = 24
"""Nodes of Gauss and Legendre's rule on each piece of an integral."""

STEEPNESS = (-FAR, -3.0, 0.0, 3.0, FAR)
"""An integral is divided at these distances from the steep place of its integrand, in widths of
that place."""


def both_below(a: float, b: float, correlation: float) -> float:
    """Return the probability that two standard normal variables are at most a and b; error below
    1e-12.

    Given the first, x, the second is normal about r·x with the variance 1 − r²:

        ∫_{−∞}^{a} φ(x) Φ((b − r·x) / √(1 − r²)) dx,

    by Gauss and Legendre's rule on pieces. Near r = ±1 the second factor is steep at x = b/r: the
    pieces are finer there."""
    r = min(1.0, max(-1.0, correlation))
    sine = math.sqrt((1.0 - r) * (1.0 + r))
    if sine < CERTAIN:
        if r > 0.0:
            return normal_below(min(a, b))
        return max(0.0, normal_below(a) - normal_below(-b))
    end = min(a, FAR)
    if end <= -FAR:
        return 0.0
    if b >= FAR:
        return normal_below(a)
    ends = {-FAR, end, *(float(x) for x in range(-8, 9, 2))}
    if r:
        ends |= {(b + sine * each) / r for each in STEEPNESS}
    pieces = sorted(x for x in ends if -FAR <= x <= end)
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    total = 0.0
    for start, stop in pairwise(pieces):
        half = 0.5 * (stop - start)
        x = start + half * (nodes + 1.0)
        density = np.exp(-0.5 * x * x) / math.sqrt(2.0 * math.pi)
        conditional = [normal_below((b - r * each) / sine) for each in x.tolist()]
        total += half * float(weights @ (density * conditional))
    return min(1.0, max(0.0, total))


def probability(low: float, high: float, covariance: Floats, limits: tuple[float, float]) -> float:
    """Return the probability that a lower size is not below the lower limit and an upper one not
    above the upper limit, both normal with the expectations `low` and `high` and the `covariance`
    (2, 2). For one size pass it twice, with its variance four times. A limit may be infinite."""
    lower, upper = limits
    s_low, s_high = (math.sqrt(max(0.0, float(covariance[k, k]))) for k in (0, 1))
    above = _sigmas(low - lower, s_low)
    below = _sigmas(upper - high, s_high)
    if s_low < CERTAIN or s_high < CERTAIN:
        return normal_below(above) * normal_below(below)
    # "Not below the lower limit" means: −low is at most −lower. So the correlation changes its
    # sign.
    return both_below(above, below, -float(covariance[0, 1]) / (s_low * s_high))


def _sigmas(inside: float, standard: float) -> float:
    """Return the distance inside a limit, in standard deviations; ±inf if the value is certain."""
    if standard < CERTAIN:
        return math.inf if inside >= 0.0 else -math.inf
    return inside / standard
