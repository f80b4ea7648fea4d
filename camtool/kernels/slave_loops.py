"""The programs of the Matlab router's slaves: the interrupt every 5 ms, and the main loop.

`camtool.kernels.slaves` says what they do. Whole numbers, but for the text's loop, whose gains are
none; every number of the listing is an int32 at most.
"""

from __future__ import annotations

import math

import numpy as np

from camtool.kernels.compiled import inner
from camtool.kernels.slave_record import (
    BEGIN,
    CHUNK,
    COUNT,
    CRUISING,
    DONE,
    DRIVE,
    FOLLOWING,
    HOME_AMOUNT,
    HOMING,
    KID,
    KPD,
    LEFT,
    NEVER,
    NEXT_REF,
    PHASE,
    REF,
    SEEN,
    SHOWN,
    SLOWING,
    SPEED_BEFORE,
    STAGE,
    STILL,
    SUM,
    TABLE_COUNTS,
    TARGET,
    TURN,
    UP,
    WRAPS,
    Floats,
    Ints,
)


@inner
def _int32(value: int) -> int:
    """As it stands in a signed int of 32 bits."""
    return ((value + 0x80000000) & 0xFFFFFFFF) - 0x80000000


@inner
def listed_loop(motor: Floats, slave: Ints, axis: Floats, table: Ints) -> None:
    """The interrupt of the listing: L5496-5584."""
    shown = (slave[COUNT] + np.int64(axis[PHASE])) % TURN
    change = shown - slave[SHOWN] if slave[UP] == 1 else slave[SHOWN] - shown
    slave[SHOWN] = shown
    if change >= 0:
        slave[SEEN] = change
    if slave[STAGE] == SLOWING:
        left = int(axis[CHUNK]) - _seen_way(slave, axis, slave[UP])
        fast = table[min(max(left, 0), TABLE_COUNTS)]
        slave[REF] = fast if slave[NEXT_REF] >= 0 else -fast
    speed, ref = slave[SEEN], slave[REF]
    kid, kpd = np.int64(axis[KID]), np.int64(axis[KPD])
    slave[SUM] = _int32(slave[SUM] + (abs(ref) - speed) * kid)
    drive = _int32(np.int64(motor[DRIVE]) + slave[SUM] - speed * kpd)
    drive = 0 if drive < 0 else min(drive // 1000, 100)
    motor[DRIVE] = drive if ref > 0 else -drive if ref < 0 else 0


@inner
def text_loop(motor: Floats, slave: Ints, axis: Floats, top: int) -> None:
    """Equations 4.15-4.18 and 4.27: the reference by the way that is left, and the loop in its
    velocity form. Nothing drives an axis that has arrived."""
    speed = float(slave[COUNT] - slave[SHOWN])
    slave[SHOWN] = slave[COUNT]
    if slave[STAGE] == FOLLOWING:
        left = float(slave[TARGET] - slave[COUNT])
        most = float(abs(slave[REF]))
        ref = min(most, top * math.sqrt(abs(left) / TABLE_COUNTS))
        ref = math.copysign(ref if abs(left) < TABLE_COUNTS else most, left)
        change = axis[KID] * (ref - speed) - axis[KPD] * (speed - motor[SPEED_BEFORE])
        motor[DRIVE] = min(max(motor[DRIVE] + change / 1000.0, -100.0), 100.0)
    motor[SPEED_BEFORE] = speed


@inner
def _seen_way(slave: Ints, axis: Floats, up: int) -> int:
    """Posi of the main loop, when the counter's direction is `up`."""
    shown = (slave[COUNT] + np.int64(axis[PHASE])) % TURN
    return int((shown if up == 1 else TURN - 1 - shown) + (TURN - 1) * slave[WRAPS])


@inner
def to_go_of(slave: Ints, axis: Floats, sense: int) -> int:
    """Counts in the direction `sense` until the loop that the slave is in ends.

    Posi does not fall: within the turn number k it is c + 1023 k, c = 0 … 1023. It first reaches
    T in the turn k' = ⌈T / 1023⌉ − 1, or in the present one, at c' = max(T − 1023 k', 0).
    """
    stage = slave[STAGE]
    if stage == FOLLOWING:
        left = slave[TARGET] - slave[COUNT]
        left = left if slave[NEXT_REF] >= 0 else -left
        ahead = sense == (1 if slave[NEXT_REF] >= 0 else -1)
        return int(left) if left <= 0 or ahead else NEVER
    if stage != CRUISING and stage != SLOWING:
        return NEVER
    wanted = int(axis[CHUNK])
    if stage == CRUISING:
        wanted += 1 if slave[LEFT] > 1 else -TABLE_COUNTS
    up = int(slave[UP]) if sense == 0 else int(sense > 0)
    wraps = int(slave[WRAPS])
    here = _seen_way(slave, axis, up) - (TURN - 1) * wraps
    turn = max(wraps, (wanted + TURN - 2) // (TURN - 1) - 1)
    way = (turn - wraps) * TURN + max(wanted - (TURN - 1) * turn, 0) - here
    # The direction is that of the last count: a motor that turns back must count first.
    return way if up == int(slave[UP]) else max(way, 1)


@inner
def next_stage(motor: Floats, slave: Ints, moment: float) -> None:
    """The count that the slave waited for has come."""
    if slave[STAGE] == CRUISING and slave[LEFT] > 1:
        slave[LEFT] -= 1
        slave[WRAPS] = 0
    elif slave[STAGE] == CRUISING:
        slave[STAGE] = SLOWING
    else:
        slave[STAGE], slave[REF], slave[SEEN], slave[WRAPS] = STILL, 0, 0, 0
        motor[DONE], motor[DRIVE] = moment, 0.0


@inner
def start_line(motor: Floats, slave: Ints, text: bool) -> None:
    """The master's word to go. The text's distances add up, so that what an axis went too far is
    taken back by its next line; the listing's begin where the axis is."""
    slave[WRAPS], slave[REF] = 0, slave[NEXT_REF]
    amount = slave[LEFT]
    motor[DONE] = motor[BEGIN]
    if amount == HOME_AMOUNT:
        slave[STAGE] = HOMING
    elif text:
        slave[STAGE] = FOLLOWING
        slave[TARGET] += amount if slave[NEXT_REF] >= 0 else -amount
        slave[NEXT_REF] = -1 if slave[TARGET] < slave[COUNT] else 1
    else:
        slave[STAGE] = CRUISING
