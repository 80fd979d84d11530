"""Models from elsewhere: systems from matrices, files of finite-element programs, rotors, and reduced models of them."""
