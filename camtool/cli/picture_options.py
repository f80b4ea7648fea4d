"""The flags that say how a picture looks, and the pictures of a command drawn by them.

A command says with a `Canvas` what its pictures can show. Flags that a picture cannot honour are
refused by name before any work is done; the user is warned about named layers that are empty."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from pathlib import PurePath
from typing import TYPE_CHECKING

import click
from msgspec import Struct

from camtool.cli.life_signs import progress
from camtool.cli.messages import say
from camtool.cli.options import Command, option, with_flags
from camtool.errors import OptionError
from camtool.pictures.layers import Layer, chosen, layer_names, layer_of, layers_in
from camtool.pictures.options import VIEWS, PictureOptions
from camtool.records import replace
from camtool.units import parse_length

if TYPE_CHECKING:
    from camtool.pictures.scene import Scene


_PICTURE = "Picture"
OF_ALL = ("--size", "--crop", "--dark")
"""Flags that every still picture has."""

PICTURES = (".svg", ".png", ".html")


def is_viewer(name: str) -> bool:
    """Return True if a file of this name is an HTML page with pan, zoom and play, not a
    picture."""
    return PurePath(name).suffix.lower() == ".html"


def picture_name(ctx: click.Context, param: click.Parameter, value: str | None) -> str | None:
    """Return the name of a picture if its extension is known; a usage error otherwise."""
    if value is not None and PurePath(value).suffix.lower() not in PICTURES:
        raise click.BadParameter(f"{value!r} ends in none of .svg, .png and .html", ctx, param)
    return value


class Canvas(Struct, frozen=True):
    """What the pictures of a command can show: `moves` of a machine or only a drawing; the
    `predicted` path; several layers (`layered`). `more`: text on what would allow the rest."""

    more: str = ""
    moves: bool = True
    predicted: bool = False
    layered: bool = True

    def has(self, layer: Layer) -> bool:
        """Return True if the pictures of the command can have this layer."""
        if layer.needs == "path":
            return self.predicted
        return layer.needs == "drawing" or self.moves


DRAWING = Canvas("camtool preview --target NAME --simulate shows more", moves=False)
RESULT = Canvas(predicted=True)
UNVERIFIED = Canvas("drop --no-verify")
OVERLAY = Canvas("drop --compare", layered=False)


class PictureFlags(Struct, frozen=True):
    """`--view`, `--size` (px), `--crop` (x, y, width, height in mm), `--dark`, `--exaggerate`,
    `--layers`, `--no-layer`, `--polar`."""

    view: str | None = None
    size: int | None = None
    crop: tuple[float, float, float, float] | None = None
    dark: bool = False
    exaggerate: float | None = None
    layers: str | None = None
    no_layer: tuple[str, ...] = ()
    polar: int | None = None

    @property
    def given(self) -> tuple[str, ...]:
        """Flags that were given, by name."""
        values = {name: getattr(self, name) for name in FLAGS}
        return tuple(
            f"--{name.replace('_', '-')}"
            for name, value in values.items()
            if not (value is None or value is False or value == ())
        )

    @property
    def named(self) -> tuple[str, ...]:
        """Layers that `--layers` names."""
        names = (name.strip() for name in (self.layers or "").split(","))
        return tuple(dict.fromkeys(name for name in names if name))

    def options(self) -> PictureOptions:
        """Return the options of the pictures; OptionError for values that no picture can have."""
        times = 1.0 if self.exaggerate is None else self.exaggerate
        layers = chosen(self.named, self.no_layer) if self.named or self.no_layer else None
        view = self.view or "plan"
        return PictureOptions(self.size, self.crop, self.dark, times, layers, self.polar, view)

    def check(self, pictures: Sequence[str | None], canvas: Canvas) -> None:
        """Raise a usage error for flags that none of the `pictures` can honour, and for flags that
        contradict each other; OptionError as `options`."""
        if not self.given:
            return
        names, flags = [name for name in pictures if name is not None], ", ".join(self.given)
        if not names:
            raise click.UsageError(f"{flags}: there is no picture to make; add --preview")
        if all(map(is_viewer, names)):
            raise click.UsageError(
                f"{flags}: an .html page has switches of its own; name a .svg or .png, or drop it"
            )
        if self.view not in (None, "plan") and not canvas.moves:
            raise click.UsageError(
                f"--view {self.view}: nothing cuts the stock here; {canvas.more}"
            )
        if self.layers is not None and not self.named:
            raise click.UsageError("--layers names no layer")
        if not canvas.layered and not {*self.given} <= {*OF_ALL}:
            other_flags = ", ".join(flag for flag in self.given if flag not in OF_ALL)
            raise click.UsageError(f"{other_flags}: not for this picture; {canvas.more}")
        self._check_errors(canvas)
        self._check_layers(canvas, self.options())

    def _check_errors(self, canvas: Canvas) -> None:
        """Raise a usage error if errors are to be shown but are not known, and for flags that the
        plot of a circle (`--polar`) does not have."""
        for flag in ("--exaggerate", "--polar"):
            if flag in self.given and not canvas.predicted:
                raise click.UsageError(f"{flag} needs the predicted path; {canvas.more}")
        other_flags = ", ".join(
            flag for flag in self.given if flag not in ("--polar", "--size", "--dark")
        )
        if self.polar is not None and other_flags:
            raise click.UsageError(
                f"{other_flags}: --polar plots a circle alone; drop one of them"
            )

    def _check_layers(self, canvas: Canvas, options: PictureOptions) -> None:
        shown = layer_names() if options.layers is None else options.layers
        covered = canvas.predicted and "path" in shown
        for name in self.named:
            layer = layer_of(name)
            if not canvas.has(layer):
                raise click.UsageError(f"--layers {name}: there is none here; {canvas.more}")
            if not layer.under_path and covered and name in shown:
                raise click.UsageError(
                    f"--layers {name}: it is left out where the predicted path is shown; "
                    "name it without path"
                )
        if self.exaggerate is not None and canvas.predicted and not covered:
            raise click.UsageError("--exaggerate moves the layer path, which is left out")

    def painter(self, scenes: Callable[[], Sequence[Scene]], *, quiet: bool = False) -> Painter:
        """Return the function that draws the scenes (several side by side) for a picture file of a
        given name. It warns about flags that the scenes cannot show."""
        return Painter(scenes, self, quiet)


FLAGS = PictureFlags.__struct_fields__


def check_beside(flag: str, pictures: Sequence[str | None]) -> None:
    """Raise a usage error if `flag` puts two pictures side by side and they are not made, or one
    of them is a viewer."""
    names = [name for name in pictures if name is not None]
    if not names:
        raise click.UsageError(f"{flag}: there is no picture to make; add --preview")
    if any(map(is_viewer, names)):
        raise click.UsageError(f"{flag}: an .html viewer shows a single one; name a .svg or .png")


def picture_options(command: Command) -> Command:
    """Add `picture: PictureFlags`."""
    return with_flags(
        command,
        "picture",
        PictureFlags,
        [
            option(
                _PICTURE,
                "--view",
                type=click.Choice(VIEWS),
                help="The moves from above (plan), or the stock after them.  [plan]",
            ),
            option(
                _PICTURE,
                "--size",
                type=click.INT,
                metavar="PX",
                help="Width in pixels; text and lines scale with it.  [1200, .svg 1000]",
            ),
            option(
                _PICTURE,
                "--crop",
                callback=_crop,
                metavar="X,Y,W,H",
                help="Only this part: lower left corner, width and height.",
            ),
            option(_PICTURE, "--dark", is_flag=True, help="On a dark ground."),
            option(
                _PICTURE,
                "--exaggerate",
                type=click.FLOAT,
                metavar="TIMES",
                help="Draw deviations from the wanted path this many times larger.",
            ),
            option(
                _PICTURE,
                "--layers",
                metavar="NAME,...",
                help=f"Only these layers: {', '.join(layer_names())}.",
            ),
            option(
                _PICTURE, "--no-layer", multiple=True, metavar="NAME", help="Without this layer."
            ),
            option(
                _PICTURE,
                "--polar",
                type=click.IntRange(min=1),
                metavar="N",
                help="The radial errors of the N-th full circle, as a ball-bar shows them.",
            ),
        ],
    )


def _crop(
    ctx: click.Context, param: click.Parameter, value: str | None
) -> tuple[float, float, float, float] | None:
    """Parse a rectangle such as `10,20,4mm,1/8in` (x, y, width, height) to mm."""
    if value is None:
        return None
    try:
        lengths = [parse_length(part) for part in value.split(",")]
    except OptionError as error:
        raise click.BadParameter(str(error), ctx, param) from error
    if len(lengths) != 4:
        raise click.BadParameter(f"{value!r} is not X,Y,WIDTH,HEIGHT", ctx, param)
    return lengths[0], lengths[1], lengths[2], lengths[3]


CLOSEUP = "closeup.svg"
"""A file name that stands for the kind of picture of close-ups."""


class Painter(Struct, frozen=True, dict=True):
    """Draws the pictures of a command, from the scenes that `make` returns when the first picture
    is requested; several scenes stand side by side."""

    make: Callable[[], Sequence[Scene]]
    flags: PictureFlags
    quiet: bool

    @cached_property
    def scenes(self) -> Sequence[Scene]:
        """Return the scenes, made once, with a warning for each flag that they cannot show."""
        scenes = self.make()
        for line in self._not_shown(scenes):
            say(f"camtool: warning: {line}", quiet=self.quiet)
        return scenes

    def __call__(self, name: str) -> bytes:
        """Draw the picture, for a file of this name."""
        scenes, options = self.scenes, self.flags.options()
        progress().begin("drawing the picture")
        if not _is_judged(scenes):  # the findings say why; the picture shows what there is
            options = replace(options, polar=None)
        if len(scenes) > 1:
            from camtool.pictures.beside import render_beside

            return render_beside(scenes, name, options)
        from camtool.pictures.draw import render

        return render(scenes[0], name, options)

    def closeups(self) -> Iterator[tuple[str, bytes]]:
        """Yield caption and SVG of the additional pictures of a page: close-ups of the last scene,
        which is the result."""
        from camtool.pictures.draw import render
        from camtool.pictures.limits import draw_limits, has_limits
        from camtool.pictures.picture import closeups

        if has_limits(self.scenes[-1]):
            yield (
                "Dimensions and their limits",
                draw_limits(self.scenes[-1], self.flags.options()).encode(),
            )
        for caption, options in closeups(self.scenes[-1], self.flags.options()):
            yield caption, render(self.scenes[-1], CLOSEUP, options)

    def stock(self, swept_mm: tuple[float, float, float, float] | None = None) -> bytes | None:
        """Return the SVG of the stock on the machine, with the box that tools and holders pass
        over; None without a drawing."""
        from camtool.pictures.draw import render
        from camtool.pictures.picture import on_stock

        picture = on_stock(self.scenes[-1], swept_mm)
        return None if picture is None else render(picture[0], CLOSEUP, picture[1])

    def _not_shown(self, scenes: Sequence[Scene]) -> Iterator[str]:
        """Yield warnings about empty layers, and about errors if nothing could be judged."""
        for name in self._missing(scenes):
            yield f"--layers {name}: nothing in this picture{layer_of(name).hint}"
        for flag in ("--exaggerate", "--polar"):
            if flag in self.flags.given and not _is_judged(scenes):
                yield f"{flag}: the part cannot be judged; the picture shows what is planned"

    def _missing(self, scenes: Sequence[Scene]) -> list[str]:
        named = self.flags.named
        if not named:
            return []
        from camtool.pictures.content import content_of

        options = self.flags.options()
        present_layers = {
            name for scene in scenes for name in layers_in(content_of(scene, options))
        }
        return [name for name in named if name not in present_layers]


def _is_judged(scenes: Sequence[Scene]) -> bool:
    """Return True if all scenes have a predicted path."""
    return all(scene.trace_points is not None for scene in scenes)
