"""How often the truth lies in the bands that are predicted: of calibrated machines, and of parts
that are simulated on machines that are not quite the one in the file."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

from camtool.arrays import Floats
from camtool.calibration.calibrate import Calibration
from camtool.calibration.coupons import Kind, sheet
from camtool.importers.read import read_bytes
from camtool.inspection.dimensions import Dimension
from camtool.inspection.inspector import Inspector
from camtool.inspection.uncertainty import (
    Inputs,
    MachineVariant,
    inputs_of,
    monte_carlo,
    propagate,
)
from camtool.machine.model import Machine
from camtool.pipeline import post_drawing
from camtool.planning.job import job_of
from camtool.records import replace
from camtool.target.registry import load_target
from tests.calibration.test_recovered import found, machine_of

BAND = 1.959964
"""Standard uncertainties to either side that hold 95 %."""


# Machines that were calibrated by coupons with known faults.


def sizes_of(variant: MachineVariant) -> Floats:
    """Sizes of parts of a machine, exactly: a width and a height whose edges are reached from
    opposite sides, and both diagonals of a rectangle (camtool/calibration/model.py)."""
    machine = variant.machine
    widths = []
    for axis, nominal in ((machine.axes.x, 35.0), (machine.axes.y, 22.0)):
        k = axis.real_step_mm / axis.coded_step_mm
        widths.append(k * nominal - (axis.backlash_mm - k * axis.compensation_mm))
    width, height = widths
    lean = math.tan(machine.mechanics.squareness_rad) * height
    rising, falling = math.hypot(width + lean, height), math.hypot(width - lean, height)
    return np.array([width, height, rising, falling])


def calibrated(machine: Machine, result: Calibration) -> Machine:
    """The machine as the calibration has it."""
    axes = machine.axes
    own = {}
    for name in ("x", "y"):
        step, play = result.estimate("step", name), result.estimate("play", name)
        assert step is not None
        assert play is not None
        axis = getattr(axes, name)
        own[name] = replace(axis, real_step_mm=step.value, backlash_mm=max(play.value, 0.0))
    lean = result.estimate("squareness")
    assert lean is not None
    mechanics = replace(machine.mechanics, squareness_rad=lean.value)
    return replace(
        machine, axes=replace(axes, **own), mechanics=mechanics, uncertainty=result.known
    )


def calibrations_that_cover(kind: Kind, cases: int) -> Floats:
    """(4,) the share of machines, each with faults of its own, whose sizes lie in the bands that
    follow from a coupon that was measured with scatter."""
    random = np.random.default_rng(5)
    none = np.zeros((4, 0, 2))
    hits = np.zeros(4)
    for case in range(cases):
        scale = tuple(random.uniform(0.99, 1.01, 2).tolist())
        play = tuple(random.uniform(0.05, 0.2, 2).tolist())
        machine = machine_of(scale, play, (0.05, 0.1), float(random.uniform(-0.01, 0.01)))
        drawn = sheet(kind, (60.0, 40.0), (1, 1), machine)
        ours = calibrated(machine, found(drawn, machine, sigma_mm=0.003, seed=case))
        budget = propagate(sizes_of, inputs_of(ours, 0.0), none)
        known = {"squareness_rad", "x.scale", "y.scale", "x.backlash_mm", "y.backlash_mm"}
        assert not known & {each.name for row in range(4) for each in budget.unknown(row)}
        off = np.abs(sizes_of(MachineVariant(machine)) - budget.expected)
        hits += off <= BAND * budget.standards
    return hits / cases


@pytest.mark.parametrize("kind", ["squares", "circles"])
def test_calibrated_machines_are_covered(kind: Kind) -> None:
    share = calibrations_that_cover(kind, 60)
    assert (share > 0.85).all(), share


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["squares", "circles"])
def test_two_thousand_calibrated_machines_are_covered(kind: Kind) -> None:
    share = calibrations_that_cover(kind, 2000)
    assert (share > 0.93).all(), share
    assert (share < 0.97).all(), share


# Parts that are simulated.

PART = b"""<svg xmlns="http://www.w3.org/2000/svg" width="40mm" height="30mm" viewBox="0 0 40 30">
<rect x="5" y="5" width="20" height="12"/><circle cx="15" cy="11" r="3"/></svg>"""
DIMENSIONS = (
    Dimension("width", "distance", ((5.0, 19.0), (25.0, 19.0)), "test", direction_rad=0.0),
    Dimension("height", "distance", ((15.0, 25.0), (15.0, 13.0)), "test"),
    Dimension("hole", "diameter", ((15.0, 19.0),), "test"),
    Dimension("to the hole", "distance", ((5.0, 19.0), (15.0, 19.0)), "test", direction_rad=0.0),
)
TOOL_MM = 2.0
KNOWN = (
    "uncertainty.x.backlash_mm=0.006",
    "uncertainty.x.scale=0.0003",
    "uncertainty.y.backlash_mm=0.004",
    "uncertainty.y.scale=0.0002",
    "uncertainty.squareness_rad=0.0005",
    "uncertainty.tool_diameter_mm=0.005",
    "uncertainty.runout_mm=0.002",
    "uncertainty.process_mm=0.004",
    'uncertainty.correlations=[["x.backlash_mm", "x.scale", 0.5], ["x.scale", "y.scale", 0.3]]',
)
LOST = ("axes.x.backlash_mm=0.08", "axes.y.backlash_mm=0.05")
ADDED = (
    "axes.x.compensation_mm=0.05",
    "axes.y.compensation_mm=0.05",
    "uncertainty.x.compensation_mm=0.001",
    "uncertainty.y.compensation_mm=0.0",
)
MACHINES = {"grbl": (*LOST, *KNOWN), "linuxcnc": (*LOST, *ADDED, *KNOWN)}


@cache
def inspector(target: str) -> tuple[Inspector, Inputs]:
    loaded = load_target(target, settings=MACHINES[target])
    job = job_of(kind="profile", tool_diameter_mm=TOOL_MM, depth_mm=1.0)
    made = Inspector(post_drawing(read_bytes(PART, "part.svg"), job, loaded), DIMENSIONS)
    assert not made.left_out
    return made, inputs_of(loaded.machine, TOOL_MM)


def simulated(target: str, draws: int) -> tuple[Floats, Floats]:
    """(12,) the share of parts, each cut on a machine drawn about the one in the file, whose sizes
    lie in the predicted bands, and their scatter over the predicted one."""
    made, inputs = inspector(target)

    budget = propagate(made.values, inputs, made.edges, extremes=True)
    assert budget.runs == 13
    for row in range(len(budget.values)):
        assert {each.name for each in budget.unknown(row)} == {"temperature_k"}
    true = monte_carlo(made.values, inputs, made.edges, draws, 17)
    covered = np.abs(true.values - budget.expected) <= BAND * budget.standards
    return covered.mean(axis=0), true.standards / budget.standards


@pytest.mark.parametrize("target", sorted(MACHINES))
def test_simulated_parts_are_covered(target: str) -> None:
    share, scatter = simulated(target, 40)
    assert (share > 0.82).all(), share
    assert (np.abs(scatter - 1.0) < 0.4).all(), scatter


@pytest.mark.slow
@pytest.mark.parametrize("target", sorted(MACHINES))
def test_two_thousand_simulated_parts_are_covered(target: str) -> None:
    share, scatter = simulated(target, 2000)
    assert (share > 0.93).all(), share
    assert (share < 0.97).all(), share
    assert (np.abs(scatter - 1.0) < 0.06).all(), scatter
