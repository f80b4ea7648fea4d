#!/usr/bin/python3
"""The display of a LinuxCNC without a screen: runs programs, and samples where the joints go.

The programs are those that CNC_PROGRAMS names (absolute, with blanks between). Each begins at
X0 Y0 Z0 in G64 P0.01, as the machine file of the linuxcnc target has it. Beside each PROGRAM then
stands PROGRAM.samples: lines "index x y z velocity", one for each servo period. Debian's own
Python has the module `linuxcnc`.
"""

import os
import subprocess
import time
from pathlib import Path

import linuxcnc

RESET = ("G10 L2 P1 X0 Y0 Z0 R0", "G54 G92.1 G49")
"""What a program may have left in the machine's parameters."""

command, status = linuxcnc.command(), linuxcnc.stat()


def wait(done, seconds):
    end = time.time() + seconds
    while time.time() < end:
        try:
            status.poll()
        except linuxcnc.error:
            time.sleep(0.05)
            continue
        if done():
            return True
        time.sleep(0.02)
    return False


def idle():
    return status.interp_state == linuxcnc.INTERP_IDLE and status.inpos


def mode(number):
    command.mode(number)
    command.wait_complete()


time.sleep(1)
for state in (linuxcnc.STATE_ESTOP_RESET, linuxcnc.STATE_ON):
    command.state(state)
    command.wait_complete()
mode(linuxcnc.MODE_MANUAL)
command.home(-1)
wait(lambda: all(status.homed[:3]), 20)
for program in os.environ["CNC_PROGRAMS"].split():
    with Path(program + ".samples").open("w", encoding="ascii") as out:
        sampler = subprocess.Popen(["halsampler", "-t"], stdout=out)
        time.sleep(0.3)
        mode(linuxcnc.MODE_MDI)
        for block in ("G21 G17 G90 G94", *RESET, "G64 P0.01", "G0 X0 Y0 Z0"):
            command.mdi(block)
            command.wait_complete(30)
        wait(idle, 60)
        time.sleep(0.2)
        mode(linuxcnc.MODE_AUTO)
        command.program_open(program)
        command.wait_complete()
        command.auto(linuxcnc.AUTO_RUN, 0)
        time.sleep(0.3)
        done = wait(idle, 600)
        time.sleep(0.5)
        sampler.terminate()
        sampler.wait()
    print(program, "done" if done else "NOT DONE", flush=True)
