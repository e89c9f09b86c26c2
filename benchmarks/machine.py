"""What figures depend on besides the codes, how calls are timed, and where the figures are kept."""

from __future__ import annotations

import gc
import json
import math
import os
import platform
import subprocess
import sys
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from reference import RESULTS

PACKAGES = (
    "wheeltapper", "numba", "llvmlite", "numpy", "scipy", "scikit-sundae", "heyoka", "diffrax", "jax", "mpmath",
)  # fmt: skip


def cpu() -> str:
    """Return the processor's name."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor()


def commit() -> str:
    """Return the commit of the source, with a sign if it was changed since."""
    command = ["git", "describe", "--always", "--dirty", "--abbrev=12"]
    try:
        done = subprocess.run(command, cwd=RESULTS.parent.parent, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    return done.stdout.strip()


def installed(package: str) -> str | None:
    """Return the version of a package; None where it is not installed."""
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def load() -> float | None:
    """Return how many processes wanted a core in the last minute, where the system tells."""
    return os.getloadavg()[0] if hasattr(os, "getloadavg") else None


def surroundings() -> dict[str, Any]:
    """Return what the figures depend on besides the codes."""
    return {
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "commit": commit(),
        "cpu": cpu(),
        "cores": os.cpu_count(),
        "load": load(),
        "system": f"{platform.system()} {platform.machine()}",
        "versions": {"python": platform.python_version()} | {name: installed(name) for name in PACKAGES},
    }


def prepare() -> dict[str, Any]:
    """Print and return the surroundings, and silence what is known of the cases."""
    warnings.filterwarnings("ignore", message="the irregularity is more sharply hollow")  # true, and meant so
    around = surroundings()
    print(f"{around['cpu']}, {around['cores']} cores, load {around['load']}, commit {around['commit']}")
    print(", ".join(f"{name} {number}" for name, number in around["versions"].items() if number))
    return around


def without_nan(data: Any) -> Any:
    """Return plain data with None where a number is not finite, which JSON does not know."""
    if isinstance(data, dict):
        return {str(name): without_nan(value) for name, value in data.items()}
    if isinstance(data, list | tuple):
        return [without_nan(value) for value in data]
    return None if isinstance(data, float) and not math.isfinite(data) else data


def store(name: str, result: dict[str, Any]) -> None:
    """Write a result to the folder of results."""
    RESULTS.mkdir(exist_ok=True)
    path = RESULTS / f"{name}-{datetime.now(UTC):%Y%m%dT%H%M%S}.json"
    path.write_text(json.dumps(without_nan(result), indent=1, allow_nan=False), encoding="utf-8")
    print(f"\nwritten to {path}", file=sys.stderr)


@contextmanager
def no_garbage_collection() -> Iterator[None]:
    """Keep Python's garbage collector from stepping into a timed call."""
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        gc.enable()


def seconds(run: Callable[[], Any]) -> float:
    """Return how long a call takes."""
    start = time.perf_counter()
    run()
    return time.perf_counter() - start


def shortest(run: Callable[[], Any], rounds: int) -> float:
    """Return the shortest time of some calls, s."""
    with no_garbage_collection():
        return min(seconds(run) for _ in range(rounds))
