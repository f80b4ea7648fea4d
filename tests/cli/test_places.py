"""No output takes the place of an input or of another output, in any command."""

from pathlib import Path

import pytest

from tests.cli.conftest import Run

SQUARE = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="9mm" height="9mm" viewBox="0 0 9 9">{}</svg>'
)
DRAWN = SQUARE.format('<path d="M1 1h5v5h-5z" fill="none" stroke="#000"/>')
PROGRAM = "G21\nG90\nG1 X1 F100\nM2\n"


@pytest.fixture
def here(tmp_path: Path) -> Path:
    """A drawing, a program, and all files that may stand beside them."""
    files = {
        "w.svg": DRAWN,
        "other.svg": DRAWN,
        "a.ngc": PROGRAM,
        "b.ngc": PROGRAM,
        "job.toml": 'tool_table = "tool.tbl"\ntool = 1\n',
        "tool.tbl": "T1 P1 D1.0\n",
        "my.toml": 'extends = "linuxcnc"\n',
        "their.toml": 'extends = "grbl"\n',
        "m.toml": "",
    }
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    return tmp_path


def contents(folder: Path) -> dict[str, bytes]:
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


POST = ("post", "w.svg", "-t", "linuxcnc", "--no-verify")
VERIFY = ("verify", "a.ngc", "-t", "linuxcnc", "--against", "w.svg")
TABLES = ("--job", "job.toml", "--machine", "my.toml")


@pytest.mark.parametrize(
    "line",
    [
        (*POST, "-o", "w.svg"),
        (*POST, *TABLES, "-o", "job.toml"),
        (*POST, *TABLES, "-o", "./tool.tbl"),
        (*POST, *TABLES, "--preview", "x.svg", "-o", "my.toml"),
        (*POST, "--tool-table", "tool.tbl", "-o", "tool.tbl"),
        (*POST, "-o", "x.svg", "--preview", "./x.svg"),
        (*POST, "-o", "x.ngc", "--preview", "w.svg"),
        (*POST[:-1], *TABLES, "--json", "job.toml"),
        (*POST[:-1], *TABLES, "--json", "my.toml"),
        (*POST[:-1], *TABLES, "--json", "tool.tbl"),
        (*POST[:-1], "-o", "x.ngc", "--json", "./x.ngc"),
        (*POST[:-1], "-o", "x.ngc", "--json", "X.NGC"),
        (*POST[:-1], "-o", "x.json", "--report", "x.json"),
        (*POST[:-1], "-o", "x.svg", "--report", "x.md"),
        (*POST[:-1], "-o", "x.ngc", "--report", "w.md"),
        (*POST[:-1], "-o", "x.ngc", "--report", "other.md"),
        (*POST[:-1], "-o", "/dev/stdout", "--json", "/dev/fd/1"),
        (*VERIFY, "--json", "a.ngc"),
        (*VERIFY, *TABLES, "--json", "job.toml"),
        (*VERIFY, *TABLES, "--json", "tool.tbl"),
        (*VERIFY, *TABLES, "--json", "my.toml"),
        (*VERIFY, "--preview", "w.svg"),
        (*VERIFY, "--report", "w.md"),
        (*VERIFY, "--report", "other.md"),
        (*VERIFY, "--beside", "b.ngc", "--preview", "x.svg", "--json", "b.ngc"),
        (*VERIFY, "--preview", "x.svg", "--json", "x.svg"),
        ("convert", "a.ngc", "--from", "linuxcnc", "--to", "grbl", "-o", "a.ngc"),
        ("convert", "a.ngc", "--from", "linuxcnc", "--to", "grbl", "--report", "other.md"),
        *(
            (
                *("convert", "a.ngc", "--from", "linuxcnc", "--to", "grbl"),
                *("--from-machine", "my.toml", "--machine", "their.toml", "-o", name),
            )
            for name in ("my.toml", "their.toml")
        ),
        ("preview", "w.svg", "--beside", "other.svg", "-o", "other.svg"),
        ("preview", "w.svg", "-o", "./w.svg"),
        ("check", "w.svg", "--json", "w.svg"),
        ("check", "w.svg", "--json", "x.svg", "--preview", "x.svg"),
        ("job", "new", "w.svg", "-o", "w.svg"),
        ("job", "new", "w.svg", "--machine", "my.toml", "-o", "my.toml"),
        ("targets", "new", "mine", "--extends", "grbl", "-o", "my.toml"),
        ("coupon", "lines", "-o", "x.svg", "--measurements", "x.svg"),
        ("coupon", "lines", "-o", "x.svg", "--measurements", "m.toml"),
        ("calibrate", "m.toml", "-t", "grbl", "-o", "m.toml"),
        ("calibrate", "m.toml", "--machine", "my.toml", "-o", "my.toml"),
        ("calibrate", "m.toml", "-t", "grbl", "-o", "x.toml", "--json", "./x.toml"),
        ("send", "a.ngc", "--machine", "my.toml", "--live", "a.ngc"),
        ("send", "a.ngc", "--machine", "my.toml", "--live", "my.toml"),
        ("send", "a.ngc", "--machine", "my.toml", "--journal", "./a.ngc"),
        ("send", "a.ngc", "--machine", "my.toml", "--journal", "x", "--live", "x"),
        ("batch", "w.svg", "-t", "linuxcnc", "-o", ".", "--preview", "svg"),
        ("batch", "w.svg", "-t", "linuxcnc", "-o", "out", "--json", "w.svg"),
        ("batch", "w.svg", "-t", "linuxcnc", "-o", "out", "--json", "out/w.ngc"),
        ("batch", "w.svg", "-t", "linuxcnc", "-o", "out", *TABLES, "--json", "tool.tbl"),
        ("batch", "w.svg", "-o", "out", *TABLES, "--json", "my.toml"),
        ("batch", "w.svg", "-o", "out", *TABLES, "--json", "job.toml"),
    ],
)  # fmt: skip
def test_a_file_that_is_read_or_written_already_is_refused(
    camtool: Run, here: Path, line: tuple[str, ...]
) -> None:
    (here / "out").mkdir()
    before = contents(here)
    done = camtool(*line)
    assert done.returncode == 2, done.stderr.decode()
    words = (
        "is the input", "asked for twice", "exists already", "is there, and is not the picture"
    )  # fmt: skip
    assert any(each in done.stderr.decode() for each in words), done.stderr.decode()
    assert contents(here) == before


def test_a_batch_replaces_no_drawing_that_it_does_not_read(camtool: Run, here: Path) -> None:
    (here / "w.toml").write_text('tool_table = "own.tbl"\ntool = 1\n')
    (here / "own.tbl").write_text("T1 P1 D1.0\n")
    (here / "w.dxf").write_bytes((here / "w.svg").read_bytes())
    for line in (
        ("w.dxf", "-o", ".", "--preview", "svg"),
        ("w.dxf", "-o", "out", "--json", "w.toml"),
        ("w.dxf", "-o", "out", "--json", "own.tbl"),
        ("w.dxf", "-o", "out", "--json", "out/.camtool-batch.jsonl"),
    ):
        before = contents(here)
        done = camtool("batch", *line, "-t", "linuxcnc")
        assert done.returncode == 2, done.stderr.decode()
        assert contents(here) == before, line


@pytest.mark.parametrize(
    ("line", "name"),
    [
        (("post", "w.svg", "-t", "grbl", "--no-verify"), "w.nc"),
        (("post", "w.svg", "-t", "linuxcnc", "--no-verify", "--split", "tool"), "w-1-mill.ngc"),
        (("convert", "a.ngc", "--from", "linuxcnc", "--to", "grbl", "--no-verify"), "a.nc"),
        (("coupon", "lines"), "coupon.dxf"),
    ],
)
def test_a_name_that_nobody_gave_replaces_only_what_camtool_wrote(
    camtool: Run, here: Path, line: tuple[str, ...], name: str
) -> None:
    (here / "a.ngc").write_text("G21 G90\nG0 X1\nG1 X2 F100\nM2\n")
    place = here / name
    place.write_bytes(b"G21\nG1 X1 F100\nM2\n")
    before = contents(here)
    done = camtool(*line)
    assert done.returncode == 2, done.stderr.decode()
    assert f"{name}: is there, and camtool did not write it".encode() in done.stderr
    assert contents(here) == before
    place.unlink()
    assert camtool(*line).returncode == 0
    made = place.read_bytes()
    assert camtool(*line).returncode == 0
    assert place.read_bytes() == made
    if "--split" not in line:
        place.write_bytes(b"G21\n")
        assert camtool(*line, "-o", name).returncode == 0
        assert place.read_bytes() == made


def test_a_page_replaces_only_its_own_picture(camtool: Run, here: Path) -> None:
    line = (*POST[:-1], "-o", "x.ngc", "--report", "page.md")
    assert camtool(*line).returncode == 0
    made = (here / "page.svg").read_bytes()
    assert camtool(*line).returncode == 0, "a page is made again"
    assert (here / "page.svg").read_bytes() == made
    for foreign in (made.replace(b"<svg", b"<svg ", 1), b"", made + b"\n", DRAWN.encode()):
        (here / "page.svg").write_bytes(foreign)
        done = camtool(*line)
        assert done.returncode == 2
        assert b"page.svg: is there, and is not the picture that page.md brought" in done.stderr
        assert (here / "page.svg").read_bytes() == foreign
    # Where it was asked for by its name it is an output like another.
    assert camtool(*line, "--preview", "page.svg").returncode == 0
    (here / "page.svg").write_bytes(made)
    (here / "other.svg").write_bytes(made)
    done = camtool(*line[:-1], "other.md")
    assert done.returncode == 2, "the picture of another page"


def test_a_batch_makes_its_pictures_again(camtool: Run, here: Path) -> None:
    (here / "d").mkdir()
    (here / "w.svg").rename(here / "d" / "w.svg")
    line = ("batch", "d", "-t", "linuxcnc", "-o", "out", "--preview", "svg", "--force", "-j", "1")
    assert camtool(*line).returncode == 0
    (here / "out" / ".camtool-batch.jsonl").unlink()  # it knows them without its manifest
    assert camtool(*line).returncode == 0
    (here / "out" / ".camtool-batch.jsonl").unlink()
    (here / "out" / "w.svg").write_text(DRAWN)
    done = camtool(*line)
    assert done.returncode == 2
    assert b"w.svg: is there, and is no picture of d/w.svg" in done.stderr
    assert (here / "out" / "w.svg").read_text() == DRAWN


def test_nothing_is_there_when_a_stream_takes_no_more(camtool: Run, here: Path) -> None:
    done = camtool(*POST[:-1], "-o", "k.ngc", "--json", "/dev/full")
    assert done.returncode == 2
    last = done.stderr.splitlines()[-1]
    assert last.startswith(b"camtool: error: /dev/full: cannot be written (No space left")
    assert not (here / "k.ngc").exists()
