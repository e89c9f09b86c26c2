"""Contact laws, one file each."""

from wheeltapper.describe.contact.elastic_plastic import ElasticPlastic
from wheeltapper.describe.contact.hertz import Hertz
from wheeltapper.describe.contact.jackson_green import JacksonGreen
from wheeltapper.describe.contact.kogut_etsion import KogutEtsion
from wheeltapper.describe.contact.linear import Linear
from wheeltapper.describe.contact.restitution import hysteresis_from_restitution
from wheeltapper.describe.contact.stronge import Stronge
from wheeltapper.describe.contact.thornton import Thornton

__all__ = [
    "ElasticPlastic",
    "Hertz",
    "JacksonGreen",
    "KogutEtsion",
    "Linear",
    "Stronge",
    "Thornton",
    "hysteresis_from_restitution",
]
