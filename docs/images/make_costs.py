"""Draws what judging costs, and prints its numbers:  python docs/images/make_costs.py

A spiral of straight cuts is judged on each target, in processor time: so many cuts of growing
length, and a growing number of cuts of one length. All is measured in one run, and drawn as the
ratio to the first of each row, so that other computers draw nearly the same picture
(docs/images/costs.svg); nothing compares it.
"""

from __future__ import annotations

import math
import resource
from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np

from camtool.simulation.motion import Options
from camtool.target.registry import load_target
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Toolpath
from camtool.verification.case import Case, VerifyOptions
from camtool.verification.verify import verify

ROOT = Path(__file__).parents[2]
LENGTHS_MM = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
COUNTS = (200, 400, 800, 1600, 3200)
CUTS, LENGTH_MM = 400, 8.0
"""Fixed in the left picture, and in the right one."""

TARGETS = {
    "grbl": "#1f77b4",
    "linuxcnc": "#2ca02c",
    "valcnc": "#9467bd",
    "i8751": "#8c564b",
    "flashcut": "#ff7f0e",
    "pic-mmh": "#d62728",
    "matlab-router": "#7f7f7f",
}
LOW, HIGH_RATIO, STEP = 0.5, 32.0, 2.0
"""The axis of ratios."""

ROUNDS = 3
"""The least of so many measurements counts; between two of one point are all others."""

WIDE, HIGH, LEFT, TOP, APART = 330.0, 300.0, 60.0, 40.0, 90.0


def cuts(count: int, length_mm: float) -> Toolpath:
    """Cut so many lines of one length, each in another direction."""
    rng = np.random.default_rng(1)
    b = ToolpathBuilder().rapid(z=0.2).line(z=-0.02, feed=60.0)
    x, y, angle = 0.0, 0.0, 0.0
    for number in range(count):
        # A spiral of chords, a little uneven: cuts of one length that cross few others.
        angle += math.asin(min(length_mm / (2.0 * length_mm * (1.0 + 0.05 * number)), 1.0)) * 2.0
        angle += rng.uniform(-1e-3, 1e-3)
        x, y = x + length_mm * math.cos(angle), y + length_mm * math.sin(angle)
        b.line(round(x, 3), round(y, 3), feed=60.0)
    return b.rapid(z=0.2).finish()


def case_of(target: str, count: int, length_mm: float) -> Case:
    """Return what is judged."""
    sample = ROOT / "samples" / "i8751-sample.toml"
    loaded = load_target(target, machine_file=sample if target == "i8751" else None)
    return Case(cuts(count, length_mm), loaded, None, None, VerifyOptions(shape=False), Options())


def seconds(case: Case) -> float:
    """Return the processor time of a judgement, s."""
    begun = resource.getrusage(resource.RUSAGE_SELF)
    verify(case)
    ended = resource.getrusage(resource.RUSAGE_SELF)
    return ended.ru_utime + ended.ru_stime - begun.ru_utime - begun.ru_stime


def measured(sizes: list[tuple[int, float]]) -> dict[str, list[float]]:
    """Return the least processor time (s) of each target for cuts of these numbers and lengths."""
    cases = {name: [case_of(name, *size) for size in sizes] for name in TARGETS}
    rounds = [{n: [seconds(c) for c in row] for n, row in cases.items()} for _ in range(ROUNDS)]
    return {name: [min(t) for t in zip(*(r[name] for r in rounds), strict=True)] for name in cases}


def place(value: float, low: float, high: float, size: float) -> float:
    """Return a value's place on a logarithmic axis of this size."""
    return size * math.log(value / low) / math.log(high / low)


def panel(left: float, title: str, steps: tuple[float, ...], rows: dict[str, list[float]]) -> str:
    """Draw one picture: ratios to the first time of each row against lengths or numbers, and
    dashed what is proportional to these."""
    parts = [f'<text x="{left}" y="24" font-size="13">{escape(title)}</text>']

    def height(ratio: float) -> float:
        return TOP + HIGH - place(max(ratio, LOW), LOW, HIGH_RATIO, HIGH)

    ratio = LOW
    while ratio <= HIGH_RATIO:
        y = height(ratio)
        parts.append(f'<path d="M{left} {y:.1f}h{WIDE}" stroke="#ccc"/>')
        parts.append(f'<text x="{left - 6}" y="{y + 4:.1f}" text-anchor="end">{ratio:g}</text>')
        ratio *= STEP
    for step in steps:
        x = left + place(step, steps[0], steps[-1], WIDE)
        parts.append(f'<path d="M{x:.1f} {TOP}v{HIGH}" stroke="#eee"/>')
        parts.append(
            f'<text x="{x:.1f}" y="{TOP + HIGH + 16}" text-anchor="middle">{step:g}</text>'
        )
    top = height(steps[-1] / steps[0])
    parts.append(
        f'<path d="M{left} {height(1.0):.1f}L{left + WIDE} {top:.1f}" stroke="#000" '
        'stroke-dasharray="4 4"/>'
    )
    for name, times in rows.items():
        points = " ".join(
            f"{left + place(step, steps[0], steps[-1], WIDE):.1f},{height(time / times[0]):.1f}"
            for step, time in zip(steps, times, strict=True)
        )
        line = f'points="{points}" fill="none" stroke="{TARGETS[name]}" stroke-width="2"'
        parts.append(f"<polyline {line}/>")
    return "\n".join(parts)


def legend() -> str:
    """Name the colours."""
    x, parts = LEFT, []
    for name, colour in TARGETS.items():
        y = TOP + HIGH + 40
        parts.append(f'<path d="M{x:.0f} {y - 4}h18" stroke="{colour}" stroke-width="3"/>')
        parts.append(f'<text x="{x + 23:.0f}" y="{y}">{name}</text>')
        x += 40 + 7 * len(name)
    return "\n".join(parts)


def main() -> None:
    """Measure, print and draw."""
    every = measured([(CUTS, one) for one in LENGTHS_MM] + [(one, LENGTH_MM) for one in COUNTS])
    by_length = {name: times[: len(LENGTHS_MM)] for name, times in every.items()}
    by_count = {name: times[len(LENGTHS_MM) :] for name, times in every.items()}
    for title, steps, rows in (("mm", LENGTHS_MM, by_length), ("cuts", COUNTS, by_count)):
        print("|", " | ".join(["", *(f"{step:g} {title}" for step in steps)]), "|")
        for name, times in rows.items():
            print("|", " | ".join([name, *(f"{time:.3f}" for time in times)]), "|")
    right = LEFT + WIDE + APART
    text = "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{right + WIDE + 30:g}" '
            f'height="{TOP + HIGH + 60:g}" font-family="sans-serif" font-size="11">',
            '<rect width="100%" height="100%" fill="white"/>',
            panel(
                LEFT,
                f"{CUTS} cuts: time against their length (mm)",
                LENGTHS_MM,
                by_length,
            ),
            panel(
                right,
                f"cuts of {LENGTH_MM:g} mm: time against their number",
                COUNTS,
                by_count,
            ),
            legend(),
            "</svg>\n",
        ]
    )
    (ROOT / "docs" / "images" / "costs.svg").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
