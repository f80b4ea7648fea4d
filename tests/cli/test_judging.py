"""Limits, comparisons, and mechanics with parts left out, from the command line."""

import json
from pathlib import Path

import pytest

from tests.cli.conftest import Run

CIRCLE = "G00X00000.00Y00004.20;G02X00000.00Y00004.20I00000.00J00000.00F08;M30;"
"""A circle of 30 steps: the one whose iterations the thesis counts (Tabla 7)."""


@pytest.fixture
def circle(tmp_path: Path) -> str:
    (tmp_path / "circle.pic").write_text(CIRCLE)
    return "circle.pic"


def rows(camtool: Run, *arguments: str) -> list[dict[str, object]]:
    done = camtool("verify", *arguments, "-t", "pic-mmh", "--json", "-")
    assert done.returncode == 0, done.stderr
    found: list[dict[str, object]] = json.loads(done.stdout)
    return found


def test_interpolators_side_by_side(camtool: Run, circle: str) -> None:
    found = {row["name"]: row for row in rows(camtool, circle, "--compare", "interpolators")}
    assert list(found) == ["dsm", "dda", "stairs"]
    # Tabla 7, L1438-1458: those of the circle, without the way to it.
    counts = {name: row["iterations_cutting"] for name, row in found.items()}
    assert counts == {"dsm": 168, "dda": 188, "stairs": 240}
    assert found["dsm"]["interpolation_max_um"] <= 0.07  # type: ignore[operator]
    assert found["stairs"]["interpolation_max_um"] <= 0.14  # type: ignore[operator]


def test_the_report_counts_the_iterations_of_the_way_too(camtool: Run, circle: str) -> None:
    done = camtool("verify", circle, "-t", "pic-mmh", "--json", "-")
    steps = json.loads(done.stdout)["steps"]
    assert steps["iterations_cutting"] == 168
    assert steps["iterations"] - 168 in (30, 31)  # 30 steps and the line's idle pass


def test_play_side_by_side(camtool: Run, circle: str) -> None:
    none = ("--set", "axes.x.compensation_mm=0", "--set", "axes.y.compensation_mm=0")
    found = rows(camtool, circle, "--compare", "backlash=0,0.001,0.002", *none)
    assert [row["name"] for row in found] == ["backlash=0", "backlash=0.001", "backlash=0.002"]
    errors = [row["total_max_um"] for row in found]
    assert errors == sorted(errors)  # type: ignore[type-var]
    assert errors[0] < 0.1  # type: ignore[operator]
    assert errors[2] > 1.0  # type: ignore[operator]


def test_any_key_and_the_table(camtool: Run, circle: str) -> None:
    done = camtool(
        "verify", circle, "-t", "pic-mmh", "--compare", "limits.rapid_step_rate_hz=50,100"
    )
    assert done.returncode == 0
    head, first, second = done.stdout.decode().splitlines()
    assert head.split()[:4] == ["µm", "interp.", "mechanics", "total"]
    assert first.startswith("limits.rapid_step_rate_hz=50 ")
    assert second.startswith("limits.rapid_step_rate_hz=100 ")


def test_shares_of_the_mechanics(camtool: Run, circle: str) -> None:
    found = {row["name"]: row for row in rows(camtool, circle, "--compare", "mechanics")}
    assert {"as it is", "without play", "without compensation", "ideal"} <= set(found)
    assert found["ideal"]["mechanics_max_um"] == 0.0
    assert found["without compensation"]["time_s"] < found["as it is"]["time_s"]  # type: ignore[operator]


@pytest.mark.parametrize(
    ("setting", "share"),
    [
        ("axes.x.backlash_mm=0.19", "play"),
        ("play_map.use=true", "play"),
        ("axes.z.compensation_mm=0.1", "compensation"),
        ("axes.y.real_step_mm=0.000141", "scale"),
        ("mechanics.squareness_rad=0.001", "squareness"),
        ("axes.z.repeatability_mm=0.001", "repeatability"),
    ],
)
def test_only_what_the_machine_has_is_a_share(
    camtool: Run, circle: str, setting: str, share: str
) -> None:
    """Of a machine made ideal first."""
    nothing = [f"axes.{name}.{key}_mm=0" for name in "xy" for key in ("backlash", "compensation")]
    flags = [word for value in (*nothing, setting) for word in ("--set", value)]
    found = rows(camtool, circle, "--compare", "mechanics", *flags)
    assert [row["name"] for row in found] == ["as it is", f"without {share}", "ideal"]


@pytest.mark.parametrize(
    ("spec", "words"),
    [
        ("nothing", "interpolators, mechanics"),
        ("backlash=", "is nothing to compare"),
        ("axes.x.no_such=1,2", "unknown key"),
        ("backlash=0.1,wide", "axes.x"),
    ],
)
def test_what_cannot_be_compared(camtool: Run, circle: str, spec: str, words: str) -> None:
    done = camtool("verify", circle, "-t", "pic-mmh", "--compare", spec)
    assert done.returncode == 2
    assert words in done.stderr.decode()


def test_the_picture_of_a_comparison(camtool: Run, circle: str, tmp_path: Path) -> None:
    for name in ("a.svg", "b.svg"):
        done = camtool(
            "verify", circle, "-t", "pic-mmh", "--compare", "interpolators", "--preview", name
        )
        assert done.returncode == 0, done.stderr
    first = (tmp_path / "a.svg").read_text()
    assert first == (tmp_path / "b.svg").read_text()
    assert [f'id="run-{number}"' in first for number in (1, 2, 3, 4)] == [True] * 3 + [False]
    assert "stairs" in first


def test_without_a_part_of_the_mechanics(camtool: Run, circle: str) -> None:
    def error(*arguments: str) -> float:
        done = camtool("verify", circle, "-t", "pic-mmh", "--json", "-", *arguments)
        found: float = json.loads(done.stdout)["error_um"]["mechanics"]["max"]
        return found

    assert error("--without", "play", "--without", "compensation") == 0.0
    assert error("--without", "compensation") > 2.0
    done = camtool("verify", circle, "-t", "pic-mmh", "--without", "gravity")
    assert done.returncode == 2
    assert b"no part of the mechanics" in done.stderr


@pytest.mark.parametrize(
    ("limit", "held", "broken"),
    [
        ("--max-error", "1mm", "0.01um"),
        ("--max-reversals", "100", "1"),
        ("--max-time", "1h", "100ms"),
    ],
)
def test_limits(camtool: Run, circle: str, limit: str, held: str, broken: str) -> None:
    fine = camtool("verify", circle, "-t", "pic-mmh", limit, held)
    assert fine.returncode == 0, fine.stderr
    done = camtool("verify", circle, "-t", "pic-mmh", limit, broken, "--json", "r.json")
    assert done.returncode == 1
    assert f"ABOVE_GATE [{limit}]".encode() in done.stderr


def test_a_post_beyond_its_limits_writes_nothing(camtool: Run, tmp_path: Path) -> None:
    (tmp_path / "square.csv").write_text("0,0\n1,0\n1,1\n0,1\n0,0\n")
    common = ("post", "square.csv", "-t", "pic-mmh", "-o", "square.pic", "--units", "mm")
    done = camtool(*common, "--max-error", "0.1um")
    assert done.returncode == 1
    assert b"ABOVE_GATE [--max-error]" in done.stderr
    assert not (tmp_path / "square.pic").exists()
    assert camtool(*common, "--max-error", "1mm").returncode == 0
    assert camtool(*common, "--max-error", "1mm", "--no-verify").returncode == 2


def test_limits_and_comparisons_do_not_go_together(camtool: Run, circle: str) -> None:
    done = camtool(
        "verify", circle, "-t", "pic-mmh", "--compare", "interpolators", "--max-error", "1um"
    )
    assert done.returncode == 2
    assert b"drop --compare" in done.stderr


def test_a_limit_that_nothing_can_be_held_against(camtool: Run, tmp_path: Path) -> None:
    (tmp_path / "still.pic").write_text("G54;M30;")
    done = camtool("verify", "still.pic", "-t", "pic-mmh", "--max-error", "1um")
    assert done.returncode == 1
    assert b"no error is known" in done.stderr


def test_compensation_makes_the_part_better(camtool: Run, tmp_path: Path) -> None:
    (tmp_path / "square.csv").write_text("0,0\n1,0.2\n1.2,1.3\n0.1,1\n0,0\n")
    play = ("--set", "axes.x.backlash_mm=0.1", "--set", "axes.y.backlash_mm=0.06")
    post = ("post", "square.csv", "-t", "grbl", "--units", "mm", "-o", "square.nc", *play)
    done = camtool(*post, "--compensate", "--json", "r.json")
    assert done.returncode == 0, done.stderr
    report = json.loads((tmp_path / "r.json").read_text())
    assert report["before"]["total_max_um"] > 60.0
    assert report["error_um"]["total"]["max"] < 10.0
    # Judged on its own, it is held against the same.
    verify = (
        "verify",
        "square.nc",
        "-t",
        "grbl",
        "--against",
        "square.csv",
        "--units",
        "mm",
        *play,
    )
    again = camtool(*verify, "--compensate", "--json", "-")
    assert again.returncode == 0, again.stderr
    assert json.loads(again.stdout)["error_um"]["total"] == report["error_um"]["total"]
    assert camtool(*verify).returncode == 1  # taken as it stands, it cuts beside the drawing


def test_a_job_file_compensates_as_the_flag_does(camtool: Run, tmp_path: Path) -> None:
    (tmp_path / "square.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="2mm" height="2mm" viewBox="0 0 2 2">'
        '<path d="M0 0 1 0.2 1.2 1.3 0.1 1z"/></svg>'
    )
    (tmp_path / "bent.toml").write_text('kind = "engrave"\ncompensate = true\n')
    (tmp_path / "plain.toml").write_text('kind = "engrave"\ncompensate = false\n')
    play = ("--set", "axes.x.backlash_mm=0.1", "--set", "axes.y.backlash_mm=0.06")
    known = ("-t", "grbl", *play)

    def program(*flags: str) -> bytes:
        done = camtool("post", "square.svg", *known, *flags, "-o", "square.nc")
        assert done.returncode == 0, done.stderr
        return (tmp_path / "square.nc").read_bytes()

    by_flag, plain = program("--kind", "engrave", "--compensate"), program("--kind", "engrave")
    assert program("--job", "plain.toml") == plain
    assert program("--job", "plain.toml", "--compensate") == by_flag
    assert program("--job", "bent.toml") == by_flag != plain
    # The same file tells verify and stale what the program should be.
    judge = ("verify", "square.nc", "--against", "square.svg", *known)
    assert camtool(*judge, "--job", "bent.toml").returncode == 0
    assert camtool(*judge, "--job", "plain.toml").returncode == 1
    (tmp_path / "square.toml").write_text((tmp_path / "bent.toml").read_text())
    assert camtool("stale", "square.svg", *known).returncode == 0
    (tmp_path / "square.toml").write_text((tmp_path / "plain.toml").read_text())
    assert camtool("stale", "square.svg", *known).returncode == 1
    # And a picture of the toolpath is of what is written.
    shown = {}
    for name in ("bent", "plain"):
        done = camtool("preview", "square.svg", *known, "--job", f"{name}.toml", "-o", "a.svg")
        assert done.returncode == 0, done.stderr
        shown[name] = (tmp_path / "a.svg").read_bytes()
    assert shown["bent"] != shown["plain"]


@pytest.mark.parametrize("target", ["matlab-router", "pic-mmh", "grbl"])
def test_no_figure_depends_on_a_picture(
    camtool: Run, tmp_path: Path, samples: Path, target: str
) -> None:
    # The slides of the router curve where their program does not: few points of their path would
    # give another shape of the part.
    flags = ("-t", target, "--tool-diameter", "0.2mm", "--side", "auto", "-o", "a.out")
    reports = []
    for more in ((), ("--preview", "a.svg"), ("--report", "b.md")):
        args = ("post", str(samples / "logo.dxf"), *flags, "--json", "a.json", *more)
        done = camtool(*args)
        assert done.returncode == 0, done.stderr
        reports.append(json.loads((tmp_path / "a.json").read_text(encoding="utf-8")))
    assert reports[0]["shape"] is not None
    assert reports[0] == reports[1] == reports[2]


def test_engagement_is_limited_by_a_part_or_an_angle(camtool: Run, tmp_path: Path) -> None:
    """A slot engages the tool by half of its circle."""
    lines = ("G21 G90", "G0 Z5", "M3 S9000", "G1 Z-1 F100", "G1 X40 F600", "G0 Z5", "M5", "M2")
    (tmp_path / "part.nc").write_text("\n".join(lines) + "\n")
    flags = ["verify", "part.nc", "-t", "grbl", "--tool-diameter", "5", "--json", "part.json"]
    for limit, code in (("100%", 0), ("179deg", 1), ("0.5", 1)):
        assert camtool(*flags, "--max-engagement", limit).returncode == code
        (row,) = json.loads((tmp_path / "part.json").read_text())["engagement"]
        assert row["greatest_deg"] == pytest.approx(180.0)
    assert camtool(*flags).returncode == 0
    assert json.loads((tmp_path / "part.json").read_text())["engagement"] is None
