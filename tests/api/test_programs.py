"""Programs converted, compared, and machines calibrated from Python, as the commands do it."""

import json
import re
from pathlib import Path

import pytest
from click.testing import CliRunner

import camtool
from camtool.cli.main import cli
from camtool.comparison import Comparison
from camtool.records import replace
from camtool.run import Run

CIRCLE = b"G00X00000.00Y00004.20;G02X00000.00Y00004.20I00000.00J00000.00F08;M30;"
SAMPLES = Path("samples")


@pytest.fixture(scope="module")
def converted() -> Run:
    return camtool.convert(CIRCLE, "pic-mmh", "grbl")


@pytest.fixture(scope="module")
def compared() -> Comparison:
    return camtool.compare(CIRCLE, "pic-mmh", "interpolators")


def ran(*arguments: str | Path) -> str:
    """Run the command and return its stdout."""
    done = CliRunner().invoke(
        cli, [*map(str, arguments)], standalone_mode=False, catch_exceptions=False
    )
    return done.stdout


def test_convert_gives_what_the_command_writes(converted: Run, tmp_path: Path) -> None:
    (tmp_path / "circle.pic").write_bytes(CIRCLE)
    output = tmp_path / "circle.nc"
    ran("convert", tmp_path / "circle.pic", "--from", "pic-mmh", "--to", "grbl", "-o", output)
    assert converted.data == output.read_bytes()
    assert converted.verification is not None
    assert "µm at most" in str(converted)


def test_what_is_converted_prints_and_shows_itself(converted: Run) -> None:
    assert repr(converted).startswith("<Run of <bytes> on grbl: ")
    assert converted._repr_svg_() == camtool.preview(converted).svg
    assert b"<html" in camtool.preview(converted).render("circle.html")
    broken = replace(converted, program=None)
    with pytest.raises(camtool.CamtoolError, match=r"<bytes>.*must not be run"):
        _ = broken.data


def test_convert_from_a_file_with_a_feed_and_no_verdict(tmp_path: Path) -> None:
    file = tmp_path / "circle.pic"
    file.write_bytes(CIRCLE)
    slow = camtool.convert(file, "pic-mmh", "grbl", feed_mm_min=5.0, check=False)
    assert b"F5" in slow.data
    assert slow.verification is None
    assert slow.source == str(file)
    with pytest.raises(camtool.CamtoolError, match=r"circle\.pic: block 1"):
        camtool.convert(file, "valcnc", "grbl")


def test_compare_gives_what_the_command_prints(compared: Comparison, tmp_path: Path) -> None:
    (tmp_path / "circle.pic").write_bytes(CIRCLE)
    arguments = ("verify", tmp_path / "circle.pic", "-t", "pic-mmh", "--compare")
    assert f"{compared}\n" == ran(*arguments, "interpolators")
    play = camtool.compare(CIRCLE, "pic-mmh", "backlash=0,0.001")
    assert f"{play}\n" == ran(*arguments, "backlash=0,0.001")
    assert len({row.total_max_um for row in play.rows}) == 2
    shares = camtool.compare(CIRCLE, "pic-mmh", "mechanics")
    assert [row.name for row in shares.rows][:2] == ["as it is", "without play"]


def test_a_comparison_has_verdicts_and_a_picture(compared: Comparison) -> None:
    assert repr(compared) == "<Comparison of <bytes>: dsm, dda, stairs>"
    most = {name: each.report.error_um.total.max for name, each in compared.verdicts.items()}
    assert most == {row.name: row.total_max_um for row in compared.rows}
    assert compared._repr_svg_().startswith("<svg")
    picture = camtool.preview(compared, dark=True)
    assert picture.svg != compared._repr_svg_()
    assert picture.render("x.png").startswith(b"\x89PNG")
    with pytest.raises(camtool.CamtoolError, match=r"x\.html"):
        picture.render("x.html")


def test_targets_of_ones_own_are_compared() -> None:
    worn = camtool.load_target("pic-mmh", settings={"axes.x.backlash_mm": 0.4})
    found = camtool.compare(CIRCLE, worn, {"as built": "pic-mmh", "worn": worn})
    built, old = found.rows
    assert (built.name, old.name) == ("as built", "worn")
    assert built.total_max_um != old.total_max_um
    # Values are laid over the target that is given, not over the one that it extends.
    other = camtool.compare(CIRCLE, worn, "axes.y.backlash_mm=0.1685")
    assert other.rows[0].total_max_um == old.total_max_um


@pytest.mark.parametrize(
    ("ways", "words"),
    [
        ("nothing", "nothing to compare"),
        ("backlash=", "nothing to compare"),
        ("axes.x.backlsh_mm=1", "did you mean backlash_mm"),
        ("backlash=-1", "backlash_mm"),
    ],
)
def test_ways_that_are_none(ways: str, words: str) -> None:
    with pytest.raises(camtool.CamtoolError, match=words):
        camtool.compare(CIRCLE, "pic-mmh", ways)


def test_nothing_to_compare_and_no_machine_are_said(tmp_path: Path) -> None:
    with pytest.raises(camtool.CamtoolError, match="nothing to compare"):
        camtool.compare(CIRCLE, "pic-mmh", {})
    text = (SAMPLES / "measured" / "pic-mmh-lines.toml").read_text(encoding="utf-8")
    file = tmp_path / "lines.toml"
    file.write_text(re.sub(r"^target = .*$", "", text, flags=re.MULTILINE), encoding="utf-8")
    with pytest.raises(camtool.CamtoolError, match=r"lines\.toml: no machine is named"):
        camtool.calibrate(file)
    assert camtool.calibrate(file, "pic-mmh").target == "pic-mmh"


def test_values_stand_beside_each_other(compared: Comparison, tmp_path: Path) -> None:
    (tmp_path / "square.csv").write_text("0,0\n4,0\n4,4\n0,4\n0,0\n")
    drawing = camtool.read_drawing(tmp_path / "square.csv")
    plain = camtool.post(drawing, "pic-mmh")
    bent = camtool.post(drawing, "pic-mmh", compensate=True)
    both = camtool.preview(plain, bent, titles=("before", "after"), size_px=500)
    assert repr(both) == "<Picture of before and after>"
    assert "before, after" in both.svg
    assert both.svg == both._repr_svg_() == both.render("both.svg").decode()
    with pytest.raises(camtool.CamtoolError, match=r"both\.html"):
        both.render("both.html")
    assert "mine" in camtool.preview(drawing, titles=["mine"]).svg
    with pytest.raises(TypeError, match="2 titles for 1 values"):
        camtool.preview(drawing, titles=["mine", "yours"])
    with pytest.raises(TypeError, match="a Comparison stands beside no other picture"):
        camtool.preview(plain, compared)


def test_limits_and_parts_of_the_mechanics() -> None:
    judging = camtool.Judging(gates=camtool.Gates(error_mm=0.001), effects=camtool.Effects())
    kept = camtool.verify(CIRCLE, "pic-mmh", judging=judging)
    assert "ABOVE_GATE" in {finding.code.name for finding in kept.findings}
    ideal = camtool.Judging(effects=camtool.Effects(play=False, compensation=False))
    without = camtool.verify(CIRCLE, "pic-mmh", judging=ideal).report.error_um.total.max
    assert without is not None
    assert without < (kept.report.error_um.total.max or 0.0)


def test_calibrate_gives_what_the_command_writes(tmp_path: Path) -> None:
    file = SAMPLES / "measured" / "pic-mmh-lines.toml"
    found = camtool.calibrate(file)
    text = ran("calibrate", file, "-o", tmp_path / "my.toml", "--json", tmp_path / "my.json")
    assert f"{found}\n" == text
    assert found.machine_file == (tmp_path / "my.toml").read_text(encoding="utf-8")
    told = json.loads((tmp_path / "my.json").read_text(encoding="utf-8"))
    assert [each.value for each in found.estimates] == [row["value"] for row in told["estimates"]]
    assert repr(found).startswith(f"<Calibration of pic-mmh from {file}: step of x, ")
    assert repr(found).endswith(", play of x, play of y>")
    again = camtool.calibrate(file, machine=tmp_path / "my.toml")
    play = again.estimate("play", "x")
    assert play is not None
    assert play.before == pytest.approx(play.value, abs=1e-3)
    mine = camtool.load_target(machine=tmp_path / "my.toml").machine
    assert mine.target.name == "pic-mmh"
    assert mine.axes.x.backlash_mm == pytest.approx(play.value, abs=1e-3)
    with pytest.raises(TypeError, match="needs a name"):
        camtool.load_target()
    with pytest.raises(camtool.CamtoolError, match="was measured on pic-mmh"):
        camtool.calibrate(file, "grbl")
