"""Ball arithmetic that proofs are made of; it knows nothing of mechanics.

`balls` has the number fields (python-flint), `jets` balls with exact derivatives, `forms` Taylor forms along a curve, and
`krawczyk` the existence and uniqueness of a zero in a box.  Start reading at `balls`.
"""
