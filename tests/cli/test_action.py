"""The action's own steps, run as GitHub runs them: its expressions worked out from an event, and
`bash --noprofile --norc -eo pipefail` (actions/runner, ADR 0277, "run-action shell options").
"""

import json
import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.cli.conftest import ROOT, Run

ACTION = yaml.safe_load((ROOT / "action.yml").read_text(encoding="utf-8"))
STEPS = ACTION["runs"]["steps"]
RING = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="40mm" height="40mm" viewBox="0 0 40 40">'
    '<circle cx="20" cy="20" r="{radius}"/></svg>'
)
HOLE = "0\nSECTION\n2\nENTITIES\n0\nCIRCLE\n8\n0\n10\n9\n20\n9\n40\n5\n0\nENDSEC\n0\nEOF\n"
"""A circle as the smallest DXF; it has no unit."""

EXPRESSION = re.compile(r"\$\{\{(.*?)\}\}")
REFUSED = set('":<>|*?\r\n')
"""What upload-artifact takes in no name (actions/toolkit, path-and-artifact-name-validation)."""

PATH = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
RECORDER = f"""#!{sys.executable}
import json, os, pathlib, sys
if sys.argv[1] == "targets":
    print(json.dumps({{"targets": [{{"name": "grbl", "extension": ".nc"}}]}}))
    sys.exit()
place = pathlib.Path(sys.argv[sys.argv.index("--report") + 1])
place.write_text("# " + place.name)
at = sys.argv.index("--annotations")
pathlib.Path(sys.argv[at + 1]).write_text("")
del sys.argv[at : at + 2]
with open(os.environ["RECORD"], "a") as stream:
    print(json.dumps(sys.argv[1:]), file=stream)
sys.exit("fails" in sys.argv[2])
"""
"""Stands for camtool: says what it was called with, and fails on files called so."""


def evaluated(text: str, contexts: dict[str, Any]) -> str:
    """A value of action.yml with its `${{ a.b || c.d }}` worked out."""

    def one(found: re.Match[str]) -> str:
        for way in found[1].split("||"):
            value: Any = contexts
            for name in way.strip().split("."):
                value = value.get(name) if isinstance(value, dict) else None
            if value:
                return str(value)
        return ""

    return EXPRESSION.sub(one, text)


def test_expressions_are_worked_out() -> None:
    contexts = {"github": {"event": {"before": "b"}}, "inputs": {"all": "false"}}
    said = "x ${{ github.event.pull_request.base.sha || github.event.before }} ${{ inputs.none }}"
    assert evaluated(said, contexts) == "x b "


@dataclass(frozen=True)
class Ran:
    """Exit code, output and files of a step."""

    code: int
    log: str
    summary: str
    outputs: dict[str, str]
    made: Path
    calls: list[list[str]]


def step(identifier: str = "run") -> dict[str, Any]:
    (found,) = [step for step in STEPS if step.get("id", step.get("name")) == identifier]
    return found


def run_step(
    folder: Path, event: dict[str, Any], *, path: str = PATH, name: str = "run", **inputs: str
) -> Ran:
    """Run a step of the action in this repository, for this event and these inputs."""
    there = folder.parent / "runner"
    shutil.rmtree(there, ignore_errors=True)
    there.mkdir()
    given = {key: str(value.get("default", "")) for key, value in ACTION["inputs"].items()}
    contexts = {
        "inputs": given | inputs,
        "github": {"event": event, "action_path": str(ROOT)},
        "runner": {"temp": str(there)},
    }
    chosen = step(name)
    env = {key: evaluated(str(value), contexts) for key, value in chosen["env"].items()}
    files = {"GITHUB_STEP_SUMMARY": "summary", "GITHUB_OUTPUT": "output", "RECORD": "record"}
    env |= {key: str(there / file) for key, file in files.items()} | {"PATH": path}
    script = there / "step.sh"
    script.write_text(chosen["run"])
    command = ["bash", "--noprofile", "--norc", "-eo", "pipefail", str(script)]
    done = subprocess.run(
        command,
        cwd=folder,
        env={**os.environ, **env},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,  # one log, in the order of its lines
        check=False,
    )
    log = done.stdout.decode()
    texts = {file: (there / file).read_text() if (there / file).exists() else ""
             for file in files.values()}  # fmt: skip
    outputs = dict(line.split("=") for line in texts["output"].splitlines())
    calls = [json.loads(line) for line in texts["record"].splitlines()]
    return Ran(done.returncode, log, texts["summary"], outputs, there / "camtool", calls)


def git(folder: Path, *arguments: str) -> str:
    who = ("-c", "user.name=t", "-c", "user.email=t@example.org")
    done = subprocess.run(
        ["git", *who, *arguments], cwd=folder, capture_output=True, text=True, check=True
    )
    return done.stdout.strip()


def committed(folder: Path, files: dict[str, str]) -> str:
    """A commit of these files; the commit before it."""
    for name, text in files.items():
        place = folder / name
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(text)
    if not (folder / ".git").exists():
        git(folder, "init", "-q")
        git(folder, "commit", "-qm", "none", "--allow-empty")
    before = git(folder, "rev-parse", "HEAD")
    git(folder, "add", ".")
    git(folder, "commit", "-qm", "more", "--allow-empty")
    return before


def request(base: str) -> dict[str, Any]:
    """Return the event of a pull request as GitHub sends it."""
    return {"pull_request": {"base": {"sha": base}}, "before": "1" * 40}


# with camtool itself


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    """A repository of two drawings; its last commit changes one and adds another."""
    folder = tmp_path / "repository"
    ring = RING.format
    committed(folder, {"old.svg": ring(radius=10), "parts/changed.svg": ring(radius=10)})
    committed(
        folder,
        {
            "parts/changed.svg": ring(radius=9),
            "parts/$(touch owned) `x`;.svg": ring(radius=8),
            "parts/changed.toml": 'depth = "0.7mm"\n',
        },
    )
    return folder


def test_a_pull_request_posts_changed_drawings(repository: Path) -> None:
    ran = run_step(repository, request(git(repository, "rev-parse", "HEAD~1")), target="grbl")
    assert ran.code == 0
    assert ran.outputs == {"checked": "2", "failed": "0"}
    assert "# changed.svg" in ran.summary
    assert "old.svg" not in ran.summary
    assert "![" not in ran.summary
    assert b"Z-0.7" in (ran.made / "parts" / "changed.nc").read_bytes()
    assert (ran.made / "parts" / "changed.svg").read_bytes().startswith(b"<svg")
    assert (ran.made / "parts" / "$(touch owned) `x`;.nc").exists()
    assert not list(repository.rglob("owned"))
    assert git(repository, "status", "--porcelain") == ""


def test_a_pull_request_shows_what_is_cut_differently(repository: Path) -> None:
    """The first commit has no job: a tool without width would leave no stock to compare."""
    job = 'kind = "pocket"\ndepth = "{depth}mm"\ntool_diameter = "2mm"\n'
    committed(repository, {"parts/changed.toml": job.format(depth=0.5)})
    base = committed(repository, {"parts/changed.toml": job.format(depth=0.7),
                                  "parts/changed.svg": RING.format(radius=9.5)})  # fmt: skip
    ran = run_step(repository, request(base), target="grbl", diff="--max-difference 0.05mm")
    assert (ran.code, ran.outputs["checked"]) == (0, "1")
    text = (ran.made / "parts" / "changed.diff.txt").read_text()
    assert "B cuts more: by 0.5" in text  # in the plane; the floor is 0.2 mm deeper
    assert "B cuts less: nowhere by more than" in text
    assert text in ran.summary
    assert (ran.made / "parts" / "changed.diff.html").read_text().count("<svg") == 4
    assert "base" not in {file.name for file in ran.made.iterdir()}
    assert git(repository, "status", "--porcelain") == ""


@pytest.mark.slow
def test_it_fails_with_a_page_of_why(repository: Path) -> None:
    base = git(repository, "rev-parse", "HEAD~1")
    ran = run_step(repository, request(base), target="grbl", flags="--max-time 1s --quiet")
    assert ran.code == 1
    assert ran.outputs == {"checked": "2", "failed": "2"}
    assert "ABOVE_GATE" in ran.summary


@pytest.mark.slow
def test_it_verifies_programs_against_their_drawings(camtool: Run, repository: Path) -> None:
    camtool("post", repository / "old.svg", "-t", "grbl", "-o", repository / "old.nc")
    base = committed(repository, {})
    ran = run_step(repository, {"before": base}, target="grbl", mode="verify", files="*.nc")
    assert (ran.code, ran.outputs) == (0, {"checked": "1", "failed": "0"})
    assert "# old.nc" in ran.summary
    assert "| --against | ./old.svg |" in ran.summary


# with what only says how it was called


@pytest.fixture
def recorder(tmp_path: Path) -> str:
    """A PATH on which camtool says how it was called."""
    place = tmp_path / "bin" / "camtool"
    place.parent.mkdir()
    place.write_text(RECORDER)
    place.chmod(0o755)
    return f"{place.parent}{os.pathsep}{PATH}"


ODD = ("a b.dxf", "it's.dxf", 'say "hi".dxf', "-dash.dxf", "two\nlines.dxf", "co:lon.dxf",
       "$(touch owned).dxf", "]x[.dxf", "größe.dxf", "::error::x.dxf", "in/-n.dxf")  # fmt: skip


def test_odd_names_are_words(tmp_path: Path, recorder: str) -> None:
    folder = tmp_path / "repository"
    base = committed(folder, dict.fromkeys(ODD, HOLE))
    ran = run_step(folder, request(base), path=recorder, target="grbl")
    assert (ran.code, ran.outputs) == (0, {"checked": str(len(ODD)), "failed": "0"})
    assert sorted(call[1] for call in ran.calls) == sorted(f"./{name}" for name in ODD)
    pages = [file.relative_to(ran.made) for file in ran.made.rglob("*.md")]
    assert len(pages) == len(ODD)
    assert not [page for page in pages if REFUSED & set(str(page))]
    assert not list(tmp_path.rglob("owned"))


def test_names_that_become_alike_keep_their_own_pages(tmp_path: Path, recorder: str) -> None:
    folder = tmp_path / "repository"
    base = committed(folder, dict.fromkeys(("a:.dxf", "a?.dxf", "a_.dxf", "a_.svg"), HOLE))
    ran = run_step(folder, request(base), path=recorder, target="grbl")
    assert ran.outputs["checked"] == "3"
    assert len(list(ran.made.rglob("*.md"))) == 3
    assert "passed over, for it is called like another file: a_.svg" in ran.log


def test_limits_beside_a_drawing_are_inspected(tmp_path: Path, recorder: str) -> None:
    folder = tmp_path / "repository"
    names = ("a.dxf", "b.dxf", "in/c.svg", "c.nc", "d.nc")
    committed(folder, dict.fromkeys(names, HOLE))
    for name in ("a", "in/c", "c", "d"):
        committed(folder, {f"{name}.tolerances.toml": ""})
    committed(folder, {"c.svg": HOLE})
    ran = run_step(folder, {}, path=recorder, target="grbl")
    said = {call[1]: call[call.index("-o") + 2 :] for call in ran.calls}
    assert said["./a.dxf"] == ["--tolerances", "./a.tolerances.toml"]
    assert said["./b.dxf"] == []
    assert said["./in/c.svg"] == ["--tolerances", "./in/c.tolerances.toml"]
    ran = run_step(folder, {}, path=recorder, target="grbl", mode="verify", files="*.nc")
    said = {call[1]: call[6:] for call in ran.calls}
    limits = ["--tolerances", "./c.tolerances.toml"]
    assert said == {"./c.nc": ["--against", "./c.svg", *limits], "./d.nc": []}


def test_flags_are_taken_as_a_shell_takes_them(tmp_path: Path, recorder: str) -> None:
    folder = tmp_path / "repository"
    base = committed(folder, {"a.dxf": HOLE})
    flags = "--layer 'My Layer'\n--set \"axes.x.backlash_mm=0.1\" $(touch owned) *"
    ran = run_step(folder, request(base), path=recorder, target="grbl", flags=flags)
    (call,) = ran.calls
    assert call[6:] == [
        "--layer", "My Layer", "--set", "axes.x.backlash_mm=0.1", "$(touch", "owned)", "*",
        "-o", str(ran.made / "a.nc"),
    ]  # fmt: skip
    assert not list(tmp_path.rglob("owned"))
    ran = run_step(folder, request(base), path=recorder, target="grbl", flags="--layer 'My")
    assert (ran.code, ran.calls) == (2, [])
    assert "flags hold a quote without its end" in ran.log


@pytest.mark.parametrize(
    ("event", "inputs"),
    [
        ({"before": "0" * 40}, {}),
        ({"before": "1" * 40}, {}),
        ({}, {}),
        ({"before": "HEAD"}, {"all": "true"}),
    ],
    ids=["a new branch", "a commit that is gone", "by hand or by the clock", "all asked for"],
)
def test_all_files_where_no_base_is_known(
    tmp_path: Path, recorder: str, event: dict[str, Any], inputs: dict[str, str]
) -> None:
    folder = tmp_path / "repository"
    committed(folder, {"a.dxf": HOLE, "b/c.svg": "", "readme.md": ""})
    ran = run_step(folder, event, path=recorder, target="grbl", **inputs)
    assert [call[1] for call in ran.calls] == ["./a.dxf", "./b/c.svg"]


def test_nothing_changed_is_fine(tmp_path: Path, recorder: str) -> None:
    folder = tmp_path / "repository"
    committed(folder, {"a.dxf": HOLE})
    base = committed(folder, {"readme.md": "x"})
    for event in (request(base), {"merge_group": {"base_sha": base}}, {"before": base}):
        ran = run_step(folder, event, path=recorder, target="grbl")
        assert (ran.code, ran.outputs) == (0, {"checked": "0", "failed": "0"})
        assert "0 checked" in ran.summary


def test_removed_and_renamed_drawings(tmp_path: Path, recorder: str) -> None:
    folder = tmp_path / "repository"
    committed(folder, {"a.dxf": HOLE, "b.dxf": HOLE + " "})
    git(folder, "rm", "-q", "a.dxf")
    git(folder, "mv", "b.dxf", "c.dxf")
    ran = run_step(folder, request(committed(folder, {})), path=recorder, target="grbl")
    assert [call[1] for call in ran.calls] == ["./c.dxf"]


def test_one_that_fails_does_not_hide_the_others(tmp_path: Path, recorder: str) -> None:
    folder = tmp_path / "repository"
    base = committed(folder, dict.fromkeys(("a.dxf", "fails.dxf", "z.dxf"), HOLE))
    ran = run_step(folder, request(base), path=recorder, target="grbl")
    assert (ran.code, ran.outputs) == (1, {"checked": "3", "failed": "1"})
    assert [call[1] for call in ran.calls] == ["./a.dxf", "./fails.dxf", "./z.dxf"]


def test_verifying_takes_the_drawing_beside(tmp_path: Path, recorder: str) -> None:
    folder = tmp_path / "repository"
    base = committed(folder, dict.fromkeys(("a b.nc", "a b.svg", "alone.nc"), ""))
    inputs = {"target": "grbl", "mode": "verify", "files": "\n  *.nc  \n\n"}
    ran = run_step(folder, request(base), path=recorder, **inputs)
    assert [call[:2] + call[6:] for call in ran.calls] == [
        ["verify", "./a b.nc", "--against", "./a b.svg"],
        ["verify", "./alone.nc"],
    ]


@pytest.mark.parametrize(
    ("inputs", "words"),
    [
        ({"mode": "post; rm"}, "mode is neither post nor verify"),
        ({"files": " \n"}, "files holds no pattern"),
        ({"files": ":(nonsense)x"}, "nonsense"),
    ],
)
def test_wrong_inputs_fail(
    tmp_path: Path, recorder: str, inputs: dict[str, str], words: str
) -> None:
    folder = tmp_path / "repository"
    committed(folder, {"a.dxf": HOLE})
    ran = run_step(folder, {}, path=recorder, **({"target": "grbl"} | inputs))
    assert ran.code != 0
    assert words in ran.log
    assert ran.calls == []


def test_a_summary_stays_below_what_github_takes(tmp_path: Path, recorder: str) -> None:
    folder = tmp_path / "repository"
    base = committed(folder, {f"{i:02}.dxf": HOLE for i in range(20)})
    ran = run_step(folder, request(base), path=recorder, target="grbl")
    assert ran.outputs["checked"] == "20"
    assert ran.summary.count("# ") == 14
    assert "20 checked, 0 failed, 14 shown here" in ran.summary


# what stands in the file


def test_camtool_is_installed_from_where_the_action_is(tmp_path: Path) -> None:
    chosen = step("Install camtool")
    contexts = {"github": {"action_path": "/a place/camtool"}}
    source = evaluated(chosen["env"]["CAMTOOL_SOURCE"], contexts)
    script = f"python() {{ printf '<%s>' \"$@\"; }}; {chosen['run']}"
    command = ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", script]
    wheels = tmp_path / "the wheels"
    env = os.environ | {"CAMTOOL_SOURCE": source, "WHEELS": str(wheels)}

    def said() -> str:
        return subprocess.run(command, env=env, capture_output=True, check=True).stdout.decode()

    install = f"<-m><pip><install><--quiet><--no-index><--find-links><{wheels}><camtool>"
    wheel = f"<-m><pip><wheel><--quiet><--wheel-dir><{wheels}></a place/camtool>"
    assert said() == wheel + install
    wheels.mkdir()
    (wheels / "camtool-0.1.0-cp312-cp312-linux_x86_64.whl").touch()
    assert said() == install, "what was kept is not built again"


def test_nothing_of_a_pull_request_stands_in_the_script() -> None:
    assert "${{" not in "".join(step.get("run", "") for step in STEPS)
    assert set(step()["env"]) >= {"MODE", "TARGET", "FILES", "FLAGS", "ALL", "BASE", "OUT"}
    assert ACTION["runs"]["using"] == "composite"
    assert all("shell" in step for step in STEPS if "run" in step)


def commands_of(log: str) -> list[str]:
    """Return the commands that GitHub's runner obeys in a log: lines that begin with `::`, and
    `##[` anywhere, unless they are stopped (actions/runner, ActionCommandManager)."""
    obeyed, token = [], None
    for line in log.splitlines():
        stripped = line.lstrip()
        if token is not None:
            if stripped == f"::{token}::":
                token = None
        elif stripped.startswith("::stop-commands::"):
            token = stripped.removeprefix("::stop-commands::")
        elif stripped.startswith("::") or "##[" in line:
            obeyed.append(stripped)
    return obeyed


def test_findings_are_annotations_and_nothing_else_is_a_command(repository: Path) -> None:
    owned = "::error::owned%0A##[error]owned"
    hole = f'<g id="a\n{owned}"><circle cx="20" cy="20" r="0.2"/></g></svg>'
    text = RING.format(radius=10).replace("</svg>", hole)
    base = committed(repository, {"parts/odd.svg": text,
                                  f"parts/{owned}.svg": RING.format(radius=0.2)})  # fmt: skip
    ran = run_step(repository, request(base), target="grbl", flags="--tool-diameter 1mm -v")
    assert ran.code == 0, ran.log
    commands = commands_of(ran.log)
    assert "##[error]owned" in ran.log, "the log has the names as they are"
    assert any(re.match(r"::warning file=parts/odd\.svg,line=\d,", line) for line in commands), (
        commands
    )
    assert any(line.startswith("::warning file=parts/%3A%3Aerror") for line in commands)
    assert all(line.startswith("::warning file=parts/") for line in commands), commands


def test_the_wheels_are_kept_until_the_sources_change(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    named = run_step(tmp_path / "a", {}, name="wheels")
    assert named.code == 0, named.log
    key = named.outputs["key"]
    version = f"{sys.version_info[0]}.{sys.version_info[1]}-"
    assert re.fullmatch(re.escape(version) + "[0-9a-f]{64}", key)
    kept = next(each for each in STEPS if str(each.get("uses", "")).startswith("actions/cache@"))
    assert kept["with"]["key"].endswith("${{ steps.wheels.outputs.key }}")
    install = step("Install camtool")["env"]
    assert install["WHEELS"] == kept["with"]["path"]
    copy = tmp_path / "source"
    shutil.copytree(ROOT / "camtool" / "cli", copy / "camtool" / "cli")
    script, keys = step("wheels")["run"], set()
    for text in ("a", "b", "a"):
        (copy / "camtool" / "more.py").write_text(text)
        output = tmp_path / "output"
        output.write_text("")
        env = {**os.environ, "CAMTOOL_SOURCE": str(copy), "GITHUB_OUTPUT": str(output)}
        subprocess.run(["bash", "-ec", script], env=env, check=True)
        keys.add(output.read_text())
    assert len(keys) == 2
