"""The coils of the Intel 8751's motors: 03H, 06H, 0CH, 09H (L1888-1898).

M1 and M2 (X and Y) are the low and the high half of P2, M3 (Z) the low half of P1 (L2125-2137,
L4516-4518). A pulse is written first, then comes its delay. The first pulse of a motor is the
first cell of its table, forward, or the last one, backward (Tablas III.5, III.6)."""

from __future__ import annotations

from collections.abc import Iterator

from camtool.machine.model import Machine
from camtool.simulation.pulses import OUTPUTS, Pulses, row_pulses
from camtool.target.signals import Board, Coils, SignalModel
from camtool.toolpath.moves import Toolpath

from .controller import I8751Model
from .dialect import I8751Controller, I8751Dialect

_Machine = Machine[I8751Controller, I8751Dialect]

FORWARD = 0x03, 0x06, 0x0C, 0x09

PLACES = ("X", "P2", 0), ("Y", "P2", 4), ("Z", "P1", 0)
"""Axis, port and lowest bit of each motor."""


class I8751Signals(SignalModel):
    """The coils of M1, M2 and M3."""

    def board(self, machine: _Machine) -> Board:
        """Return the coil lines of the three motors."""
        backward = machine.dialect.plus_backward.upper()
        lines = "coil1", "coil2", "coil3", "coil4"
        return Board(
            tuple(
                Coils(
                    name,
                    port,
                    shift,
                    lines,
                    FORWARD[::-1] if name in backward else FORWARD,
                    at_start="off",
                )
                for name, port, shift in PLACES
            ),
            1e-6,
            "us",
            ("no coil has current before the first move of its motor",),
        )

    def pulses(self, toolpath: Toolpath, machine: _Machine) -> Iterator[Pulses]:
        """Yield the motor pulses, with the ramps of their rate."""
        model = I8751Model()
        chunks = model.run(toolpath, machine, OUTPUTS)
        return row_pulses(chunks, model.clock(toolpath, machine), toolpath)
