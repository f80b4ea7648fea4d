"""Targets are found by entry point; a broken one harms nothing else."""

from importlib.metadata import EntryPoint, EntryPoints

import pytest

from camtool.errors import MachineError, UnknownTargetError
from camtool.machine import registry
from camtool.machine.registry import load_target, target_names


def test_pic_mmh_is_installed() -> None:
    assert "pic-mmh" in target_names()
    target = load_target("pic-mmh")
    assert target.machine.target.name == "pic-mmh"
    assert target.post.name == "pic-mmh"


@pytest.mark.parametrize("name", ["pic-mhm", "picmmh", "", "nothing like it"])
def test_an_unknown_target_is_told_the_nearest(name: str) -> None:
    with pytest.raises(UnknownTargetError, match="pic-mmh"):
        load_target(name)


def test_a_broken_plug_in_is_named_and_harms_nothing_else(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    broken = EntryPoint("broken", "no_such_module:POST", registry.GROUP)
    good = EntryPoint("pic-mmh", "camtool_postprocessors.pic_mmh:POST", registry.GROUP)
    monkeypatch.setattr(registry, "entry_points", lambda group: EntryPoints([broken, good]))
    assert target_names() == ["broken", "pic-mmh"]
    assert load_target("pic-mmh").machine.target.name == "pic-mmh"
    with pytest.raises(MachineError, match="'broken' cannot be loaded") as caught:
        load_target("broken")
    assert "no_such_module" in str(caught.value)


def test_a_dialect_checks_its_own_table() -> None:
    with pytest.raises(MachineError, match="form"):
        load_target("pic-mmh", settings=["dialect.form=roman"])
    with pytest.raises(MachineError, match="fourm"):
        load_target("pic-mmh", settings=["dialect.fourm=annex"])
