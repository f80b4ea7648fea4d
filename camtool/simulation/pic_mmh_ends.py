"""What each reading of the controller's stop test does to the arcs of a program.

The readings are those of `camtool.kernels.arc_stops`, each with both values of D that the
controller may start with. An arc that stands on its end by the strictest of them, whatever D was,
stops there by all; of the others the machine's owner must know what may become of them.
"""

from __future__ import annotations

import numpy as np

from camtool.findings import Code, Finding, Severity
from camtool.kernels import arc_stops as stopping
from camtool.kernels import leg_steps as columns
from camtool.machine.controllers import PicMmhController
from camtool.machine.model import Machine, controller_of
from camtool.simulation.motion import Floats, Ints
from camtool.toolpath.moves import Toolpath


def arc_end_findings(toolpath: Toolpath, machine: Machine, legs: Ints) -> tuple[Finding, ...]:
    """One ARC_END_UNSURE for the arcs of `legs` (L, 14), each from the end of the row before it,
    that do not stop on their end by every reading."""
    arcs = legs[
        (legs[:, columns.KIND] == columns.ARC) & (legs[:, [columns.A, columns.B]] != 0).any(axis=1)
    ]
    met = [
        _stops(arcs, rounded, stopping.EQUAL)[:, stopping.MET] != 0 for rounded in (False, True)
    ]
    unsure = ~(met[0] & met[1])
    if not unsure.any():
        return ()
    apart = {
        name: max(float(_apart(arcs[unsure], rounded, number).max()) for rounded in (False, True))
        for name, number in stopping.READINGS.items()
        if number != stopping.EQUAL
    }
    row = int(arcs[unsure][0, columns.ROW])
    block = int(toolpath.block[row])
    taken = controller_of(machine, PicMmhController).arc_end
    return (
        Finding(
            Code.ARC_END_UNSURE,
            Severity.WARNING,
            f"{int(unsure.sum())} of {len(arcs)} arcs do not stand on their end by every reading "
            f"of the thesis (controller.arc_end): by equal {int((~met[0]).sum())} run on past it "
            f"({int((~met[1]).sum())} with initial_error=rounded-radius), by final-quadrant they "
            f"stop up to {apart['final-quadrant']:.1f} steps beside it, by nearest up to "
            f"{apart['nearest']:.1f}; simulated is {taken}",
            where=f"block {block + 1}" if block >= 0 else f"move {row}",
            measured=float(unsure.sum()),
            limit=0.0,
            unit="arcs",
        ),
    )


def _stops(arcs: Ints, rounded: bool, reading: int) -> Ints:
    """(L, 4) of `camtool.kernels.arc_stops`, by direct search."""
    out = np.empty((len(arcs), stopping.STOP_COLUMNS), dtype=np.int64)
    stopping.arc_stops(np.ascontiguousarray(arcs), (columns.DSM, rounded, reading), out)
    return out


def _apart(arcs: Ints, rounded: bool, reading: int) -> Floats:
    """(L,) steps from the stop of each arc to its end."""
    stops = _stops(arcs, rounded, reading)[:, [stopping.STOP_X, stopping.STOP_Y]]
    return np.asarray(np.hypot(*(stops - arcs[:, [columns.END_X, columns.END_Y]]).T))
