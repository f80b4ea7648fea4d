"""Controllers as a machine file may say them: one record per model, told apart by `model`."""

from __future__ import annotations

from camtool.machine.controllers.base import SlideStart
from camtool.machine.controllers.flashcut import FlashcutController
from camtool.machine.controllers.grbl import GrblController
from camtool.machine.controllers.i8751 import I8751Controller
from camtool.machine.controllers.linuxcnc import LinuxcncController
from camtool.machine.controllers.matlab_router import MatlabRouterController
from camtool.machine.controllers.path import PathController
from camtool.machine.controllers.pic_mmh import Interpolator, PicMmhController
from camtool.machine.controllers.valcnc import ValcncController

__all__ = [
    "Controller",
    "FlashcutController",
    "GrblController",
    "I8751Controller",
    "Interpolator",
    "LinuxcncController",
    "MatlabRouterController",
    "PathController",
    "PicMmhController",
    "SlideStart",
    "ValcncController",
]

Controller = (
    PicMmhController
    | PathController
    | FlashcutController
    | MatlabRouterController
    | I8751Controller
    | ValcncController
    | GrblController
    | LinuxcncController
)
"""Any of them."""
