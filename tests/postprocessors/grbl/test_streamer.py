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
import os, sys, threading, time
from grbl_streamer import GrblStreamer

port, program = sys.argv[1:]
events = {name: threading.Event() for name in ("on_boot", "on_job_completed", "on_error")}

def callback(name, *data):
    if name in events:
        events[name].set()
    if name in ("on_error", "on_alarm", "on_log"):
        print(name, *data, flush=True)

grbl = GrblStreamer(callback)
grbl.cnect(port, 115200)
if not events["on_boot"].wait(60):
    os._exit(3)  # its threads would keep it alive
time.sleep(3.0)  # opening the port resets it, and so does the streamer
grbl.poll_start()
grbl.incremental_streaming = True  # its other mode takes lines from two threads without a lock
grbl.load_file(program)
events["on_job_completed"].clear()  # of the empty job before
grbl.job_run()
if not events["on_job_completed"].wait(120):
    print(grbl._rx_buffer_fill, grbl.current_line_number, flush=True)
    os._exit(4)
print("settings", len(grbl.settings), "buffer", grbl.buffer_size, flush=True)
os._exit(0)
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


def test_it_streams_the_logo_to_the_end(tmp_path: Path) -> None:
    program = tmp_path / "logo.nc"
    program.write_bytes(logo("grbl"))
    twin: Any = load_target("grbl").twin([])
    with hosted(twin, 40.0) as port:
        done = subprocess.run(
            [PYTHON, "-c", STREAM, port, str(program)],
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
