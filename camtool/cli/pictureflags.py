"""The flags that say how a picture looks, for every command that makes one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import click

from camtool.cli.gather import Command, with_flags
from camtool.cli.sections import option
from camtool.errors import OptionError
from camtool.units import parse_length

if TYPE_CHECKING:
    from camtool.preview.options import Options

_PICTURE = "Picture"


@dataclass(frozen=True)
class PictureFlags:
    """`--size` (px), `--crop` (x, y, width, height in mm), `--dark`, `--exaggerate`, `--layers`,
    `--no-layer`, `--polar`."""

    size: int | None
    crop: tuple[float, float, float, float] | None
    dark: bool
    exaggerate: float | None
    layers: str | None
    no_layer: tuple[str, ...]
    polar: int | None

    @property
    def given(self) -> bool:
        """Whether anything is asked of the picture."""
        return self != PictureFlags(None, None, False, None, None, (), None)

    def options(self) -> Options:
        """What `camtool.preview` is told."""
        from camtool.preview.layers import chosen
        from camtool.preview.options import Options

        times = 1.0 if self.exaggerate is None else self.exaggerate
        named = [name.strip() for name in (self.layers or "").split(",") if name.strip()]
        layers = chosen(named, self.no_layer)
        return Options(self.size, self.crop, self.dark, times, layers, self.polar)


def picture_options(command: Command) -> Command:
    """Adds `picture: PictureFlags`."""
    return with_flags(
        command,
        "picture",
        PictureFlags,
        [
            option(
                _PICTURE,
                "--size",
                type=click.INT,
                metavar="PX",
                help="Width of the picture; letters and lines suit it.  [1200, .svg 1000]",
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
                help="Draw the predicted path so many times as far from the wanted one.",
            ),
            option(
                _PICTURE,
                "--layers",
                metavar="NAME,...",
                help="Only these layers; those of docs/pictures.md.",
            ),
            option(
                _PICTURE,
                "--no-layer",
                multiple=True,
                metavar="NAME",
                help="Without this layer.",
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
    """`10,20,4mm,1/8in` as mm."""
    if value is None:
        return None
    try:
        lengths = [parse_length(part) for part in value.split(",")]
    except OptionError as error:
        raise click.BadParameter(str(error), ctx, param) from error
    if len(lengths) != 4:
        raise click.BadParameter(f"{value!r} is not X,Y,WIDTH,HEIGHT", ctx, param)
    return lengths[0], lengths[1], lengths[2], lengths[3]
