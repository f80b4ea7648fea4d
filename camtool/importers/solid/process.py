"""Runs `worker` in a process of its own and takes over what it found."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from camtool.errors import DrawingError

FILE_SECONDS = 60.0
"""A STEP or BREP file may take so long, and SECONDS_PER_MB more for its size: damaged ones can
keep OpenCASCADE busy for ever. Scripts may take their time."""

SECONDS_PER_MB = 5.0
"""See FILE_SECONDS; a sound file takes about one second for a megabyte."""

CHATTER_BYTES = 1 << 16
"""So much of what OpenCASCADE prints is looked through for complaints."""

# -P: nothing that lies in the working directory is taken for a module.
_START = (
    "import json, sys; request = json.load(open(sys.argv[1], encoding='utf-8'));"
    "sys.path[:] = request['path'];"
    "from camtool.importers.solid.worker import main; main(request)"
)
_STDERR = 2
_COLOURS = re.compile(r"\x1b\[[\d;]*m")


def outlined(data: bytes, wanted: dict[str, Any], file: str) -> dict[str, Any]:
    """What `worker.found` gives for these bytes, and a `complaint` of the reader or "".

    DrawingError when the model is damaged; RuntimeError for a fault of camtool itself.
    """
    script = wanted["kind"] == "script"
    with tempfile.TemporaryDirectory() as folder:
        source, answer, chatter = (Path(folder, name) for name in ("source", "answer", "chatter"))
        source.write_bytes(data)
        request = wanted | {"source": str(source), "answer": str(answer), "path": sys.path}
        asked = Path(folder, "request")
        asked.write_text(json.dumps(request), encoding="utf-8")
        with chatter.open("wb") as words:
            seconds = None if script else FILE_SECONDS + SECONDS_PER_MB * len(data) / 1e6
            code = _run(asked, _STDERR if script else words.fileno(), seconds, file)
        result = _answer(answer, code, script, file)
        with chatter.open("rb") as words:
            said = words.read(CHATTER_BYTES).decode("utf-8", errors="replace")
    if "error" in result:
        error = result["error"]
        raise DrawingError(error["message"], file=file, where=error["where"], mend=error["mend"])
    if "fault" in result:
        raise RuntimeError(result["fault"])
    return result | {"complaint": _complaint(said)}


def _run(request: Path, output: int, seconds: float | None, file: str) -> int:
    """The exit code of the worker, whose words go to this file descriptor."""
    try:
        done = subprocess.run(
            [sys.executable, "-P", "-c", _START, str(request)],
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
    return done.returncode


def _answer(answer: Path, code: int, script: bool, file: str) -> dict[str, Any]:
    """What the worker wrote; a worker that died without a word met a damaged file."""
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


def _complaint(said: str) -> str:
    """The first line in which OpenCASCADE speaks of an error, without its ornaments; else ""."""
    for line in _COLOURS.sub("", said).splitlines():
        if "ERR" in line or "FAIL" in line.upper():
            return "".join(sign for sign in line if sign.isprintable()).strip(" *")
    return ""
