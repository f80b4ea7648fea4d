"""What the figures of post, verify and their like are of: the part, at its real size."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import ezdxf
import pytest

from tests.cli.conftest import Run

EXACT = ("--set", "dialect.path=exact-path")


@pytest.fixture
def wavy(tmp_path: Path) -> str:
    """A closed spline, some 4 mm wide."""
    document = ezdxf.new()
    document.header["$INSUNITS"] = 4
    points = [
        (radius * math.cos(0.7 * k), radius * math.sin(0.7 * k), 0.0)
        for k, radius in enumerate((2.0, 1.2, 1.9, 1.1, 2.1, 1.0, 1.8, 1.3, 2.0))
    ]
    document.modelspace().add_cad_spline_control_frame([*points, points[0]])
    document.saveas(tmp_path / "wavy.dxf")
    return "wavy.dxf"


def report(camtool: Run, *arguments: str) -> dict[str, Any]:
    done = camtool(*arguments, "-t", "linuxcnc", *EXACT, "--json", "-")
    assert done.returncode == 0, done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def fit_um(found: dict[str, Any]) -> float:
    return float(found["error_um"]["fit"]["max"])


@pytest.mark.parametrize("place", [("--scale", "40"), ("--scale", "0.05"), ("--fit", "150x150mm")])
def test_curves_are_fitted_for_the_part(camtool: Run, wavy: str, place: tuple[str, ...]) -> None:
    found = report(camtool, "post", wavy, *place, "--origin", "lower-left", "-o", "a.ngc")
    assert fit_um(found) <= 5.01
    assert found["error_um"]["total"]["max"] >= fit_um(found)
    # 5 µm of 4 mm are few arcs, and of 160 mm three or four times as many.
    again = report(camtool, "verify", "a.ngc", "--against", wavy, *place, "--origin", "lower-left")
    assert again["error_um"] == found["error_um"]
    assert again["against"] == "drawing"


def test_the_limit_is_of_the_whole_error(camtool: Run, wavy: str, tmp_path: Path) -> None:
    coarse = ("--tolerance", "0.2mm", "--max-error", "20um", *EXACT, "-t", "linuxcnc")
    done = camtool("post", wavy, *coarse, "-o", "a.ngc")
    assert done.returncode == 1
    assert b"ABOVE_GATE" in done.stderr
    assert not (tmp_path / "a.ngc").exists()
    done = camtool("post", wavy, "--tolerance", "0.2mm", *EXACT, "-t", "linuxcnc", "-o", "a.ngc")
    assert done.returncode == 0
    assert camtool("verify", "a.ngc", "--against", wavy, *coarse).returncode == 1
    # Of the program alone no more is known than how it is run; and it says so.
    alone = camtool("verify", "a.ngc", "--max-error", "20um", *EXACT, "-t", "linuxcnc")
    assert alone.returncode == 0
    assert b"no drawing is known" in alone.stdout


def test_a_unit_and_a_scale_that_undo_each_other_change_nothing(
    camtool: Run, wavy: str, tmp_path: Path
) -> None:
    plain = report(camtool, "post", wavy, "-o", "a.ngc")
    other = report(camtool, "post", wavy, "--units", "cm", "--scale", "0.1", "-o", "b.ngc")
    assert (tmp_path / "a.ngc").read_bytes() == (tmp_path / "b.ngc").read_bytes()
    assert other["dimensions"] == plain["dimensions"]
    assert fit_um(other) == pytest.approx(fit_um(plain), rel=1e-3)


def test_a_job_file_scales_too_in_a_batch_and_for_stale(
    camtool: Run, wavy: str, tmp_path: Path
) -> None:
    (tmp_path / "wavy.toml").write_text('[place]\nscale = 40\norigin = "lower-left"\n')
    flags = ("-t", "linuxcnc", *EXACT)
    done = camtool("batch", wavy, *flags, "--out", "made", "--reports", "--jobs", "1")
    assert done.returncode == 0, done.stderr
    found = json.loads((tmp_path / "made" / "wavy.json").read_text(encoding="utf-8"))
    assert 0.5 < fit_um(found) <= 5.01
    assert camtool("stale", wavy, *flags, "--programs", "made").returncode == 0
    assert camtool("job", "check", "wavy.toml", "--against", wavy).returncode == 0
