"""Controller models: Toolpath and machine to Motion."""

from camtool.simulation.motion import Chunk
from camtool.simulation.simulate import simulate

__all__ = ["Chunk", "simulate"]
