"""Steps of a branch by pseudo-arclength, whatever is continued.

`arclength` predicts, corrects and judges; `detect` says what lies in a step, with `roots` of tests along the curve, simple branch
points (`branchpoint`), `tori`, and what the ends of a step do not show (`hidden`); `rows` are the result.
Start reading at `arclength`.
"""
