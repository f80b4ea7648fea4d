"""DXF drawings, ASCII and binary, of any version that ezdxf knows: what a space of them shows.

    bytes → load (dxf_tags, dxf_load) → walk of model space or a layout (dxf_walk) → assemble

What cannot be used is counted with a reason: layers that are off or frozen, kinds without lines,
entities that lack what they need.
"""

from __future__ import annotations

from collections import Counter
from typing import Any

from camtool.errors import DrawingError
from camtool.findings import Code, Finding, Severity
from camtool.geometry.drawing import Drawing, Skipped
from camtool.importers.assemble import assemble
from camtool.importers.dxf.load import load, quiet, without_collector
from camtool.importers.dxf.units import units_of
from camtool.importers.dxf.walk import Walk
from camtool.importers.options import ReadOptions
from camtool.importers.told import font_findings

REPAIRS_NAMED = 3
"""So many repairs are told in full."""


def read(data: bytes, file: str, options: ReadOptions) -> Drawing:
    """The Drawing in model space or in `options.layout`; DrawingError naming layer and entity
    when it cannot be read."""
    with without_collector():
        loaded = load(data, file)
        units, findings = units_of(loaded.header, options)
        walk = Walk(loaded.document, file, options)
        with quiet():
            walk.space(_space(loaded.document, options.layout, file), units.mm_per_unit)
    return assemble(
        walk.pieces,
        marks=walk.marks,
        file=file,
        units=units,
        used=dict(walk.used),
        skipped=[Skipped(kind, count, why) for (kind, why), count in walk.skipped.items()],
        findings=[
            *_repaired(loaded.repairs),
            *findings,
            *_not_applied(walk.lacking),
            *font_findings(walk.fonts),
        ],
        options=options,
    )


def _space(document: Any, layout: str | None, file: str) -> Any:
    """Model space, or the layout of this name in any case."""
    if layout is None:
        return document.modelspace()
    named = {str(space.name).casefold(): space for space in document.layouts}
    if layout.casefold() not in named:
        known = ", ".join(str(space.name) for space in document.layouts)
        raise DrawingError(f"has no layout {layout!r}", file=file, mend=f"use one of {known}")
    return named[layout.casefold()]


def _repaired(repairs: tuple[str, ...]) -> list[Finding]:
    """One finding for all repairs, the first few in full."""
    if not repairs:
        return []
    more = len(repairs) - REPAIRS_NAMED
    text = "; ".join(" ".join(message.split()) for message in repairs[:REPAIRS_NAMED])
    tail = f"; and {more} more" if more > 0 else ""
    return [
        Finding(
            Code.FILE_REPAIRED,
            Severity.WARNING,
            f"the file is faulty and was repaired ({len(repairs)}): {text}{tail}",
            measured=float(len(repairs)),
        )
    ]


def _not_applied(lacking: Counter[tuple[str, str]]) -> list[Finding]:
    """What the paths of some entities leave out."""
    return [
        Finding(
            Code.NOT_APPLIED,
            Severity.WARNING,
            f"{count} {kind}: {what} is not applied",
            measured=float(count),
        )
        for (kind, what), count in lacking.items()
    ]
