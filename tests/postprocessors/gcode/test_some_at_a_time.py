"""Moves are planned some thousands at a time: how many changes nothing of the motion."""

import numpy as np
import pytest
from camtool_postprocessors.grbl import controller as grbl
from camtool_postprocessors.linuxcnc import controller as linuxcnc
from hypothesis import example, given
from hypothesis import strategies as st

from camtool.target.registry import load_target
from camtool.toolpath import moves
from tests.oracles.motion_rows import RowMotion, rows_of
from tests.strategies import examples


def wheel(steps: list[int]) -> str:
    """Arcs of 1 mm one after the other around one centre, each some hundredths of a radian: the
    modes that merge take them for lines, of which one may end in the middle of an arc."""
    angles = np.cumsum([0, *steps]) / 50
    moved = np.diff(np.column_stack([np.sin(angles), np.cos(angles)]), axis=0)
    return "\n".join(["G91", *(f"G2 X{x:.6f} Y{y:.6f} R1" for x, y in moved), "G90 G1"])


PIECES = st.lists(
    st.one_of(
        st.tuples(st.integers(-30, 30), st.integers(-30, 30)).map(
            lambda to: f"G1 X{to[0] / 10} Y{to[1] / 10}"
        ),
        st.lists(st.integers(1, 14), min_size=1, max_size=12).map(wheel),
        st.sampled_from(
            [
                "G0 Z1",
                "G1 Z-1",
                "G1 Z-1 F300",
                "G4 P0.1",
                "M3 S1000",
                "G91\nG2 X0 Y1 I0 J0.5\nG90 G1",
            ]
        ),
    ),
    min_size=1,
    max_size=20,
)
MODES = {"grbl": [], "linuxcnc": ["G61", "G61.1", "G64 P0.01", "G64 P0.05 Q0.05"]}
SLOW = (
    "axes.x.acceleration_mm_s2=10",
    "axes.y.acceleration_mm_s2=10",
)  # no move is enough to stop
AHEAD = {"grbl": "controller.buffer_blocks", "linuxcnc": "controller.lookahead_moves"}


def motion(target: str, program: str, ahead: int) -> list[RowMotion]:
    loaded = load_target(target).with_settings([f"{AHEAD[target]}={ahead}", *SLOW])
    path = loaded.target.read(program.encode(), loaded.machine)
    return rows_of(loaded.simulate(path))


@pytest.mark.parametrize("target", MODES)
@given(
    pieces=PIECES,
    modes=st.lists(st.integers(0, 3), max_size=3),
    at_once=st.integers(1, 5),
    ahead=st.sampled_from([3, 4, 20]),
)
@example(pieces=[f"G1 X{0.4 * k:.1f}" for k in range(9)], modes=[], at_once=1, ahead=20)
@examples(25, 2000)
def test_how_many_moves_are_planned_together_changes_nothing(
    target: str, pieces: list[str], modes: list[int], at_once: int, ahead: int
) -> None:
    """Times from rest to rest are summed in another order, and sines of blends computed in arrays
    of other lengths: both differ in their last bits."""
    for place, mode in enumerate(modes if MODES[target] else []):
        pieces.insert(3 * place, MODES[target][mode])
    program = "\n".join(["G21 G90 G17 G0 Z1", "F600", *pieces, "M2", ""])
    wanted = motion(target, program, ahead)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(moves, "ROWS_AT_ONCE", at_once)
        patch.setattr(grbl, "ROWS_AT_ONCE", at_once)
        patch.setattr(grbl, "BLOCKS_AT_ONCE", at_once)
        patch.setattr(linuxcnc, "ROWS_AT_ONCE", at_once)
        found = motion(target, program, ahead)
    for one, other in zip(found, wanted, strict=True):
        assert one.commanded == pytest.approx(other.commanded, rel=0.0, abs=1e-15)
        assert one.slide == pytest.approx(other.slide, rel=0.0, abs=1e-15)
        assert one.duration_s == pytest.approx(other.duration_s, rel=1e-12)
        assert one.steps.tolist() == other.steps.tolist()
        assert one.reversals.tolist() == other.reversals.tolist()
        assert one.iterations == other.iterations
