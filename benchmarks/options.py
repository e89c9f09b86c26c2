"""Options of all these programs, and their message if a peer is missing."""

from __future__ import annotations

import argparse
import sys
from importlib.util import find_spec

PEERS = ("heyoka", "sksundae", "diffrax", "jax")
"""Modules of the other codes, which are a dependency group of their own."""


def parser_of(text: str | None) -> argparse.ArgumentParser:
    """Return a command line with a program's description, and with --smallest."""
    parser = argparse.ArgumentParser(description=text, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--smallest", action="store_true", help="the smallest run there is: to see that it still works")
    return parser


def need_peers() -> None:
    """End with exit code 2 where a peer is missing."""
    missing = [name for name in PEERS if find_spec(name) is None]
    if missing:
        print(f"not installed: {', '.join(missing)}; `uv run --group peers python ...` installs them", file=sys.stderr)
        raise SystemExit(2)
