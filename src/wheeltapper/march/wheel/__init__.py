"""The march of one wheel on a stiff rail or on a deck: alone, eight at a time, with tangents, in orbits."""
