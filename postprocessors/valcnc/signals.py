"""The lines of ValCNC's drivers: a step and a direction each (Tabla 9, L1342-1356).

A pass of its loop sets the step lines, waits 166.667 µs and resets them (L1336)."""

from __future__ import annotations

from collections.abc import Iterator

from camtool.machine.model import Machine
from camtool.simulation.pulses import OUTPUTS, Pulses, row_pulses
from camtool.target.signals import Board, SignalModel, StepDirection
from camtool.toolpath.moves import Toolpath

from .controller import ValcncModel
from .dialect import ValcncController, ValcncDialect

_Machine = Machine[ValcncController, ValcncDialect]

LOW_S = 2e-6
"""Time for which a step line is low, ours: the controller's own arithmetic, which is not timed.
The driver, an A4988, needs 1 µs."""


class ValcncSignals(SignalModel):
    """Steps and directions of X on port D, of Y on port B, of Z on port A."""

    def board(self, machine: _Machine) -> Board:
        """Return the signal lines of the three drivers."""
        high_s = 1.0 / machine.controller.step_rate_hz - LOW_S
        return Board(
            tuple(
                StepDirection(name, (port, 0), (port, 1), high_s, positive=1)
                for name, port in zip("XYZ", ("PORTD", "PORTB", "PORTA"), strict=True)
            ),
            1e-7,
            "us",
            (
                f"step lines are low for {LOW_S * 1e6:g} µs, ours: the time of the controller's "
                "own arithmetic is not stated",
                "a high direction line is ours for +: the level is not stated (L1334)",
            ),
        )

    def pulses(self, toolpath: Toolpath, machine: _Machine) -> Iterator[Pulses]:
        """Yield the step pulses of the counter's passes."""
        model = ValcncModel()
        chunks = model.run(toolpath, machine, OUTPUTS)
        return row_pulses(chunks, model.clock(toolpath, machine), toolpath)
