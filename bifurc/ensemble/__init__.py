"""Many starts over whole forcing periods: what basins, cell maps, sweeps and edge states stand on.

`grid` and `region` say which starts, `initial_conditions` in which mode each begins, `outcomes` what became of it.
`integrator` labels starts and `period_map` maps them, by the fastest kernel that the scene allows: `batch` (many starts side
by side), `scalar` (any scene), or the simulation; `proximity` tells which attractor a section point has reached.
Start reading at `integrator`.
"""
