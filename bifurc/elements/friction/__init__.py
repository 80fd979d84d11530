"""Dry friction and micro-slip along a row.

`dry` holds one contact: Coulomb, Stribeck, regularised, cubic, and the elastic (Jenkins) slider with or without a load that
varies.  `microslip` holds sets of elastic sliders (Iwan, bar and ring), `loaded_slip` those whose normal loads vary with time,
`sliders` what they share.  Start reading at `dry`.
"""
