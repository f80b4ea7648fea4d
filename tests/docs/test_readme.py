"""The README holds its promises: set-up commands as CI runs them, links that lead somewhere."""

import re
from pathlib import Path

import yaml

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = [ROOT / "README.md", *sorted(ROOT.glob("docs/**/*.md"))]


def set_up_commands() -> list[str]:
    blocks = re.findall(r"```sh\n(.*?)```", README, flags=re.DOTALL)
    return [line for block in blocks for line in block.splitlines()]


def test_the_readme_has_exactly_two_set_up_commands() -> None:
    commands = set_up_commands()
    assert len(commands) == 2
    assert all(line.startswith("python3 -m venv .venv && .venv/bin/pip") for line in commands)


def test_ci_runs_them_as_the_readme_has_them() -> None:
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8").splitlines()
    ran = [line for line in script if line.startswith("python3 -m venv .venv")]
    assert ran == set_up_commands()
    assert script[-1] == set_up_commands()[-1]


def test_hooks_and_pull_requests_run_the_checks_of_ci() -> None:
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    (hooks,) = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text("utf-8"))["repos"]
    commands = [hook["entry"].partition(" ") for hook in hooks["hooks"]]
    assert [tool for tool, _, _ in commands] == ["ruff", "ruff", "mypy"]
    for tool, _, arguments in commands:
        assert re.search(rf'bin/{tool}"? {re.escape(arguments)}$', script, re.MULTILINE)
    workflow = yaml.safe_load((ROOT / ".github" / "workflows" / "ci.yml").read_text("utf-8"))
    assert {"run": ".ci/run"} in workflow["jobs"]["check"]["steps"]


def test_its_job_on_github_gives_the_action_what_it_takes() -> None:
    (block,) = re.findall(r"```yaml\n(.*?)```", README, flags=re.DOTALL)
    (step,) = (
        step for step in yaml.safe_load(block)["jobs"]["drawings"]["steps"] if "with" in step
    )
    inputs = yaml.safe_load((ROOT / "action.yml").read_text(encoding="utf-8"))["inputs"]
    needed = {name for name, each in inputs.items() if each.get("required")}
    assert needed <= step["with"].keys() <= inputs.keys()


def test_every_link_leads_somewhere() -> None:
    for page in PAGES:
        for link in re.findall(r"\]\(([^)#\s]+)[^)]*\)", page.read_text(encoding="utf-8")):
            if "://" not in link:
                assert (page.parent / link).exists(), f"{page.name}: {link}"


def test_every_file_that_a_page_names_exists() -> None:
    name_of_file = re.compile(r"`((?:camtool|postprocessors|tests|samples|docs)/[\w./-]*\w/?)`")
    for page in PAGES:
        for name in name_of_file.findall(page.read_text(encoding="utf-8")):
            assert (ROOT / name).exists(), f"{page.name}: {name}"
