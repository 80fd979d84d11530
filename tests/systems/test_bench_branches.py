"""Branches of contacts whose motion is prescribed: frequency only sets the time scale, blocks begin to slip where statics say."""
import numpy as np
import pytest

import bifurc as bf


def slip_amplitudes(limits, spring, contact, closed, most):
    """Displacements of the driven block up to ``most`` at which one block more has begun to slip; each contact carries its limit
    from then on."""
    n = len(limits)
    K = np.zeros((n, n))
    for i in range(n if closed else n - 1):
        j = (i + 1) % n
        K[np.ix_([i, j], [i, j])] += spring * np.array([[1.0, -1.0], [-1.0, 1.0]])
    slips, found = [], []
    while len(slips) < n:
        stuck = np.array([i not in slips for i in range(n)], float)
        A = (K + contact * np.diag(stuck))[1:, 1:]
        per, rest = -np.linalg.solve(A, K[1:, 0]), -np.linalg.solve(A, np.where(stuck, 0.0, limits)[1:])
        places, offset = np.append(1.0, per), np.append(0.0, rest)
        turns = [(limits[i] / contact - offset[i]) / places[i] if stuck[i] else np.inf for i in range(n)]
        first = min(turns)
        if first > most:
            break
        slips += [i for i in range(n) if turns[i] <= first * (1.0 + 1e-9)]
        found.append(first)
    return found


def numbers_of(system):
    """Limits, springs, contact stiffness and shape of the only contact of a bench."""
    contact = system.elements[0].element
    return contact.limits, contact.spring, contact.contact, contact.closed


BENCHES = {"strip": bf.systems.micro_slip_strip(n=4), "ring": bf.systems.micro_slip_ring(n=5),
           "case 1": bf.systems.macro_slip_contact(), "case 3": bf.systems.macro_slip_contact(case=3)}


@pytest.mark.parametrize("name", BENCHES)
def test_frequency_changes_nothing(name):
    system = BENCHES[name]
    branch = bf.trace(bf.find_orbit(system), "omega", bounds=(0.6, 2.5))
    assert branch.audit.ok and branch.stop_reason == ("bound", "bound") and len(branch.special_points) == 0
    assert len(set(branch.column("n_events"))) == 1 and branch.column("stable").all()


@pytest.mark.parametrize(("builder", "n", "factors"), [("micro_slip_strip", 3, (0.4, 2.0)), ("micro_slip_strip", 15, (0.6, 1.5)),
                                                     ("micro_slip_ring", 3, (0.1, 1.2))])
def test_blocks_begin_to_slip_at_the_amplitudes_of_statics(builder, n, factors):
    """In the steady state a block slips if it does on first loading (Masing 1926)."""
    system = getattr(bf.systems, builder)(n=n)
    low, high = (factor * system.parameters["amplitude"] for factor in factors)
    branch = bf.trace(bf.find_orbit(system), "amplitude", bounds=(low, high))
    assert branch.audit.ok and branch.stop_reason == ("bound", "bound")
    expected = [a for a in slip_amplitudes(*numbers_of(system), high) if a > low]
    found = sorted(p.parameter for p in branch.special_points)
    assert len(found) == len(expected) > 0 and {str(p.kind) for p in branch.special_points} == {"slip_onset"}
    assert np.abs(np.array(found) / expected - 1.0).max() < 1e-10


def test_a_leap_of_the_order_of_slip_is_named():
    """Two blocks change places between 6.8 and 7.8: the equations are others beyond."""
    system = bf.systems.micro_slip_strip(n=4, load_end=7.0)
    orders = [bf.systems.micro_slip_strip(n=4, load_end=load).elements[0].element.order for load in (7.0, 7.8)]
    assert orders[0] != orders[1]
    with pytest.raises(ValueError, match=r"they leap at 7\.6\d+, as where sliders begin to slip in another order"):
        bf.trace(bf.find_orbit(system), "load_end", bounds=(6.8, 7.8))


def test_what_damping_has_left_of_a_start_is_no_size():
    """The coordinate of a bench falls like exp(-t/2) whatever it began with; the contacts do not feel it."""
    system = bf.systems.macro_slip_contact(case=2)
    orbit = bf.find_orbit(system)
    for start in ((0.3, 0.2), (-1.0, 1.0)):
        late = bf.simulate(system, (*start, *orbit.state[2:]), periods=40).final
        assert 0.0 < np.abs(late[:2]).max() < 10.0 * np.exp(-40.0 * np.pi)
        found = bf.find_orbit(system, late)
        assert found.success and np.abs(found.state - orbit.state).max() < 1e-12
