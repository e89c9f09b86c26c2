"""Frames: what the server sends, a head in JSON and arrays of numbers behind it, in one binary message."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

BLOCK = 8
"""Arrays begin at multiples of this many bytes, so that a browser reads them where they lie."""
DTYPES: dict[str, np.dtype[Any]] = {"<f8": np.dtype("<f8"), "<f4": np.dtype("<f4"), "|u1": np.dtype("u1")}


class Frame:
    """A message with arrays; the head names an array by its number.

    Parameters
    ----------
    kind
        What the message is.
    head
        What is said beside the arrays, as JSON holds it.
    """

    def __init__(self, kind: str, **head: Any) -> None:
        self.head: dict[str, Any] = {"kind": kind} | head
        self._arrays: list[NDArray[Any]] = []

    def array(self, values: Any) -> int:
        """Add an array of floats (or of bytes) and return its number."""
        held = np.asarray(values)
        held = held if held.dtype == np.uint8 else held.astype("<f8", copy=False)
        self._arrays.append(np.ascontiguousarray(held).ravel())
        return len(self._arrays) - 1

    def encoded(self) -> bytes:
        """Return the message: the length of the head, the head, the arrays."""
        places, offset = [], 0
        for held in self._arrays:
            places.append([held.dtype.str, offset, held.size])
            offset += -(-held.nbytes // BLOCK) * BLOCK
        text = json.dumps(_plain(self.head | {"arrays": places}), ensure_ascii=False, allow_nan=False).encode()
        text += b" " * (-(4 + len(text)) % BLOCK)
        parts = [struct.pack("<I", len(text)), text]
        for held in self._arrays:
            parts += [held.tobytes(), b"\0" * (-held.nbytes % BLOCK)]
        return b"".join(parts)


def _plain(value: Any) -> Any:
    """Return a value as JSON knows it: NumPy's numbers as Python's, what is not finite as null."""
    if isinstance(value, dict):
        return {str(name): _plain(held) for name, held in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(held) for held in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value


def decoded(message: bytes) -> tuple[dict[str, Any], list[NDArray[Any]]]:
    """Return the head and the arrays of a message; tests and benchmarks read with it what a page reads."""
    (length,) = struct.unpack_from("<I", message)
    head = json.loads(message[4 : 4 + length])
    begin = 4 + length
    places: list[tuple[str, int, int]] = head.pop("arrays")
    return head, [np.frombuffer(message, DTYPES[dtype], size, begin + offset) for dtype, offset, size in places]
