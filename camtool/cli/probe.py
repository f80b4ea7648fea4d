"""`camtool probe`: the top of the blank, measured where a program cuts."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

from camtool.cli.files import display_name, read_bytes, refuse_same, write_all
from camtool.cli.home import UNLOCK, carried, port_options
from camtool.cli.life_signs import progress, signs_of_command
from camtool.cli.messages import say, show_text
from camtool.cli.options import (
    Command,
    MachineFlags,
    SectionedCommand,
    decorate,
    feed,
    length,
    talk_options,
)
from camtool.errors import OptionError, OutputError
from camtool.geometry.polylines import Segments
from camtool.importers.read import read_drawing
from camtool.jobs.build import job_of_file
from camtool.pipeline import read_program
from camtool.sending.line import manner_of, wire_of
from camtool.toolpath.probing import (
    Box,
    ProbeAnswer,
    ProbeCycle,
    ProbeStep,
    grid_over,
    height_map,
    in_rows,
    noted,
    probed_nodes,
    refuse_boxes_on_the_way,
    surface_from,
)
from camtool.toolpath.surface import text_of_surface


def touch_options(command: Command) -> Command:
    """Add `journal`, `as_json`, `yes`, `quiet` and `verbose`."""
    options = [
        click.option(
            "--journal", metavar="FILE", help="Add each touch and the result to this file."
        ),
        click.option(
            "--json", "as_json", is_flag=True, help="What was measured as JSON, on stdout."
        ),
        click.option("--yes", is_flag=True, help="Begin without asking."),
    ]
    return decorate(talk_options(command), options)


@click.command(cls=SectionedCommand, short_help="Measure the top of the blank.")
@click.argument("program", metavar="PROGRAM")
@port_options
@UNLOCK
@click.option("-o", "--output", metavar="FILE", help="The surface  [PROGRAM.surface.csv]")
@click.option(
    "--step", default="10mm", callback=length, metavar="LENGTH", help="Between points, at most."
)
@click.option(
    "--clear", default="2mm", callback=length, metavar="LENGTH", help="Height between points."
)
@click.option(
    "--lowest", default="-2mm", callback=length, metavar="LENGTH", help="The probe goes no lower."
)
@click.option("--feed", default="50", callback=feed, metavar="FEED", help="Of the probe.")
@click.option("--holes", metavar="DRAWING", help="Leave out points in its closed contours.")
@click.option("--job", metavar="FILE", help="Leave out points in its clamps ([[keep_out]]).")
@click.option(
    "--margin",
    default="1mm",
    callback=length,
    metavar="LENGTH",
    help="Distance of points from holes and clamps.",
)
@touch_options
def probe(
    program: str,
    machine: MachineFlags,
    port: str,
    baud: int | None,
    unlock: bool,
    output: str | None,
    step: float,
    clear: float,
    lowest: float,
    feed: float,
    holes: str | None,
    job: str | None,
    margin: float,
    journal: str | None,
    as_json: bool,
    yes: bool,
    quiet: bool,
    verbose: bool,
) -> int:
    """Probe the top of the blank at the points of a grid over the area that PROGRAM cuts.

    The tool stands above part zero, which was touched off; heights are measured from there.
    `camtool convert PROGRAM --from NAME --to NAME --surface FILE` lets the cuts follow them.
    Points in the holes of a drawing and in the clamps of a job are left out. Ctrl-C stops the
    machine. Exit code 1, and no file, when a point was not touched."""
    check_sizes({"--step": step, "--clear": clear, "--lowest": lowest or None}, {"--feed": feed})
    check_sizes({"--margin": margin or None}, {})
    if not lowest < clear:
        raise OptionError(
            f"{lowest:g} mm is not below the height between points, {clear:g} mm", where="--lowest"
        )
    target = machine.load()
    wire = wire_of(target)
    out = output or str(Path(program).with_suffix(".surface.csv"))
    reads = [program, *machine.files(), *(each for each in (holes, job) if each is not None)]
    refuse_same(reads, [out, *([] if journal is None else [journal])])
    decoded = read_program(read_bytes(program), target, source=display_name(program)).decoded
    assert decoded is not None
    x, y = grid_over(decoded, step)
    boxes = [] if job is None else _boxes(job)
    probed = probed_nodes(x, y, [] if holes is None else _contours(holes), boxes, margin)
    points = in_rows(x, y, probed)
    refuse_boxes_on_the_way(points, boxes, clear, margin)
    heights: list[float] = []
    cycle = height_map(points, clear, lowest, feed, heights)
    with journaled(journal, "surface", cycle) as (noted, close):
        conversation = wire.probing(noted, target.machine, manner_of(target, unlock=unlock))
        words = f"Probe {len(points)} points from X{x[0]:g} Y{y[0]:g} to X{x[-1]:g} Y{y[-1]:g}?"
        if not yes and not asked_to_begin(words):
            return 1
        signs = progress()
        signs.begin("probing", len(points))

        def watch(_: object) -> None:
            signs.done = len(heights)

        reason = carried(conversation, target, port, baud, quiet=quiet, watch=watch)
        close(reason, {"points": len(heights)})
    if reason:
        say(f"camtool: error: probe: {reason}; {len(heights)} points were touched")
        return 1
    surface = surface_from(x, y, probed, heights)
    write_all({out: text_of_surface(surface).encode()})
    low, high = surface.range_mm
    if as_json:
        result = {"file": out, "points": len(points), "low_mm": low, "high_mm": high}
        show_text(json.dumps(result, indent=2, ensure_ascii=False))
    say(
        f"camtool: {out}: {len(points)} points, {low:.3f} to {high:.3f} mm; camtool convert "
        f"{display_name(program)} --from … --to … --surface {out} follows it",
        quiet=quiet,
    )
    return 0


MIN_MM, MAX_MM = 0.001, 10_000.0
"""Lengths of a probe, mm: from the last decimal of a coordinate to more than any machine
travels."""
MIN_FEED, MAX_FEED = 0.1, 100_000.0
"""Feeds of a probe, mm/min: from the least that one decimal can express to more than any machine
moves."""


def check_sizes(lengths: Mapping[str, float | None], feeds: Mapping[str, float]) -> None:
    """Raise OptionError for a length (mm; its absolute value counts) or a feed (mm/min) that is
    out of range."""
    for values, low, high, unit in (
        (lengths, MIN_MM, MAX_MM, "mm"),
        (feeds, MIN_FEED, MAX_FEED, "mm/min"),
    ):
        for name, value in values.items():
            if value is not None and not low <= abs(value) <= high:
                raise OptionError(
                    f"{value:g} {unit} is not between {low:g} and {high:g}", where=name
                )


def asked_to_begin(words: str) -> bool:
    """Ask the user whether to begin; if not, report that nothing was moved and return False."""
    with signs_of_command().hidden():
        if click.confirm(words, err=True, default=False):
            return True
    say("camtool: nothing was sent")
    return False


Close = Callable[[str, Mapping[str, Any]], None]
"""Function that adds the end of a cycle to its journal: why it failed, and what was measured."""


@contextmanager
def journaled(
    name: str | None, what: str, cycle: ProbeCycle
) -> Iterator[tuple[ProbeCycle, Close]]:
    """Yield the cycle, which writes each touch to the journal as a JSON line, and the function
    that ends the journal; without a file name, the cycle unchanged. OutputError for a file that
    cannot be written."""
    if name is None:
        yield cycle, lambda reason, measured: None
        return

    def refused(error: OSError) -> OutputError:
        return OutputError(f"the journal cannot be written ({error.strerror})", file=name)

    try:
        handle = os.open(name, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o666)
    except OSError as error:
        raise refused(error) from error

    def add(line: Mapping[str, Any]) -> None:
        try:
            os.write(handle, json.dumps(line, ensure_ascii=False).encode() + b"\n")
            os.fsync(handle)
        except OSError as error:
            raise refused(error) from error

    def note(step: ProbeStep, answer: ProbeAnswer) -> None:
        add({step.action: step.axes, "at": answer.place, "touched": answer.has_touched})

    def close(reason: str, measured: Mapping[str, Any]) -> None:
        add({"end": "failed" if reason else "finished", "why": reason, **measured})

    try:
        add({"probe": what, "at": time.strftime("%Y-%m-%dT%H:%M:%S%z")})
        yield noted(cycle, note), close
    finally:
        os.close(handle)


def _contours(name: str) -> list[Segments]:
    """Return the closed contours of the drawing in this file."""
    rings = [Segments.of(path) for path in read_drawing(Path(name)).paths if path.closed]
    if not rings:
        raise OptionError("has no closed contours", where=f"--holes {name}")
    return rings


def _boxes(name: str) -> list[Box]:
    """Return the keep-out boxes of a job file, in the work frame."""
    boxes = job_of_file(Path(name)).keep_out
    if not boxes:
        raise OptionError("has no [[keep_out]]", where=f"--job {name}")
    return [Box(each.name, each.x_mm, each.y_mm, each.z_mm[1]) for each in boxes]
