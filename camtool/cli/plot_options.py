"""The flags of plots over time: `--plot`, `--plot-from`, `--plot-span`."""

from __future__ import annotations

from pathlib import PurePath
from typing import TYPE_CHECKING

import click
from msgspec import Struct

from camtool.cli.options import Command, duration, option, with_flags
from camtool.pictures.options import PictureOptions

if TYPE_CHECKING:
    from camtool.run import Run
    from camtool.waveforms.plot import PlotKind

_PLOTS = "Picture"

KINDS = ("speed", "position", "error")
LOOKS = {"--size", "--dark"}
"""The flags of pictures that plots have too."""


class PlotFlags(Struct, frozen=True):
    """`--plot KIND FILE` (several), and the stretch of time that they show, s."""

    plot: tuple[tuple[PlotKind, str], ...] = ()
    plot_from: float | None = None
    plot_span: float | None = None

    @property
    def names(self) -> list[str]:
        """The names of the files."""
        return [name for _, name in self.plot]

    def check(self, looks: tuple[str, ...] = (), *, pictures: bool = True) -> None:
        """Raise a usage error for a stretch without a plot, and for flags of pictures (`looks`)
        that plots do not have, where no other picture is made."""
        if not self.plot and (self.plot_from is not None or self.plot_span is not None):
            raise click.UsageError("--plot-from and --plot-span are of plots: add --plot")
        if self.plot and not pictures and not {*looks} <= LOOKS:
            others = ", ".join(flag for flag in looks if flag not in LOOKS)
            raise click.UsageError(f"{others}: plots over time do not have it; add --preview")

    def refuse(self, why: str) -> None:
        """Raise a usage error with the reason `why` there are no plots, if any are asked for."""
        if self.plot:
            raise click.UsageError(f"--plot {why}")

    def files(self, run: Run, options: PictureOptions) -> dict[str, bytes]:
        """Return the plots of a run by file name; none for a program that could not be
        simulated."""
        if run.verification is None:
            return {}
        look = PictureOptions(size_px=options.size_px, dark=options.dark)
        return {
            name: run.plot(kind, name, self.plot_from or 0.0, self.plot_span, look)
            for kind, name in self.plot
        }


def _plots(
    ctx: click.Context, param: click.Parameter, values: tuple[tuple[PlotKind, str], ...]
) -> tuple[tuple[PlotKind, str], ...]:
    """Return the kinds and file names of plots; a usage error for a name with an unknown
    extension."""
    for _, name in values:
        if PurePath(name).suffix.lower() not in (".svg", ".png"):
            raise click.BadParameter(f"{name!r} ends in none of .svg and .png", ctx, param)
    return values


def plot_options(command: Command) -> Command:
    """Add `plots: PlotFlags`."""
    return with_flags(
        command,
        "plots",
        PlotFlags,
        [
            option(
                _PLOTS,
                "--plot",
                type=(click.Choice(KINDS), str),
                multiple=True,
                metavar="KIND FILE",
                callback=_plots,
                help="speed, position or error over time, .svg or .png; may be given several "
                "times.",
            ),
            option(
                _PLOTS,
                "--plot-from",
                metavar="TIME",
                callback=duration,
                help="Plots begin so long after the start, such as 1.5s.",
            ),
            option(
                _PLOTS,
                "--plot-span",
                metavar="TIME",
                callback=duration,
                help="Plots show only so long.",
            ),
        ],
    )
