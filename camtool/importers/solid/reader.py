"""Solid models: STEP and BREP files through OpenCASCADE, and build123d scripts.

A model becomes a drawing in one of two ways:

    as it comes           the outlines of the highest level face of each solid
    options.section_z_mm  the section of all solids by the plane at that height

A sketch gives the outlines of all its faces, a bare wire gives itself. Lines and circular arcs
stay exact; ellipses, splines and all other curves are fitted within the tolerance.

OpenCASCADE brings the interpreter down over some damaged files, and prints what it likes: it
works in a process of its own (`worker`). A script is a program with all the rights of its
user: it is run only when the caller allows it.
"""

from __future__ import annotations

from collections import Counter
from pathlib import PurePath
from typing import Any

import numpy as np

from camtool.errors import DrawingError
from camtool.findings import Code, Finding, Severity
from camtool.geometry.drawing import Drawing, Skipped, Units
from camtool.geometry.polylines import POSITION_EPS_MM
from camtool.importers.assemble import Piece, assemble
from camtool.importers.options import ReadOptions
from camtool.importers.read_format import is_brep, is_step, text_head
from camtool.importers.solid.process import outlined
from camtool.importers.solid.units import FileUnit, script_unit, step_unit, unnamed_unit

_AGAIN = "export it again as STEP (AP214 or AP242)"
_STEP_END = b"END-ISO-10303-21"
_NO_SCRIPT = (".step", ".stp", ".brep", ".brp")


def read(data: bytes, file: str, options: ReadOptions) -> Drawing:
    """The Drawing of a solid model; DrawingError when it cannot be read, or is not cut."""
    kind, unit = _kind(data, file, options)
    scale = unit.scale(options, file)
    height = None if options.section_z_mm is None else options.section_z_mm / scale
    wanted = {
        "kind": kind,
        "file": file,
        "height": height,
        "tolerance": max(options.tolerance_mm / scale, POSITION_EPS_MM),
    }
    found = outlined(data, wanted, file)
    units = (
        Units("mm", 1.0, unit.why)
        if options.units is None
        else Units(options.units.lower(), options.mm_per(options.units), "as asked")
    )
    return assemble(
        _pieces(found["outlines"], scale),
        file=file,
        units=units,
        used=dict(Counter(outline["kind"] for outline in found["outlines"])),
        skipped=[Skipped("body", count, why) for why, count in found["missed"].items()],
        findings=[*_faults(found), *_chosen(found, scale, height)],
        options=options,
    )


def _kind(data: bytes, file: str, options: ReadOptions) -> tuple[str, FileUnit]:
    """ "step", "brep" or "script" by the content, and its unit."""
    head = text_head(data)
    if is_step(head):
        if _STEP_END not in data:
            raise DrawingError("is cut off: its end is missing", file=file, mend=_AGAIN)
        return "step", step_unit(data)
    if is_brep(head):
        return "brep", unnamed_unit()
    binary = "\x00" in head or "\ufffd" in head
    if binary or PurePath(file).suffix.lower() in _NO_SCRIPT:
        raise DrawingError("is neither STEP nor BREP", file=file, mend=_AGAIN)
    if not options.allow_scripts:
        raise DrawingError(
            "is a script: a program that runs with all your rights",
            file=file,
            mend="read it, and if you trust it give --allow-scripts",
        )
    return "script", script_unit()


def _pieces(outlines: list[dict[str, Any]], scale: float) -> list[Piece]:
    """A piece for each wire, in mm."""
    pieces: list[Piece] = []
    for number, outline in enumerate(outlines, start=1):
        for wire, path in enumerate(outline["paths"], start=1):
            vertices = np.array(path["vertices"], dtype=np.float64).reshape(-1, 3)
            vertices[:, :2] *= scale
            source = f"{outline['kind']} {number} wire {wire}"
            off = scale * np.array(path["off"], dtype=np.float64).reshape(-1, 2)
            look = outline["layer"], outline["colour"]
            pieces.append(Piece(vertices, path["closed"], *look, source, off_mm=off))
    return pieces


def _faults(found: dict[str, Any]) -> list[Finding]:
    """FILE_REPAIRED when the reader complained or a body does not hold together."""
    findings: list[Finding] = []
    if found["faulty"]:
        findings.append(
            Finding(
                Code.FILE_REPAIRED,
                Severity.WARNING,
                f"{found['faulty']} of {found['bodies']} bodies have faces or edges that do not "
                "fit together",
                measured=float(found["faulty"]),
            )
        )
    if found["complaint"]:
        findings.append(
            Finding(
                Code.FILE_REPAIRED,
                Severity.WARNING,
                f"the file is damaged, something may be missing: {found['complaint']}",
            )
        )
    return findings


def _chosen(found: dict[str, Any], scale: float, height: float | None) -> list[Finding]:
    """SECTION_CHOSEN: what was taken, at which height, and how high the model is."""
    if not found["levels"]:
        return []
    low, high = scale * min(found["levels"]), scale * max(found["levels"])
    bottom, top = (scale * z for z in found["span"])
    place = f"z = {low:.6g}" if high - low <= POSITION_EPS_MM else f"z = {low:.6g} to {high:.6g}"
    what = "the section" if height is not None else "the highest level face of each solid"
    return [
        Finding(
            Code.SECTION_CHOSEN,
            Severity.INFO,
            f"{what} at {place} mm is drawn; the model spans z = {bottom:.6g} to {top:.6g} mm; "
            "--section-z chooses another height",
            measured=high,
            unit="mm",
        )
    ]
