"""Second implementations in mpmath (40 digits) that share no code with the package, and tables of the digits they give.

The tests compare the package with these numbers; `digits` keeps the results of slow derivations, and tests marked slow
derive them again.
"""
