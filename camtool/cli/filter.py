"""`camtool filter`: LinuxCNC opens a drawing.

LinuxCNC runs the line that `[FILTER]` of its INI file gives for a file's extension, through a
shell, with the file's name behind it. The program is expected on stdout; a line
`FILTER_PROGRESS=10` on stderr moves its progress bar; when the exit code is not 0 it shows what
else was on stderr (LinuxCNC's manual, "Filter programs")."""

from __future__ import annotations

import click

from camtool.cli.files import STDOUT
from camtool.cli.messages import say
from camtool.cli.options import MachineFlags, SectionedCommand, talk_options
from camtool.cli.picture_options import PictureFlags
from camtool.cli.post import Posting, RequestedOutputs, finish, posting_options
from camtool.records import replace
from camtool.target.registry import filter_target

BEGUN, READ, MADE, DONE = 1, 20, 95, 100
"""Percentages of the progress bar: begun, read, made and judged, written."""


@click.command(cls=SectionedCommand, short_help="LinuxCNC opens a drawing.")
@click.argument("source", metavar="FILE")
@posting_options
@talk_options
def filter(source: str, posting: Posting, quiet: bool, verbose: bool) -> int:
    """Write the program of the drawing FILE to stdout, as [FILTER] of LinuxCNC's INI file wants.

    \b
    [FILTER]
    PROGRAM_EXTENSION = .dxf,.svg Drawing
    dxf = camtool filter --tool-diameter 1mm --depth 0.5mm
    svg = camtool filter --tool-diameter 1mm --depth 0.5mm

    A job file beside a drawing, part.toml for part.dxf, is its job; --job is for those without
    one. The target is linuxcnc unless --target or --machine names another one."""
    if posting.machine.by_default or posting.machine.name() is None:
        machine = MachineFlags(filter_target(), None, posting.machine.settings)
        posting = replace(posting, machine=machine)
    _progress(BEGUN)
    target = posting.load()
    posting = posting.of(source)
    run = posting.make(source, target, on_read=lambda: _progress(READ))
    _progress(MADE)
    code = finish(
        run,
        RequestedOutputs(source, STDOUT, reads=[*posting.files(source), str(target.file)]),
        picture=PictureFlags().painter(lambda: [run.scene()], quiet=quiet),
        quiet=quiet,
        verbose=verbose,
    )
    if code == 0:
        _progress(DONE)
    return code


def _progress(percent: int) -> None:
    """Print a line that moves LinuxCNC's progress bar to this percentage."""
    say(f"FILTER_PROGRESS={percent}")
