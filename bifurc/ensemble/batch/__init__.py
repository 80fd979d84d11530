"""Batch kernels: one forcing period of many starts side by side, on one to three degrees of freedom.

`packing` says which scenes have one; `several_modes` (with `tables`) writes the text of the batch step of affine modes, `one_mode`
that of one mass with one stop in the same words, `law_modes` and `smooth` those under laws (with `stages`, `runge_kutta`);
`certified` (a period, one stop) and `deferred` (a substep) integrate what it defers; `driver` runs it over periods (`blank` stands
in for the written step); `writing` makes the module.  Start reading at `packing`.
"""
