"""Command-line values: lengths, feeds and picture names are checked at this door.

These are click callbacks: text in, float (mm, mm/min) or name out, a usage error otherwise.
"""

from __future__ import annotations

from pathlib import PurePath

import click

from camtool.errors import OptionError
from camtool.units import parse_feed, parse_length, parse_time

PICTURES = (".svg", ".png", ".html")
PAGES = (".html", ".md", ".json")


def length(ctx: click.Context, param: click.Parameter, value: str | None) -> float | None:
    """`0.2mm`, `1/8in`, `200um` or a bare number (mm) as mm."""
    try:
        return None if value is None else parse_length(value)
    except OptionError as error:
        raise click.BadParameter(str(error), ctx, param) from error


def feed(ctx: click.Context, param: click.Parameter, value: str | None) -> float | None:
    """`0.8`, `0.8mm/min`, `0.01mm/s` as mm/min."""
    try:
        return None if value is None else parse_feed(value)
    except OptionError as error:
        raise click.BadParameter(str(error), ctx, param) from error


def duration(ctx: click.Context, param: click.Parameter, value: str | None) -> float | None:
    """`90min`, `1h`, `200ms` or a bare number (s) as s."""
    try:
        return None if value is None else parse_time(value)
    except OptionError as error:
        raise click.BadParameter(str(error), ctx, param) from error


def is_viewer(name: str) -> bool:
    """Whether a picture of this name is a page to pan, zoom and play."""
    return PurePath(name).suffix.lower() == ".html"


def picture(ctx: click.Context, param: click.Parameter, value: str | None) -> str | None:
    """The name of a picture that we can make."""
    if value is not None and PurePath(value).suffix.lower() not in PICTURES:
        raise click.BadParameter(f"{value!r} ends in none of .svg, .png and .html", ctx, param)
    return value


def page(ctx: click.Context, param: click.Parameter, value: str | None) -> str | None:
    """The name of a page that we can make; - is Markdown on stdout."""
    if value not in (None, "-") and PurePath(str(value)).suffix.lower() not in PAGES:
        raise click.BadParameter(f"{value!r} ends in none of {', '.join(PAGES)}", ctx, param)
    return value
