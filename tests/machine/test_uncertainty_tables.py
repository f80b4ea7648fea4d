"""How well a machine's numbers are known, as its file says it: what holds, and what is refused."""

from __future__ import annotations

import json
import pickle
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.inspect import type_info

from camtool.errors import MachineError
from camtool.machine.model import CORRELATED_KEYS, Machine, Uncertainty
from camtool.target.registry import load_target, target_names
from camtool.target.template import machine_template
from tests.machine.numbers import FILES, loaded, numbers_of

ALL = tuple(f"uncertainty.{key}=0.01" for key in CORRELATED_KEYS)


def built(*settings: str) -> Machine:
    return loaded("grbl", *settings)


def test_what_is_left_out_is_not_known() -> None:
    said = built("uncertainty.process_mm=0.0").uncertainty
    assert said.process_mm == 0.0
    assert [said.standard(key) for key in CORRELATED_KEYS] == [None] * 15
    assert said.standard("process_mm") == 0.0
    assert said.machine_expansion_per_k is None


def test_values_that_hold() -> None:
    said = built(
        "uncertainty.x.backlash_mm=0.005",
        "uncertainty.x.scale=2e-4",
        "uncertainty.squareness_rad=0.1",
        "uncertainty.part_expansion_per_k=23e-6",
        'uncertainty.correlations=[["x.scale", "x.backlash_mm", -0.5]]',
    ).uncertainty
    assert (said.x.backlash_mm, said.standard("x.scale")) == (0.005, 2e-4)
    assert said.correlation(("x.backlash_mm", "squareness_rad", "x.scale")).tolist() == [
        [1.0, 0.0, -0.5],
        [0.0, 1.0, 0.0],
        [-0.5, 0.0, 1.0],
    ]
    assert said.correlation(("x.scale", "y.scale")).tolist() == np.eye(2).tolist()


@pytest.mark.parametrize("target", target_names())
def test_programs_do_not_depend_on_it(target: str) -> None:
    """A program that was posted before a calibration may be sent after it."""
    base = load_target(target, machine_file=FILES.get(target)).machine
    machine = loaded(target, *ALL, "uncertainty.process_mm=0.02")
    assert machine != base
    assert machine.digest == base.digest
    assert pickle.loads(pickle.dumps(machine)) == machine


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (["uncertainty.process=0.1"], ["[uncertainty], key process", "did you mean process_mm"]),
        (["uncertainty.w.scale=0.1"], ["[uncertainty], key w", "unknown key"]),
        (["uncertainty.x.scales=0.1"], ["[uncertainty.x], key scales", "mean scale?"]),
        (["uncertainty.x.scale=0.2"], ["[uncertainty.x], key scale", "between 0 and 0.1"]),
        (["uncertainty.process_mm=-0.1"], ["key process_mm", "-0.1 is not between 0 and 100"]),
        (["uncertainty.process_mm=unknown"], ["key process_mm", "float"]),
        (["uncertainty.process_mm=nan"], ["uncertainty.process_mm", "not finite"]),
    ],
)
def test_wrong_keys_and_values(settings: list[str], words: list[str]) -> None:
    refused(settings, words)


@pytest.mark.parametrize(
    ("pairs", "words"),
    [
        ([["x.scale", "y.scale", 1.01]], ["correlations[0][2]", "between -1 and 1"]),
        ([["x.scale", "y.scale"]], ["correlations[0]", "length 3"]),
        ([["x.scale", "y.scal", 0.1]], ["correlations[0]", "'y.scal'", "mean y.scale?"]),
        ([["x.scale", "process_mm", 0.1]], ["'process_mm' is nothing", "squareness_rad"]),
        ([["x.scale", "x.scale", 0.1]], ["x.scale is correlated with itself"]),
        (
            [["x.scale", "y.scale", 0.1], ["y.scale", "x.scale", 0.1]],
            ["correlations[1]", "y.scale is correlated twice with x.scale"],
        ),
        (
            [["x.scale", "y.scale", 0.9], ["y.scale", "runout_mm", 0.9],
             ["runout_mm", "x.scale", -0.9], ["temperature_k", "squareness_rad", 0.5]],
            ["x.scale, y.scale, runout_mm contradict", "not positive semidefinite", "by 0.55 or"],
        ),
    ],
)  # fmt: skip
def test_wrong_correlations(pairs: list[list[object]], words: list[str]) -> None:
    where = "table [uncertainty], key correlations"
    refused([*ALL, f"uncertainty.correlations={json.dumps(pairs)}"], [where, *words])


def test_a_correlation_of_what_is_not_known() -> None:
    refused(
        ["uncertainty.x.scale=0.001", 'uncertainty.correlations=[["x.scale", "y.scale", 0.1]]'],
        ["the uncertainty of y.scale is not given", "give uncertainty.y.scale, or leave"],
    )


def refused(settings: list[str], words: list[str]) -> None:
    with pytest.raises(MachineError) as caught:
        built(*settings)
    message = str(caught.value)
    for word in words:
        assert word in message
    assert "\n" not in message
    assert "--set" in message


def test_the_file_is_named(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(
        'extends = "grbl"\n[uncertainty]\ncorrelations = [["x.scale", "y.scale", 0.1]]\n'
    )
    with pytest.raises(MachineError, match=r"mine\.toml: table \[uncertainty\]"):
        load_target("grbl", machine_file=file)


def test_a_new_machine_file_lists_every_key() -> None:
    text = machine_template("mine", "grbl", "[axes.x]\n[uncertainty]\nprocess_mm = 0.01 # said\n")
    table, listed = "", set[str]()
    for line in text.splitlines():
        table = line.strip("[]") if line.startswith("[") else table
        key = re.match(r"##? (\w+) = ", line)
        if key and table.startswith("uncertainty"):
            listed.add(f"{table}.{key[1]}")
    every = {path.partition("[]")[0] for path, _ in numbers_of(type_info(Uncertainty))}
    assert listed == {f"uncertainty.{key}" for key in every - {"correlations"}}
    assert "\n# process_mm = 0.01 # said\n" in text
    assert text.count("process_mm") == 1


PAIRS = [(a, b) for i, a in enumerate(CORRELATED_KEYS) for b in CORRELATED_KEYS[i + 1 :]]


def uncertain(pairs: tuple[tuple[str, str, float], ...]) -> Uncertainty:
    said = built(*ALL).uncertainty
    return Uncertainty(
        x=said.x, y=said.y, z=said.x, squareness_rad=0.01, tool_diameter_mm=0.01, runout_mm=0.01,
        temperature_k=1.0, z_zero_mm=0.01, stock_thickness_mm=0.01, correlations=pairs,
    )  # fmt: skip


@given(st.data())
def test_correlations_of_real_numbers_are_taken(data: st.DataObject) -> None:
    """Those of any columns of numbers, whole or rounded to four decimals."""
    seed = data.draw(st.integers(0, 10**6))
    rows = data.draw(st.integers(1, 15))
    columns = np.random.default_rng(seed).standard_normal((rows, len(CORRELATED_KEYS)))
    matrix = columns.T @ columns
    matrix /= np.sqrt(np.outer(np.diag(matrix), np.diag(matrix)))
    pairs = tuple(
        (a, b, round(float(matrix[CORRELATED_KEYS.index(a), CORRELATED_KEYS.index(b)]), 4))
        for a, b in PAIRS
    )
    uncertain(pairs).check()


@given(st.lists(st.sampled_from(PAIRS), unique=True, max_size=8), st.data())
def test_the_check_is_that_of_the_eigenvalues_and_its_mend_mends(
    pairs: list[tuple[str, str]], data: st.DataObject
) -> None:
    given_pairs = tuple((a, b, data.draw(st.floats(-1.0, 1.0))) for a, b in pairs)
    said = uncertain(given_pairs)
    least = float(np.linalg.eigvalsh(said.correlation(CORRELATED_KEYS))[0])
    try:
        said.check()
    except MachineError as error:
        assert least < -0.0009
        factor = float(str(error.mend).split("them by ")[1].split()[0])
        assert factor < 1.0
        uncertain(tuple((a, b, factor * r) for a, b, r in given_pairs)).check()
    else:
        assert least > -0.0011
