"""`camtool jog` and `home` as processes, where the machine's place or its reset must be said."""

from __future__ import annotations

import subprocess
from typing import Any

import pytest

from camtool.target.registry import load_target
from tests.commands import run_camtool
from tests.sending.test_any_order import SETTINGS
from tests.sending.test_ends import hosted

I8751 = (*SETTINGS["i8751"], "link.homing=start")


def camtool(*words: str, settings: tuple[str, ...] = ()) -> subprocess.CompletedProcess[str]:
    flags = [word for setting in settings for word in ("--set", setting)]
    return run_camtool(*words, *flags)


def test_valcnc_jogs_from_a_place_and_says_the_next_one() -> None:
    twin: Any = load_target("valcnc").twin([])
    with hosted(twin, 1.0) as port:
        at = ("-t", "valcnc", "--port", port)
        refused = camtool("jog", "X2", *at)
        assert refused.returncode == 2
        assert "does not say where it stands" in refused.stderr
        assert not twin.decoded
        first = camtool("jog", "X2", "Z0.5", *at, "--at", "X0,Y0,Z0")
        assert first.returncode == 0, first.stderr
        place = first.stderr.partition("it stands at ")[2].split(" ")[0]
        again = camtool("jog", "Y-1", *at, "--at", place)
        assert again.returncode == 0, again.stderr
        step = max(axis.coded_step_mm for axis in load_target("valcnc").machine.axes)
        assert twin.slides.commanded_mm == pytest.approx([2.0, -1.0, 0.5], abs=1.01 * step)


@pytest.mark.parametrize("text", ["X0,Y0", "here", "X0,Y0,Z0,F5", "X0,X1,Y0,Z0"])
def test_a_place_that_is_none_is_refused(text: str) -> None:
    done = camtool("jog", "X1", "-t", "valcnc", "--port", "/dev/null", "--at", text)
    assert done.returncode == 2
    assert "X0,Y0,Z5" in done.stderr or "axis" in done.stderr


def test_other_machines_need_no_place() -> None:
    done = camtool("jog", "X1", "-t", "grbl", "--port", "/dev/null", "--at", "X0,Y0,Z0")
    assert done.returncode == 2
    assert "needs no place" in done.stderr


def test_i8751_homes_only_when_somebody_says_that_it_was_reset() -> None:
    target = load_target("i8751", settings=I8751)
    twin: Any = target.twin(["homing=start", "origin_mm=-0.25"])
    with hosted(twin, 1.0) as port:
        at = ("-t", "i8751", "--port", port)
        asked = camtool("home", *at, settings=I8751)
        assert asked.returncode == 2
        assert "has it just been reset" in asked.stderr
        assert "--yes" in asked.stderr
        done = camtool("home", *at, "--yes", settings=I8751)
        assert done.returncode == 0, done.stderr
        assert not twin.is_moving
        assert twin.slides.commanded_mm == pytest.approx([-0.25] * 3, abs=0.0125)
