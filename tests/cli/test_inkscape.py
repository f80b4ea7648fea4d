"""`camtool inkscape`: the entries of Inkscape, as Inkscape calls them, and by Inkscape itself."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree as tree

import pytest

from camtool.cli import inkscape
from tests.cli.conftest import ROOT, Run

RING = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="40mm" height="40mm" viewBox="0 0 40 40">'
    '<circle cx="20" cy="20" r="{radius}"/></svg>'
)
NAMESPACE = "{http://www.inkscape.org/namespace/inkscape/extension}"
GRAMMAR = Path("/usr/share/inkscape/extensions/inkscape.extension.rng")
JOB = 'depth = "0.7mm"\ntool_diameter = "1mm"\n'
INX = sorted(Path(inkscape.__file__).parent.glob("*.inx"))


@pytest.fixture
def extensions(camtool: Run, tmp_path: Path) -> Path:
    """The folder of extensions as the command leaves it."""
    done = camtool("inkscape", "-o", "profile/extensions")
    assert done.returncode == 0, done.stderr.decode()
    return tmp_path / "profile" / "extensions"


@pytest.fixture
def part(tmp_path: Path) -> Path:
    """A drawing with a machine and a job in its folder."""
    folder = tmp_path / "my parts"
    folder.mkdir()
    (folder / "camtool.toml").write_text('target = "grbl"\n')
    (folder / "ring.toml").write_text(JOB)
    (folder / "ring.svg").write_text(RING.format(radius=10))
    return folder / "ring.svg"


def called(
    script: Path, drawing: Path, *words: str, document: str | None = None
) -> subprocess.CompletedProcess[bytes]:
    """Run an extension as Inkscape does: a copy of the drawing, and where the document is."""
    copy = script.parent / "ink_ext_1.svg"
    copy.write_bytes(drawing.read_bytes())
    env = {**os.environ, "DOCUMENT_PATH": str(drawing) if document is None else document}
    command = [sys.executable, "-I", str(script), *words, str(copy)]
    if script.name.endswith("effect.py"):
        command.remove("-I")  # it loads the file beside it
    return subprocess.run(
        command, cwd=script.parent, env=env | {"PYTHONHOME": ""}, capture_output=True, check=False
    )


def test_four_files_are_installed_with_the_place_of_camtool(extensions: Path) -> None:
    assert {path.name for path in extensions.iterdir()} == set(inkscape.FILES)
    text = (extensions / "camtool_output.py").read_text()
    assert f"COMMAND = ({sys.executable!r}, '-m', 'camtool')" in text
    source = Path(inkscape.__file__).with_name("camtool_output.py").read_text()
    assert source.count(inkscape.COMMAND_LINE) == 1


def test_the_folder_is_that_of_the_user(
    camtool: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("INKSCAPE_PROFILE_DIR", raising=False)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
    assert camtool("inkscape", "-q").returncode == 0
    if sys.platform == "linux":
        assert (tmp_path / "config/inkscape/extensions/camtool_output.inx").exists()
    monkeypatch.setenv("INKSCAPE_PROFILE_DIR", str(tmp_path / "mine"))
    assert camtool("inkscape").returncode == 0
    assert (tmp_path / "mine/extensions/camtool_effect.py").exists()
    (tmp_path / "file").write_text("")
    done = camtool("inkscape", "-o", "file/below")
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)


@pytest.mark.parametrize("file", INX, ids=lambda file: file.name)
def test_an_entry_names_its_script_and_its_flags(file: Path) -> None:
    assert len(INX) == 2
    root = tree.parse(file).getroot()
    command = root.find(f"{NAMESPACE}script/{NAMESPACE}command")
    assert command is not None
    assert file.with_suffix(".py").name == command.text
    names = [each.attrib["name"] for each in root.iter(f"{NAMESPACE}param")]
    assert names == ["target", "flags"]


@pytest.mark.skipif(not GRAMMAR.exists(), reason="Inkscape's grammar is not here")
@pytest.mark.parametrize("file", INX, ids=lambda file: file.name)
def test_an_entry_is_valid_by_inkscapes_grammar(file: Path) -> None:
    etree = pytest.importorskip("lxml.etree")
    grammar = etree.RelaxNG(etree.parse(GRAMMAR))
    assert grammar.validate(etree.parse(file)), grammar.error_log
    wrong = file.read_text(encoding="utf-8").replace("<script>", "<scripts>")
    wrong = wrong.replace("</script>", "</scripts>")
    assert not grammar.validate(etree.fromstring(wrong.encode()))


def test_a_saved_program_is_that_of_post(extensions: Path, part: Path, camtool: Run) -> None:
    done = called(extensions / "camtool_output.py", part)
    assert done.returncode == 0, done.stderr.decode()
    flags = ("-t", "grbl", "--job", part.with_suffix(".toml"), "-o", "-")
    assert done.stdout == camtool("post", part, *flags).stdout
    assert b"Z-0.700" in done.stdout
    assert b"warning CUT_DOUBTFUL" in done.stderr
    assert b"camtool: " not in done.stderr
    done = called(extensions / "camtool_output.py", part, "--target=linuxcnc", "--flags=--depth 2")
    assert b"Z-2" in done.stdout
    assert b"M2" in done.stdout
    assert done.returncode == 0


def test_a_drawing_that_was_never_saved(extensions: Path, part: Path) -> None:
    words = ("--target=grbl", "--flags=--depth 1mm --tool-diameter 1mm")
    done = called(extensions / "camtool_output.py", part, *words, document="")
    assert done.returncode == 0, done.stderr.decode()
    assert b"(drawing.svg)" in done.stdout


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        ("--flags=--scale 100", "error OUT_OF_TRAVEL"),
        ("--flags=--depth -3", "-3"),
        ("--flags=--nonsense", "No such option '--nonsense'"),
        ("--flags='", "the flags hold a quote without its end; close it"),
        ("--target=none", "error: "),
    ],
)
def test_errors_are_sentences_and_no_program(
    flags: str, words: str, extensions: Path, part: Path
) -> None:
    done = called(extensions / "camtool_output.py", part, flags)
    said = done.stderr.decode()
    assert (done.returncode, done.stdout) == (1, b"")
    assert words in said
    assert "Traceback" not in said
    assert str(extensions) not in said
    assert 1 <= len(said.splitlines()) <= 3


def test_no_camtool_is_a_sentence(part: Path, tmp_path: Path) -> None:
    folder = tmp_path / "copied"
    folder.mkdir()
    source = Path(inkscape.__file__).with_name("camtool_output.py").read_text()
    gone = source.replace(inkscape.COMMAND_LINE, 'COMMAND = ("/nowhere/camtool",)')
    (folder / "camtool_output.py").write_text(gone)
    done = called(folder / "camtool_output.py", part)
    assert (done.returncode, done.stdout) == (1, b"")
    assert done.stderr.decode() == (
        "/nowhere/camtool cannot be run (No such file or directory); install camtool, then run "
        "camtool inkscape\n"
    )


def test_the_effect_reports_and_leaves_the_drawing(extensions: Path, part: Path) -> None:
    done = called(extensions / "camtool_effect.py", part)
    assert (done.returncode, done.stdout) == (0, part.read_bytes())
    said = done.stderr.decode()
    assert said.startswith("# ring.svg\n")
    assert "µm at most" in said
    assert "warning CUT_DOUBTFUL" in said
    done = called(extensions / "camtool_effect.py", part, "--flags=--scale 100")
    assert (done.returncode, done.stdout) == (0, part.read_bytes())
    assert "error OUT_OF_TRAVEL" in done.stderr.decode()
    assert sorted(path.name for path in part.parent.iterdir()) == [
        "camtool.toml", "ring.svg", "ring.toml",
    ]  # fmt: skip


# inkex's own parser of entries, and its comparison with the arguments that a script takes. Its
# test cases for effects need a class of inkex in the script; ours use Python's library alone.
INKEX = """
import importlib.util, sys, unittest
from argparse import ArgumentParser
from inkex.inx import InxFile
from inkex.tester.inx import InxMixin

parsers = []
class Kept(ArgumentParser):
    def parse_known_args(self, *words):
        parsers.append(self)
        return super().parse_known_args(*words)

class Extension:
    arg_parser = property(lambda self: parsers[-1])

class Entries(InxMixin, unittest.TestCase):
    def test(self):
        spec = importlib.util.spec_from_file_location("script", sys.argv[1])
        script = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(script)
        script.ArgumentParser = Kept
        script.read_arguments(["drawing.svg"])
        kinds = []
        for path in sys.argv[2:]:
            inx = InxFile(path)
            kinds.append((inx.kind, inx.ident))
            self.assertParams(inx, Extension)
            self.assertEqual([each.name for each in inx.params], ["target", "flags"])
        self.assertEqual(
            kinds, [("effect", "org.camtool.effect"), ("output", "org.camtool.output")]
        )

unittest.main(argv=["entries"])
"""


@pytest.mark.slow
def test_the_entries_fit_their_script_by_inkex(extensions: Path, tmp_path: Path) -> None:
    library = tmp_path / "inkex"
    # Without what draws its windows, which needs a compiler and GTK.
    packages = ("inkex", "cssselect", "lxml", "numpy", "tinycss2", "webencodings")
    pip = (sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--target")
    done = subprocess.run([*pip, library, *packages], capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip(f"inkex is not to be had here: {done.stderr.strip().splitlines()[-1]}")
    files = [extensions / name for name in inkscape.FILES if name.endswith(".inx")]
    words = [extensions / "camtool_output.py", *sorted(files)]
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", INKEX, *words],
        env={**os.environ, "PYTHONPATH": str(library)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("inkscape") is None, reason="Inkscape is not here")
def test_inkscape_itself_saves_the_program(extensions: Path, part: Path, camtool: Run) -> None:
    program = part.with_suffix(".nc")
    done = subprocess.run(
        [
            "inkscape", str(part), f"--export-filename={program}",
            "--export-extension=org.camtool.output",
        ],
        env={**os.environ, "INKSCAPE_PROFILE_DIR": str(extensions.parent)},
        capture_output=True,
        timeout=120,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr.decode()
    flags = ("-t", "grbl", "--job", part.with_suffix(".toml"), "-o", "-")
    posted = camtool("post", part, *flags).stdout
    # Comments name the line of an element, which Inkscape writes on another one.
    blocks = [re.sub(rb"\(.*\)", b"", text) for text in (program.read_bytes(), posted)]
    assert blocks[0] == blocks[1], "machine and job are those of the folder"
    assert b"Z-0.700" in blocks[0]


def test_the_files_are_in_the_package() -> None:
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    assert '"cli/inkscape/*.inx"' in text
