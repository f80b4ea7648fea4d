"""The machine record of the Matlab router as the arrays that its kernel runs on."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from camtool.errors import MachineError
from camtool.machine.controllers import MatlabRouterController
from camtool.machine.model import Machine, controller_of
from camtool.simulation.motion import Floats, Ints

if TYPE_CHECKING:
    from camtool.kernels.slave_record import Account, Program, State

TICK_S = 0.005
"""The slaves' timer: (65536 − 53036) · 2 / 5 MHz (L2757)."""

TICKS_PER_S = 200
"""The same, the other way round."""

SIGNS = np.array([1, 1, -1])
"""Home is at the low ends of X and Y and at the top of Z: all distances are away from it."""

TEXT_KID = (17.549, 28.152, 16.2)
"""Table 4.1, L2872-2880, in thousandths; the table's order is Y, X, Z."""

TEXT_KPD = (98.125, 159.124, 92.64)
"""The same."""

IDENTIFIED = 70.0
"""The drive at which gains were measured (L2704): whatever the friction, that speed stays."""


def program_of(orders: Ints, pauses_s: Floats, machine: Machine) -> Program:
    """What the kernel runs; MachineError for gains that the listing's integers cannot hold."""
    from camtool.kernels.slave_record import TABLE_COUNTS, Program

    router = controller_of(machine, MatlabRouterController)
    text = router.slaves == "text"
    axes = np.zeros((3, 8))
    friction = np.array(router.friction_percent)
    axes[:, 0] = np.array(router.plant_gain) * IDENTIFIED / (IDENTIFIED - friction)
    axes[:, 1] = np.array(router.time_constant_s) * TICKS_PER_S
    axes[:, 2] = router.friction_percent
    axes[:, 3] = router.kid or (TEXT_KID if text else (28.0,) * 3)
    axes[:, 4] = router.kpd or (TEXT_KPD if text else (159.0,) * 3)
    axes[:, 5] = router.chunk_counts
    axes[:, 6] = 0 if text else router.home_phase_counts
    axes[:, 7] = router.home_counts
    if not text and (axes[:, 3:5] % 1.0).any():
        raise MachineError(
            "the gains of the listing are whole thousandths",
            where="table [controller], keys kid and kpd",
            mend='round them, or say slaves = "text"',
        )
    share = np.arange(TABLE_COUNTS + 1) / TABLE_COUNTS
    table = np.rint(router.table_counts * np.sqrt(share)).astype(np.int64)
    lag = router.start_lag_s * TICKS_PER_S
    return Program(orders, pauses_s * TICKS_PER_S, axes, table, lag, text)


def state_of(start_mm: Floats, machine: Machine) -> State:
    """All motors at rest at a place."""
    from camtool.kernels.slave_record import COUNT, PLACE, SHOWN, TARGET, TURN, State

    router = controller_of(machine, MatlabRouterController)
    coded = np.array([axis.coded_step_mm for axis in machine.axes])
    place = np.rint((start_mm - np.array(machine.controller.machine_zero_mm)) * SIGNS / coded)
    motors, slaves = np.zeros((3, 6)), np.zeros((3, 11), dtype=np.int64)
    motors[:, PLACE] = place
    slaves[:, COUNT] = slaves[:, TARGET] = slaves[:, SHOWN] = place
    if router.slaves == "listing":
        slaves[:, SHOWN] = (slaves[:, COUNT] + np.array(router.home_phase_counts)) % TURN
    return State(motors, slaves, np.zeros(3, dtype=np.int64), np.zeros(2))


def account_of(rows: int) -> Account:
    """Nothing done yet."""
    from camtool.kernels.slave_record import Account

    zeros = np.zeros(rows)
    return Account(zeros, zeros.astype(np.int64), np.ones(rows, dtype=np.bool_))
