"""Pulses of every target against the ledgers of its controller's model, program by program."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.records import replace
from camtool.simulation.pulses import OUTPUTS, Pulses
from camtool.toolpath.moves import Toolpath
from tests.strategies import examples
from tests.waveforms.programs import BENCHES, paths, signals, totals

READINGS = {
    "pic-mmh": (
        (),
        ("controller.time_base=iteration", "axes.x.compensation_mm=0.0014"),
        ("controller.arcs=dda", "axes.y.compensation_mm=0.00028"),
        ("controller.start_direction=-",),
        ("controller.compensation=by-region", "play_map.use=true"),
    ),
    "valcnc": (
        (),
        ("axes.x.compensation_mm=0.16", "controller.rounding=truncated"),
        ("controller.counting=differences", "controller.arc_end=programmed"),
    ),
    "i8751": (
        (),
        ("dialect.first_pulse=repeats", "axes.x.compensation_mm=0.02"),
        ("dialect.elbow=flows", "dialect.cruise=declared"),
        ("dialect.first_pulse=repeats", "dialect.elbow=flows", "dialect.high_byte='255'"),
    ),
    "flashcut": (
        (),
        ("controller.clock=late-longer", "controller.half_periods_per_step=1"),
        ("axes.x.compensation_mm=0.0019", "controller.compensation_half_period_ms=7"),
        ("controller.goes_on_from=reached", "dialect.spindle_stops=false"),
    ),
    "grbl": (
        (),
        ("controller.idle_delay_ms=255", "axes.x.acceleration_mm_s2=200"),
        ("axes.z.coded_step_mm=0.001", "axes.y.max_rate_mm_min=100"),
        ("controller.buffer_blocks=3", "controller.laser_mode=true"),
    ),
}
"""Settings of each target under which its signals are tested."""


def times_of(name: str, moves: int) -> dict[str, float]:
    """Tolerances of the time of so many moves. The ledger of grbl has trapezoids; no segment
    of its stepper is slower than 30.5 steps/s, which shortens the slow ends of each move."""
    return {"abs": 0.02 * moves, "rel": 0.003} if name == "grbl" else {"abs": 1e-9, "rel": 1e-12}


@pytest.mark.parametrize(
    ("name", "settings"),
    [(name, settings) for name, many in READINGS.items() for settings in many],
)
@examples(30, 2000)
@given(data=st.data())
def test_steps_and_times_are_those_of_the_ledger(
    name: str, settings: tuple[str, ...], data: st.DataObject
) -> None:
    bench = BENCHES[name]
    target = bench.target(*settings)
    path: Toolpath = data.draw(paths(bench))
    wanted, found = totals(path, target), signals(path, target).count()
    assert found.steps[:3].tolist() == wanted.steps.tolist()
    assert found.added[:3].tolist() == wanted.added.tolist()
    assert found.seconds == pytest.approx(wanted.seconds, **times_of(name, len(path)))


@pytest.mark.parametrize("name", READINGS)
@examples(20, 500)
@given(data=st.data())
def test_pulses_are_in_order_and_chunks_change_none(name: str, data: st.DataObject) -> None:
    """However small the chunks are: the same pulses at the same times."""
    bench = BENCHES[name]
    target = bench.target()
    path: Toolpath = data.draw(paths(bench, reach=40))
    many = list(signals(path, target).pulses())
    until = [-np.inf, *(part.until_s for part in many)]
    for before, part in zip(until[:-1], many, strict=True):
        assert (part.at_s >= before - 1e-9).all()
        assert (part.at_s <= part.until_s + 1e-9).all()
    with pytest.MonkeyPatch.context() as patch:
        for module in ("pic_mmh", "valcnc", "i8751", "flashcut"):
            options = f"camtool_postprocessors.{module}.signals.OUTPUTS"
            patch.setattr(options, replace(OUTPUTS, chunk_steps=7))
        patch.setattr("camtool_postprocessors.grbl.signals.SEGMENTS_AT_ONCE", 3)
        small = list(signals(path, target).pulses())
    for motor in range(many[0].moves.shape[1]):
        for whole, pieces in zip(of_motor(many, motor), of_motor(small, motor), strict=True):
            np.testing.assert_allclose(pieces, whole, atol=1e-9)


def of_motor(parts: list[Pulses], motor: int) -> tuple[np.ndarray, np.ndarray]:
    """Times and ways of the pulses of a motor."""
    at_s = [part.at_s[part.moves[:, motor] != 0] for part in parts]
    ways = [part.moves[part.moves[:, motor] != 0, motor] for part in parts]
    return np.concatenate(at_s), np.concatenate(ways)
