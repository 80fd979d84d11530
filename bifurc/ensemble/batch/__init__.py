"""Batch kernels: one forcing period of many starts side by side, on one to three degrees of freedom.

`packing` says which scenes have one and packs their numbers; `several_modes` (with `tables`) writes the text of the batch step of
affine modes, `one_mode` that of one mass with one stop in the same words, `smooth` that under laws (with `stages`, `runge_kutta`,
and `law_modes` for guards); `certified` (one stop) and `deferred` integrate what it defers; `driver` runs
both over periods (`blank` stands in for the written step); `writing` makes the module.  Start reading at `packing`.
"""
