"""The engine of many degrees of freedom: the same functions as `flow.affine`, in modal coordinates.

`engine` takes the place of the affine one in the kernels of a scene; `steps` are as long as the amplitudes that are there
allow, each with a bound; `states` has derivatives and Taylor series of a state.  Start reading at `steps`.
"""
