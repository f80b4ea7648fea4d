"""The speed loops of servo axes: the motors and the gains that their controllers store."""

from __future__ import annotations

from msgspec import Struct

from camtool.arrays import Floats, Ints


class MotorModel(Struct, frozen=True):
    """A motor of first order with dry friction: τ dω/dt = gain · (u − friction · sign ω) − ω, and
    u acts `dead_time_s` late.

    Speeds ω are counts of the encoder in a tick, drives u are percent. A drive of at most
    `friction_percent` does not move it from rest."""

    gain: float
    time_constant_s: float
    friction_percent: float = 0.0
    dead_time_s: float = 0.0

    def speed_at(self, drive_percent: float) -> float:
        """Return the steady speed at a drive, counts in a tick."""
        return self.gain * max(drive_percent - self.friction_percent, 0.0)


class SpeedLoop(Struct, frozen=True):
    """The speed loops of X, Y and Z: u(k) = u(k−1) − Kpd (ω(k) − ω(k−1)) + Kid e.

    `tick_s` between two passes of the loop. `kid`, `kpd` as the controller stores them: multiples
    of `gain_unit`, whole ones if `is_whole`."""

    tick_s: float
    motors: tuple[MotorModel, ...]
    kid: tuple[float, ...]
    kpd: tuple[float, ...]
    gain_unit: float
    is_whole: bool
    counts_per_turn: int = 1024


class ServoTicks(Struct, frozen=True, eq=False):
    """K passes of the speed loops of a program: when each ends, `at_s` (K,), whose sample it is,
    `row` (K,) of the toolpath, and which of its orders the controller runs, `line` (K,), −1 for
    none. Of each axis (K, 3): the loop's `reference` and the mean `speed`, counts in a tick, the
    `drive`, percent; where the order asks the motor to be, `wanted`, and where it is, `reached`,
    counts from home. `goal` (K, 3) is the speed of the order, without ramps."""

    at_s: Floats
    row: Ints
    line: Ints
    reference: Floats
    speed: Floats
    drive: Floats
    wanted: Floats
    reached: Floats
    goal: Floats
