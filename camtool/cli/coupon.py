"""`camtool coupon`: drawings to cut and measure, for `camtool calibrate`."""

from __future__ import annotations

import re
from pathlib import PurePath
from typing import TYPE_CHECKING, cast

import click

from camtool.calibration import coupons
from camtool.calibration.coupons import sheet, skeleton
from camtool.cli.files import STDOUT, check_new, check_ours, check_places, write_all
from camtool.cli.life_signs import progress
from camtool.cli.messages import say
from camtool.cli.options import MachineFlags, SectionedCommand, machine_options, talk_options
from camtool.errors import OptionError
from camtool.units import parse_length

if TYPE_CHECKING:
    from camtool.calibration.coupons import Kind
    from camtool.machine.model import Machine

KINDS = ("lines", "squares", "circles", "steps")
DRAWINGS = (".dxf", ".svg")
SIZE = (50.0, 50.0)


def _size(
    ctx: click.Context, param: click.Parameter, value: str | None
) -> tuple[float, float] | None:
    """Parse `40x30mm` to two lengths in mm."""
    if value is None:
        return None
    match = re.fullmatch(r"([\d.]+)[x×]([\d.]+)([a-zA-Zµμ\"]*)", value)
    try:
        sides = tuple(parse_length(side + match[3]) for side in match.group(1, 2)) if match else ()
    except OptionError as error:
        raise click.BadParameter(str(error), ctx, param) from error
    if len(sides) != 2:
        raise click.BadParameter(f"{value!r}: write it like 40x30mm", ctx, param)
    if min(sides) <= 0.0:
        raise click.BadParameter(f"{value!r} has no area", ctx, param)
    return sides[0], sides[1]


def _regions(ctx: click.Context, param: click.Parameter, value: str) -> tuple[int, int]:
    """Parse `3x2` to columns and rows."""
    match = re.fullmatch(r"(\d{1,3})x(\d{1,3})", value)
    if match is None:
        raise click.BadParameter(f"{value!r}: write it like 3x2", ctx, param)
    return int(match[1]), int(match[2])


@click.command(cls=SectionedCommand, short_help="Drawings to cut and measure.")
@click.argument("kind", type=click.Choice(KINDS), metavar="KIND")
@click.option("-o", "--output", metavar="FILE", help="The drawing, .dxf or .svg.  [coupon.dxf]")
@click.option(
    "--measurements", metavar="FILE", help="Also a file to fill in for camtool calibrate."
)
@click.option(
    "--size", metavar="WxH", callback=_size, help="Of the sheet; the machine's travel, or 50x50mm."
)
@click.option(
    "--regions",
    metavar="NxM",
    default="1x1",
    callback=_regions,
    help="Columns and rows of the table in which lines measure the backlash.  [1x1]",
)
@machine_options
@talk_options
def coupon(
    kind: str,
    output: str | None,
    measurements: str | None,
    size: tuple[float, float] | None,
    regions: tuple[int, int],
    machine: MachineFlags,
    quiet: bool,
    verbose: bool,
) -> None:
    """Draw coupons of a KIND: the parts to cut and measure for `camtool calibrate`.

    \b
    lines    two lines along each axis, joined at one end: backlash, also by --regions
    squares  three of them: step scale, backlash, squareness
    circles  three of them: the same, from eight diameters each
    steps    a ruler along each axis, forwards and backwards: step scale and backlash

    Cut them: camtool post coupon.dxf --kind engrave --start longest-line --gap 0."""
    named, output = output is not None, output or "coupon.dxf"
    if output != STDOUT and PurePath(output).suffix.lower() not in DRAWINGS:
        raise click.UsageError(f"-o {output!r} ends in neither .dxf nor .svg")
    check_places(machine.files(), [output, measurements])
    if measurements is not None:
        check_new(measurements)
    machine_used = machine.load().machine if machine.name() is not None else None
    sheet_made = sheet(cast("Kind", kind), size or _travel(machine_used), regions, machine_used)
    draw = coupons.svg if output.lower().endswith(".svg") else coupons.dxf
    progress().begin("drawing the coupons")
    files = {output: draw(sheet_made)}
    if not named:
        check_ours(output, lambda old: old == files[output])
    if measurements is not None:
        files[measurements] = skeleton(sheet_made, machine_used).encode()
    write_all(files)
    for name in files:
        say(f"written: {'stdout' if name == STDOUT else name}", quiet=quiet)


def _travel(machine: Machine | None) -> tuple[float, float]:
    """Return the travel (x, y) of the machine, mm; OptionError if it is not known."""
    if machine is None:
        return SIZE
    x, y = machine.axes.x.travel_mm, machine.axes.y.travel_mm
    if x is None or y is None:
        raise OptionError(
            f"the travel of {machine.target.name} is not known",
            mend="give --size, such as 40x30mm",
        )
    return x, y
