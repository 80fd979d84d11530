"""Batch kernels: one forcing period of many starts side by side, on one to three degrees of freedom.

`packing` says which scenes have one; `several_modes` (with `tables`) writes the text of the batch step of affine modes, `law_modes`
and `smooth` that under laws (with `stages`); substeps that it defers are integrated by `bifurc.ensemble.scalar.substep`; `driver`
runs it over periods; `writing` makes the module.  Start reading at `packing`.
"""
