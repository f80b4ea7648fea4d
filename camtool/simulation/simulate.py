"""The door of the simulation: a toolpath and a machine in, the motion of its slides out."""

from __future__ import annotations

from collections.abc import Iterator

from camtool.errors import OptionError
from camtool.machine.model import Interpolator, Machine, PicMmhController
from camtool.simulation.motion import Chunk
from camtool.toolpath.moves import Toolpath


def simulate(
    toolpath: Toolpath,
    machine: Machine,
    *,
    interpolator: Interpolator | None = None,
    ideal: bool = False,
    chunk_steps: int = 65536,
) -> Iterator[Chunk]:
    """The motion that the machine's controller and mechanics make of a toolpath, chunk by chunk.

    `interpolator` takes the place of the controller's own for arcs; `ideal` leaves out play,
    compensation and scale, so that slide == commanded; no chunk has more than `chunk_steps`
    samples. Rows behind the end of the program are not run. Raises OptionError, MachineError, and
    ProgramError (some of them only when the row comes) naming the block.
    """
    if chunk_steps < 1:
        raise OptionError(f"chunk_steps is {chunk_steps}", mend="give at least 1")
    if interpolator not in (None, "dsm", "dda", "stairs"):
        raise OptionError(f"unknown interpolator {interpolator!r}", mend="dsm, dda or stairs")
    if isinstance(machine.controller, PicMmhController):
        from camtool.simulation.pic_mmh import Options, PicMmh  # loads numba

        return PicMmh(toolpath, machine, Options(interpolator, ideal, chunk_steps)).run()
    if interpolator is not None:
        raise OptionError(
            f"the controller of {machine.target.name} has no interpolators to choose from",
            where="--interpolator",
            mend="leave it out",
        )
    from camtool.simulation.path import PathRun  # loads numba

    return PathRun(toolpath, machine, ideal=ideal, chunk_steps=chunk_steps).run()
