"""Contact laws: the normal force between wheel and rail."""

from typing import TYPE_CHECKING

from wheeltapper.describe.registry import room

if TYPE_CHECKING:
    from wheeltapper.describe.contact.base import Contact as Contact
    from wheeltapper.describe.contact.elastic import ElasticContact as ElasticContact
    from wheeltapper.describe.contact.elastic_plastic import ElasticPlastic as ElasticPlastic
    from wheeltapper.describe.contact.force_law import ForceLaw as ForceLaw
    from wheeltapper.describe.contact.hertz import Hertz as Hertz
    from wheeltapper.describe.contact.jackson_green import JacksonGreen as JacksonGreen
    from wheeltapper.describe.contact.kogut_etsion import KogutEtsion as KogutEtsion
    from wheeltapper.describe.contact.law import Law as Law
    from wheeltapper.describe.contact.linear import Linear as Linear
    from wheeltapper.describe.contact.restitution import hysteresis_from_restitution as hysteresis_from_restitution
    from wheeltapper.describe.contact.stronge import Stronge as Stronge
    from wheeltapper.describe.contact.thornton import Thornton as Thornton
else:
    __getattr__, __dir__ = room(__name__)
