"""The flags that say how a drawing is read, and which part of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from camtool.cli.gather import decorate, gather
from camtool.cli.types import length

if TYPE_CHECKING:
    from camtool.geometry.drawing import Drawing
    from camtool.machine.model import Machine
    from camtool.planning.job import Job

Command = TypeVar("Command", bound=Callable[..., Any])
FORMATS = ("dxf", "svg", "points", "solid")
TEXTS = ("skip", "outline", "stroke")


@dataclass(frozen=True)
class DrawingFlags:
    """How a drawing is read: `given` are fields of ReadOptions, None where no flag says."""

    layers: tuple[str, ...]
    exclude_layers: tuple[str, ...]
    colours: tuple[str, ...]
    line_types: tuple[str, ...]
    given: dict[str, Any]

    def read(self, name: str, machine: Machine | None = None, job: Job | None = None) -> Drawing:
        """The drawing (`-` is stdin), of the job's layers when there is a job.

        Tolerances that no flag gives are the machine's, or else the importer's.
        """
        from camtool.importers.options import ReadOptions, Selection
        from camtool.importers.read import read_drawing
        from camtool.importers.select import colour_named

        settings: dict[str, Any] = {}
        if machine is not None:
            settings["tolerance_mm"] = machine.defaults.fit_tolerance_mm
            settings["gap_mm"] = machine.defaults.gap_mm
        settings.update({key: value for key, value in self.given.items() if value is not None})
        settings["select"] = Selection(
            layers=self.layers if job is None else job.layers,
            exclude_layers=self.exclude_layers,
            colours=tuple(colour_named(colour) for colour in self.colours),
            line_types=self.line_types,
        )
        return read_drawing(Path(name), options=ReadOptions(**settings))


def drawing_options(command: Command) -> Command:
    """Adds `drawing: DrawingFlags`."""
    names = (*_SELECTION_FLAGS, *_READ_FIELDS)
    wrapped = gather("drawing", _make_drawing, names)(command)
    return decorate(wrapped, [*_read_flags(), *_selection_flags()])  # type: ignore[no-any-return]


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
    tolerance, gap = "How near arcs come to fitted curves.", "Ends nearer than this are joined."
    return [
        click.option("--format", type=click.Choice(FORMATS), help="Do not guess it."),
        click.option("--units", metavar="UNIT", help="Unit of the drawing: mm, in, um, px ..."),
        click.option("--dpi", type=float, help="Pixels per inch of an SVG.  [96]"),
        click.option(
            "--tolerance", "tolerance_mm", callback=length, metavar="LENGTH", help=tolerance
        ),
        click.option("--gap", "gap_mm", callback=length, metavar="LENGTH", help=gap),
        _switch("--across-layers", "across_layers", "Join ends of different layers too."),
        _switch("--recognise-arcs", "recognise_arcs", "Chords on one circle become arcs again."),
        click.option("--text", type=click.Choice(TEXTS), help="What to do with text.  [skip]"),
        _switch("--dimensions", "dimensions", "Read the lines of dimensions too."),
        click.option("--layout", metavar="NAME", help="A layout of a DXF, not model space."),
        click.option(
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
    return click.option(flag, name, is_flag=True, default=None, help=text)


def _patterns(flag: str, text: str) -> Callable[..., Any]:
    return click.option(flag, multiple=True, metavar="PATTERN", help=text)


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
