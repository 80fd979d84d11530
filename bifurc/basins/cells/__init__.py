"""Cell mapping: `compute` is the verb, `cell_map` the result.

`images` maps the cells, `simple` and `generalized` analyse the map (Hsu 1987), `morse` its recurrent groups, and
`confirmation` asks the motion itself which groups hold an attractor.  Start reading at `compute`.
"""
