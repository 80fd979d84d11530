"""Branches of periodic orbits by shooting over event sequences.

`problem` is the continuation problem of one event sequence; `signature_change` says how the sequence goes on where it ends
(`appearing`, `vanishing` events, `several` impacts at once), `branching` which orbits branch off.  Start reading at `problem`.
"""
