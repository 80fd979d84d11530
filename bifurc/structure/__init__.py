"""Linear structures as matrices: checks, names of degrees of freedom, damping, reduction.  Knows no system and no element."""
