"""Contact laws, one file each."""

from wheeltapper.describe.contact.hertz import Hertz
from wheeltapper.describe.contact.linear import Linear
from wheeltapper.describe.contact.restitution import hysteresis_from_restitution

__all__ = ["Hertz", "Linear", "hysteresis_from_restitution"]
