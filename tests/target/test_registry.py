"""Targets are found by entry point; a broken one harms nothing else."""

import os
import pickle
import sys
from importlib import import_module, metadata
from inspect import isfunction
from pathlib import Path

import pytest
from click.testing import CliRunner

from camtool.cli.targets import targets
from camtool.errors import CamtoolError, MachineError, PostError, UnknownTargetError
from camtool.plugins import EntryPoint, entry_points
from camtool.target import registry
from camtool.target.registry import each_target, list_target, load_target, target_names


def test_pic_mmh_is_installed() -> None:
    assert "pic-mmh" in target_names()
    target = load_target("pic-mmh")
    assert target.machine.target.name == "pic-mmh"
    assert target.target.name == "pic-mmh"


@pytest.mark.parametrize("name", target_names())
def test_the_functions_that_a_target_names_exist(name: str) -> None:
    target = type(registry.find_target(name)[0])
    methods = filter(isfunction, vars(target).values())
    paths = [vars(method)["path"] for method in methods if "path" in vars(method)]
    assert {path.rpartition(":")[2] for path in paths} >= {"write_program"}
    for path in paths:
        module, _, function = path.partition(":")
        assert callable(getattr(import_module(module), function)), path


@pytest.mark.parametrize("name", ["pic-mhm", "picmmh", "", "nothing like it"])
def test_an_unknown_target_is_told_the_nearest(name: str) -> None:
    with pytest.raises(UnknownTargetError, match="pic-mmh"):
        load_target(name)


def test_a_broken_plug_in_is_named_and_harms_nothing_else(monkeypatch: pytest.MonkeyPatch) -> None:
    broken = EntryPoint("broken", "no_such_module:POST")
    good = EntryPoint("pic-mmh", "camtool_postprocessors.pic_mmh:POST")
    monkeypatch.setattr(registry, "entry_points", lambda group: (broken, good))
    assert target_names() == ["broken", "pic-mmh"]
    assert load_target("pic-mmh").machine.target.name == "pic-mmh"
    with pytest.raises(MachineError, match="'broken' cannot be loaded") as caught:
        load_target("broken")
    assert "no_such_module" in str(caught.value)
    errors: list[CamtoolError] = []
    assert [name for name, _ in each_target(list_target, broken=errors)] == ["pic-mmh"]
    assert [str(error) for error in errors] == [str(caught.value)]
    assert not list(each_target(list_target, prefix="grbl"))


@pytest.mark.parametrize(
    "group", [registry.GROUP, "camtool.operations", "console_scripts", "none"]
)
def test_entry_points_are_those_of_the_standard_library(
    group: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    for package, text in {
        "one-1.0": f"[other]\nx = y:z\n\n[{group}]\n# x = none\na.b = one:Thing.of\nc=two\n",
        "Camtool-99": f"[{group}]\nfirst = of.two : INSTALLED\n",
        "none-2": "",
    }.items():
        folder = tmp_path / f"{package}.dist-info"
        folder.mkdir()
        name, _, version = package.partition("-")
        (folder / "METADATA").write_text(
            f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n"
        )
        (folder / "entry_points.txt").write_text(text)
    theirs = metadata.entry_points(group=group)
    assert len(theirs) >= 3
    assert sorted((each.name, each.module, each.attr) for each in entry_points(group)) == sorted(
        (each.name, each.module, each.attr or "") for each in theirs
    )
    archive = tmp_path / "archive.zip"
    archive.write_bytes(b"")
    monkeypatch.setattr(sys, "path", [*sys.path, str(archive)])
    assert sorted(each.name for each in entry_points(group)) == sorted(theirs.names)


def test_a_package_installed_meanwhile_is_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "path", [*sys.path, str(tmp_path)])
    os.utime(tmp_path, (1, 1))  # the clock of files may stand still for some milliseconds
    before = target_names()
    folder = tmp_path / "meanwhile-1.0.dist-info"
    folder.mkdir()
    (folder / "METADATA").write_text("Metadata-Version: 2.1\nName: meanwhile\nVersion: 1.0\n")
    (folder / "entry_points.txt").write_text(f"[{registry.GROUP}]\nmeanwhile = nowhere:POST\n")
    assert target_names() == sorted([*before, "meanwhile"])
    os.utime(tmp_path, (1, 1))
    (folder / "METADATA").unlink()
    (folder / "entry_points.txt").unlink()
    folder.rmdir()
    assert target_names() == before


def test_a_dialect_checks_its_own_table() -> None:
    with pytest.raises(MachineError, match="form"):
        load_target("pic-mmh", settings=["dialect.form=roman"])
    with pytest.raises(MachineError, match="fourm"):
        load_target("pic-mmh", settings=["dialect.fourm=annex"])


def test_a_target_that_needs_the_user_is_listed_and_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    whole = registry.read_table(list_target("pic-mmh").file)
    axes = whole["axes"] | {"x": {"travel_mm": 10.0}}
    partial = whole | {"axes": axes, "needs": ["axes.x.coded_step_mm"]}
    monkeypatch.setattr(registry, "read_table", lambda file: partial)
    listed = list_target("pic-mmh")
    assert (listed.target.extension, listed.needs) == (".pic", ("axes.x.coded_step_mm",))
    with pytest.raises(MachineError, match="--machine FILE"):
        load_target("pic-mmh")
    shown = CliRunner().invoke(targets, [])
    assert "pic-mmh" in shown.stdout
    assert "(needs --machine FILE: axes.x.coded_step_mm)" in shown.stdout


def test_a_listed_target_is_checked() -> None:
    assert list_target("pic-mmh").needs == ()
    with pytest.raises(UnknownTargetError):
        list_target("pic")


def test_what_a_plug_in_raises_is_its_own_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    class Post:
        name = "mine"

        def write(self, toolpath: object, machine: object) -> None:
            raise TypeError("no such thing")

    post = registry.Guarded(Post(), "their_module:POST")
    with pytest.raises(PostError) as refused:
        post.write(None, None)
    said = str(refused.value)
    assert "plug-in their_module:POST: fails to write (TypeError: no such thing)" in said
    assert post.name == "mine"
    assert not hasattr(post, "listing")
    again = pickle.loads(pickle.dumps(registry.Guarded(len, "builtins:len")))
    assert again.__self__ is not None


@pytest.mark.parametrize(
    ("name", "reason"),
    [("haas", "only its language is described"), ("klipper", "only its language is described")],
)
def test_a_target_without_a_virtual_controller_says_why(name: str, reason: str) -> None:
    with pytest.raises(MachineError, match=reason):
        load_target(name).twin()
    path_alone = load_target("grbl").with_settings(["controller.model=path"])
    with pytest.raises(MachineError, match="its own is grbl"):
        path_alone.twin()
