"""The steps of a wheel: their equations, written once, and the code that is derived from them.

`equations` says what a step is, as a `tape` of power series. `derive` turns a tape into lines of code, `scalar` these
into the functions that march one wheel, `lanes` into those for eight cells at a time, `tangents` into those of both
that differentiate, and `powers` into those that check the energy. `written` compiles what a march needs, by the numbers
in `variants`, and `calling` calls it.
"""
