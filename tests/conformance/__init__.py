"""Suites over families: what all of them must do. They take their members from the registry, a new file's too."""

from wheeltapper.describe.registry import makeable_nouns


def samples(family, **common):
    """Return one of every noun of a family, as its class says, by the name of the class."""
    return {kind.__name__: kind(**kind.example | common) for kind in makeable_nouns(family)}
