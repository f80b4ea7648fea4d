"""Controller models: Toolpath and machine to Motion."""

from camtool.simulation.motion import Chunk
from camtool.simulation.options import ALL, IDEAL, Effects, Options
from camtool.simulation.simulate import simulate

__all__ = ["ALL", "IDEAL", "Chunk", "Effects", "Options", "simulate"]
