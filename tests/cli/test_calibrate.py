"""`camtool calibrate`: from measurements to a machine file that predicts what was measured."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from tests.cli.conftest import Run


def test_the_table_and_the_file(camtool: Run, samples: Path, tmp_path: Path) -> None:
    lines = samples / "measured" / "pic-mmh-lines.toml"
    done = camtool("calibrate", lines, "-t", "pic-mmh", "-o", "my-mmh.toml")
    assert done.returncode == 0, done.stderr
    text = done.stdout.decode()
    assert re.search(r"play of x in H2 +0.1925 +0.201 +0.0034 +mm +1\n", text)
    assert "not estimated: squareness: no reading depends on it" in text
    assert "compensation of x that takes up this play: 0.1924 mm, 1374 steps" in text
    assert b"written: my-mmh.toml" in done.stderr
    shown = camtool("targets", "pic-mmh", "--machine", "my-mmh.toml", "--json")
    axes = json.loads(shown.stdout)["axes"]
    assert axes["x"]["backlash_mm"] == pytest.approx(0.19267, abs=1e-5)


def test_the_target_is_the_files_own_when_nobody_says_another(camtool: Run, samples: Path) -> None:
    steps = samples / "measured" / "valcnc-steps.toml"
    done = camtool("calibrate", steps)
    assert done.returncode == 0, done.stderr
    assert re.search(rb"step of z +0.0403 +0.0403304 +9e-06 +mm +10", done.stdout)
    assert camtool("calibrate", steps, "-t", "grbl").returncode == 2


def test_json_has_everything(camtool: Run, samples: Path) -> None:
    circles = samples / "measured" / "pic-mmh-circles.toml"
    done = camtool("calibrate", circles, "--json", "-")
    report = json.loads(done.stdout)
    assert report["target"] == "pic-mmh"
    assert [each["what"] for each in report["estimates"]].count("play") == 2
    assert len(report["readings"]) == 24
    assert report["readings"][0]["source"] == "a, Tabla 15, L2528-2594"
    assert report["freedom"] == 19
    assert report["instrument_um"] is None


def test_a_program_verified_with_the_new_file_has_the_measured_error(
    camtool: Run, samples: Path, tmp_path: Path
) -> None:
    """ValCNC as its makers coded it: 8 mm come out as 8.076. The calibrated file knows."""
    plain = tmp_path / "as-coded.toml"
    plain.write_text(
        'extends = "valcnc"\n[axes.x]\nreal_step_mm = 0.04\n[axes.y]\nreal_step_mm = 0.04\n'
    )
    (tmp_path / "line.csv").write_text("0,0\n80,0\n")
    steps = samples / "measured" / "valcnc-steps.toml"
    made = camtool("calibrate", steps, "--machine", plain, "-o", "mine.toml", "-q")
    assert made.returncode == 0, made.stderr
    assert made.stdout == b""
    errors = {}
    for name in ("as-coded.toml", "mine.toml"):
        done = camtool(
            "post", "line.csv", "--units", "mm", "--kind", "engrave", "--machine", name,
            "--json", "r.json", "-o", "p.ngc",
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        report = json.loads((tmp_path / "r.json").read_text())
        errors[name] = report["error_um"]["total"]["max"]
    assert errors["as-coded.toml"] < 40.0
    # 80 mm by Tabla 16: 80.76 were read, the fitted line says 80.7535.
    assert errors["mine.toml"] == pytest.approx(753.5, abs=25.0)


def test_an_outlier_is_told(camtool: Run, samples: Path, tmp_path: Path) -> None:
    text = (samples / "measured" / "valcnc-steps.toml").read_text()
    (tmp_path / "m.toml").write_text(text.replace("40.36", "40.96"))
    done = camtool("calibrate", "m.toml")
    assert done.returncode == 0
    assert b"warning: outlier: steps 2, forward at 40 mm" in done.stderr
    assert done.stdout.count(b"outlier") == 1


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("none.toml",), b"cannot be read"),
        (("m.toml", "-t", "gbrl"), b"did you mean grbl"),
        (("m.toml", "-t", "grbl", "-o", "m.toml"), b"is the input itself"),
        (("m.toml",), b"--target is missing"),
        (("m.toml", "-t", "grbl"), b"m.toml: [[lines]] 1, key first_mm: 20.5 is 10.2 times"),
    ],
)
def test_wrong_use_says_what_to_do(
    camtool: Run, tmp_path: Path, arguments: tuple[str, ...], words: bytes
) -> None:
    good = b"key first_mm" not in words
    text = '[[lines]]\naxis = "x"\nnominal_mm = 2.0\nfirst_mm = 20.5\n'
    (tmp_path / "m.toml").write_text(text.replace("20.5", "2.05") if good else text)
    done = camtool("calibrate", *arguments)
    assert done.returncode == 2
    assert words in done.stderr, done.stderr
    assert [each.name for each in tmp_path.iterdir()] == ["m.toml"]
