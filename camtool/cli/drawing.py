"""The flags that say how a drawing is read, and which part of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from camtool.cli.gather import Command, decorate, gather
from camtool.cli.sections import option
from camtool.cli.types import length

if TYPE_CHECKING:
    from camtool.geometry.drawing import Drawing
    from camtool.machine.model import Machine
    from camtool.planning.job import Job

FORMATS = ("dxf", "svg", "points", "solid")
_READ, _CHOSEN = "How the drawing is read", "Which part of it"
TEXTS = ("skip", "outline", "stroke")


@dataclass(frozen=True)
class DrawingFlags:
    """How a drawing is read: `given` are fields of ReadOptions, None where no flag says."""

    layers: tuple[str, ...]
    exclude_layers: tuple[str, ...]
    colours: tuple[str, ...]
    line_types: tuple[str, ...]
    given: dict[str, Any]

    def read(
        self,
        name: str,
        machine: Machine | None = None,
        job: Job | None = None,
        data: bytes | None = None,
    ) -> Drawing:
        """The drawing (`-` is stdin), of the layers that the job's operations take.

        `data` is the file's content where it has been read already. Tolerances that no flag
        gives are the machine's, or else the importer's; they are of the part, whose scale the
        job says. OptionError for a layer or colour of
        the job that the drawing has not, unless flags restrict it.
        """
        from camtool.importers.options import ReadOptions, Selection
        from camtool.importers.read import content, read_bytes
        from camtool.importers.select import NoMatchError, colour_named
        from camtool.jobs.layers import layers_of, refuse_unmatched, unmatched
        from camtool.jobs.reading import read_to_scale

        settings: dict[str, Any] = {}
        if machine is not None:
            settings["tolerance_mm"] = machine.defaults.fit_tolerance_mm
            settings["gap_mm"] = machine.defaults.gap_mm
        settings.update({key: value for key, value in self.given.items() if value is not None})
        settings["select"] = Selection(
            layers=self.layers or (() if job is None else layers_of(job)),
            exclude_layers=self.exclude_layers,
            colours=tuple(colour_named(colour) for colour in self.colours),
            line_types=self.line_types,
        )
        try:
            options = ReadOptions(**settings)
            data, file = content(Path(name)) if data is None else (data, name)
            drawing = read_to_scale(
                lambda scale: read_bytes(data, file, replace(options, scale=scale)), job
            )
        except NoMatchError as error:
            if job is None or error.pattern not in layers_of(job) or self.layers:
                raise
            raise unmatched(error, job) from error
        if job is not None and not (self.layers or self.exclude_layers or self.colours):
            refuse_unmatched(drawing, job)
        return drawing


def drawing_options(command: Command) -> Command:
    """Adds `drawing: DrawingFlags`."""
    names = (*_SELECTION_FLAGS, *_READ_FIELDS)
    wrapped = gather("drawing", _make_drawing, names)(command)
    return decorate(wrapped, [*_read_flags(), *_selection_flags()])


def _make_drawing(
    layer: tuple[str, ...],
    exclude_layer: tuple[str, ...],
    colour: tuple[str, ...],
    line_type: tuple[str, ...],
    **given: Any,
) -> DrawingFlags:
    return DrawingFlags(layer, exclude_layer, colour, line_type, given)


def _read_flags() -> list[Callable[..., Any]]:
    """How geometry is read."""
    tolerance, gap = (
        "How near arcs come to curves of the part.",
        "Ends nearer than this are joined.",
    )
    return [
        option(_READ, "--format", type=click.Choice(FORMATS), help="Do not guess it."),
        option(_READ, "--units", metavar="UNIT", help="Unit of the drawing: mm, in, um, px ..."),
        option(
            _READ,
            "--dpi",
            type=float,
            help="Pixels per inch of an SVG.  [96, or what its program took]",
        ),
        option(
            _READ, "--tolerance", "tolerance_mm", callback=length, metavar="LENGTH", help=tolerance
        ),
        option(_READ, "--gap", "gap_mm", callback=length, metavar="LENGTH", help=gap),
        _switch("--across-layers", "across_layers", "Join ends of different layers too."),
        _switch("--recognise-arcs", "recognise_arcs", "Chords on one circle become arcs again."),
        option(_READ, "--text", type=click.Choice(TEXTS), help="What to do with text.  [skip]"),
        _switch("--dimensions", "dimensions", "Read the lines of dimensions too."),
        option(_READ, "--layout", metavar="NAME", help="A layout of a DXF, not model space."),
        option(
            _READ,
            "--section-z",
            "section_z_mm",
            callback=length,
            metavar="HEIGHT",
            help="Cut a solid at this height.",
        ),
        _switch("--allow-scripts", "allow_scripts", "Run a build123d script, with your rights."),
    ]


def _selection_flags() -> list[Callable[..., Any]]:
    """What of it is read."""
    return [
        _patterns("--layer", "Only these layers (CUT, ENG*)."),
        _patterns("--exclude-layer", "Not these layers."),
        _patterns("--colour", "Only this colour (#ff0000, red, or 1 to 255)."),
        _patterns("--line-type", "Only these line types (DASHED, CENTER*)."),
    ]


def _switch(flag: str, name: str, text: str) -> Callable[..., Any]:
    """A flag that is None unless given, so that a default stays one."""
    return option(_READ, flag, name, is_flag=True, default=None, help=text)


def _patterns(flag: str, text: str) -> Callable[..., Any]:
    return option(_CHOSEN, flag, multiple=True, metavar="PATTERN", help=text)


_SELECTION_FLAGS = ("layer", "exclude_layer", "colour", "line_type")
_READ_FIELDS = (
    "format",
    "units",
    "dpi",
    "tolerance_mm",
    "gap_mm",
    "across_layers",
    "recognise_arcs",
    "text",
    "dimensions",
    "layout",
    "section_z_mm",
    "allow_scripts",
)
