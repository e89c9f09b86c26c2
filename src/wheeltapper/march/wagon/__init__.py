"""The march of wagons, rigid bodies in space, on stiff rails, on decks and on rails that bend."""
