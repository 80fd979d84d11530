"""Pictures of one motion.

`phase_plane` draws the phase plane with its stops and the time history with its events, `animation` the same as it grows,
`rotors` the path in a stator and the full spectrum, `loops` the hysteresis loop of a contact.  Start reading at `phase_plane`.
"""
