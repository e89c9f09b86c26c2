"""The kernels of dampers with an end of their own: loaded from the cache, and the same without compilation."""

import contextlib
import json
import os
import subprocess
import sys

import pytest

SCRIPT = """
import json, sys
import wheeltapper as wt
scene = wt.Scenario(
    vehicle=wt.Wheelset(
        mass=1500, load=91307, stiffness=2.44e6, damping=5e4, damper_play=2e-5, damper_play_start=0.3,
        bush_stiffness=1e8 if "bush" in sys.argv else None,
    ),
    track=wt.FloatingDeck(mass=3000, stiffness=1e7) if "bush" in sys.argv else wt.StiffTrack(),
    contact=wt.Hertz(constant=1.405e11, hysteresis=0.2 if "bush" in sys.argv else None),
    irregularity=wt.CosineBump(height=2e-4, length=0.05, start=0.01),
    rolling="point", speed=9, duration=0.02,
)
record = wt.simulate(scene)
print(json.dumps({
    "times": record.events.time.values.tolist(),
    "stops": record.damper_events.time.values.tolist(),
    "forces": record.peaks.normal_force.values.tolist(),
    "end": record.at(record.end).damper_end_displacement.values.tolist(),
    "lost": record.energy.dissipated_suspension.item(),
}))
"""


def answer(*arguments, **environment):
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", SCRIPT, *arguments], env=os.environ | environment, capture_output=True,
        text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout), done.stderr


def answer_here(arguments, capsys, monkeypatch):
    """Return what the script says in this process, whose kernels are loaded already."""
    monkeypatch.setattr(sys, "argv", ["script", *arguments])
    with contextlib.suppress(SystemExit):
        exec(SCRIPT, {})
    return json.loads(capsys.readouterr().out)


@pytest.mark.few(1)
@pytest.mark.slow
@pytest.mark.parametrize("arguments", [(), ("bush",)])
def test_without_compilation_the_answers_are_the_same_and_a_second_process_compiles_nothing(
    arguments, capsys, monkeypatch
):
    plain, _ = answer(*arguments, NUMBA_DISABLE_JIT="1")
    compiled = answer_here(arguments, capsys, monkeypatch)
    again, said = answer(*arguments)
    assert "compiling" not in said
    assert len(plain["times"]) == len(compiled["times"]) >= 2
    assert len(plain["stops"]) == len(compiled["stops"]) >= 4
    for name in plain:
        assert plain[name] == pytest.approx(compiled[name], rel=1e-9, abs=1e-15)
        assert again[name] == pytest.approx(compiled[name], rel=1e-13)
