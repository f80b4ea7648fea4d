"""`camtool post`: the main job, drawing to verified program."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from camtool.cli.finish import Asked, finish
from camtool.cli.options import talk_options
from camtool.cli.output import STDOUT
from camtool.cli.pictureflags import (
    RESULT,
    UNVERIFIED,
    PictureFlags,
    check_beside,
    picture_options,
)
from camtool.cli.posting import posting_options
from camtool.cli.report import flags_given, pictures_asked, report_option
from camtool.cli.sections import SectionedCommand
from camtool.cli.types import picture as picture_name
from camtool.cli.watch import watch

if TYPE_CHECKING:
    from camtool.cli.posting import Posting


@click.command(cls=SectionedCommand, short_help="Drawing to verified program.")
@click.argument("source", metavar="DRAWING")
@click.option("-o", "--output", metavar="FILE", help="The program; - is stdout.  [DRAWING.ext]")
@click.option(
    "--preview",
    metavar="FILE",
    callback=picture_name,
    help="Picture of the predicted result, .svg or .png; .html to pan, zoom and play.",
)
@click.option("--json", "report", metavar="FILE", help="The report; - is stdout.")
@report_option
@click.option("--watch", "watching", is_flag=True, help="Again when a file has changed.")
@click.option(
    "--before-after",
    is_flag=True,
    help="The picture without and with --compensate, --minimise reversals and --approach.",
)
@posting_options
@picture_options
@talk_options
def post(
    source: str,
    output: str | None,
    preview: str | None,
    report: str | None,
    page: str | None,
    watching: bool,
    before_after: bool,
    picture: PictureFlags,
    posting: Posting,
    quiet: bool,
    verbose: bool,
) -> int:
    """Turn DRAWING (- is stdin) into the program of a machine, verified before it is written.

    The program is read back from its bytes, run through a model of the machine's own controller
    and mechanics, and compared with the drawing. Exit code 1 (and no file) when something is
    wrong.
    """
    if watching and STDOUT in (source, output, report, page):
        raise click.UsageError("--watch works on files: neither reads stdin nor writes stdout")
    pictures = pictures_asked(page, preview)
    picture.check(pictures, UNVERIFIED if posting.no_verify else RESULT)
    if before_after:
        if posting.no_verify:
            raise click.UsageError("--before-after needs the predicted path; drop --no-verify")
        check_beside("--before-after", pictures)
    flags = flags_given()

    def once() -> int:
        target = posting.load()
        reads = [*posting.files(source), str(target.file)]
        asked = Asked(source, output, report, preview, page, flags, reads)
        asked.check(target.machine.target.extension, verified=not posting.no_verify)
        made = posting.make(source, target, quiet=quiet, preview=preview)
        return finish(
            made.posted,
            asked,
            quiet=quiet,
            verbose=verbose,
            picture=picture.painter(lambda: made.scenes(before=before_after), quiet=quiet),
            target=target,
        )

    return watch(once, lambda: posting.files(source), quiet=quiet) if watching else once()
