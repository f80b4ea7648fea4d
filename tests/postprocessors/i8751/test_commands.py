"""Programs of this machine by the commands `post` and `verify`, with the sample machine."""

from pathlib import Path

import pytest

from tests.cli.conftest import Run


@pytest.mark.parametrize("form", ["packets", "listing", "hex"])
def test_post_and_verify(form: str, camtool: Run, samples: Path) -> None:
    logo = samples / "logo.dxf"
    machine = ["-t", "i8751", "--machine", samples / "i8751-sample.toml"]
    machine += ["--set", f"dialect.format={form}"]
    done = camtool("post", logo, *machine, "-o", "logo.bin")
    assert done.returncode == 0, done.stderr
    done = camtool("verify", "logo.bin", *machine, "--against", logo)
    assert done.returncode == 0, done.stderr


def test_without_a_machine_file(camtool: Run, samples: Path) -> None:
    done = camtool("post", samples / "logo.dxf", "-t", "i8751")
    assert done.returncode == 2
    assert b"axes.x.coded_step_mm" in done.stderr
    assert b"--machine FILE" in done.stderr


def test_records_that_leave_their_lines_on_purpose_are_no_extra_cuts(
    camtool: Run, samples: Path, tmp_path: Path
) -> None:
    points = "\n".join(f"{20 * t / 9:.3f},{0.7 * t + 0.05 * t * t:.3f}" for t in range(10))
    (tmp_path / "slanted.csv").write_text(points + "\n")
    sample = ("-t", "i8751", "--machine", samples / "i8751-sample.toml")
    done = camtool("post", "slanted.csv", "--units", "mm", "-o", "a.bin", *sample)
    assert done.returncode == 0, done.stderr
    verify = ("verify", "a.bin", "--against", "slanted.csv", "--units", "mm", *sample)
    assert camtool(*verify).returncode == 0
    # What is not cut at all still shows.
    (tmp_path / "more.csv").write_text(points + "\n30,0.5\n")
    assert camtool(*verify[:3], "more.csv", *verify[4:]).returncode == 1
