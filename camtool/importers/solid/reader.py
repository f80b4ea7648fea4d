"""Solid models: STEP and BREP files through OpenCASCADE, and build123d scripts.

A model becomes a drawing in one of two ways:

    as it comes           the outlines of the highest level face of each solid
    options.section_z_mm  the section of all solids by the plane at that height

A sketch gives the outlines of all its faces, a bare wire gives itself. Lines and circular arcs
stay exact; ellipses, splines and all other curves are fitted within the tolerance.

OpenCASCADE brings the interpreter down over some damaged files, and prints what it likes: it
works in a process of its own (`worker`). A script is a program with all the rights of its
user: it is run only when the caller allows it."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path, PurePath
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import asdict

from camtool.errors import DrawingError
from camtool.findings import Finding
from camtool.geometry.drawing import Drawing, Skipped
from camtool.geometry.polylines import POSITION_EPS_MM
from camtool.importers.assemble import Found, assemble, unit_or_mm
from camtool.importers.findings import (
    FILE_REPAIRED_BODIES,
    FILE_REPAIRED_IN_PART,
    SECTION_CHOSEN,
    SECTION_CHOSEN_FACES,
)
from camtool.importers.formats import is_brep, is_step, text_head
from camtool.importers.options import ReadOptions
from camtool.importers.pieces import Piece

_AGAIN = "export it again as STEP (AP214 or AP242)"
_STEP_END = b"END-ISO-10303-21"
_NO_SCRIPT = (".step", ".stp", ".brep", ".brp")


def read(data: bytes, file: str, options: ReadOptions) -> Drawing:
    """Read a solid model and return its section, or its outline, as a Drawing. DrawingError when
    it cannot be read, or when the plane of the section does not meet it."""
    kind, unit = _kind(data, file, options)
    scale = unit.scale(options, file)
    height = None if options.section_z_mm is None else options.section_z_mm / scale
    request = {
        "kind": kind,
        "file": file,
        "height": height,
        "tolerance": max(options.tolerance_mm / scale, POSITION_EPS_MM),
    }
    content = found_in(run_worker(data, request, file), unit.why, scale, options)
    return assemble(file=file, options=options, **asdict(content))


def found_in(answer: dict[str, Any], why: str, scale: float, options: ReadOptions) -> Found:
    """Return the pieces in the worker's answer, in mm: `scale` is mm for each mm of the answer;
    `why` says where the unit comes from."""
    height = None if options.section_z_mm is None else options.section_z_mm / scale
    return Found(
        _pieces(answer["outlines"], scale),
        unit_or_mm(options, why),
        used=dict(Counter(outline["kind"] for outline in answer["outlines"])),
        skipped=[Skipped("body", count, reason) for reason, count in answer["missed"].items()],
        findings=[*_faults(answer), *_section_finding(answer, scale, height)],
    )


def _kind(data: bytes, file: str, options: ReadOptions) -> tuple[str, FileUnit]:
    """Return "step", "brep" or "script" by the content, and the unit of the file.

    DrawingError for a file that is cut off or unknown, or a script that is not allowed."""
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
    """Return a piece for each path of the outlines, in mm."""
    pieces: list[Piece] = []
    for number, outline in enumerate(outlines, start=1):
        for wire, path in enumerate(outline["paths"], start=1):
            vertices = np.array(path["vertices"], dtype=np.float64).reshape(-1, 3)
            vertices[:, :2] *= scale
            source = f"{outline['kind']} {number} wire {wire}"
            errors = scale * np.array(path["off"], dtype=np.float64).reshape(-1, 2)
            look = outline["layer"], outline["colour"]
            pieces.append(Piece(vertices, path["closed"], *look, source, off_mm=errors))
    return pieces


def _faults(answer: dict[str, Any]) -> list[Finding]:
    """Return findings FILE_REPAIRED if OpenCASCADE complained, or if faces and edges of a body do
    not fit together."""
    findings: list[Finding] = []
    if answer["faulty"]:
        findings.append(FILE_REPAIRED_BODIES(measured=answer["faulty"], bodies=answer["bodies"]))
    if answer["complaint"]:
        findings.append(FILE_REPAIRED_IN_PART(complaint=answer["complaint"]))
    return findings


def _section_finding(answer: dict[str, Any], scale: float, height: float | None) -> list[Finding]:
    """Return the finding SECTION_CHOSEN: the height at which faces or a section were taken, and
    the lowest and highest z of the model."""
    if not answer["levels"]:
        return []
    low, high = scale * min(answer["levels"]), scale * max(answer["levels"])
    bottom, top = (scale * z for z in answer["span"])
    heights = f"{low:.6g}" if high - low <= POSITION_EPS_MM else f"{low:.6g} to {high:.6g}"
    sentence = SECTION_CHOSEN_FACES if height is None else SECTION_CHOSEN
    return [sentence(measured=high, heights=heights, bottom=bottom, top=top)]


# Start `worker` in a process of its own, and read its answer.

FILE_SECONDS = 60.0
"""Time limit for a STEP or BREP file, to which SECONDS_PER_MB is added for its size: damaged ones
can keep OpenCASCADE busy for ever. Scripts have no limit."""

SECONDS_PER_MB = 5.0
"""See FILE_SECONDS; a sound file takes about one second for a megabyte."""

CHATTER_BYTES = 1 << 16
"""Number of bytes of OpenCASCADE's output that are searched for complaints."""

# -P: no module is imported from the working directory.
START = (
    "import json, sys; request = json.load(open(sys.argv[1], encoding='utf-8'));"
    "sys.path[:] = request['path'];"
    "from camtool.importers.solid.worker import main; main(request)"
)
_STDERR = 2
_COLOURS = re.compile(r"\x1b\[[\d;]*m")


def run_worker(data: bytes, request_items: dict[str, Any], file: str) -> dict[str, Any]:
    """Run the worker on these bytes; return its answer with a `complaint` of the reader, or "".

    DrawingError when the model is damaged; RuntimeError for a fault of camtool itself."""
    script = request_items["kind"] == "script"
    with tempfile.TemporaryDirectory() as folder:
        source, answer, chatter = (Path(folder, name) for name in ("source", "answer", "chatter"))
        source.write_bytes(data)
        request = request_items | {"source": str(source), "answer": str(answer), "path": sys.path}
        request_file = Path(folder, "request")
        request_file.write_text(json.dumps(request), encoding="utf-8")
        with chatter.open("wb") as words:
            seconds = None if script else FILE_SECONDS + SECONDS_PER_MB * len(data) / 1e6
            code = _run(request_file, _STDERR if script else words.fileno(), seconds, file)
        result = _answer(answer, code, script, file)
        with chatter.open("rb") as words:
            output = words.read(CHATTER_BYTES).decode("utf-8", errors="replace")
    if "error" in result:
        error = result["error"]
        raise DrawingError(error["message"], file=file, where=error["where"], mend=error["mend"])
    if "fault" in result:
        raise RuntimeError(result["fault"])
    return result | {"complaint": _complaint(output)}


def _run(request: Path, output: int, seconds: float | None, file: str) -> int:
    """Run the worker, which writes its messages to the file descriptor `output`; return its exit
    code.

    DrawingError if it takes more than `seconds`."""
    try:
        process = subprocess.run(
            [sys.executable, "-P", "-c", START, str(request)],
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=output,
            timeout=seconds,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise DrawingError(
            f"is not read after {error.timeout:.0f} s: it is damaged, or too much for OpenCASCADE",
            file=file,
            mend="simplify the model, or export it again",
        ) from error
    return process.returncode


def _answer(answer: Path, code: int, script: bool, file: str) -> dict[str, Any]:
    """Read the answer of the worker; DrawingError without one, since then a damaged file has
    killed it."""
    if answer.exists():
        result: dict[str, Any] = json.loads(answer.read_text(encoding="utf-8"))
        return result
    if script:
        raise DrawingError(f"the script ended the interpreter (code {code})", file=file)
    raise DrawingError(
        "is damaged so badly that OpenCASCADE fails on it",
        file=file,
        mend="export it again as STEP (AP214 or AP242)",
    )


def _complaint(output: str) -> str:
    """Return the first line in which OpenCASCADE reports an error, without its decoration; else
    ""."""
    for line in _COLOURS.sub("", output).splitlines():
        if "ERR" in line or "FAIL" in line.upper():
            return "".join(sign for sign in line if sign.isprintable()).strip(" *")
    return ""


# The unit of length of a solid model, and how `--units` replaces it.

_CONTEXT = re.compile(rb"GLOBAL_UNIT_ASSIGNED_CONTEXT\s*\(\s*\(([#\d,\s]*)\)")
_ENTITY = re.compile(rb"#(\d+)\s*=\s*(\([^;]*LENGTH_UNIT[^;]*);")
_NAMED = re.compile(rb"CONVERSION_BASED_UNIT\s*\(\s*'([^']*)'")
_SI = re.compile(rb"SI_UNIT\s*\(\s*(?:\.(\w+)\.|\$)\s*,\s*\.METRE\.")

_MM = {
    "millimetre": 1.0,
    "centimetre": 10.0,
    "metre": 1000.0,
    "micrometre": 0.001,
    "inch": 25.4,
    "foot": 304.8,
}
_PREFIXES = {b"": "metre", b"MILLI": "millimetre", b"CENTI": "centimetre", b"MICRO": "micrometre"}
_SPELLINGS = {"inches": "inch", "in": "inch", "feet": "foot", "ft": "foot"}


class FileUnit(Struct, frozen=True):
    """The unit of a file: `mm` for each of its units, which its reader has applied already (None:
    unknown), and the reason `why`."""

    why: str
    mm: float | None = 1.0

    def scale(self, options: ReadOptions, file: str) -> float:
        """Return the factor for lengths that replaces the file's unit by the one that the caller
        asks for; 1 if none is asked for."""
        if options.units is None:
            return 1.0
        if self.mm is None:
            raise DrawingError(
                "has no single unit that --units could replace", file=file, mend="leave it out"
            )
        return options.mm_per(options.units) / self.mm


def unnamed_unit() -> FileUnit:
    """Return mm as the unit of a BREP file, since such files name none."""
    return FileUnit("BREP names no unit; its makers count in mm")


def script_unit() -> FileUnit:
    """Return mm as the unit of a script, since build123d counts in mm."""
    return FileUnit("build123d counts in mm")


def step_unit(data: bytes) -> FileUnit:
    """Return the unit of length that all parts of a STEP file name; its reader has converted it to
    mm. It is unknown (None) if they differ."""
    entities = {match[1]: match[2] for match in _ENTITY.finditer(data)}
    names = {
        _name(entities[number])
        for context in _CONTEXT.finditer(data)
        for number in re.findall(rb"#(\d+)", context[1])
        if number in entities
    }
    name = names.pop() if len(names) == 1 else ""
    if name not in _MM:
        return FileUnit("named in the file, turned into mm by its reader", None)
    return FileUnit(f"the file counts in {name}, turned into mm by its reader", _MM[name])


def _name(entity: bytes) -> str:
    named = _NAMED.search(entity)
    if named is not None:
        name = named[1].decode("ascii", errors="replace").strip().lower()
        return _SPELLINGS.get(name, name)
    si = _SI.search(entity)
    return "" if si is None else _PREFIXES.get(si[1] or b"", "")
