"""Batch kernels: one forcing period of many starts side by side, on one to three degrees of freedom.

`packing` says which scenes have one and packs their numbers; `one_mode`, `several_modes` (with `tables`) and `smooth` (with
`runge_kutta`) write the text of the batch step; `certified` (one mass) and `deferred` (several) integrate what it defers;
`driver` runs both over periods (`blank` stands in for the written step); `writing` makes the module.  Start reading at `packing`.
"""
