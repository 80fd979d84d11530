"""Attractors: found from where motions end (`discovery`), confirmed (`attractors`), recognised.

`continuum` tells the members of a continuum of orbits, `trapping` finds boxes that a chaotic attractor never
leaves; `matching` follows attractors from one parameter value to the next.  Start reading at `discovery`.
"""
