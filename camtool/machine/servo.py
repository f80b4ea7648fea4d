"""The speed loops of servo axes: the motors and the gains that their controllers store."""

from __future__ import annotations

from msgspec import Struct


class MotorModel(Struct, frozen=True):
    """A motor of first order with dry friction: τ dω/dt = gain · (u − friction · sign ω) − ω, and
    u acts `dead_time_s` late.

    Speeds ω are counts of the encoder in a tick, drives u are percent. A drive of at most
    `friction_percent` does not move it from rest.
    """

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
    of `gain_unit`, whole ones if `is_whole`.
    """

    tick_s: float
    motors: tuple[MotorModel, ...]
    kid: tuple[float, ...]
    kpd: tuple[float, ...]
    gain_unit: float
    is_whole: bool
