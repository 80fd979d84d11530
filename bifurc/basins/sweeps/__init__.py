"""Over parameters: `attractor_sweep` (attractors and basin shares), `diagram` and `chart` (brute force).

`points` is one parameter value of a sweep, `sections` the section points of a diagram or a chart.
Start reading at `attractor_sweep`.
"""
