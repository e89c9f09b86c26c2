"""Every fault: what it changes can be fitted, told and printed; a new one is found by everything, and asked by none."""

import ast
import json
from pathlib import Path

import numpy as np
import pytest

import wheeltapper as wt
from wheeltapper.describe.registry import unregister
from wheeltapper.describe.scenario import write_toml
from wheeltapper.diagnosis import CATALOGUE, Fault, Prior, diagnose_train, read_rules
from wheeltapper.diagnosis.faults.base import PLAIN, listed
from wheeltapper.diagnosis.scale import Scale
from wheeltapper.faces.cli import main
from wheeltapper.lower.fields import Fields
from wheeltapper.record.limits.rule import OF_FAULTS

SOURCE = Path(__file__).parents[2] / "src" / "wheeltapper"
SITE = wt.load("examples/site.toml")
SHORT = SITE.model_copy(update={"passage": SITE.passage.replaced({"duration": 0.2})})
STIFFNESS = "vehicle.stiffness"


@pytest.fixture
def stiff_spring():
    """Register a fault for the length of a test."""

    class StiffSpring(Fault):
        name, part = "stiff spring", "suspension"
        meaning = "a primary spring is stiffer than it should be"
        size, usual, path = "stiffness over the healthy one", 30.0, STIFFNESS
        fields = {STIFFNESS: ("stiffness", "kN/mm", 1e-6)}  # noqa: RUF012

        def made(self, passage, size, place):
            return passage.replaced({STIFFNESS: size * passage.vehicle.stiffness})

        def believed(self, passage):
            return {STIFFNESS: Prior(20.0 * passage.vehicle.stiffness, 1.0, "lognormal")}

    yield StiffSpring
    unregister(StiffSpring)


@pytest.mark.parametrize("name", CATALOGUE)
def test_a_fault_believes_in_what_it_changes(name):
    fault, healthy = CATALOGUE[name], SITE.passage
    faulty = fault.passage(healthy)
    believed = fault.believed(healthy)
    changed = fault.path.replace(".-1.", f".{len(healthy.irregularity)}.")
    assert changed in believed
    assert all(np.isfinite(float(Fields(faulty)(path))) for path in believed)
    assert not fault.plain or set(believed) <= set(PLAIN)
    assert fault.plain or changed in fault.fields or fault.part == "wheel"
    assert set(fault.alarms) <= set(OF_FAULTS)
    assert fault.meaning in listed()
    assert fault.size in listed()


def test_faults_are_compared_in_the_order_of_their_ranks():
    ranks = [fault.rank for fault in CATALOGUE.values()]
    assert ranks == sorted(ranks)
    assert len(set(ranks)) == len(ranks) == 10
    assert CATALOGUE["free play"] == CATALOGUE["free play"] != CATALOGUE["soft bush"]


def test_no_other_module_asks_for_a_fault_by_its_name():
    """But for the paper's figures, which are about one of them."""
    asked, names = [], [*CATALOGUE]
    for path in SOURCE.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        if {"faults", "paper"} & set(path.parts) or not any(name in text for name in names):
            continue
        texts = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Constant) and node.value in names]
        asked += [f"{path.relative_to(SOURCE)}:{text.lineno}: {text.value!r}" for text in texts]
    assert asked == []


@pytest.mark.slow
def test_a_new_fault_is_synthesised_and_diagnosed(stiff_spring):
    (recording,) = wt.synthesise(SHORT, fault="stiff spring", seed=1)
    finding = wt.diagnose(recording, SHORT)
    assert finding.verdict == "stiff spring"
    assert finding.part == "suspension"
    assert finding.size == pytest.approx(30.0 * 2.44e6, rel=0.1)
    assert "stiffer than it should be" in str(finding)
    assert "kN/mm" in str(finding)
    assert diagnose_train([recording], SHORT, rules=read_rules()).table()[0]["verdict"] == "stiff spring"


@pytest.mark.slow
def test_a_new_fault_is_in_the_manual_and_assessed_on_the_command_line(stiff_spring, tmp_path):
    assert "   * - stiff spring\n     - a primary spring is stiffer" in listed()
    site = tmp_path / "site.toml"
    write_toml(SHORT, site)
    words = ["assess", str(site), "--faults", "stiff spring", "--count", "2", "--workers", "1"]
    assert main([*words, "--output", str(tmp_path / "out.json")]) == 0
    found = json.loads((tmp_path / "out.json").read_text())["faults"]["stiff spring"]
    assert (found["passages"], found["named"], found["auc"]) == (2, 1.0, 1.0)


def test_a_forgotten_fault_is_gone(stiff_spring):
    assert "stiff spring" in CATALOGUE
    unregister(stiff_spring)
    assert "stiff spring" not in CATALOGUE
    with pytest.raises(wt.InputError, match="'stiff spring'"):
        wt.synthesise(SHORT, fault="stiff spring")


def test_a_fault_needs_its_words_and_a_name_of_its_own():
    with pytest.raises(wt.InputError, match=r"Nameless\.name: found nothing"):
        type("Nameless", (Fault,), {})
    words = {"name": "free play", "part": "damper", "meaning": "", "size": "", "usual": 1.0}
    with pytest.raises(wt.InputError, match="a second 'free play'"):
        type("Again", (Fault,), words)
    assert type(CATALOGUE["free play"]).__name__ == "FreePlay"


def test_the_scale_of_a_passage_is_its_own():
    scale, heavier = Scale(SITE.passage), Scale(SITE.passage.replaced({"vehicle.mass": 6000.0}))
    vehicle, constant = SITE.passage.vehicle, 1.405e11
    indentation = (vehicle.weight / constant) ** (2 / 3)
    period = 2.0 * np.pi * np.sqrt(vehicle.mass / (1.5 * constant * indentation**0.5))
    assert scale.period == pytest.approx(period, rel=1e-12)
    assert heavier.period > 1.8 * scale.period
    assert (scale.height, scale.radius) == (2e-4, 0.46)
    linear = SITE.passage.replaced({"contact": wt.Linear(stiffness=2e9)})
    assert Scale(linear).period == pytest.approx(2.0 * np.pi * np.sqrt(vehicle.mass / 2e9), rel=1e-12)


def test_starts_grow_with_the_passage():
    """Play with the height of the irregularity, bushes with the damper."""
    small = SITE.passage
    large = small.replaced({"irregularity.0.height": 4e-4, "vehicle.damping": 2.0 * small.vehicle.damping})
    for name, path in (("free play", "vehicle.damper_play"), ("soft bush", "vehicle.bush_stiffness")):
        tried = [
            [float(Fields(one)(path)) for one in CATALOGUE[name].tried(passage, Scale(passage))]
            for passage in (small, large)
        ]
        assert len(tried[0]) >= 4
        assert tried[1] == pytest.approx([2.0 * size for size in tried[0]], rel=1e-12)
