"""Everything in one run: this package against its peers, and against the machine.

    uv run --group peers python benchmarks/compare.py [--rounds 10] [--side 256] [--samples 64] [--cells 1024]

One trajectory at a time (core.py), many trajectories (ensembles.py), the feature map on all cores (maps.py; with
--scaling also maps of 1e4 to 1e7 cells), and the fraction of the processor's peak (peak.py): five minutes on two cores.
The tables are printed, and stored with versions, processor, load and commit in the folder of results. The rules are in
README.md beside this file.
"""

from __future__ import annotations

import core
import ensembles
import maps
import peak
from machine import load, prepare, store
from options import need_peers, parser_of
from problems import CASES


def main() -> None:
    """Measure, print and store."""
    parser = parser_of(__doc__)
    parser.add_argument("--rounds", type=int, default=10, help="rounds of each interleaved measurement (default 10)")
    parser.add_argument("--map-rounds", type=int, default=3, help="the same for the map and its peers (default 3)")
    maps.arguments(parser)
    ensembles.arguments(parser)
    options = parser.parse_args()
    need_peers()
    if options.smallest:
        options.rounds, options.map_rounds, options.cells, options.side, options.samples = 1, 1, 64, 16, 2
    result = prepare()
    result["cases"] = {name: core.run(case, options.rounds) for name, case in CASES.items()}
    result["ensembles"] = {name: ensembles.run(CASES[name], options.cells, options.rounds) for name in CASES}
    result["map"] = maps.run(options.side, options.samples, options.map_rounds)
    if options.scaling:
        result["scaling"] = maps.scaling()
    result["peak"] = peak.run(options.side, options.cells, options.rounds)
    if not options.smallest:
        store("compare", result | {"load_at_the_end": load()})


if __name__ == "__main__":
    main()
