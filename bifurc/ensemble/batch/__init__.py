"""Batch kernels: one forcing period of many starts side by side, on one to three degrees of freedom.

`packing` and `smooth` say which scenes have one, of affine modes and under laws; `several_modes` and `law_modes` write the text of
the batch step, with the numbers that it reads from `tables`; what it defers is integrated by `bifurc.ensemble.scalar.substep`;
`driver` runs it over periods, around the stand-in `step`; `writing` makes the module.  Start reading at `packing`.
"""
