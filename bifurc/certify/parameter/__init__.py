"""What is proved over a range of a parameter: that nothing happens between two rows of a branch.

`family` has the numbers of a system along the parameter, `sequence` an event sequence with its derivatives, `sheet` its matrices
over a range; `tube` proves one piece of a branch, `stretch` halves what lies between two rows until each piece is proved.
Start reading at `stretch`.
"""
