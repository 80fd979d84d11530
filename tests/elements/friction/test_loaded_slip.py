"""What follows an event of a chain under varying loads: one contact in closed form, several against their mirror image."""
import numpy as np

from bifurc.elements import LoadedMicroSlip
from bifurc.elements.local import Core, rate

OMEGA = 1.7
CORE = Core(np.eye(1), np.eye(1), np.eye(1), OMEGA)


def at(u, s, z, phase):
    """Return the function that gives expressions their value at drive u, its speed s, memory z (n,) and a phase."""
    known = {("u", 0): u, ("s", 0): s, ("one", 0): 1.0, ("cos", 1): np.cos(phase), ("sin", 1): np.sin(phase)}
    known |= {("z", i): value for i, value in enumerate(z)}
    return lambda expression: sum(weight * known[name] for name, weight in expression.terms.items())


def on_the_limit(mode, guard, u, s, z, i, phase):
    """Return the memory z with its entry ``i`` such that a guard of the mode, affine in it, is zero."""
    zero, one = (at(u, s, [*z[:i], value, *z[i + 1:]], phase)(mode.guards[guard].value) for value in (0.0, 1.0))
    return [*z[:i], zero / (zero - one), *z[i + 1:]]


def test_one_contact_slips_where_the_spring_outruns_its_limit(rng):
    """Limit N (1 + a cos(t + phi)): the force k (u - z) at +N goes on with k u' - N' > 0 only, at -N with -k u' - N' > 0."""
    k, N, a, phi = 2.0, 0.8, 0.6, 0.4
    chain = LoadedMicroSlip(1.0, k, (N,), (a,), (phi,))
    mode, seen = chain.mode("s", CORE), set()
    for phase, s in zip(rng.uniform(0.0, 2.0 * np.pi, 200), rng.uniform(-0.6, 0.6, 200), strict=True):
        limit, rising = N * (1.0 + a * np.cos(phase + phi)), -N * a * OMEGA * np.sin(phase + phi)
        for guard, way, letter in ((0, 1.0, "+"), (1, -1.0, "-")):
            z = [0.3 - way * limit / k]
            value = at(0.3, s, z, phase)
            assert abs(value(mode.guards[guard].value)) < 1e-15
            assert abs(value(rate(chain.limit[0], OMEGA)) - rising) < 1e-14
            slips = way * k * s > rising
            assert mode.guards[guard].then(value) == ((letter,) if slips else ())
            seen.add((letter, bool(slips), rising > 0.0))
    assert len(seen) == 8


def test_the_mirror_image_of_an_event_has_the_mirrored_followers(rng):
    """Drive, speed and memory with the other sign under the same loads: slip turns round, whatever sticks, slips or is apart."""
    turned = str.maketrans("+-", "-+")
    seen = set()
    for _ in range(300):
        chain = LoadedMicroSlip(3.0, 1.0, tuple(rng.uniform(0.1, 0.6, 4)), tuple(rng.uniform(0.0, 0.9, 4)),
                                tuple(rng.uniform(0.0, 6.0, 4)))
        key = "".join(rng.choice(list("ss+-"), 4))
        i = int(rng.integers(0, 4))
        key = f"{key[:i]}s{key[i + 1:]}"
        mode, first = chain.mode(key, CORE), sum({"s": 3}.get(letter, 2) for letter in key[:i])
        guard = first + int(rng.integers(0, 2))
        u, s, phase = rng.uniform(-1.0, 1.0), rng.uniform(-1.0, 1.0), rng.uniform(0.0, 6.0)
        z = on_the_limit(mode, guard, u, s, rng.uniform(-1.0, 1.0, 4).tolist(), i, phase)
        found = mode.guards[guard].then(at(u, s, z, phase))
        mirrored = key.translate(turned)
        other = chain.mode(mirrored, CORE)
        image = other.guards[chain.mirrored_guard(key, guard)].then(at(-u, -s, [-value for value in z], phase))
        assert {word.translate(turned) for word in image} == set(found)
        seen |= {word[i] for word in found}
    assert seen == {"s", "+", "-"}
