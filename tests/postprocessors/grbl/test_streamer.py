"""A sender that is not ours streams a program into the virtual grbl: `grbl-streamer` of the
package registry, in an environment of its own, whose Python GRBL_STREAMER_PYTHON names."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path
from typing import Any

import pytest

from camtool.target.registry import load_target
from tests.feeding import logo, motion
from tests.sending.test_ends import at_rest, hosted

PYTHON = os.environ.get("GRBL_STREAMER_PYTHON", "")

STREAM = """
import sys, threading
from grbl_streamer import GrblStreamer

port, program, incremental = sys.argv[1:]
events = {name: threading.Event() for name in ("on_boot", "on_job_completed", "on_error")}

def callback(name, *data):
    if name in events:
        events[name].set()
    if name in ("on_error", "on_alarm", "on_log"):
        print(name, *data, flush=True)

grbl = GrblStreamer(callback)
grbl.cnect(port, 115200)
assert events["on_boot"].wait(30), "it does not boot"
grbl.poll_start()
grbl.incremental_streaming = incremental == "yes"
grbl.load_file(program)
events["on_job_completed"].clear()  # of the empty job before
grbl.job_run()
assert events["on_job_completed"].wait(240), "it does not end"
print("settings", len(grbl.settings), "buffer", grbl.buffer_size, flush=True)
grbl.poll_stop()
grbl.disconnect()
"""

pytestmark = [
    pytest.mark.slow,
    pytest.mark.referee,
    pytest.mark.skipif(
        not PYTHON,
        reason="grbl-streamer is not here: python -m venv V; V/bin/pip install grbl-streamer; "
        "GRBL_STREAMER_PYTHON=V/bin/python",
    ),
]


@pytest.mark.parametrize("incremental", ["no", "yes"], ids=["counting", "line by line"])
def test_it_streams_the_logo_to_the_end(incremental: str, tmp_path: Path) -> None:
    program = tmp_path / "logo.nc"
    program.write_bytes(logo("grbl"))
    twin: Any = load_target("grbl").twin([])
    with hosted(twin, 40.0) as port:
        done = subprocess.run(
            [PYTHON, "-c", STREAM, port, str(program), incremental],
            capture_output=True,
            text=True,
            check=False,
            timeout=300,
        )
        at_rest(twin)
    assert done.returncode == 0, done.stderr + done.stdout
    assert "on_error" not in done.stdout
    loaded = load_target("grbl")
    sent = b"\n".join(twin.decoded) + b"\n"
    wanted = motion(program.read_bytes(), loaded).commanded
    trace = twin.slides.trace.commanded
    assert len(trace) == len(wanted), (len(twin.decoded), sent[:200])
    assert (trace == wanted).all()
