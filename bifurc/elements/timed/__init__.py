"""Elements that follow the excitation: switched at known phases, and with a stiffness that varies."""
