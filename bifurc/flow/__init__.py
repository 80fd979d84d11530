"""Motion in time: closed form between events, first events with a bound, and the one rule that says what follows them.

`simulate` is the verb, `trajectory` its result.  `scan` integrates from event to event; `settle` with `rule` decides what
follows an event; `saltation` is the derivative across it.  Three engines move a state: `affine`, `laws` (modes under a law that
is not affine), `modal` (many degrees of freedom); `delayed` has motions with feedback from the past, `hysteresis` drives single
elements.  Start reading at `simulate`.
"""
