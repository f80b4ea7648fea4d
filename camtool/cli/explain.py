"""`camtool explain`: each block of a program in words."""

from __future__ import annotations

from collections.abc import Iterable

import click

from camtool.cli.files import STDOUT, check_places, display_name, read_bytes, write_all
from camtool.cli.messages import say_findings, show_text
from camtool.cli.options import MachineFlags, SectionedCommand, machine_options, talk_options
from camtool.errors import OptionError
from camtool.pipeline import read_program
from camtool.plain import one_line, to_json
from camtool.toolpath.explain import ExplainedBlock
from camtool.toolpath.explain import explain as explained_blocks

MAX_TEXT_CHARS = 40
"""Blocks are shown in a column as wide as the longest, up to this many characters."""

LINE = click.IntRange(min=1)


@click.command(cls=SectionedCommand, short_help="Each block of a program in words.")
@click.argument("program", metavar="PROGRAM")
@machine_options
@click.option("--from", "first", type=LINE, metavar="LINE", help="The first line that is told.")
@click.option("--to", "last", type=LINE, metavar="LINE", help="The last line that is told.")
@click.option("--json", "report", metavar="FILE", help="The same as JSON; - is stdout.")
@talk_options
def explain(
    program: str,
    machine: MachineFlags,
    first: int | None,
    last: int | None,
    report: str | None,
    quiet: bool,
    verbose: bool,
) -> int:
    """Say what each block of PROGRAM (- is stdin) makes the machine do.

    Moves are those that the controller decodes, in millimetres from part zero, whatever units and
    modes the block is written in; a feed is told where it changes. Lines are those of the file;
    of a program without lines, such as one in binary, its blocks."""
    if first is not None and last is not None and last < first:
        raise OptionError(f"ends before line {first} of --from", where=f"--to {last}")
    check_places([program, *machine.files()], [report])
    target, name = machine.load(), display_name(program)
    data = read_bytes(program)
    run = read_program(data, target, source=name)
    decoded = run.decoded
    assert decoded is not None
    listing = None if run.listing is None else run.listing()
    told_blocks: Iterable[ExplainedBlock] = explained_blocks(
        decoded, listing, target.target.meanings, first or 1, last
    )
    if report is not None:
        told_blocks = list(told_blocks)
        write_all({report: to_json(told_blocks).encode()})
    if report != STDOUT and not quiet:
        texts = () if listing is None else listing.blocks
        width = min(max(map(len, texts), default=0), MAX_TEXT_CHARS)
        numbers = () if listing is None else listing.lines
        number_width = len(str(numbers[-1] if numbers else max(len(texts), 1)))
        for each in told_blocks:
            text = one_line(each.text)
            words = one_line("; ".join(each.words))
            show_text(f"{each.line or each.block:>{number_width}}  {text:<{width}}  {words}")
    say_findings(run.findings, quiet=quiet, verbose=verbose)
    return 0
