"""Curves of special points in two parameters.

`tracing` is `trace_curve`; `problem` has the equations of a branch with one condition more, `unfolding` those of branch points.
`codimension_two` says what is tested along a curve, `leaving` and `resonant` where other curves and orbits start from there.
Start reading at `tracing`.
"""
