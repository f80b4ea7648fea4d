"""Moves are planned some thousands at a time: how many changes nothing of the motion."""

from dataclasses import astuple

import numpy as np
import pytest
from camtool_postprocessors.grbl import controller as grbl
from camtool_postprocessors.linuxcnc import controller as linuxcnc
from hypothesis import given, settings
from hypothesis import strategies as st

from camtool.simulation import samples, speed_plan
from camtool.simulation.motion import Chunk
from camtool.target.registry import load_target

PIECES = st.lists(
    st.one_of(
        st.tuples(st.integers(-30, 30), st.integers(-30, 30)).map(
            lambda to: f"G1 X{to[0] / 10} Y{to[1] / 10}"
        ),
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


def motion(target: str, program: str) -> list[Chunk]:
    loaded = load_target(target)
    path = loaded.target.read(program.encode(), loaded.machine)
    return list(loaded.simulate(path))


@pytest.mark.parametrize("target", MODES)
@given(pieces=PIECES, modes=st.lists(st.integers(0, 3), max_size=3), at_once=st.integers(1, 5))
@settings(deadline=None)
def test_how_many_moves_are_planned_together_changes_nothing(
    target: str, pieces: list[str], modes: list[int], at_once: int
) -> None:
    for place, mode in enumerate(modes if MODES[target] else []):
        pieces.insert(3 * place, MODES[target][mode])
    program = "\n".join(["G21 G90 G17 G0 Z1", "F600", *pieces, "M2", ""])
    wanted = motion(target, program)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(samples, "ROWS_AT_ONCE", at_once)
        patch.setattr(speed_plan, "BLOCKS_AT_ONCE", at_once)
        patch.setattr(grbl, "ROWS_AT_ONCE", at_once)
        patch.setattr(grbl, "BLOCKS_AT_ONCE", at_once)
        patch.setattr(linuxcnc, "MOVES_AT_ONCE", at_once)
        found = motion(target, program)
    assert len(found) == len(wanted)
    for one, other in zip(found, wanted, strict=True):
        pairs = zip(
            (one.row, one.commanded, one.slide, *astuple(one.ledger)),
            (other.row, other.commanded, other.slide, *astuple(other.ledger)),
            strict=True,
        )
        assert all(np.array_equal(a, b) for a, b in pairs)
