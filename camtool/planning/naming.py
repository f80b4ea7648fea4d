"""Names of places, tools, operations and keys in messages of planning."""

from __future__ import annotations

import math
from collections.abc import Sequence

from camtool.findings import Finding, Sentence
from camtool.machine.model import Machine
from camtool.planning.job import Job, JobSetup, Operation, Tool
from camtool.toolpath.wanted import TOOL_SHAPES

MAX_LISTED = 12


def at_place(name: str, point: Sequence[float]) -> str:
    """Return text that names a path and a place (x, y) mm of it."""
    return f"{name} at X {point[0]:.4f} Y {point[1]:.4f}"


def tool_name(tool: Tool) -> str:
    """Return text with the tool's diameter, and its name if it has one."""
    name = f" ({tool.name})" if tool.name else ""
    return f"a tool of {tool.diameter_mm:g} mm{name}"


def width_name(operation: Operation) -> str:
    """Return text that names an operation's tool by its width beside the line that it follows."""
    if operation.contract.breaks_edges:
        return f"a V bit, {2.0 * operation.wall_radius_mm:.3g} mm wide where its bevel ends,"
    return tool_name(operation.tool)


def tool_words(tool: Tool, shape: str = "") -> str:
    """Return text on all that is known of a tool's shape, such as `end mill 3.175 mm, 2 flutes,
    cuts 12 mm`. `shape`: its name in TOOL_SHAPES, if that is not the tool's own kind."""
    words = [f"{TOOL_SHAPES[shape or tool.kind]} {tool.diameter_mm:g} mm"]
    if not tool.diameter_mm:
        words = [TOOL_SHAPES[tool.kind] if tool.kind != "flat" else "point"]
    if tool.tip_angle_rad is not None:
        words.append(f"{math.degrees(tool.tip_angle_rad):g}°")
    if tool.tip_diameter_mm:
        words.append(f"tip {tool.tip_diameter_mm:g} mm")
    if tool.corner_radius_mm:
        words.append(f"corner {tool.corner_radius_mm:g} mm")
    if tool.flutes:
        words.append(f"{tool.flutes} flute{'s' if tool.flutes > 1 else ''}")
    if tool.cutting_length_mm:
        words.append(f"cuts {tool.cutting_length_mm:g} mm")
    if tool.stickout_mm:
        words.append(f"sticks out {tool.stickout_mm:g} mm")
    return ", ".join(words)


def key_of(operation: Operation, key: str) -> str:
    """Return text that names a setting of an operation: its key in the job, or in the preset of
    its tool."""
    preset_words = (
        f" of the tool's preset for {operation.material!r}" if key in operation.preset else ""
    )
    return f"{operation_name(operation)}, key {key}{preset_words}"


def operation_name(operation: Operation) -> str:
    """Return an operation's name, or its kind if it has none."""
    return f"operation {operation.name or operation.kind!r}"


def range_words(limits: tuple[float, float] | None) -> str:
    """Return a range as text: `0.02 to 0.06`, `at most 0.06` or `at least 0.02`."""
    min_value, max_value = limits or (0.0, math.inf)
    if math.isinf(max_value):
        return f"at least {min_value:g}"
    return f"{min_value:g} to {max_value:g}" if min_value else f"at most {max_value:g}"


def own_numbers(machine: Machine, settings: Sequence[str]) -> str:
    """Return text on how to give these numbers of the user's own machine, which may differ from
    the target's."""
    keys = " ".join(f"--set {each}" for each in settings)
    name, dialect = machine.target.name, machine.target.dialect
    its_file = (
        f"make its own file with camtool init NAME -t {dialect} and use it with --machine NAME"
    )
    if name != dialect:
        its_file = f"give them in the machine file of {name}, or in one that extends it"
    return f"if your machine can do more, use {keys}, or {its_file}"


def shortened_list(findings: Sequence[Finding], sentence: Sentence) -> list[Finding]:
    """Return the first `MAX_LISTED` of findings of one kind, and one more that counts the
    others."""
    listed, unlisted = list(findings[:MAX_LISTED]), findings[MAX_LISTED:]
    if unlisted:
        listed.append(
            sentence(
                where=unlisted[0].where, measured=len(unlisted), severity=unlisted[0].severity
            )
        )
    return listed


def setup_name(job: Job) -> str:
    """Return the name of the set-up that this job is, "" for a job that is no set-up."""
    return "" if job.setup_of is None else job.setup_of[1].name


def setup_heading(job: Job) -> tuple[str, ...]:
    """Return lines of text: which set-up of a part this is, which face is up, and how the part is
    turned to it from the face that is drawn; () for a job that is no set-up."""
    if job.setup_of is None:
        return ()
    setup = job.setup_of[1]
    if setup.flip is None:
        return f"set-up {setup.name}", "the face that is drawn is up"
    ((axis, place),) = flip_lines_of(job)
    how = "X{:g} so that left and right" if axis == "y" else "Y{:g} so that front and back"
    return (
        f"set-up {setup.name}",
        "the other face is up",
        f"turned over about {how.format(place)} change places",
    )


def setup_words(job: Job) -> str:
    """Return the heading of a set-up with its pins and the error between the faces as text; "" for
    a job that is no set-up."""
    if job.setup_of is None:
        return ""
    setup, words = job.setup_of[1], list(setup_heading(job))
    words[0] = setup.name
    if pins := pins_of(job):
        words.append("pins at " + ", ".join(f"X{x:g} Y{y:g}" for x, y in pins))
    if setup.flip is not None:
        length = flip_error_words(setup)
        words.append(f"its cuts lie {length} beside those of the other face (flip_error)")
    return "; ".join(words)


def flip_error_words(*setups: JobSetup) -> str:
    """Return text on how far the cuts of these set-ups may lie beside each other."""
    errors = [setup.flip_error_mm for setup in setups if setup.flip is not None]
    lengths = [error for error in errors if error is not None]
    return f"up to {max(lengths):g} mm" if lengths and lengths == errors else "an unknown length"


def pins_of(job: Job) -> tuple[tuple[float, float], ...]:
    """Return the places (x, y), mm, of all alignment pins of a part, in the frame of the job's
    set-up or of the face that is drawn."""
    places = dict.fromkeys(pin for setup in job.whole.setups for pin in setup.pins_mm)
    return tuple(map(job.placement.turn.point, places))


def flip_lines_of(job: Job) -> tuple[tuple[str, float], ...]:
    """Return (axis "x" or "y", position in mm) of the lines about which the part is turned over,
    to this set-up or from it to others, in its frame."""
    if job.setup_of is None:
        return ()
    whole_job, own = job.setup_of
    lines: dict[tuple[str, float], None] = {}
    for setup in whole_job.setups if own.flip is None else (own,):
        place = whole_job.flip_line_mm(setup)
        if setup.flip is not None and place is not None:
            across = 0 if setup.flip == "y" else 1
            lines[setup.flip, job.placement.turn.point((place, place))[across]] = None
    return tuple(lines)
