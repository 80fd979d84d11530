"""Motion in time: closed form between events, first events with a bound, and the one rule that says what follows them.

`simulate` is the verb, `trajectory` its result.  `scan` integrates affine modes from event to event, `collocation` modes with a
law; `settle` with `rule` decides what follows an event; `saltation` is the derivative across it; `hysteresis` drives single
elements.  Start reading at `simulate`.
"""
