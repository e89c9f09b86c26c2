"""Compiled kernels: the cache sees every change of their sources, and without compilation the answers are the same."""

import contextlib
import json
import os
import random
import runpy
import shutil
import subprocess
import sys
import time
from pathlib import Path

import llvmlite.binding as llvm
import numba
import numpy as np
import pytest

from wheeltapper.ground.progress import reporting
from wheeltapper.march.compiling import prebuilt, store, telling
from wheeltapper.march.steps.layout import SCRATCH
from wheeltapper.march.wheel.roots import evaluate

PACKAGE = Path(__file__).resolve().parents[2] / "src" / "wheeltapper"

SCRIPT = """
import json, sys
import wheeltapper as wt
scene = wt.Scenario(
    vehicle=wt.Wheelset(mass=1500, load=91307, stiffness=2.44e6, damping=5e4),
    track=wt.FloatingDeck(mass=3000, stiffness=1e7) if "deck" in sys.argv else wt.StiffTrack(),
    contact=wt.Hertz(constant=1.405e11, hysteresis=0.2 if "deck" in sys.argv else None),
    irregularity=wt.CosineBump(height=2e-4, length=0.05, start=0.02),
    rolling="point", speed=9, duration=0.03,
)
record = wt.simulate(scene)
if "map" in sys.argv:
    over = {"vehicle.mass": [1400.0, 1500.0, 1600.0]}
    chart = wt.sweep(scene, over, [wt.features.first_loss(), wt.features.largest_force()])
    print(json.dumps({"times": chart.first_loss.values.tolist() * 2, "forces": chart.largest_force.values.tolist()}))
    sys.exit()
print(json.dumps({
    "times": record.events.time.values.tolist(),
    "forces": record.peaks.normal_force.values.tolist(),
    "end": record.at(record.end).wheel_displacement.values.tolist(),
}))
"""


def answer(*arguments, script=SCRIPT, **environment):
    done = subprocess.run(
        [sys.executable, "-c", script, *arguments], env=os.environ | environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout), done.stderr


def answer_here(arguments, capsys, monkeypatch):
    """Return what the script says in this process, whose kernels are loaded already."""
    monkeypatch.setattr(sys, "argv", ["script", *arguments])
    with contextlib.suppress(SystemExit):
        exec(SCRIPT, {})
    return json.loads(capsys.readouterr().out)


@pytest.mark.slow
@pytest.mark.parametrize(
    "arguments", [(), pytest.param(("deck",), marks=pytest.mark.slow), pytest.param(("map",), marks=pytest.mark.slow)]
)
def test_without_compilation_the_answers_are_the_same(arguments, capsys, monkeypatch):
    plain, _ = answer(*arguments, NUMBA_DISABLE_JIT="1")
    compiled = answer_here(arguments, capsys, monkeypatch)
    assert len(plain["times"]) == len(compiled["times"]) > 4
    for name in plain:
        assert plain[name] == pytest.approx(compiled[name], rel=1e-9, abs=1e-15)


SMALL = """
import json, sys
import numpy as np
from wheeltapper.march.steps.layout import SCRATCH
from wheeltapper.march.wheel.margin import _smallest_value

S = np.zeros(SCRATCH)
S[:3] = 5.0, -2.0, 1.0
print(json.dumps(_smallest_value(0, 2, 0.5, S)))
"""
"""Where 5 - 2·x + x² is smallest on (0, 0.5): a kernel that is compiled soon, with a callee in another file."""
TOLD = "wheeltapper: compiling wheel.margin._smallest_value for this machine, once\n"


@pytest.mark.slow
def test_an_edited_kernel_is_compiled_again(tmp_path):
    shutil.copytree(PACKAGE, tmp_path / "wheeltapper", ignore=shutil.ignore_patterns("__pycache__"))
    place = {"PYTHONPATH": str(tmp_path), "WHEELTAPPER_CACHE": str(tmp_path / "cache")}
    assert answer(script=SMALL, **place) == (4.25, TOLD)
    assert answer(script=SMALL, **place) == (4.25, "")
    roots = tmp_path / "wheeltapper" / "march" / "wheel" / "roots.py"
    text = roots.read_text(encoding="utf-8")
    assert text.count("    total = a[at + n]\n") == 1
    roots.write_text(text.replace("    total = a[at + n]\n", "    total = 2.0 * a[at + n]\n"))
    assert answer(script=SMALL, **place) == (4.5, TOLD)  # 5 - 2·x + 2·x²
    assert answer(script=SMALL, **place) == (4.5, "")


PARTS = """
import json, sys
import numpy as np
from wheeltapper.march.steps.layout import SCRATCH
from wheeltapper.march.wheel.margin import _smallest_value
from wheeltapper.march.wheel.roots import evaluate

S = np.zeros(SCRATCH)
S[:3] = 5.0, -2.0, 1.0
if "first" in sys.argv:
    evaluate(S, 0, 2, 0.5)
_smallest_value(0, 2, 0.5, S)
shown = len(evaluate.overloads)
evaluate(S, 0, 2, 0.5)
code = _smallest_value.inspect_asm(_smallest_value.signatures[0])
print(json.dumps({"shown": shown, "lines": [line.split()[0] for line in code.splitlines() if line[:1] == "\t"]}))
"""
"""A kernel, and one that it calls, which Python calls before it, or only afterwards."""


@pytest.mark.whole
@pytest.mark.slow
def test_what_a_kernel_becomes_does_not_depend_on_what_python_has_called_before(tmp_path):
    alone, _ = answer(script=PARTS, WHEELTAPPER_CACHE=str(tmp_path / "alone"))
    after, _ = answer("first", script=PARTS, WHEELTAPPER_CACHE=str(tmp_path / "after"))
    again, _ = answer(script=PARTS, WHEELTAPPER_CACHE=str(tmp_path / "after"))
    assert (alone["shown"], after["shown"], again["shown"]) == (0, 1, 0)
    assert alone["lines"] == after["lines"]
    assert len(alone["lines"]) > 20


@pytest.mark.whole
@pytest.mark.slow
def test_where_nothing_can_be_written_it_compiles_and_runs(tmp_path):
    (tmp_path / "home").write_text("in the way")  # even of the superuser
    place = {"XDG_CACHE_HOME": str(tmp_path / "home"), "WHEELTAPPER_CACHE": "", "NUMBA_CACHE_DIR": ""}
    found, said = answer(**place)
    assert "compiling" in said
    assert said.count("compiled kernels are not kept") == 1
    assert len(found["times"]) > 4


@pytest.mark.slow
def test_a_package_that_cannot_be_written_is_compiled_into_the_user_s_folder(tmp_path):
    shutil.copytree(PACKAGE, tmp_path / "wheeltapper", ignore=shutil.ignore_patterns("__pycache__"))
    for path in [tmp_path / "wheeltapper", *(tmp_path / "wheeltapper").rglob("*")]:
        path.chmod(path.stat().st_mode & ~0o222)
    home = tmp_path / "home"
    home.mkdir()
    place = {"PYTHONPATH": str(tmp_path), "XDG_CACHE_HOME": str(home), "WHEELTAPPER_CACHE": "", "NUMBA_CACHE_DIR": ""}
    assert answer(script=SMALL, **place) == (4.25, TOLD)
    assert answer(script=SMALL, **place) == (4.25, "")
    assert list((home / "wheeltapper" / "kernels").rglob("*.code"))


@pytest.mark.slow
def test_a_second_clone_of_the_same_sources_compiles_nothing(tmp_path):
    place = {"WHEELTAPPER_CACHE": str(tmp_path / "cache")}
    for clone in ("one", "two"):
        shutil.copytree(PACKAGE, tmp_path / clone / "wheeltapper", ignore=shutil.ignore_patterns("__pycache__"))
        _, said = answer(script=SMALL, PYTHONPATH=str(tmp_path / clone), **place)
        assert said == (TOLD if clone == "one" else "")


@pytest.mark.whole
@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="has other rights")
def test_nothing_is_read_from_a_folder_that_others_can_write(tmp_path):
    cache = tmp_path / "cache"
    place = {"WHEELTAPPER_CACHE": str(cache)}
    answer(script=SMALL, **place)
    (folder,) = cache.glob("wheel-*")
    for one in (cache, folder):
        one.chmod(0o777)
        found, said = answer(script=SMALL, **place)
        one.chmod(0o700)
        assert found == 4.25
        note = f"wheeltapper: {cache} can be written by other users: compiled kernels are not kept, "
        assert said == f"{note}each process compiles its own\n{TOLD}"
    assert answer(script=SMALL, **place) == (4.25, "")


@pytest.mark.slow
def test_a_damaged_file_is_compiled_again(tmp_path):
    place = {"WHEELTAPPER_CACHE": str(tmp_path)}
    answer(script=SMALL, **place)
    for damage in (
        lambda data: data[:100],
        lambda data: b"",
        lambda data: data[:50] + bytes([data[50] ^ 1]) + data[51:],
    ):
        for path in tmp_path.rglob("wheel.margin._smallest_value.*.code"):
            path.write_bytes(damage(path.read_bytes()))
        assert answer(script=SMALL, **place) == (4.25, TOLD)
        assert answer(script=SMALL, **place) == (4.25, "")


FULL_DISK = (
    """
import errno, pathlib

def no_room(self, data):
    raise OSError(errno.ENOSPC, "No space left on device")

pathlib.Path.write_bytes = no_room
"""
    + SMALL
)


@pytest.mark.slow
def test_a_full_disk_costs_one_line(tmp_path):
    found, said = answer(script=FULL_DISK, WHEELTAPPER_CACHE=str(tmp_path))
    assert found == 4.25
    assert sorted(said.splitlines()) == [
        f"wheeltapper: {tmp_path}: a compiled kernel could not be kept (No space left on device)", TOLD.strip(),
    ]  # fmt: skip
    assert not [path for path in tmp_path.rglob("*") if path.is_file() and path.stat().st_size]


@pytest.mark.whole
@pytest.mark.slow
def test_of_two_processes_one_compiles(tmp_path):
    environment = os.environ | {"WHEELTAPPER_CACHE": str(tmp_path)}
    start = [sys.executable, "-c", SCRIPT]
    both = [
        subprocess.Popen(start, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        for _ in range(2)
    ]
    told = [process.communicate() for process in both]
    assert [process.returncode for process in both] == [0, 0]
    assert told[0][0] == told[1][0]
    lines = [line for _, said in told for line in said.splitlines() if ": compiling" in line]
    compiled = [line for line in lines if "a wheel's steps" not in line]  # one line for several functions
    assert len(compiled) == len(set(compiled)) > 2


@pytest.mark.whole
@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="kills by signals")
def test_kills_leave_a_cache_that_works(tmp_path):
    dice = random.Random(38)
    environment = os.environ | {"WHEELTAPPER_CACHE": str(tmp_path)}
    for kill in range(20):
        if kill % 4 == 3:
            shutil.rmtree(tmp_path)
        process = subprocess.Popen([sys.executable, "-c", SMALL], env=environment, stderr=subprocess.DEVNULL)
        with contextlib.suppress(subprocess.TimeoutExpired):
            process.wait(dice.uniform(0.3, 3.0))
        process.kill()
        process.wait()
        if kill % 5 == 4:
            assert answer(script=SMALL, WHEELTAPPER_CACHE=str(tmp_path))[0] == 4.25
    assert answer(script=SMALL, WHEELTAPPER_CACHE=str(tmp_path)) == (4.25, "")


@pytest.mark.slow
def test_a_second_process_compiles_nothing_and_answers_with_the_same_bits(tmp_path):
    march = "record = wt.simulate(scene)\n"
    script = SCRIPT.replace(march, f"{march}assert abs(float(record.energy.relative_imbalance)) < 1e-9\n")
    first, said = answer(script=script, WHEELTAPPER_CACHE=str(tmp_path))
    assert said.count(": compiling") > 2
    assert answer(script=script, WHEELTAPPER_CACHE=str(tmp_path)) == (first, "")


SLIDER = """
import json
from pathlib import Path
import wheeltapper as wt
from wheeltapper.faces.explore.paths import Files
from wheeltapper.faces.explore.session import Session
scene = wt.Scenario(
    vehicle=wt.Wheelset(mass=1500, load=91307, stiffness=2.44e6, damping=5e4), contact=wt.Hertz(constant=1.405e11),
    irregularity=wt.CosineBump(height=2e-4, length=0.05, start=0.02), rolling="point", speed=9, duration=0.03,
)
session, told = Session("page", scene, Files(Path("."))), [[], [], []]
for value, lines in zip((0.0, 0.1, 0.2), told):
    assert not session.edit([{"do": "set", "path": "contact.hysteresis", "value": value}])
    session.marched(lambda: False, lines.append)
print(json.dumps([[line for line in lines if line.startswith("compiling")] for lines in told]))
"""


@pytest.mark.whole
@pytest.mark.slow
def test_a_slider_of_the_explorer_that_meets_a_new_term_says_what_is_compiled(tmp_path):
    first, second, third = answer(script=SLIDER, WHEELTAPPER_CACHE=str(tmp_path))[0]
    assert any("the wheelset's march" in line for line in first)
    assert second
    assert all("a wheel's steps" in line for line in second)
    assert third == []


FOUND_AGAIN = """
import importlib, json, pickle, sys
import wheeltapper.march
from wheeltapper.march.compiling import guests, kept, store, telling
from wheeltapper.march.steps import written

told = []
telling.say = told.append
asked = 0
steps = {}
for functions in written.EVERY:
    for order in written.ORDERS:
        for number in range(len(functions.addresses[order])):
            source = functions.source(number, order)
            steps[source[len("def "):source.index("(")]] = source
for room in kept.ROOMS:
    held = store.store_of(room)
    for file in sorted(held.folder.glob("*.code")):
        _, reduced = pickle.loads(held.read(file.name))
        *place, name = file.name.split(".")[:-2]
        if name in steps:
            kernel = written.compiled(steps[name])
        else:
            kernel = getattr(importlib.import_module(".".join(["wheeltapper", "march", *place])), name)
        kernel.compile(reduced[3].args)
        asked += 1
print(json.dumps([asked, told]))
"""
"""Ask for every kernel that was compiled, in another process."""


@pytest.mark.whole
@pytest.mark.slow
def test_whatever_was_compiled_is_found_again_by_another_process():
    answer()  # a few, if nothing was
    (asked, told), _ = answer(script=FOUND_AGAIN)
    assert told == []
    assert asked > 5


TINY = """
from wheeltapper.march.common.kernel import kernel, shared_kernel

@kernel
def unit(x):
    return 1.0 + 0.0 * x

@shared_kernel
def inner(x):
    return 2.0 * x

@kernel
def between(x):
    return inner(x) + unit(x)

@kernel
def outer(x):
    return between(x) * inner(1.0)
"""
CALL_TINY = """
import json, sys
from wheeltapper.march.common import tiny
from wheeltapper.march.compiling.pipeline import code_of
if "first" in sys.argv:
    assert tiny.unit(0.0) == 1.0
names = {}
found = tiny.outer(3.0)
inner, outer = (code_of(*one.overloads.values()) for one in (tiny.inner, tiny.outer))
symbol = inner.itself.symbol
defined = {one.name for one in outer._shared_module.functions} if outer._shared_module else set()
print(json.dumps([found, symbol, symbol in defined]))
"""
"""A kernel that calls a shared one, by itself and by way of a part."""


@pytest.mark.slow
def test_a_shared_kernel_has_one_copy_and_who_calls_another_one_is_compiled_again(tmp_path):
    shutil.copytree(PACKAGE, tmp_path / "wheeltapper", ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "wheeltapper" / "march" / "common" / "tiny.py").write_text(TINY)
    place = {"PYTHONPATH": str(tmp_path), "WHEELTAPPER_CACHE": str(tmp_path / "cache")}
    told = "wheeltapper: compiling common.tiny.{} for this machine, once\n"
    first, said = answer(script=CALL_TINY, **place)
    assert said == told.format("outer")
    assert first[::2] == [14.0, False]
    assert answer(script=CALL_TINY, **place) == (first, "")
    for file in (tmp_path / "cache").rglob("common.tiny.inner.*.code"):
        file.unlink()
    again, said = answer("first", script=CALL_TINY, **place)  # where the shared one has another symbol
    assert again[0] == 14.0
    assert again[1] != first[1]
    assert said == told.format("unit") + told.format("inner") + told.format("outer")
    assert answer(script=CALL_TINY, **place) == (again, "")


@pytest.fixture
def brought(tmp_path):
    """Return where a package lies that brings a few kernels for a level, and the environment of its processes."""
    if not all(map(llvm.get_host_cpu_features().get, prebuilt.V3.split())):
        pytest.skip("this processor has no level")
    package = tmp_path / "wheeltapper"
    shutil.copytree(PACKAGE, package, ignore=shutil.ignore_patterns("__pycache__", "prebuilt"))
    (package / "march" / "common" / "tiny.py").write_text(TINY)
    place = {"PYTHONPATH": str(tmp_path), "WHEELTAPPER_CACHE": str(tmp_path / "level")}
    answer("first", script=CALL_TINY, NUMBA_CPU_NAME="x86-64-v3", NUMBA_CPU_FEATURES="", **place)
    gather = runpy.run_path(str(PACKAGE.parents[1] / "tools" / "prebuild.py"))["gather"]
    gather(tmp_path / "level", package / "march" / "prebuilt" / "x86-64-v3")
    return package / "march", place | {"WHEELTAPPER_CACHE": str(tmp_path / "cache")}


@pytest.mark.slow
def test_what_a_package_brings_is_neither_compiled_nor_written(brought):
    march, place = brought
    found, said = answer("first", script=CALL_TINY, **place)
    assert (found[0], said) == (14.0, "")
    assert not Path(place["WHEELTAPPER_CACHE"]).exists()
    off, said = answer(script=CALL_TINY, **place, WHEELTAPPER_PREBUILT="off")
    assert off[0] == 14.0
    assert "compiling common.tiny.outer" in said
    (damaged,) = march.rglob("common.tiny.outer.*.code")
    damaged.write_bytes(damaged.read_bytes()[:-1])
    assert prebuilt.counted(march / "prebuilt")["x86-64-v3"].total() == 2
    again, said = answer(script=CALL_TINY, **place)
    assert again == found  # of the shared kernel it brings, not of that which was compiled
    assert said.count("\n") == 1
    assert "compiling common.tiny.outer" in said


@pytest.mark.slow
def test_other_sources_than_those_of_what_is_brought_are_compiled_with_a_word(brought):
    march, place = brought
    other = TINY.replace("2.0 * x", "1.5 * 2.0 * x")  # of another size: byte-code goes by size and by whole seconds
    (march / "common" / "tiny.py").write_text(other)
    found, said = answer(script=CALL_TINY, **place)
    assert found[0] == 30.0
    assert said.startswith("wheeltapper: the prebuilt kernels are of ")
    assert said.count("the prebuilt kernels") == 1
    wrong = subprocess.run(
        [sys.executable, "-c", CALL_TINY], env=os.environ | place | {"WHEELTAPPER_PREBUILT": "v5"},
        capture_output=True, text=True,
    )  # fmt: skip
    assert "the environment: WHEELTAPPER_PREBUILT: found v5; allowed: one of off, x86-64-v3" in wrong.stderr


UNTOUCHED = """
import json, sys
import numba
from numba.core import caching, codegen, compiler, cpu, dispatcher, registry

def state():
    classes = [
        codegen.JITCodeLibrary, codegen.CPUCodeLibrary, codegen.CodeLibrary, codegen.JITCPUCodegen, caching.Cache,
        caching.CacheImpl, caching.CompileResultCacheImpl, caching.FunctionCache, caching.IndexDataCacheFile,
        dispatcher.Dispatcher, dispatcher._DispatcherBase, registry.CPUDispatcher, compiler.CompilerBase,
        compiler.Compiler, compiler.Flags, cpu.CPUContext, numba.types.Function,
    ]
    held = {f"{one.__name__}.{name}": value for one in classes for name, value in vars(one).items()}
    return {name: value for name, value in held.items() if "_abc" not in name}

before, locators = state(), list(caching.CacheImpl._locator_classes)
import wheeltapper as wt
from wheeltapper.march.wheel import ensemble, gradients, orbits, single
from wheeltapper.march.wagon import multibody, replay
from wheeltapper.march.general import march
from wheeltapper.march.wagon.rails import march
after = state()
changed = [name for name in before if after.get(name) is not before[name]] + sorted(set(after) - set(before))
print(json.dumps(changed + [str(one) for one in caching.CacheImpl._locator_classes if one not in locators]))
"""


@pytest.mark.slow
def test_importing_the_package_changes_nothing_of_numba_s():
    assert answer(script=UNTOUCHED)[0] == []


THEIRS = """
import json, math, sys
import numba, numpy as np
if "ours" in sys.argv:
    from wheeltapper.march.steps.layout import SCRATCH
    from wheeltapper.march.wheel.margin import _smallest_value
    S = np.zeros(SCRATCH)
    S[:3] = 5.0, -2.0, 1.0
    assert _smallest_value(0, 2, 0.5, S) == 4.25

@numba.njit
def inner(x, table):
    return math.sqrt(x) + table[np.searchsorted(table, x)]

@numba.njit(fastmath=True)
def theirs(xs, table):
    total = 0.0
    for x in xs:
        total += inner(x, table) if x > 0.0 else min(x, -1.0) ** 2
    return total

@numba.vectorize(["float64(float64)"])
def each(x):
    return abs(x) * 3.0

theirs(np.ones(3), np.linspace(0.0, 2.0, 9))
(code,) = theirs.inspect_asm().values()
print(json.dumps([line.split()[0] for line in code.splitlines() if line[:1] == "\t"] + each(np.ones(2)).tolist()))
"""


@pytest.mark.slow
def test_other_people_s_functions_become_the_same_machine_code():
    alone, _ = answer(script=THEIRS)
    beside, _ = answer("ours", script=THEIRS)
    assert alone == beside
    assert len(alone) > 50


def test_other_people_s_functions_are_told_that_they_cannot_call_a_kernel():
    from numba.core.errors import TypingError

    @numba.njit
    def theirs(S):
        return evaluate(S, 0, 2, 0.5)

    if numba.config.DISABLE_JIT:
        pytest.skip("nothing is compiled")
    with pytest.raises(TypingError, match="a kernel of wheeltapper cannot be called from a function that Numba"):
        theirs(np.zeros(SCRATCH))


# -- what is told ------------------------------------------------------------------------------------------------------


@pytest.fixture
def at_pace(monkeypatch):
    """Let the machine be as fast as that of the table, and one kernel be known."""
    monkeypatch.setattr(telling, "pace", telling._Pace())
    monkeypatch.setattr(telling, "costs", lambda: {"single.march_kernel": {"what": "the march", "seconds": 12.0}})


def test_what_is_compiled_is_told_with_its_time(at_pace, tmp_path, capsys):
    with telling.told("single.march_kernel", tmp_path):
        with telling.told("single.other", tmp_path):  # for it
            pass
        telling.tick()
    assert capsys.readouterr().err == "wheeltapper: compiling the march for this machine, once; about 12 s\n"
    with telling.told("margin.unknown", tmp_path):
        pass
    assert capsys.readouterr().err == "wheeltapper: compiling margin.unknown for this machine, once\n"


def test_the_many_functions_of_a_folder_are_told_once(at_pace, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(telling, "costs", lambda: {"steps": {"what": "a wheel's steps", "seconds": 0.9}})
    monkeypatch.setattr(telling, "_said", set())
    for name in ("steps.flat_12.flat_12", "steps.wave_12.wave_12", "margin.other"):
        with telling.told(name, tmp_path):
            pass
    lines = ["compiling a wheel's steps for this machine, once", "compiling margin.other for this machine, once"]
    assert capsys.readouterr().err.splitlines() == [f"wheeltapper: {line}" for line in lines]


def test_the_bar_of_a_compilation_goes_on_with_time_and_never_beyond_its_end(at_pace, tmp_path, monkeypatch):
    heard, clock = [], iter([0.0, 0.0, 3.0, 100.0, 100.0])
    monkeypatch.setattr(telling.time, "perf_counter", lambda: next(clock))
    with reporting(lambda *told: heard.append(told), lambda line: None), telling.told("single.march_kernel", tmp_path):
        telling.tick()
        telling.tick()
    assert heard == [("compiling the march", done, 12.0) for done in (0.0, 3.0, 0.99 * 12.0)]


def test_a_slower_machine_is_told_longer_times_also_by_the_next_process(at_pace, tmp_path, monkeypatch, capsys):
    clock = iter([0.0, 0.0, 36.0])
    monkeypatch.setattr(telling.time, "perf_counter", lambda: next(clock))
    with telling.told("single.march_kernel", tmp_path):
        pass
    monkeypatch.undo()
    capsys.readouterr()
    monkeypatch.setattr(telling, "pace", telling._Pace())
    monkeypatch.setattr(telling, "costs", lambda: {"single.march_kernel": {"what": "the march", "seconds": 12.0}})
    with telling.told("single.march_kernel", tmp_path):
        pass
    (seconds,) = [float(word) for word in capsys.readouterr().err.split() if word.isdigit()]
    assert 30.0 <= seconds <= 36.0
    (tmp_path / "pace.json").write_text("{")
    telling.pace.__init__()
    telling.pace.read(tmp_path)
    assert telling.pace.factor == 1.0


def test_who_listens_may_end_the_work_after_a_compilation(at_pace, tmp_path):
    done = []

    def stop(*told):
        raise KeyboardInterrupt

    with (
        pytest.raises(KeyboardInterrupt),
        reporting(stop, lambda line: None),
        telling.told("single.march_kernel", tmp_path),
    ):
        done.append(1)
    assert done == [1]


def test_old_sources_kernels_are_removed_and_the_last_ones_kept_with_all_that_is_not_ours(tmp_path, monkeypatch):
    monkeypatch.setenv("WHEELTAPPER_CACHE", str(tmp_path))
    for age in range(6):
        for march in ("wheel", "general"):
            (tmp_path / f"{march}-{age:020d}-cpython").mkdir()
            os.utime(tmp_path / f"{march}-{age:020d}-cpython", (time.time() - 1000 * age,) * 2)
    os.utime(tmp_path / f"general-{1:020d}-cpython", (0, 0))
    theirs = ["rails-photos", "wheel-drawings-2020", ".removed-mine"]
    for name in (*theirs, f".removed-{1:032x}"):
        (tmp_path / name).mkdir()
        os.utime(tmp_path / name, (0, 0))
    store.clean("wheel")
    assert len(list(tmp_path.glob("general-*"))) == 6
    store.clean("general")
    left = {f"wheel-{age:020d}-cpython" for age in range(3)} | {f"general-{age:020d}-cpython" for age in (0, 2, 3)}
    assert {path.name for path in tmp_path.iterdir()} == left | set(theirs)
