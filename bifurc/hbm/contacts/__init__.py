"""Forces of contacts along a given periodic motion.

`event_driven` follows a contact between its exact instants, `sampled` at samples; `common` is what both need; `spectra` gives
the Fourier coefficients of the forces in closed form, `margins` how far the event sequence is from changing.
Start reading at `common`.
"""
