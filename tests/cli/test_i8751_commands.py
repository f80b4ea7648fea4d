"""The i8751 target by its commands, with the sample machine."""

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
