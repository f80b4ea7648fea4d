"""Sides as a user meets them: windows on a layer of their own, by job, flags, batch and Python."""

import json
from pathlib import Path

import ezdxf
import pytest

import camtool as library
from tests.cli.conftest import Run

D = 3.175


def _drawn(path: Path) -> Path:
    """A plate of 120 by 80 mm, a window of 60 mm in it and two small ones, on layers."""
    document = ezdxf.new("R2010", setup=True)
    document.header["$INSUNITS"] = 4
    space = document.modelspace()
    for layer, colour, (x, y, w, h) in (
        ("OUTER", 7, (0, 0, 120, 80)),
        ("WINDOW", 1, (30, 10, 60, 60)),
        ("BORES", 3, (8, 33, 14, 14)),
        ("BORES", 3, (98, 33, 14, 14)),
        ("SHEET BORDER", 8, (-30, -30, 180, 140)),
    ):
        space.add_lwpolyline(
            [(x, y), (x + w, y), (x + w, y + h), (x, y + h)],
            close=True,
            dxfattribs={"layer": layer, "color": colour},
        )
    space.add_circle((60, 40), 40, dxfattribs={"layer": "AXES", "linetype": "CENTER"})
    space.add_text("PLATE", dxfattribs={"layer": "TEXT", "height": 5})
    space.add_linear_dim(
        base=(0, -9), p1=(0, 0), p2=(120, 0), dxfattribs={"layer": "DIM"}
    ).render()
    document.saveas(path)
    return path


@pytest.fixture
def plate(tmp_path: Path) -> Path:
    return _drawn(tmp_path / "win.dxf")


def _widths(program: bytes) -> dict[str, float]:
    """By layer: how wide in X the tool's path is, of a program that names its contours."""
    ends: dict[str, list[float]] = {}
    layer, x, down = "", 0.0, False
    for block in program.decode().splitlines():
        if block.startswith("("):
            layer = block[1:].split("/")[0]
            continue
        words = {word[0]: float(word[1:]) for word in block.split() if word[0] in "XZ"}
        down = words.get("Z", -1.0 if down else 1.0) < 0.0
        x = words.get("X", x)
        if down:
            ends.setdefault(layer, []).append(x)
    return {name: round(max(each) - min(each), 3) for name, each in ends.items()}


WANTED = {"OUTER": 120 + D, "WINDOW": 60 - D, "BORES": 104 - D}


def _job(text: str) -> str:
    """A new job with the tool that cuts the plate."""
    text = text.replace('diameter = "0mm"', f'diameter = "{D}mm"')
    return text.replace('# depth = "1mm"', 'depth = "1mm"').replace(
        'origin = "lower-left"', 'origin = "drawing"'
    )


def _without(text: str, *layers: str) -> str:
    head, *operations = text.split("[[operations]]")
    kept = [each for each in operations if not any(f'["{name}"]' in each for name in layers)]
    return "[[operations]]".join([head, *kept])


def test_a_new_job_cuts_a_right_part(camtool: Run, tmp_path: Path, plate: Path) -> None:
    whole = camtool("job", "new", plate, "-o", "-").stdout.decode()
    (tmp_path / "job.toml").write_text(_without(_job(whole), "AXES", "SHEET BORDER", "TEXT"))
    flags = ("-t", "linuxcnc", "--job", "job.toml")
    done = camtool("post", plate, *flags, "-o", "a.ngc")
    assert done.returncode == 0, done.stderr
    assert b"SIDE_BY_UNCUT" not in done.stderr
    widths = _widths((tmp_path / "a.ngc").read_bytes())
    assert widths == {name: pytest.approx(width, abs=2e-3) for name, width in WANTED.items()}
    done = camtool("verify", "a.ngc", "--against", plate, *flags)
    assert done.returncode == 0, done.stderr
    done = camtool("batch", plate, *flags, "--out", "made")
    assert done.returncode == 0, done.stderr
    (made,) = (tmp_path / "made").glob("*.ngc")
    assert _widths(made.read_bytes()) == widths
    text = camtool("job", "check", "job.toml", "--against", plate).stdout.decode()
    (outer,) = (
        line.split("/")[0].strip() for line in text.splitlines() if "1 on layer OUTER" in line
    )
    assert outer.startswith("1 on layer OUTER outside: nothing is around it except")
    assert "1 on layer WINDOW inside: within the part OUTER/LWPOLYLINE" in text
    assert "2 on layer BORES inside: within the part OUTER/LWPOLYLINE" in text
    facts = json.loads(
        camtool("job", "check", "job.toml", "--against", plate, "--json", "-").stdout
    )
    sides = {
        group["layer"]: (group["contours"], group["side"])
        for operation in facts["operations"]
        for group in operation["contours"]
    }
    assert sides == {"OUTER": (1, "outside"), "WINDOW": (1, "inside"), "BORES": (2, "inside")}
    job = library.read_job(tmp_path / "job.toml")
    made_too = library.post(plate, "linuxcnc", job, check=False)
    assert made_too.program is not None
    assert _widths(made_too.program.data) == widths


@pytest.mark.parametrize(
    ("flags", "layers"),
    [
        (("--layer", "WINDOW"), ("WINDOW",)),
        (("--colour", "red"), ("WINDOW",)),
        (("--exclude-layer", "OUTER", "--exclude-layer", "SHEET*", "--exclude-layer", "AXES"),
         ("WINDOW", "BORES")),
        (("--layer", "OUTER"), ("OUTER",)),
        (("--line-type", "CONTINUOUS", "--exclude-layer", "SHEET*"), ("OUTER", "WINDOW", "BORES")),
    ],
)  # fmt: skip
def test_flags_change_no_side(
    camtool: Run, plate: Path, flags: tuple[str, ...], layers: tuple[str, ...]
) -> None:
    done = camtool(
        "post", plate, "-t", "linuxcnc", "--tool-diameter", str(D), "--depth", "1", *flags,
        "--no-verify", "-o", "-",
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert _widths(done.stdout) == {name: pytest.approx(WANTED[name], abs=2e-3) for name in layers}
    assert (b"SIDE_BY_UNCUT" in done.stderr) == ("OUTER" not in layers)


def test_a_misspelt_layer_stays_an_error(camtool: Run, plate: Path) -> None:
    done = camtool("post", plate, "-t", "linuxcnc", "--layer", "WINDWO", "-o", "-")
    assert done.returncode == 2
    assert b"did you mean WINDOW?" in done.stderr


def test_a_frame_of_another_name_is_told_and_can_be_named(camtool: Run, plate: Path) -> None:
    text = plate.read_text().replace("SHEET BORDER", "PAPER")
    plate.write_text(text)
    flags = ("-t", "linuxcnc", "--layer", "OUTER", "--tool-diameter", str(D), "--no-verify")
    done = camtool("post", plate, *flags, "-o", "-")
    assert done.returncode == 0
    assert b"warning SIDE_BY_UNCUT" in done.stderr
    assert b"--frames 'PAPER'" in done.stderr
    done = camtool("post", plate, *flags, "--frames", "PAPER", "-o", "-")
    assert b"SIDE_BY_UNCUT" not in done.stderr
    assert _widths(done.stdout) == {"OUTER": pytest.approx(120 + D, abs=2e-3)}
