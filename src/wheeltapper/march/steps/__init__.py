"""The steps of a wheel: their equations, written once, and the code that is derived from them.

`equations` says what a step is, as a `tape` of power series. `derive` turns a tape into lines of code, and `scalar`
these into the functions that march one wheel; `written` compiles those that a march needs, and `calling` calls them.
"""
