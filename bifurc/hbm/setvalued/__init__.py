"""Set-valued dry friction in harmonic balance.

`solution` solves the Galerkin equations from any start: `equations` with the `sign_pattern` of the speed, globalised by
`douglas_rachford`; `full_stick` is the case without slip; `system_contacts` reads them from a system, `condensed` eliminates
what friction does not touch; `li2019` is the published algorithm (Li 2019).  Start reading at `solution`.
"""
