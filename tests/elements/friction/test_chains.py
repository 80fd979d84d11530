"""Chains of blocks on sliders, against the equilibrium of every block written out and solved densely."""
import numpy as np
import pytest

from bifurc.elements import LoadedMicroSlip, MicroSlip
from bifurc.elements.friction.loaded_slip import APART, STUCK, _speeds, _Then
from bifurc.elements.friction.microslip import along, chain_stiffness
from bifurc.elements.local import Core

OMEGA = 1.7
CORE = Core(np.eye(1), np.eye(1), np.eye(1), OMEGA)


def springs(n, spring, closed):
    """Return the stiffness (n, n) as a sum of d d^T over springs, d what the spring is longer by."""
    ends = [(i, i + 1) for i in range(n - 1)] + ([(n - 1, 0)] if closed and n > 1 else [])
    rows = np.array([np.eye(n)[i] - np.eye(n)[j] for i, j in ends]).reshape(-1, n)
    return spring * rows.T @ rows


def blocks(K, drive, grips, force):
    """Return places (n,) of blocks that are driven at the first and held by springs ``grips`` (n,) against given forces (n,)."""
    x = np.full(len(K), drive)
    x[1:] = np.linalg.solve((K + np.diag(grips))[1:, 1:], force[1:] - K[1:, 0] * drive)
    return x


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("n", [1, 2, 3, 6])
def test_statics_of_chains(n, closed, rng):
    K = chain_stiffness(n, 2.5, closed)
    assert K == pytest.approx(springs(n, 2.5, closed), abs=1e-14)
    diagonal, load = rng.uniform(3.0, 4.0, n), rng.normal(size=(n, 2))
    dense = np.diag(diagonal) - 1.2 * (np.eye(n, k=1) + np.eye(n, k=-1))
    assert along(diagonal, -1.2, load) == pytest.approx(np.linalg.solve(dense, load), abs=1e-13)


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("n", [1, 2, 4, 7])
def test_a_mode_of_a_loaded_chain_is_the_equilibrium_of_its_blocks(n, closed, rng):
    """Force, places that nothing writes, and guards of random words: springs and contacts of every block, and their rates."""
    k, spring = 1.3, 2.5
    for harmonic in (1, 2):
        limits, amplitudes, phases = rng.uniform(0.1, 1.0, n), rng.uniform(-1.5, 1.5, n), rng.uniform(0.0, 6.0, n)
        chain = LoadedMicroSlip(spring, k, tuple(limits), tuple(amplitudes), tuple(phases), harmonic, closed)
        K = springs(n, spring, closed)
        for _ in range(8):
            key = "".join(rng.choice([STUCK, "+", "-", APART], n))
            (drive, speed), z, t = rng.normal(size=2), rng.normal(size=n), rng.uniform(0.0, 6.0)
            known = {("u", 0): drive, ("s", 0): speed, ("one", 0): 1.0} | {("z", i): value for i, value in enumerate(z)}
            known |= {("cos", harmonic): np.cos(harmonic * t), ("sin", harmonic): np.sin(harmonic * t)}

            def value(expression, known=known):
                return sum(weight * known[name] for name, weight in expression.terms.items())

            load = limits * (1.0 + amplitudes * np.cos(harmonic * t + phases))
            change = -limits * amplitudes * harmonic * OMEGA * np.sin(harmonic * t + phases)
            sign = np.array([{"+": 1.0, "-": -1.0}.get(letter, 0.0) for letter in key])
            grips = k * np.array([letter == STUCK for letter in key])
            x, dx = blocks(K, drive, grips, grips * z - sign * load), blocks(K, speed, grips, -sign * change)
            carried = grips * (x - z) + sign * load
            mode = chain.mode(key, CORE)
            assert value(mode.force[0]) == pytest.approx(-(K[0] @ x + carried[0]), abs=1e-12)
            guards = []
            for i, letter in enumerate(key):
                memory = mode.memory[i]
                if letter == STUCK:
                    assert memory is None
                    guards += [carried[i] - load[i], -carried[i] - load[i], -load[i]]
                elif letter == APART:
                    assert value(memory.value) == pytest.approx(x[i], abs=1e-12)
                    guards += [load[i]]
                else:
                    assert value(memory.value) == pytest.approx(x[i] - sign[i] * load[i] / k, abs=1e-12)
                    guards += [change[i] / k - sign[i] * dx[i], -load[i]]
            assert [value(guard.value) for guard in mode.guards] == pytest.approx(guards, abs=1e-12)


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("n", [1, 2, 5, 9])
def test_speeds_behind_an_event_are_those_of_the_clipped_contacts(n, closed, rng):
    """Every block behind the driven one: springs and a contact whose force has the rate of its speed, between two bounds."""
    chain = LoadedMicroSlip(2.5, 1.3, (1.0,) * n, closed=closed, load_amplitudes=(0.5,) * n)
    K = springs(n, 2.5, closed)
    for _ in range(30):
        low, high = np.sort(rng.normal(size=(2, n)), axis=0)
        low[rng.random(n) < 0.3], high[rng.random(n) < 0.3] = -np.inf, np.inf
        loose = rng.random(n) < 0.2
        low[loose] = high[loose] = 0.0
        speeds = _speeds(chain, 0.9, low, high)
        left = K @ speeds + np.clip(1.3 * speeds, low, high)
        assert speeds[0] == 0.9
        assert left[1:] == pytest.approx(np.zeros(n - 1), abs=1e-12)


@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("n", [1, 2, 5])
def test_the_response_of_a_chain_is_the_equilibrium_of_its_blocks(n, closed, rng):
    """By drive, by what is held and by what slips: places and the force on the drive, with one contact that has no limit."""
    limits = rng.uniform(0.2, 1.0, n)
    limits[rng.integers(n)] *= n < 5
    bar, K = MicroSlip(2.5, 1.3, tuple(limits), closed), springs(n, 2.5, closed)
    for _ in range(8):
        slips = tuple(np.flatnonzero((rng.random(n) < 0.4) & (limits > 0.0)).tolist())
        slip = np.isin(np.arange(n), slips)
        grips = 1.3 * (~slip & (limits > 0.0))
        drive, held, force = rng.normal(), rng.normal(size=n), rng.normal(size=n) * slip
        x = blocks(K, drive, grips, grips * held - force)
        now = bar.response(slips)
        assert now.drive * drive + now.held @ held + now.pushed @ force == pytest.approx(x, abs=1e-12)
        assert now.force_drive * drive + now.force_held @ held + now.force_pushed @ force == pytest.approx(
            (K @ x + grips * (x - held) + force)[0], abs=1e-12)
        slope, rest, line = bar.loading(slips)
        x = blocks(K, drive, grips, -limits * slip)
        assert slope * drive + rest == pytest.approx(x, abs=1e-12)
        assert line[0] * drive + line[1] == pytest.approx((K @ x + grips * x + limits * slip)[0], abs=1e-12)


def test_a_contact_that_stops_sticks_and_the_others_go_on(rng):
    """Forces inside the limits where contacts stick, slips that are not over: only the letter of the slip that ends changes."""
    seen, n, k = set(), 4, 1.3
    for _ in range(400):
        limits, phases = rng.uniform(0.3, 1.0, n), rng.uniform(0.0, 6.0, n)
        amplitudes, t, drive = rng.uniform(0.0, 0.8, n), rng.uniform(0.0, 6.0), rng.normal()
        chain = LoadedMicroSlip(2.5, k, tuple(limits), tuple(amplitudes), tuple(phases))
        letters = rng.choice([STUCK, "+", "-"], n)
        i = int(rng.integers(n))
        letters[i] = rng.choice(["+", "-"])
        key, K = "".join(letters), springs(n, 2.5, False)
        sign = np.array([{"+": 1.0, "-": -1.0}.get(letter, 0.0) for letter in key])
        load, change = limits * (1.0 + amplitudes * np.cos(t + phases)), -limits * amplitudes * OMEGA * np.sin(t + phases)
        grips = k * (sign == 0.0)
        by, rest = blocks(K, 1.0, grips, np.zeros(n)), blocks(K, 0.0, grips, -sign * change)
        speed = (sign[i] * change[i] / k - rest[i]) / by[i]  # the slip of contact i is over
        over = sign * (by * speed + rest) - change / k
        if not all(over[j] > 1e-3 for j in range(n) if sign[j] and j != i):
            continue
        force = np.where(sign == 0.0, rng.uniform(-0.9, 0.9, n), sign) * load
        x = blocks(K, drive, np.zeros(n), -force)
        known = {("u", 0): drive, ("s", 0): speed, ("one", 0): 1.0, ("cos", 1): np.cos(t), ("sin", 1): np.sin(t)}
        known |= {("z", j): x[j] - force[j] / k for j in range(n)}
        guard = next(g for g in chain.mode(key, CORE).guards if str(g.kind) == "stick" and g.then.fired == i)
        found = guard.then(lambda expression, known=known: sum(weight * known[name] for name, weight in expression.terms.items()))
        assert found == (key[:i] + STUCK + key[i + 1:],)
        seen.add((i, key[i]))
    assert len(seen) == 2 * n


@pytest.mark.parametrize("n", [3, 12])
def test_words_of_ties(n, rng):
    """Contacts whose rates are clear have one letter; of many in a tie all stop, or one goes on, or one stops, else all words."""
    key = "".join(rng.choice(["+", "-"], n))
    chain = LoadedMicroSlip(2.5, 1.3, (1.0,) * n, (0.5,) * n)
    then = _Then(chain, key, OMEGA, (), 0)
    low, high, clear = -np.ones(n), np.ones(n), n // 3
    pull = np.array([1.0 if letter == "+" else -1.0 for letter in key]) * (1.0 + 1e-12)
    pull[:clear] = [0.0, 1.5, -1.5, 0.0][:clear]
    words = then._words(pull, low, high, np.arange(n) == 3, 1e-9)
    first = [STUCK, "+", "-", APART][:clear]
    stopped = first + [STUCK] * (n - clear)
    if n == 3:
        expected = {"".join([*first, a, b]) for a in (STUCK, key[1]) for b in (STUCK, key[2])}
    else:
        expected = {"".join(stopped)}
        for i in range(clear, n):
            expected.add("".join([*stopped[:i], key[i], *stopped[i + 1:]]))
            expected.add("".join([*first, *key[clear:i], STUCK, *key[i + 1:]]))
    assert set(words) == expected and words[0] == "".join(stopped)
