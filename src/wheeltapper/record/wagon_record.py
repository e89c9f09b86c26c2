"""An older name: records of wagons are of the same class as all others."""

from wheeltapper.record.record import Record as WagonRecord

__all__ = ["WagonRecord"]
