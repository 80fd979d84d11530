"""The engine of affine modes: states, guards and their first zeros in closed form from the Taylor tables.

`engine` moves a state; `event_free` passes whole steps while a bound proves that no guard reaches zero; `polynomial` finds the
first zero of a guard on a step, `peak` its largest maximum along a segment.  Start reading at `engine`.
"""
