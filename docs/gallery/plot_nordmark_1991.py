r"""
Nordmark 1991: what happens at a grazing
========================================

*Level: further on. Time: 2 s.*

A. Nordmark showed that a motion that just touches a stop is met by a map with an infinite slope. What follows is
decided by numbers of the touching orbit: the apex acceleration, its monodromy matrix E, and the products :math:`s_k =
h^T E^k B`. bifurc computes them at every grazing it locates, says what will happen, and looks at short simulations
beyond.
"""
import matplotlib.pyplot as plt

import bifurc as bf

system = bf.systems.impact_oscillator(zeta=0.05, omega=1.5, amplitude=1.0, gap=1.0, restitution=0.7)
response = 1.0 / (1.0 - 1.5**2 + 2j * 0.05 * 1.5)  # of the linear oscillator
free = bf.find_orbit(system, guess=(response.real, -1.5 * response.imag))
branch = bf.trace(free, "amplitude", bounds=(0.9, 1.4))
point = branch.special_points.of("grazing")[0]
grazing = point.grazing
print(grazing)
print(grazing.verdict.sentence)

# %%
# The closed forms of this oscillator: grazing force, apex acceleration, and the first products.
assert abs(point.parameter - 1.25896783120142) < 1e-12
assert abs(grazing.apex - -1.5**2) < 1e-10
for value, wanted in zip(grazing.s, (-0.7011, 0.5738, -0.0084, -0.3706), strict=False):
    assert abs(value - wanted) < 6e-5
assert "jump" in str(grazing.verdict)

# %%
# Impacting orbits born there: the orbit with one impact a period begins on the side where the free motion still is, and
# turns back in a fold; between fold and grazing both exist.
figure, ax = plt.subplots(figsize=(6.0, 3.6), layout="constrained")
for start in bf.switch_branch(point)[:1]:
    impacting = bf.trace(start, "amplitude", bounds=(0.3, 1.4))
    impacting.plot(ax)
    assert abs(impacting.special_points.of("fold")[0].parameter - 0.471371390) < 1e-8
