"""`camtool job`: begin a job file from a drawing, or see what one says."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from camtool.cli.files import STDOUT, check_new, check_places, write_all
from camtool.cli.life_signs import progress
from camtool.cli.messages import say, say_findings, show_text
from camtool.cli.options import (
    DrawingFlags,
    JobFlags,
    MachineFlags,
    SectionedCommand,
    drawing_options,
    length,
    machine_options,
    talk_options,
)
from camtool.cli.picture_options import PictureFlags, picture_name
from camtool.cli.preview import SceneSource
from camtool.errors import OptionError
from camtool.jobs.tools import read_library, tool_of
from camtool.plain import one_line, to_json
from camtool.planning.job import above_zero
from camtool.project import project_of
from camtool.records import replace

if TYPE_CHECKING:
    from camtool.jobs.proposal import Proposal
    from camtool.jobs.template import Proposed
    from camtool.planning.job import Tool

NOT_CUT = "leave"
"""The answer that leaves a group uncut."""

MAX_GROUPS = 12


@click.group(short_help="Job files: begin one, or see what one says.")
def job() -> None:
    """Job files say how a drawing is cut: the tools, and one operation after the other.

    \b
    camtool job new   part.dxf -o part.toml         a file to fill in, from the layers
    camtool job check part.toml --against part.dxf  what it says, and what it takes
    camtool post part.dxf -t grbl --job part.toml   the program"""


@job.command(cls=SectionedCommand, short_help="Begin a job file.")
@click.argument("source", metavar="DRAWING")
@click.option("-o", "--output", metavar="FILE", help="The file; - is stdout.  [job.toml]")
@click.option("--tool-diameter", callback=length, metavar="LENGTH", help="Of the end mill.")
@click.option("--tool", metavar="NAME", help="The end mill; see camtool tools.")
@click.option("--material", metavar="NAME", help="What is cut, for which the tool has a preset.")
@click.option("--thickness", callback=length, metavar="LENGTH", help="Of the stock: cut through.")
@click.option(
    "--two-sided",
    type=click.Choice(["x", "y"]),
    help="Cut from both faces, turned over about a line along X or Y, with pins.",
)
@click.option("--ask", is_flag=True, help="Ask what is meant where that is in doubt.")
@machine_options
@drawing_options
@talk_options
def new(
    source: str,
    output: str | None,
    tool_diameter: float | None,
    tool: str | None,
    material: str | None,
    thickness: float | None,
    two_sided: str | None,
    ask: bool,
    machine: MachineFlags,
    drawing: DrawingFlags,
    quiet: bool,
    verbose: bool,
) -> None:
    """Write a job file for DRAWING (- is stdin): operations for each of its layers.

    With a tool, or a library that has an end mill, it cuts the drawing as a machinist would, and
    says why; with the thickness of the stock it cuts through it, over tabs. It works as it is;
    every other key stands there as a comment."""
    from camtool.geometry.drawing import is_text
    from camtool.jobs.proposal import Proposal
    from camtool.jobs.template import job_template, pin_words, proposed

    above_zero("tool diameter", tool_diameter, "mm")
    above_zero("thickness", thickness, "mm")
    if tool is not None and tool_diameter is not None:
        raise click.UsageError("--tool has a diameter: leave --tool-diameter out")
    if material is not None and tool is None:
        raise click.UsageError("--material is for the presets of a tool: give --tool too")
    if two_sided is not None and thickness is None:
        raise click.UsageError("--two-sided needs the thickness of the stock: give --thickness")
    proposal = Proposal(tool_diameter or 0.0, thickness or 0.0)
    if tool is not None:
        named_values = {"tool": tool} if material is None else {"tool": tool, "material": material}
        named = JobFlags(given=named_values, project=project_of(Path.cwd())).job(drawing)
        cutter = named.operations[0].tool
        proposal = Proposal(
            cutter.diameter_mm, proposal.thickness_mm, tool, cutter.materials, material or ""
        )
    proposal = replace(_with_library(proposal), flip=two_sided or "")
    if two_sided is not None and not proposal.tool_mm:
        raise click.UsageError("--two-sided needs an end mill: give --tool or --tool-diameter")
    if ask and (source == STDOUT or not sys.stdin.isatty()):
        raise click.UsageError(
            "--ask needs a terminal: leave it out, and read above each operation why it is so"
        )
    output = output or "job.toml"
    check_places([source, *machine.files()], [output])
    check_new(output)
    target = machine.load().machine if machine.name() is not None else None
    text = drawing.given.get("text", "stroke")
    read = DrawingFlags({**drawing.given, "text": text}).read(source, target)
    has_text = any(is_text(name) for name in read.sources)
    parts = proposed(read, proposal)
    if ask:
        parts = [part for each in parts if (part := _ask_kind(each)) is not None]
        if not parts:
            raise OptionError("nothing is left to cut", mend="let one operation cut something")
    if has_text and not any(
        is_text(read.sources[row])
        for each in parts
        if not each.part.is_left
        for row in each.part.rows
    ):
        text = "skip"  # so that what is not cut is no edge either
    job_text = job_template(read, target, proposal, parts, text if has_text else "")
    write_all({output: job_text.encode()})
    say_findings(read.findings, quiet=quiet, verbose=verbose)
    for each in parts:
        if each.part.why:
            outcome = "not cut" if each.part.is_left else each.part.kind
            say(one_line(f"{each.part.name}: {outcome}, since {each.part.why}"), quiet=quiet)
    if proposal.flip:
        say(pin_words(read, proposal), quiet=quiet)
    place = "stdout" if output == STDOUT else output
    say(f"written: {place}; look at the kinds, the tool and the depth", quiet=quiet)


def _ask_kind(each: Proposed) -> Proposed | None:
    """Ask the user which kind of operation a doubtful part is meant to be; return the operation,
    or None if it is not to be cut."""
    part = each.part
    if not part.others and not part.is_left:
        return each
    kinds: tuple[str, ...] = (part.kind, *part.others, NOT_CUT)
    kinds = (NOT_CUT, part.kind) if part.is_left else kinds
    text = one_line(f"{each.part.name}: {each.part.why}. How is it cut")
    kind = click.prompt(text, kinds[0], type=click.Choice(kinds), err=True)
    if kind == NOT_CUT:
        return None
    return each.cut() if kind == part.kind else each.of_kind(kind)


def _with_library(proposal: Proposal) -> Proposal:
    """Return the proposal with the tools of the libraries that have presets for its material. If
    neither a tool nor a diameter is given, the first end mill becomes its tool."""
    every: dict[str, Tool] = {}
    for file in project_of(Path.cwd()).libraries:
        every = {
            **{name: tool_of(name, each) for name, each in read_library(file).items()},
            **every,
        }
    material = proposal.material
    library = tuple(
        tool
        for tool in every.values()
        if not material or not tool.materials or material in tool.materials
    )
    if not proposal.tool_mm and not proposal.tool:
        mill = next((tool for tool in library if tool.kind == "flat" and tool.diameter_mm), None)
        if mill is not None:
            proposal = replace(
                proposal, tool=mill.name, tool_mm=mill.diameter_mm, materials=mill.materials
            )
    return replace(proposal, library=library)


@job.command(cls=SectionedCommand, short_help="What a job file says.")
@click.argument("file", metavar="FILE")
@click.option("--against", metavar="DRAWING", help="Say what of this drawing is taken.")
@click.option("--json", "report", metavar="FILE", help="The same as JSON; - is stdout.")
@click.option(
    "--preview",
    metavar="FILE",
    callback=picture_name,
    help="Picture of what it cuts of the drawing, .svg, .png or .html.",
)
@machine_options
@drawing_options
@talk_options
def check(
    file: str,
    against: str | None,
    report: str | None,
    preview: str | None,
    machine: MachineFlags,
    drawing: DrawingFlags,
    quiet: bool,
    verbose: bool,
) -> None:
    """Check the job FILE, and say what each operation does; with --against, to which paths, on
    which side of them, and why."""
    from camtool.jobs.description import described

    if preview is not None and (against is None or machine.name() is None):
        raise click.UsageError("--preview needs --against and --target")
    flags = JobFlags(file, project=project_of(Path.cwd()))
    reads = [*flags.files(), against, *machine.files()]
    check_places(reads, [report, preview])
    job = flags.job(drawing)
    target = machine.load().machine if machine.name() is not None else None
    read = drawing.read(against, target, job) if against is not None else None
    progress().begin("planning")
    facts, findings = described(job, read, target)
    files: dict[str, bytes] = {}
    if preview is not None and against is not None:
        scene, _ = SceneSource(machine, False, True, flags, drawing, preview).scene(against)
        files[preview] = PictureFlags().painter(lambda: [scene], quiet=quiet)(preview)
    if report is not None:
        facts["findings"] = [
            {
                "code": each.code.name,
                "severity": each.severity.name.lower(),
                "message": each.message,
            }
            for each in findings
        ]
        files[report] = to_json(facts).encode()
    write_all(files)
    if not quiet and report != STDOUT:
        for line in _summary(facts):
            show_text(one_line(line))
    say_findings(findings, quiet=quiet, verbose=verbose)


def _summary(facts: dict[str, Any]) -> Iterator[str]:
    """Yield the lines about a job, and about the parts of the drawing that it takes."""
    if "extents_mm" in facts:
        axes = facts["extents_mm"].items()
        ranges = (f"{axis} {' … '.join(map(_place, pair))}" for axis, pair in axes)
        yield f"drawing    {'   '.join(ranges)} mm"
    for operation in facts["operations"]:
        name = f"operation  {operation['number']} {operation['name']}".rstrip()
        yield f"{name}: {_does(operation)}"
        if "takes" in operation:
            takes = operation["takes"]
            yield (
                f"           {takes['closed']} closed paths, {takes['open']} open,"
                f" {takes['points']} points"
            )
            yield from _sides(operation["contours"])
    for setup in facts.get("setups", ()):
        yield f"set-up     {setup['words']}"
        yield f"           cuts {', '.join(setup['operations'])}"
    if "stock_mm" in facts:
        sizes = [f"{size:g}" for size in facts["stock_mm"]["size"] if size is not None]
        yield f"stock      {' by '.join(sizes)} mm{' thick' if len(sizes) == 1 else ''}"


def _sides(groups: list[dict[str, Any]]) -> Iterator[str]:
    """Yield lines for the groups of contours, with the side on which the tool runs; only the
    largest groups if there are many."""
    shown = sorted(groups, key=lambda group: -group["contours"])[:MAX_GROUPS]
    for group in shown:
        yield (
            f"           {group['contours']} on layer {group['layer'] or '(no name)'}"
            f" {group['side']}: {group['why']}"
        )
    if len(groups) > len(shown):
        yield f"           and {len(groups) - len(shown)} groups more; --json has them all"


def _place(mm: float) -> str:
    return f"{round(mm, 4) + 0.0:.4f}"  # never −0


def _does(operation: dict[str, Any]) -> str:
    tool = operation["tool"]
    name = f" ({tool['name']})" if tool["name"] else ""
    depth, step = operation["depth_mm"], operation["step_down_mm"]
    deep = "" if depth is None else f", {depth:g} mm deep"
    step_text = "" if step is None else f" by {step:g} mm"
    below = operation["below_stock_mm"]
    below_text = "" if below is None else f", through the stock and {below:.4g} mm below"
    allowance = operation["allowance_mm"]
    left_on = f", leaves {allowance:g} mm on the wall" if allowance > 0.0 else ""
    if allowance < 0.0:
        left_on = f", cuts {-allowance:g} mm beyond the line"
    if operation["stage"] == "finish":
        left_on += ", along the wall at the full depth"
    if operation["rest"]:
        left_on += f", what {operation['rest']!r} leaves"
    cut = f"{deep}{step_text}{below_text}{left_on}"
    return f"{operation['kind']}, tool {tool['diameter_mm']:g} mm{name}{cut}"
