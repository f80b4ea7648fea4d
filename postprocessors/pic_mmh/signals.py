"""The phases of the PIC18F8720's motors: two lines each on port D, four states (annex A.3).

The byte is written first, then the loop waits for its period: an output begins it. X goes
backwards through its states for positive moves, and Y forwards (L3532-3599, A.5)."""

from __future__ import annotations

from collections.abc import Iterator

from camtool.machine.model import Machine
from camtool.simulation.pulses import OUTPUTS, Pulses, row_pulses
from camtool.target.signals import Board, Coils, SignalModel
from camtool.toolpath.moves import Toolpath

from .controller import PicMmhModel, options_by_pass
from .dialect import PicMmhController, PicMmhDialect

_Machine = Machine[PicMmhController, PicMmhDialect]

STATES = 0b01, 0b11, 0b10, 0b00
"""The states 1 to 4, lowest bit first (L3532-3599)."""

TICK_S = 1e-6
"""Times are given to a microsecond; the processor's own cycle is 0.2 µs (L1217)."""


class PicMmhSignals(SignalModel):
    """The phases of X and Y on port D, and of Z."""

    def board(self, machine: _Machine) -> Board:
        """Return the phase lines of the three motors."""
        backward = STATES[:1] + STATES[:0:-1]
        return Board(
            (
                Coils("X", "PORTD", 0, ("phase1", "phase2"), backward),
                Coils("Y", "PORTD", 2, ("phase1", "phase2"), STATES),
                Coils("Z", "PORTE", 0, ("phase1", "phase2"), STATES),
            ),
            TICK_S,
            "us",
            (
                "port, bits and direction of Z are ours: the thesis gives those of X and Y "
                "(L3532-3599)",
                "each motor stands on the first state at the start",
            ),
        )

    def pulses(self, toolpath: Toolpath, machine: _Machine) -> Iterator[Pulses]:
        """Yield the outputs of the interpolator."""
        model = PicMmhModel()
        chunks = model.run(toolpath, machine, options_by_pass(machine, OUTPUTS))
        return row_pulses(chunks, model.clock(toolpath, machine), toolpath)
