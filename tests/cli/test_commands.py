"""The commands on the samples, as a new user types them."""

import json
import struct
from pathlib import Path

import pytest

from tests.cli.conftest import Run

REPORT_KEYS = {
    "target",
    "source",
    "moves",
    "blocks",
    "bytes",
    "extents_mm",
    "time_s",
    "steps",
    "reversals",
    "error_um",
    "closure_um",
    "dimensions",
    "circles",
    "findings",
}


def test_holes_as_wide_as_the_tool_are_plunges(camtool: Run, samples: Path) -> None:
    done = camtool("post", samples / "plate.dxf", "-t", "grbl", "--tool-diameter", "3")
    assert done.returncode == 0, done.stderr.decode()
    assert b"7.069 mm" not in done.stderr


def test_the_main_job(camtool_process: Run, samples: Path, tmp_path: Path) -> None:
    logo = samples / "logo.dxf"
    posted = camtool_process(
        "post",
        logo,
        "--target",
        "pic-mmh",
        "-o",
        "a.pic",
        "--preview",
        "a.png",
        "--json",
        "a.json",
    )
    assert posted.returncode == 0, posted.stderr.decode()
    assert posted.stdout == b""
    program = (tmp_path / "a.pic").read_bytes()
    assert program.startswith(b"G54;\nG90;\n")
    assert program.endswith(b"M30;\n")
    assert (tmp_path / "a.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"

    verified = camtool_process(
        "verify", "a.pic", "--target", "pic-mmh", "--against", logo, "--json", "-"
    )
    assert verified.returncode == 0, verified.stderr.decode()
    report = json.loads(verified.stdout)
    assert set(report) >= REPORT_KEYS
    step_um = 0.14
    interpolation = report["error_um"]["interpolation"]
    assert interpolation["arcs_steps"] <= 0.5
    assert interpolation["lines_steps"] < 1.0
    assert interpolation["max"] < step_um
    assert not [item for item in report["findings"] if item["severity"] == "error"]


def test_output_is_the_same_every_time(camtool: Run, samples: Path, tmp_path: Path) -> None:
    for name in ("a", "b"):
        done = camtool(
            "post", samples / "logo.dxf", "-t", "pic-mmh", "-o", f"{name}.pic",
            "--preview", f"{name}.svg", "--json", f"{name}.json", "-q",
        )  # fmt: skip
        assert done.returncode == 0
        assert done.stderr == b""
    for kind in ("pic", "svg", "json"):
        assert (tmp_path / f"a.{kind}").read_bytes() == (tmp_path / f"b.{kind}").read_bytes()


def test_stdout_carries_the_program_and_nothing_else(camtool: Run, samples: Path) -> None:
    posted = camtool(
        "post", samples / "star.csv", "-t", "pic-mmh", "-o", "-", "--origin", "centre"
    )
    # The router's star is 8 × 9 cm: far too large for this table.
    assert posted.returncode == 1
    assert posted.stdout == b""
    posted = camtool("post", samples / "coupon.dxf", "-t", "pic-mmh", "-o", "-")
    assert posted.returncode == 0, posted.stderr.decode()
    assert posted.stdout.startswith(b"G54;\n")
    again = camtool("verify", "-", "-t", "pic-mmh", "--json", "-", stdin=posted.stdout)
    assert again.returncode == 0
    assert json.loads(again.stdout)["blocks"] == posted.stdout.count(b";")


@pytest.mark.parametrize("side", ["auto", "on", "inside", "outside"])
def test_a_tool_with_a_diameter(camtool: Run, samples: Path, side: str, tmp_path: Path) -> None:
    flags = ["-t", "pic-mmh", "--tool-diameter", "0.1mm", "--side", side]
    posted = camtool("post", samples / "logo.dxf", *flags, "-o", "a.pic")
    assert posted.returncode == 0, posted.stderr.decode()
    judged = camtool("verify", "a.pic", *flags, "--against", samples / "logo.dxf", "--json", "-")
    assert judged.returncode == 0, judged.stderr.decode()


def test_the_wrong_drawing_is_noticed(camtool: Run, samples: Path) -> None:
    camtool("post", samples / "coupon.dxf", "-t", "pic-mmh", "-o", "a.pic")
    judged = camtool("verify", "a.pic", "-t", "pic-mmh", "--against", samples / "logo.dxf")
    assert judged.returncode == 1
    assert b"CONTOUR_MISSING" in judged.stderr


@pytest.mark.parametrize("interpolator", ["dsm", "dda", "stairs"])
def test_interpolators_compare(camtool: Run, samples: Path, interpolator: str) -> None:
    camtool("post", samples / "logo.dxf", "-t", "pic-mmh", "-o", "a.pic")
    # As far as the circle goes: by other readings arcs of another method run on to their ends.
    flags = ["-t", "pic-mmh", "--set", "controller.arc_end=equal"]
    judged = camtool("verify", "a.pic", *flags, "--interpolator", interpolator, "--json", "-")
    report = json.loads(judged.stdout)
    largest = report["error_um"]["interpolation"]["arcs_steps"]
    assert largest < {"dsm": 0.51, "dda": 1.5, "stairs": 1.01}[interpolator]


def test_pictures(camtool: Run, samples: Path, tmp_path: Path) -> None:
    camtool("post", samples / "logo.svg", "-t", "pic-mmh", "-o", "a.pic")
    for source, flags in [
        (samples / "logo.dxf", []),
        (samples / "star.csv", []),
        (samples / "logo.svg", ["-t", "pic-mmh"]),
        ("a.pic", ["-t", "pic-mmh"]),
        ("a.pic", ["-t", "pic-mmh", "--simulate"]),
    ]:
        for name in ("p.svg", "p.png"):
            done = camtool("preview", source, "-o", name, *flags)
            assert done.returncode == 0, done.stderr.decode()
        width, height = struct.unpack(">II", (tmp_path / "p.png").read_bytes()[16:24])
        assert width >= 400
        assert height >= 100


def test_targets(camtool: Run) -> None:
    listed = camtool("targets")
    assert listed.returncode == 0
    assert b"pic-mmh" in listed.stdout
    shown = camtool("targets", "pic-mmh", "--json", "--set", "axes.x.backlash_mm=0.5")
    assert json.loads(shown.stdout)["axes"]["x"]["backlash_mm"] == 0.5
    plain = camtool("targets", "pic-mmh")
    assert b"axes.x.travel_mm = 10.0" in plain.stdout


def test_check(camtool: Run, samples: Path) -> None:
    plain = camtool("check", samples / "logo.dxf")
    assert plain.returncode == 0
    assert b"units     mm" in plain.stdout
    facts = json.loads(camtool("check", samples / "logo.dxf", "--json", "-").stdout)
    assert set(facts["layers"]) == {"CUT", "ENGRAVE"}
    assert facts["smallest_radius_mm"] <= 0.15
    svg = json.loads(camtool("check", samples / "logo.svg", "--json", "-").stdout)
    assert svg["size_mm"] == pytest.approx(facts["size_mm"], abs=1e-3)


def test_a_job_file_says_what_the_flags_say(camtool: Run, samples: Path, tmp_path: Path) -> None:
    (tmp_path / "job.toml").write_text('depth = "50um"\nlayers = ["CUT"]\nfeed = 1.0\n')
    flags = ["--depth", "0.05", "--layer", "CUT", "--feed", "1mm/min"]
    common = [samples / "logo.dxf", "-t", "pic-mmh", "-q"]
    assert camtool("post", *common, "-o", "a.pic", "--job", "job.toml").returncode == 0
    assert camtool("post", *common, "-o", "b.pic", *flags).returncode == 0
    assert (tmp_path / "a.pic").read_bytes() == (tmp_path / "b.pic").read_bytes()
    camtool("post", *common, "-o", "c.pic", "--job", "job.toml", "--feed", "0.5")
    assert b"F05" in (tmp_path / "c.pic").read_bytes()


def test_annex_form(camtool: Run, samples: Path, tmp_path: Path) -> None:
    flags = ["-t", "pic-mmh", "--set", "dialect.form=annex"]
    posted = camtool("post", samples / "logo.dxf", *flags, "-o", "a.pic")
    assert posted.returncode == 0, posted.stderr.decode()
    assert b"BLOCK_TOO_LONG" not in posted.stderr
    blocks = (tmp_path / "a.pic").read_bytes().split(b"\n")
    assert max(len(block) for block in blocks) == 35
    judged = camtool("verify", "a.pic", *flags, "--against", samples / "logo.dxf")
    assert judged.returncode == 0, judged.stderr.decode()
