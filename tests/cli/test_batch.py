"""`camtool batch` as a user runs it."""

import errno
import json
import os
import shutil
import signal
from collections.abc import Generator, Sequence
from dataclasses import fields
from pathlib import Path

import pytest

from camtool.batches.lock import lock_folder
from camtool.batches.run import DrawingTask, Outputs, Pool
from camtool.cli import batch_run, batch_work
from camtool.cli.batch_run import record_signals
from camtool.cli.options import DrawingFlags
from camtool.cli.picture_options import PictureFlags
from camtool.errors import CamtoolError
from camtool.records import replace
from camtool.target.registry import load_target
from camtool.verification.report import Gates
from tests.cli.conftest import Run
from tests.oracles.batch_works import HerePool

PIC = ("-t", "pic-mmh", "--out", "build")
QUICK = ("--no-verify",)


@pytest.fixture
def pools(monkeypatch: pytest.MonkeyPatch) -> list[HerePool]:
    """The drawings are made in this process; the pool of each run, to see what it was asked."""
    made: list[HerePool] = []

    def here(run: batch_run.BatchRun, note: object) -> Pool:
        made.append(HerePool(run.work))
        return made[-1]

    monkeypatch.setattr(batch_run, "pool_for", here)
    monkeypatch.setattr(batch_work, "code_digest", lambda files: "of no matter here")
    return made


@pytest.fixture
def drawings(tmp_path: Path, samples: Path) -> Path:
    """Two good drawings and a broken one between them."""
    folder = tmp_path / "drawings"
    (folder / "in").mkdir(parents=True)
    shutil.copy(samples / "pieces" / "pic-mmh-square.dxf", folder / "in" / "square.dxf")
    shutil.copy(samples / "letter.svg", folder / "letter.svg")
    (folder / "junk.dxf").write_text("junk\n")
    return folder


def files_in(folder: Path) -> set[str]:
    return {str(p.relative_to(folder)) for p in folder.rglob("*") if p.is_file()}


MANIFEST = ".camtool-batch.jsonl"


@pytest.mark.usefixtures("pools")
def test_good_drawings_are_made_and_the_broken_one_is_in_the_table(
    camtool: Run, drawings: Path, tmp_path: Path
) -> None:
    done = camtool(
        "batch", "drawings", *PIC, "--preview", "png", "--reports", "--json", "all.json"
    )
    assert done.returncode == 1
    said = done.stderr.decode()
    assert "camtool: error: drawings/junk.dxf: is no DXF" in said
    assert "drawings/junk.dxf | is no DXF" in said
    assert "3 drawings: 2 made, 1 failed" in said
    stems = ("letter", "in/square")
    made = {f"{stem}{extension}" for stem in stems for extension in (".pic", ".png", ".json")}
    assert files_in(tmp_path / "build") == {MANIFEST, *made}
    whole = json.loads((tmp_path / "all.json").read_text())
    assert (whole["made"], whole["failed"], whole["target"]) == (2, 1, "pic-mmh")
    assert [row["state"] for row in whole["drawings"]] == ["made", "failed", "made"]
    assert whole["drawings"][0]["figures"]["error_um"] > 0.0
    report = json.loads((tmp_path / "build" / "letter.json").read_text())
    assert report["source"] == "drawings/letter.svg"


@pytest.mark.usefixtures("pools")
def test_it_makes_what_post_makes(camtool: Run, drawings: Path, tmp_path: Path) -> None:
    flags = ("-t", "pic-mmh", "--origin", "lower-left", "--feed", "0.5")
    assert camtool("post", "drawings/letter.svg", *flags, "-o", "one.pic").returncode == 0
    assert camtool("batch", "drawings/letter.svg", *flags, "-o", "build").returncode == 0
    assert (tmp_path / "build/letter.pic").read_bytes() == (tmp_path / "one.pic").read_bytes()


def asked(camtool: Run, pools: list[HerePool], *flags: str) -> list[str]:
    """Run the good drawings and return the names of those that were made anew."""
    before = len(pools)
    target = () if "-t" in flags else ("-t", "pic-mmh")
    sources = ("drawings/letter.svg", "drawings/in/square.dxf")
    done = camtool("batch", *sources, *target, "-o", "build", *QUICK, *flags)
    assert done.returncode == 0, done.stderr.decode()
    return pools[before].asked if len(pools) > before else []  # no pool where nothing is to do


def test_only_what_has_changed_is_made_again(
    camtool: Run, drawings: Path, tmp_path: Path, pools: list[HerePool]
) -> None:
    both = ["letter", "square"]
    assert asked(camtool, pools) == both
    (drawings / "letter.svg").touch()
    assert asked(camtool, pools) == []
    assert asked(camtool, pools, "--force") == both
    text = (drawings / "letter.svg").read_text()
    (drawings / "letter.svg").write_text(text + "<!-- -->")
    assert asked(camtool, pools) == ["letter"]
    (tmp_path / "build" / "square.pic").unlink()
    assert asked(camtool, pools) == ["square"]
    for flags in (
        ("--preview", "svg"),
        ("--preview", "svg", "--layers", "feeds"),
        ("--feed", "0.5"),
        ("--set", "axes.x.backlash_mm=0.004"),
        ("--tolerance", "0.002"),
        ("-t", "grbl"),
    ):
        assert asked(camtool, pools, *flags) == both, flags
        assert asked(camtool, pools, *flags) == [], flags


@pytest.mark.usefixtures("pools")
def test_engagement_is_limited_in_each_drawing(
    camtool: Run, drawings: Path, tmp_path: Path
) -> None:
    """A contour in full stock engages the tool by half of its circle; another limit is judged
    anew."""
    flags = ("-t", "grbl", "--tool-diameter", "0.5mm", "-o", "build", "--json", "all.json")
    for limit, code, state in (("100%", 0, "made"), ("170deg", 1, "failed"), ("100%", 0, "made")):
        done = camtool("batch", "drawings/in/square.dxf", *flags, "--max-engagement", limit)
        assert done.returncode == code, done.stderr.decode()
        (row,) = json.loads((tmp_path / "all.json").read_text())["drawings"]
        assert row["state"] == state
        assert ("--max-engagement" in json.dumps(row)) == (code == 1)


@pytest.mark.usefixtures("pools")
def test_it_replaces_only_what_it_made_and_nobody_changed(
    camtool: Run, drawings: Path, tmp_path: Path
) -> None:
    (drawings / "junk.dxf").unlink()
    build = tmp_path / "build"
    line = ("batch", "drawings", "-o", "build", *QUICK)
    build.mkdir()
    for name in ("letter.nc", "letter.png"):
        (build / name).write_text("by hand")
        done = camtool(*line, "-t", "grbl", "--preview", "png")
        assert done.returncode == 1
        assert f"build/{name}: is there, and no batch made it".encode() in done.stderr
        assert (build / name).read_text() == "by hand"
        (build / name).unlink()
    assert camtool(*line, "-t", "grbl").returncode == 0
    program = (build / "letter.nc").read_bytes()
    # Made here, also when a run for another machine came between.
    assert camtool(*line, "-t", "linuxcnc").returncode == 0
    letter = drawings / "letter.svg"
    letter.write_text(letter.read_text().replace("<path", "<path ", 1) + "<!-- -->")
    assert camtool(*line, "-t", "grbl", "--feed", "100").returncode == 0
    assert (build / "letter.nc").read_bytes() != program
    # One byte by hand, and a change of the drawing: nothing of it is written.
    edited = (build / "letter.nc").read_bytes() + b"\n"
    (build / "letter.nc").write_bytes(edited)
    done = camtool(*line, "-t", "grbl", "--feed", "100", "--preview", "png")
    assert done.returncode == 1
    assert b"1 made, 1 failed" in done.stderr
    assert (build / "letter.nc").read_bytes() == edited
    assert not (build / "letter.png").exists()
    assert camtool(*line, "-t", "grbl", "--feed", "100", "--force").returncode == 0
    assert (build / "letter.nc").read_bytes() == edited[:-1]
    # As after a run that was killed before it could note what it wrote.
    (build / MANIFEST).unlink()
    assert camtool(*line, "-t", "grbl", "--feed", "100").returncode == 0


def test_a_job_beside_a_drawing_is_its_own(
    camtool: Run, drawings: Path, tmp_path: Path, pools: list[HerePool]
) -> None:
    asked(camtool, pools)
    plain = (tmp_path / "build" / "letter.pic").read_bytes()
    (drawings / "letter.toml").write_text('feed = "0.5"\n')
    assert asked(camtool, pools) == ["letter"]
    assert (tmp_path / "build" / "letter.pic").read_bytes() != plain
    (drawings / "letter.toml").write_text('# the same\nfeed = "0.5mm/min"\n')
    assert asked(camtool, pools) == []
    assert asked(camtool, pools, "--no-own-jobs") == ["letter"]
    assert (tmp_path / "build" / "letter.pic").read_bytes() == plain
    (drawings / "letter.toml").write_text("compensate = true\n")
    assert asked(camtool, pools) == ["letter"]
    bent = (tmp_path / "build" / "letter.pic").read_bytes()
    assert bent != plain
    everything = asked(camtool, pools, "--compensate")
    assert everything
    assert "letter" not in everything  # its own job says so already
    assert (tmp_path / "build" / "letter.pic").read_bytes() == bent


@pytest.mark.usefixtures("pools")
def test_a_wrong_job_fails_its_drawing_alone(camtool: Run, drawings: Path, tmp_path: Path) -> None:
    (drawings / "letter.toml").write_text("fed = 1\n")
    done = camtool("batch", "drawings/letter.svg", "drawings/in", *PIC, *QUICK)
    assert done.returncode == 1
    assert b"drawings/letter.svg: drawings/letter.toml: key fed: unknown key" in done.stderr
    assert files_in(tmp_path / "build") == {MANIFEST, "square.pic"}
    shutil.copy(drawings / "letter.toml", tmp_path / "all.toml")
    assert camtool("batch", "drawings/in", *PIC, "--job", "all.toml").returncode == 2


@pytest.mark.usefixtures("pools")
def test_fail_fast_stops(camtool: Run, drawings: Path, tmp_path: Path) -> None:
    (drawings / "in" / "a.dxf").write_text("junk\n")
    done = camtool("batch", "drawings", *PIC, "--fail-fast", "--json", "-", "-q")
    assert done.returncode == 1
    whole = json.loads(done.stdout)
    assert (whole["made"], whole["failed"], whole["not_run"]) == (0, 1, 3)


@pytest.mark.usefixtures("pools")
def test_findings_are_failures_and_old_files_stay(
    camtool: Run, drawings: Path, tmp_path: Path
) -> None:
    flags = ("batch", "drawings/letter.svg", *PIC)
    assert camtool(*flags).returncode == 0
    before = (tmp_path / "build" / "letter.pic").read_bytes()
    done = camtool(*flags, "--max-error", "0.001um", "--json", "-")
    assert done.returncode == 1
    (row,) = json.loads(done.stdout)["drawings"]
    assert f"1 drawing: 1 failed (1 {row['code']}); " in done.stderr.decode()
    assert f"drawings/letter.svg | {row['code']} " in done.stderr.decode()
    assert (tmp_path / "build" / "letter.pic").read_bytes() == before


@pytest.mark.parametrize(
    ("flags", "why"),
    [
        (("drawings",), "letter.* and drawings/letter.svg|both be written as letter.*"),
        (("nowhere",), "no such file or folder"),
        (("drawings/in", "--no-verify", "--reports"), "nothing to report"),
        (("drawings/in", "--scheduler", "x", "--jobs", "2"), "not for a cluster"),
        (("drawings/in", "--json", "no/where.json"), "does not exist"),
    ],
)
def test_wrong_use_is_refused_before_anything_is_made(
    camtool: Run, drawings: Path, tmp_path: Path, flags: tuple[str, ...], why: str
) -> None:
    shutil.copy(drawings / "letter.svg", drawings / "letter.svgz")
    done = camtool("batch", *flags, *PIC)
    assert done.returncode == 2
    assert any(each in done.stderr.decode() for each in why.split("|"))
    assert not (tmp_path / "build").exists()


@pytest.mark.usefixtures("pools")
def test_a_second_batch_into_the_same_folder_is_refused(
    camtool: Run, drawings: Path, tmp_path: Path
) -> None:
    build = tmp_path / "build"
    assert camtool("batch", "drawings/letter.svg", *PIC, *QUICK).returncode == 0
    before = {path: path.read_bytes() for path in build.iterdir()}
    with lock_folder(build):
        held = files_in(build)
        done = camtool("batch", "drawings/in", *PIC, *QUICK, "--force")
        assert files_in(build) == held
    assert done.returncode == 2
    assert f"build: another batch writes there (process {os.getpid()} on ".encode() in done.stderr
    assert {path: path.read_bytes() for path in build.iterdir()} == before
    assert camtool("batch", "drawings/in", *PIC, *QUICK).returncode == 0
    assert files_in(build) == {MANIFEST, "letter.pic", "square.pic"}


@pytest.mark.usefixtures("pools")
def test_odd_names_are_only_names(camtool: Run, tmp_path: Path, samples: Path) -> None:
    stems = ("-a b", "[red]é", "new\nline", "\udcff")
    (tmp_path / "d").mkdir()
    for stem in stems:
        shutil.copy(samples / "letter.svg", tmp_path / "d" / f"{stem}.svg")
    flags = ("--preview", "svg", "--reports", "--json", "-")
    done = camtool("batch", "d", *PIC, *flags)
    assert done.returncode == 0, done.stderr.decode()
    whole = json.loads(done.stdout.decode())
    assert [row["source"] for row in whole["drawings"]] == [f"d/{stem}.svg" for stem in stems]
    made = {f"{stem}{extension}" for stem in stems for extension in (".pic", ".svg", ".json")}
    assert files_in(tmp_path / "build") == {MANIFEST, *made}
    assert (
        json.loads((tmp_path / "build" / "\udcff.json").read_text())["source"] == "d/\\udcff.svg"
    )
    assert all(line.isprintable() for line in done.stderr.decode().splitlines())
    again = camtool("batch", "d", *PIC, *flags)
    assert json.loads(again.stdout.decode())["up_to_date"] == 4


@pytest.mark.usefixtures("pools")
def test_an_output_folder_that_is_none(
    camtool: Run, drawings: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "build").write_text("a file")
    done = camtool("batch", "drawings/in", *PIC, *QUICK)
    assert done.returncode == 2
    assert b"camtool: error: build: cannot be made (File exists); choose another" in done.stderr
    assert (tmp_path / "build").read_text() == "a file"
    (tmp_path / "build").unlink()
    assert camtool("batch", "drawings/in", *PIC, *QUICK).returncode == 0
    opened = os.open

    def read_only(path: str | Path, flags: int, *rest: int, **more: int) -> int:
        if flags & (os.O_WRONLY | os.O_RDWR) and "build" in str(path):
            raise OSError(errno.EROFS, "Read-only file system", str(path))
        return opened(path, flags, *rest, **more)

    monkeypatch.setattr(os, "open", read_only)
    done = camtool("batch", "drawings/in", *PIC, *QUICK)
    assert done.returncode == 2
    assert b"cannot be written (Read-only file system); choose another --out" in done.stderr


@pytest.mark.usefixtures("pools")
def test_an_output_folder_within_the_drawings(camtool: Run, drawings: Path) -> None:
    flags = ("batch", "drawings/in", "drawings/in/*.dxf", "-t", "pic-mmh", "-o", "drawings/in/out")
    more = ("--preview", "svg", "--json", "-", *QUICK)
    for state in ("made", "up_to_date"):
        whole = json.loads(camtool(*flags, *more).stdout)
        assert (whole[state], len(whole["drawings"])) == (1, 1)
    assert files_in(drawings / "in") == {
        "square.dxf",
        *(f"out/{name}" for name in (MANIFEST, "square.pic", "square.svg")),
    }


def test_all_that_outputs_depend_on_is_in_the_digest(monkeypatch: pytest.MonkeyPatch) -> None:
    work = batch_work.PostWork(load_target("grbl"), DrawingFlags())
    other = {
        "target": load_target("grbl", settings=["axes.x.backlash_mm=0.2"]),
        "drawing": DrawingFlags({"gap_mm": 0.5}),
        "gates": Gates(error_mm=0.1),
        "preview": ".svg",
        "reports": True,
        "check": False,
        "looks": PictureFlags(dark=True),
        "require": "in",
    }
    assert other.keys() == {field.name for field in fields(work)}, "a new field counts too"
    digests = [work.digest(), *(replace(work, **{key: other[key]}).digest() for key in other)]
    monkeypatch.setattr("importlib.metadata.version", lambda name: "another one")
    digests.append(work.digest())
    monkeypatch.undo()
    monkeypatch.setattr(batch_work, "code_digest", lambda files: "of other code")
    digests.append(work.digest())
    assert len(set(digests)) == len(digests)


def test_the_first_signal_is_noted_and_a_second_ctrl_c_waits_for_nothing() -> None:
    before = signal.getsignal(signal.SIGINT)
    with record_signals() as stop:
        assert stop.signal is None
        for _ in range(2):
            signal.raise_signal(signal.SIGTERM)
            assert stop.signal == signal.SIGTERM
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    with record_signals() as stop:
        signal.raise_signal(signal.SIGINT)
        assert stop.signal == signal.SIGINT
    assert signal.getsignal(signal.SIGINT) is before


@pytest.mark.usefixtures("pools")
def test_a_run_that_is_interrupted_at_once_says_so(
    camtool: Run, drawings: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(path: Path) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(batch_run, "own_job", interrupted)
    done = camtool("batch", "drawings/in", *PIC, *QUICK)
    assert done.returncode == 128 + signal.SIGINT
    assert b"interrupted; written files are complete" in done.stderr
    assert files_in(tmp_path / "build") == set()


@pytest.mark.usefixtures("pools")
def test_a_run_that_cannot_go_on_still_sums_up(
    camtool: Run, drawings: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Lost(HerePool):
        def results(
            self, tasks: Sequence[DrawingTask]
        ) -> Generator[tuple[DrawingTask, Outputs] | None]:
            yield from super().results(tasks[:1])
            raise CamtoolError("the scheduler was lost", where="--scheduler")

    monkeypatch.setattr(batch_run, "pool_for", lambda run, note: Lost(run.work))
    sources = ("drawings/letter.svg", "drawings/in/square.dxf")
    done = camtool("batch", *sources, *PIC, *QUICK, "--json", "-")
    assert done.returncode == 2
    assert done.stderr.endswith(b"camtool: error: --scheduler: the scheduler was lost\n")
    whole = json.loads(done.stdout)
    assert (whole["made"], whole["not_run"]) == (1, 1)
    assert files_in(tmp_path / "build") == {MANIFEST, "letter.pic"}


# Dimensions.

KNOWN = """extends = "grbl"
[uncertainty]
squareness_rad = 0.0001
tool_diameter_mm = 0.004
runout_mm = 0.0
part_expansion_per_k = 23e-6
process_mm = 0.002
[uncertainty.x]
backlash_mm = 0.002
scale = 0.0001
[uncertainty.y]
backlash_mm = 0.002
scale = 0.0001
"""
PLATE = """<svg xmlns="http://www.w3.org/2000/svg" width="{wide}mm" height="9mm"
viewBox="0 0 {wide} 9"><rect x="1" y="1" width="4" height="4" fill="none" stroke="black"/></svg>"""
WIDTH = """[[dimension]]
kind = "width"
from = [1, 6]
to = [5, 6]
limits = "{limits}"
"""


@pytest.fixture
def plates(tmp_path: Path) -> Path:
    """Two plates with a square of 4 mm each, and a machine of which all is known that matters."""
    folder = tmp_path / "plates"
    folder.mkdir()
    for name, wide in (("one", 9), ("two", 10)):
        (folder / f"{name}.svg").write_text(PLATE.format(wide=wide))
    (tmp_path / "mine.toml").write_text(KNOWN)
    (tmp_path / "common.toml").write_text(WIDTH.format(limits="±0.1"))
    return folder


INSPECTED = ("batch", "plates", "--machine", "mine.toml", "-o", "build", "--json", "all.json")


def verdicts_in(folder: Path) -> list[dict[str, int]]:
    whole = json.loads((folder / "all.json").read_text())
    return [whole["verdicts"], *(row["verdicts"] for row in whole["drawings"])]


def test_dimensions_of_many_drawings(
    camtool: Run, plates: Path, tmp_path: Path, pools: list[HerePool]
) -> None:
    limits = ("--tolerances", "common.toml")
    done = camtool(*INSPECTED, *limits, "--reports")
    assert done.returncode == 0, done.stderr.decode()
    assert verdicts_in(tmp_path) == [{"in": 2}, {"in": 1}, {"in": 1}]
    assert "dimensions: 2 in" in done.stderr.decode().splitlines()[-1]
    assert "one.nc, one.json, error" in done.stderr.decode()
    report = json.loads((tmp_path / "build" / "one.json").read_text())
    assert [each["verdict"] for each in report["inspection"]] == ["in"]
    # Nothing has changed: the counts come from the manifest.
    before = len(pools)
    assert camtool(*INSPECTED, *limits, "--reports").returncode == 0
    assert len(pools) == before
    assert verdicts_in(tmp_path) == [{"in": 2}, {"in": 1}, {"in": 1}]
    # One drawing has its own limits now, which are narrower than anybody can say.
    (plates / "one.tolerances.toml").write_text(WIDTH.format(limits="±0.001"))
    done = camtool(*INSPECTED, *limits, "--reports", "--require", "not-out")
    assert done.returncode == 0, done.stderr.decode()
    assert pools[-1].asked == ["one", "two"]  # something else is required
    assert verdicts_in(tmp_path) == [{"in": 1, "undecided": 1}, {"undecided": 1}, {"in": 1}]
    assert "dimensions: 1 undecided" in done.stderr.decode()
    (plates / "one.tolerances.toml").write_text(WIDTH.format(limits="±0.002"))
    camtool(*INSPECTED, *limits, "--reports", "--require", "not-out")
    assert pools[-1].asked == ["one"]
    camtool(*INSPECTED, *limits, "--reports", "--require", "not-out", "--no-own-jobs")
    assert pools[-1].asked == ["one"]
    assert verdicts_in(tmp_path)[0] == {"in": 2}


@pytest.mark.usefixtures("pools")
def test_what_every_dimension_of_a_batch_must_be(
    camtool: Run, plates: Path, tmp_path: Path
) -> None:
    (plates / "one.tolerances.toml").write_text(WIDTH.format(limits="±0.001"))
    done = camtool(*INSPECTED, "--tolerances", "drawing", "--require", "in")
    assert done.returncode == 1
    said = done.stderr.decode()
    # The other one says nothing of limits: a gate does not pass on nothing.
    assert "2 failed (1 DIMENSION_NOT_IN, 1 NOTHING_REQUIRED)" in said
    assert "width 1 is undecided" in said
    assert files_in(tmp_path / "build") == {MANIFEST}
    assert verdicts_in(tmp_path) == [{"undecided": 1}, {"undecided": 1}, {}]
    done = camtool(*INSPECTED, "--tolerances", "common.toml", "--require", "in")
    assert "1 failed (1 DIMENSION_NOT_IN)" in done.stderr.decode()
    assert files_in(tmp_path / "build") == {MANIFEST, "two.nc"}


@pytest.mark.usefixtures("pools")
def test_limits_beside_a_drawing_need_no_flag(camtool: Run, plates: Path, tmp_path: Path) -> None:
    (plates / "one.tolerances.toml").write_text(WIDTH.format(limits="±0.1"))
    assert camtool(*INSPECTED).returncode == 0
    assert verdicts_in(tmp_path) == [{"in": 1}, {"in": 1}, {}]
    assert camtool(*INSPECTED, *QUICK).returncode == 0
    assert verdicts_in(tmp_path) == [{}, {}, {}]


@pytest.mark.usefixtures("pools")
def test_wrong_tolerances_fail_their_drawing_or_all(
    camtool: Run, plates: Path, tmp_path: Path
) -> None:
    (plates / "one.tolerances.toml").write_text(WIDTH.format(limits="+0.1"))
    done = camtool(*INSPECTED, "--tolerances", "common.toml")
    assert done.returncode == 1
    assert "plates/one.svg: plates/one.tolerances.toml: dimension 1, key limits" in (
        done.stderr.decode()
    )
    assert files_in(tmp_path / "build") == {MANIFEST, "two.nc"}
    (tmp_path / "common.toml").write_text(WIDTH.format(limits="+0.1"))
    done = camtool(*INSPECTED, "--tolerances", "common.toml")
    assert done.returncode == 2
    for flags in (("--require", "in"), ("--tolerances", "drawing", *QUICK)):
        assert camtool(*INSPECTED, *flags).returncode == 2
    done = camtool("batch", "plates", "--machine", "mine.toml", "-o", ".", "--json",
                   "plates/one.tolerances.toml")  # fmt: skip
    assert done.returncode == 2
