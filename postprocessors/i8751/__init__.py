"""The 2½-D machine on an Intel 8751: packets of bytes such as `01 03 00 64`.

docs/dialects/i8751.md explains the format, its contradictions and what was chosen;
docs/controllers/i8751.md what the controller does with it."""

from __future__ import annotations

from camtool.target.contract import Target, lazy_call, lazy_name

from .dialect import I8751Controller, I8751Dialect, I8751Link, I8751Machine, check


class I8751(Target):
    """Writer and reader share no code but the options of `[dialect]`."""

    name = "i8751"
    controllers = (I8751Controller,)
    dialect = I8751Dialect
    link = I8751Link

    write = lazy_call("camtool_postprocessors.i8751.write:write_program")
    read = lazy_call("camtool_postprocessors.i8751.read:read_program")
    model = lazy_call("camtool_postprocessors.i8751.controller:I8751Model")
    signals = lazy_call("camtool_postprocessors.i8751.signals:I8751Signals")
    wire = lazy_call("camtool_postprocessors.i8751.wire:I8751Wire")
    listing = lazy_call("camtool_postprocessors.i8751.stream:listing")
    twin_kind = lazy_name("camtool_postprocessors.i8751.twin:I8751Twin")

    def check(self, machine: I8751Machine) -> None:
        """Raise MachineError where values of the dialect do not go with the machine."""
        check(machine)

    def stray_mm(self, machine: I8751Machine) -> float:
        """Return the greatest distance of the cut from the drawing that the two tolerances allow
        together, mm: records stray from their lines, and lines from their arcs."""
        return machine.dialect.tolerance_mm + machine.dialect.arc_tolerance_mm

    def line_bytes(self, data: bytes, machine: I8751Machine) -> int:
        """Return the bytes of the packets that go over the line, whatever the form of the file."""
        from .stream import stream_of

        return len(stream_of(data, machine))


POST = I8751()
