"""The door of the simulation: a toolpath and a machine in, the motion of its slides out."""

from __future__ import annotations

from collections.abc import Iterator

from camtool.errors import OptionError
from camtool.machine.controllers import PicMmhController
from camtool.machine.model import Machine
from camtool.simulation.models import model_of
from camtool.simulation.motion import Chunk
from camtool.simulation.options import Options
from camtool.toolpath.moves import Toolpath


def simulate(
    toolpath: Toolpath, machine: Machine, options: Options | None = None
) -> Iterator[Chunk]:
    """The motion that the machine's controller and mechanics make of a toolpath, chunk by chunk.

    Rows behind the end of the program are not run. Raises OptionError, MachineError, and
    ProgramError (some of them only when the row comes) naming the block.
    """
    options = options or Options()
    check_options(machine, options)
    return model_of(machine).run(toolpath, machine, options)


def check_options(machine: Machine, options: Options) -> None:
    """OptionError for what the machine's controller cannot do."""
    if options.chunk_steps < 1:
        raise OptionError(f"chunk_steps is {options.chunk_steps}", mend="give at least 1")
    if options.interpolator not in (None, "dsm", "dda", "stairs"):
        raise OptionError(
            f"unknown interpolator {options.interpolator!r}", mend="dsm, dda or stairs"
        )
    if options.interpolator is not None and not isinstance(machine.controller, PicMmhController):
        raise OptionError(
            f"the controller of {machine.target.name} has no interpolators to choose from",
            where="--interpolator",
            mend="leave it out",
        )
