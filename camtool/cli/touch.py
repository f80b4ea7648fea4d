"""`camtool touch`: edges, corners, bores, bosses and the top of a part, by a probe or a plate."""

from __future__ import annotations

import json
import re
from typing import cast

import click

from camtool.cli.home import UNLOCK, axes_of, carried, port_options
from camtool.cli.messages import say, show_text
from camtool.cli.options import MachineFlags, SectionedCommand, feed, length
from camtool.cli.probe import asked_to_begin, check_sizes, journaled, touch_options
from camtool.errors import OptionError
from camtool.sending.line import manner_of, wire_of
from camtool.toolpath import probing
from camtool.toolpath.probing import Axis, Measured, Place, ProbeScript, Touch

AXES_OF = {"plate": "z", "edge": "xy", "corner": "xy", "bore": "xy", "boss": "xy", "skew": ""}
"""What can be touched, and the axes that it gives a zero."""

LABELS = {
    "x_mm": "X",
    "y_mm": "Y",
    "z_mm": "Z",
    "top_z_mm": "top of the plate Z",
    "diameter_mm": "diameter ",
    "width_x_mm": "width in X ",
    "width_y_mm": "width in Y ",
    "angle_deg": "turned by ",
    "first_mm": "first touch ",
    "second_mm": "second touch ",
    "along_mm": "apart ",
}
"""Words for what is measured."""


@click.command(cls=SectionedCommand, short_help="Touch off an edge, a corner, a bore or a plate.")
@click.argument("what", type=click.Choice(list(AXES_OF)), metavar="WHAT")
@click.argument("axes", nargs=-1, metavar="[X0 Y0 Z0]")
@port_options
@UNLOCK
@click.option("--towards", default="", metavar="x+", help="edge, skew: the way; corner: x+y-.")
@click.option("--inside", is_flag=True, help="corner: of a pocket.")
@click.option(
    "--tool-diameter", callback=length, metavar="LENGTH", help="Of the tool or the probe's tip."
)
@click.option("--thickness", callback=length, metavar="LENGTH", help="plate: its own.")
@click.option("--size", callback=length, metavar="LENGTH", help="boss: about how wide it is.")
@click.option("--depth", callback=length, metavar="LENGTH", help="boss: how far down beside it.")
@click.option(
    "--clear", default="5mm", callback=length, metavar="LENGTH", help="boss: beyond its size."
)
@click.option(
    "--along", default="10mm", callback=length, metavar="LENGTH", help="corner, skew: on a side."
)
@click.option("--reach", default="10mm", callback=length, metavar="LENGTH", help="Of a touch.")
@click.option("--feed", default="100", callback=feed, metavar="FEED", help="Of the first touch.")
@click.option("--slow", default="25", callback=feed, metavar="FEED", help="Of the second touch.")
@click.option("--back", default="1mm", callback=length, metavar="LENGTH", help="Between them.")
@click.option("--travel", default="150", callback=feed, metavar="FEED", help="Between places.")
@click.option("--keep-zero", is_flag=True, help="Measure only.")
@touch_options
def touch(
    what: str,
    axes: tuple[str, ...],
    machine: MachineFlags,
    port: str,
    baud: int | None,
    unlock: bool,
    towards: str,
    inside: bool,
    tool_diameter: float | None,
    thickness: float | None,
    size: float | None,
    depth: float | None,
    clear: float,
    along: float,
    reach: float,
    feed: float,
    slow: float,
    back: float,
    travel: float,
    keep_zero: bool,
    journal: str | None,
    as_json: bool,
    yes: bool,
    quiet: bool,
    verbose: bool,
) -> int:
    """Touch WHAT with a probe or a tool, and make it part zero, or the coordinates that are given.

    \b
    plate   lies on the part below the tool: Z
    edge    one side of the part, from beside it: X or Y
    corner  two sides, from diagonally beyond it, or from within: X and Y
    bore    from within: the centre X Y, and the diameter
    boss    from above its centre: the same
    skew    the angle of a side, for camtool convert --turn

    Each place is touched twice, fast and slowly. Between places the tool stops where it touches.
    Ctrl-C stops the machine. Exit code 1, and no zero, when something is not as it should be."""
    values = axes_of(axes)
    wrong = values.keys() - set(AXES_OF[what])
    if wrong:
        raise OptionError(f"a {what} has no {wrong.pop().upper()}", where="touch")
    sizes = {
        "--reach": reach,
        "--back": back,
        "--clear": clear,
        "--thickness": thickness,
        "--size": size,
        "--depth": depth,
        "--along": along,
    }
    for name, value in sizes.items():
        if value is not None and value <= 0.0 and not (name == "--along" and what == "skew"):
            raise OptionError(f"{value:g} is not above 0", where=name)
    sizes["--tool-diameter"] = tool_diameter or None
    check_sizes(sizes, {"--feed": feed, "--slow": slow, "--travel": travel})
    check_sizes({f"{axis.upper()}{value:g}": value or None for axis, value in values.items()}, {})
    if tool_diameter is not None and tool_diameter < 0.0:
        raise OptionError(f"{tool_diameter:g} mm is below 0", where="--tool-diameter")
    if what not in ("plate", "skew"):
        _needed("--tool-diameter", tool_diameter)
    how = probing.Touch(
        reach_mm=reach,
        fast=feed,
        slow=slow,
        back_mm=back,
        travel=travel,
        radius_mm=0.5 * (tool_diameter or 0.0),
        sets_zero=not keep_zero and what != "skew",
        values=values,
    )
    senses = _senses(towards, what)

    def begun(start: Place) -> Measured:
        if what == "plate":
            return probing.plate(start, how, _needed("--thickness", thickness))
        if what == "corner":
            return probing.corner(start, (senses["x"], senses["y"]), how, along, is_inside=inside)
        if what == "bore":
            return probing.bore(start, how)
        if what == "boss":
            wide, deep = _needed("--size", size), _needed("--depth", depth)
            return probing.boss(start, how, wide, clear, deep)
        [(axis, sense)] = senses.items()
        if what == "edge":
            return probing.edge(start, axis, sense, how)
        return probing.skew(start, axis, sense, how, along)

    begun((0.0, 0.0, 0.0))  # what is missing is summary before the port is opened
    measured: dict[str, float] = {}

    def cycle(start: Place) -> ProbeScript:
        measured.update((yield from begun(start)))

    target = machine.load()
    with journaled(journal, what, cycle) as (noted, close):
        conversation = wire_of(target).probing(
            noted, target.machine, manner_of(target, unlock=unlock)
        )
        if not yes and not asked_to_begin(f"Touch the {what}, {_words(how)}?"):
            return 1
        reason = carried(conversation, target, port, baud, quiet=quiet)
        close(reason, measured)
    if as_json:
        result = {"what": what, "why": reason, "zero": how.sets_zero and not reason, **measured}
        show_text(json.dumps(result, indent=2, ensure_ascii=False))
    if reason:
        say(f"camtool: error: touch {what}: {reason}")
        return 1
    labelled = (f"{LABELS[name]}{_text(name, value)}" for name, value in measured.items())
    summary = ", ".join(labelled)
    if how.sets_zero:
        axes_set = [axis for axis in AXES_OF[what] if f"{axis}_mm" in measured]
        summary += "; it is now " + " ".join(
            f"{a.upper()}{values.get(a, 0.0):g}" for a in axes_set
        )
    say(f"camtool: touch {what}: {summary}", quiet=quiet)
    if what == "skew":
        words = f"camtool convert … --turn {measured['angle_deg']:.4f} turns a program by it"
        say(f"camtool: {words}", quiet=quiet)
    return 0


def _needed(name: str, value: float | None) -> float:
    if value is None:
        raise OptionError("is missing", where=name, mend="give it")
    return value


def _senses(text: str, what: str) -> dict[Axis, int]:
    """Parse directions such as `x+` or `x+y-` to +1 or −1 for each axis; OptionError if they do
    not suit `what` is touched."""
    count = {"edge": 1, "skew": 1, "corner": 2}.get(what, 0)
    pairs = re.findall(r"([xy])([+-])", text.lower())
    senses = {cast("Axis", axis): -1 if sense == "-" else 1 for axis, sense in pairs}
    if len(senses) != count or len("".join(map("".join, pairs))) != len(text):
        example = {0: "leave it out", 1: "write x+, x-, y+ or y-", 2: "write x+y+, x+y- …"}
        raise OptionError(
            f"{text!r} is no way towards a {what}", where="--towards", mend=example[count]
        )
    return senses


def _words(how: Touch) -> str:
    return f"{how.reach_mm:g} mm at most, at F{how.fast:g} and again at F{how.slow:g}"


def _text(name: str, value: float) -> str:
    return f"{value:.4f}°" if name.endswith("deg") else f"{value:.3f}"
