"""`camtool verify --against` of programs that others made."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

SAMPLES = Path(__file__).parents[2] / "samples"
ELSEWHERE = SAMPLES / "mount-elsewhere.nc"
MOUNT = ("--against", SAMPLES / "mount.dxf")


def test_the_place_is_asked_for_and_found(camtool: Any) -> None:
    plain = camtool("verify", ELSEWHERE, "-t", "grbl", *MOUNT)
    assert plain.returncode == 1
    assert b"--align" in plain.stderr
    done = camtool("verify", ELSEWHERE, "-t", "grbl", *MOUNT, "--align", "--json", "-")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)["found"]
    assert (found["outside"], found["inside"], found["not_cut"]) == (1, 5, 1)
    assert abs(found["tools"][0]["diameter_mm"] - 3.0) < 0.01
    assert max(abs(each - 5.0) for each in found["shift_mm"]) < 0.005


def test_the_place_may_be_given(camtool: Any) -> None:
    done = camtool("verify", ELSEWHERE, "-t", "grbl", *MOUNT, "--origin=-5,-5", "--json", "-")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["found"]["shift_mm"] == [0.0, 0.0]


def test_a_limit_is_an_error(camtool: Any) -> None:
    line = ("verify", ELSEWHERE, "-t", "grbl", *MOUNT, "--align")
    assert camtool(*line, "--max-error", "50um").returncode == 0
    assert camtool(*line, "--max-error", "5um").returncode == 1


def test_own_programs_and_flags_of_the_job_are_compared_with_the_job(
    camtool: Any, tmp_path: Path
) -> None:
    job = ("--tool-diameter", "3mm", "--side", "auto")
    mine = tmp_path / "mine.nc"
    assert camtool("post", MOUNT[1], "-t", "grbl", *job, "-o", mine).returncode == 0
    done = camtool("verify", mine, "-t", "grbl", *MOUNT, "--json", "-")
    assert done.returncode == 1  # no flags: on the lines
    assert json.loads(done.stdout)["found"] is None
    done = camtool("verify", mine, "-t", "grbl", *MOUNT, *job, "--json", "-")
    assert json.loads(done.stdout)["found"] is None
    done = camtool("verify", mine, "-t", "grbl", *MOUNT, "--align", "--json", "-")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["found"]["outside"] == 1
    done = camtool("verify", ELSEWHERE, "-t", "grbl", *MOUNT, "--side", "outside", "--json", "-")
    assert json.loads(done.stdout)["found"] is None


def test_programs_of_any_target_are_aligned_when_asked(camtool: Any, tmp_path: Path) -> None:
    """A dialect without comments: its programs are taken for camtool's own."""
    mine = tmp_path / "mine.pic"
    logo = SAMPLES / "logo.dxf"
    assert camtool("post", logo, "-t", "pic-mmh", "--origin=1,1", "-o", mine).returncode == 0
    done = camtool("verify", mine, "-t", "pic-mmh", "--against", logo, "--align", "--json", "-")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)["found"]
    assert max(abs(each + 1.0) for each in found["shift_mm"]) < 0.002
    assert found["not_cut"] == 0


def test_flags_that_contradict_align_are_refused(camtool: Any) -> None:
    line = ("verify", ELSEWHERE, "-t", "grbl")
    for more, word in (
        (("--align",), "--against"),
        ((*MOUNT, "--align", "--side", "inside"), "--side"),
        ((*MOUNT, "--align", "--origin", "1,1"), "--origin"),
        ((*MOUNT, "--align", "--compare", "mechanics"), "--compare"),
    ):
        done = camtool(*line, *more)
        assert done.returncode == 2
        assert word.encode() in done.stderr
