"""All comparisons in one run: the core's cases, the feature map, ensembles, and the share of the processor's peak.

    uv run --group peers python benchmarks/compare.py [--rounds 10] [--side 256] [--samples 24] [--scaling]

The rules are in README.md beside this file.
"""

from __future__ import annotations

import argparse

import core
import maps
import peak


def main() -> None:
    """Measure, print and store."""
    parser = argparse.ArgumentParser(
        description="Compare wheeltapper with its peers.", parents=[core.arguments(), maps.arguments()]
    )
    asked = parser.parse_args()
    result = core.introduced()
    result |= {"cases": core.run(asked)} | maps.run(asked) | {"peak": peak.measure()}
    core.store("compare", result)


if __name__ == "__main__":
    main()
