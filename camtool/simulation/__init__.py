"""Controller models: Toolpath and machine to Motion."""

from camtool.simulation.motion import ALL, IDEAL, Chunk, Effects, Options
from camtool.simulation.simulate import simulate

__all__ = ["ALL", "IDEAL", "Chunk", "Effects", "Options", "simulate"]
