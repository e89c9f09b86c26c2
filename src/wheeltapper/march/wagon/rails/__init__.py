"""The wagon's march on rails that give way."""
