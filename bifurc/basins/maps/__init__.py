"""Basin maps: `compute` labels a grid, `basin_map` is the result.

`labelling` runs the parts, `refinement` spares cells far from boundaries; `label_noise` and `reliability` say how many labels
an error could change, `entropy` and `uncertainty_exponent` how mixed they are.  Start reading at `compute`.
"""
