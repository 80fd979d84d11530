"""Contacts with several memories, piece by piece: expressions against sums written out, a set of sliders against play operators."""
import numpy as np
import pytest

from bifurc import System
from bifurc.elements import HarmonicForce, Iwan
from bifurc.hbm import tables
from bifurc.hbm.balance import Balance
from bifurc.hbm.contacts import common, sampled
from bifurc.hbm.contacts.common import Contact, Segments
from bifurc.hbm.layout import Layout
from bifurc.hbm.status import ContactStatus
from bifurc.hbm.tables import GUARDS, PAIRS, THEN, TRIAL
from bifurc.hbm.waves import powers
from tests.reference.plain import plain

STIFFNESSES, REACHES = (1.0, 2.0, 3.0), (0.5, 0.2, 0.3)  # the second slips first, then the third, then the first
SET = Iwan(stiffnesses=STIFFNESSES, limits=tuple(k * d for k, d in zip(STIFFNESSES, REACHES, strict=True)))
KEYS = ("stick", "slip+1", "slip-1", "slip+2", "slip-2", "slip+3", "slip-3")
SLIDING = {"stick": (), "slip+1": (1,), "slip+2": (1, 2), "slip+3": (0, 1, 2),
           "slip-1": (1,), "slip-2": (1, 2), "slip-3": (0, 1, 2)}


def way_of(key):
    """Direction in which a mode slips; 0: it sticks."""
    return {"+": 1.0, "-": -1.0}.get(key[-2], 0.0)


def balance_of(harmonics):
    system = System(1.0, 0.1, 1.0, (HarmonicForce(1.0), SET), omega=1.3)
    return Balance(system, Layout(tuple(range(harmonics + 1)), 1), 0)


def along(x, omega=1.3, balance=None):
    """The contact along a motion of its coordinate, from the tables of a balance; of the set if none is given."""
    balance = balance or balance_of(len(x) // 2)
    S, flat = balance.parts.structure, balance.parts.flat
    waves, _, excited, contacts = plain(tables.structure)(S)
    X, loose = plain(tables.expressions)(S, flat)
    speed = np.zeros(len(x))
    k = np.arange(1, len(x) // 2 + 1)
    speed[1::2], speed[2::2] = omega * k * x[2::2], -omega * k * x[1::2]
    return Contact(waves, excited, contacts[0], X[0], loose[0], np.array([x]), np.array([speed]))


def at(a, waves, theta):
    """A trigonometric polynomial, written out."""
    return a[0] + sum(a[j] * np.cos(waves[j] * theta) + a[j + 1] * np.sin(waves[j] * theta) for j in range(1, a.size, 2))


def motion(x, theta):
    return at(x, np.repeat(np.arange(x.size // 2 + 1), 2)[1:], theta)


def test_an_expression_is_its_sum_over_rows_excitation_and_memory(rng):
    """Two rows of four, one of three places for rows stays empty; two memories; a column of excitation on a cosine and a sine."""
    waves, excited, pairs = np.array([0, 1, 1, 3, 3, 4, 4]), np.array([0, 3, 4]), 3
    A = np.zeros((5, 3, 9), np.int64)
    A[-1, 0, [tables.COUNT, tables.MEMORY, tables.WIDTH, tables.PAIRS]] = 4, 2, 2, pairs
    A[-1, 0, tables.ROWS:tables.ROWS + pairs] = 2, 0, -1
    c, v, z = rng.normal(size=(4, 7)), rng.normal(size=(4, 7)), rng.normal(size=2)
    X, loose = rng.normal(size=(4, pairs + 2 + 2, 3 + 2 * pairs + 2)), rng.normal(size=(2, 2 * pairs))
    contact, out, powers = Contact(waves, excited, A, X, loose, c, v), np.full(7, np.nan), np.empty((5, 2))
    row = X[2, pairs + 1]
    plain(common.guard_of)(contact, 2, 1, z, out)
    for theta in (0.0, 0.7, 4.0):
        known = row[0] + row[1] * np.cos(3.0 * theta) + row[2] * np.sin(3.0 * theta) + row[9] * z[0] + row[10] * z[1]
        for place, r in ((0, 2), (1, 0)):
            known += row[3 + 2 * place] * at(c[r], waves, theta) + row[4 + 2 * place] * at(v[r], waves, theta)
        assert at(out, waves, theta) == pytest.approx(known, abs=1e-12)
    # memory: the mode slaves the second alone; the first stays as it is
    A[2, 0, [tables.WRITES, tables.ALGEBRAIC, tables.ALGEBRAIC + 1]] = 1, 0, 1
    theta, kept = 2.3, z.copy()
    powers[:] = np.column_stack([np.cos(theta * np.arange(5)), np.sin(theta * np.arange(5))])
    plain(common.slaves)(contact, 2, powers, z, out)
    row = X[2, pairs + 2 + 1]
    known = row[0] + row[1] * np.cos(3.0 * theta) + row[2] * np.sin(3.0 * theta)
    for place, r in ((0, 2), (1, 0)):
        known += row[3 + 2 * place] * at(c[r], waves, theta) + row[4 + 2 * place] * at(v[r], waves, theta)
    assert z[0] == kept[0] and z[1] == pytest.approx(known, abs=1e-12)
    plain(common.slaves)(contact, 1, powers, z, out)  # a mode that writes none
    assert z[0] == kept[0] and z[1] == pytest.approx(known, abs=1e-12)
    plain(common.virgin)(contact, z)
    assert z == pytest.approx([loose[i, 0] * c[2, 0] + loose[i, 1] * v[2, 0] + loose[i, 2] * c[0, 0] + loose[i, 3] * v[0, 0]
                               for i in range(2)], abs=1e-13)


def test_modes_of_a_set_write_the_memory_of_the_sliders_that_slip(rng):
    """A slider that slips drags its grip at its reach behind the drive; one that sticks has its limit that far off its grip."""
    x, theta = rng.normal(size=7), 1.9
    contact, a = along(x), np.empty(7)
    A, waves = contact.A, contact.waves
    powers = np.column_stack([np.cos(theta * np.arange(4)), np.sin(theta * np.arange(4))])
    u, z = motion(x, theta), rng.normal(size=3)
    writer, further, back = plain(common.writer), plain(common.further), plain(common.back)
    for m, key in enumerate(KEYS):
        way, sliding, now = way_of(key), SLIDING[key], z.copy()
        plain(common.slaves)(contact, m, powers, now, a)
        assert now == pytest.approx([u - way * d if i in sliding else z[i] for i, d in enumerate(REACHES)], abs=1e-13)
        assert plain(common.writes_all)(A, m) == (len(sliding) == 3)
        ends = ["+", "-"] if key == "stick" else ["stick", key[-2]]
        number = int(key[-1]) if way else 0
        for g, end in enumerate(ends[:A[m, 0, tables.GUARDS]]):
            following = "stick" if end == "stick" else f"slip{end}{number + 1}"
            assert writer(A, m, g) == (-1 if key != "stick" else KEYS.index(following))
            assert further(A, m, g) == (-1 if "stick" in (key, following) else KEYS.index(following))
            plain(common.guard_of)(contact, m, g, z, a)
            if following == "stick":
                slope = (motion(x, theta + 1e-6) - motion(x, theta - 1e-6)) / 2e-6
                assert at(a, waves, theta) == pytest.approx(-way * 1.3 * slope, abs=1e-7)
                assert back(A, m) == g
            else:
                i = SLIDING[following][-1] if number < 2 else 0
                direction = 1.0 if end == "+" else -1.0
                spring = STIFFNESSES[i] * (direction * (u - z[i]) - REACHES[i])
                assert at(a, waves, theta) == pytest.approx(spring, abs=1e-12)
    assert A[len(KEYS) - 1, 0, tables.GUARDS] == 1  # nothing is left to slip


@pytest.mark.parametrize("reaches", [(0.2, 0.3, 0.5), (0.3, 0.5, 0.2), (0.5, 0.3, 0.2)])
def test_all_memory_is_written_where_every_slider_slips(reaches):
    """Whatever the order in which they come to slip."""
    system = System(1.0, 0.1, 1.0, (HarmonicForce(1.0), Iwan(stiffnesses=(1.0, 1.0, 1.0), limits=reaches)), omega=1.3)
    A = plain(tables.structure)(Balance(system, Layout((0, 1), 1), 0).parts.structure)[3][0]
    assert [plain(common.writes_all)(A, m) for m in range(len(KEYS))] == [key in ("slip+3", "slip-3") for key in KEYS]


def test_virgin_memory_is_the_mean_and_sticks_until_the_first_limit():
    for share, key in ((0.99, "stick"), (-0.99, "stick")):
        x = np.array([0.4, share * 0.2, 0.0])
        z, p = np.empty(3), np.empty((2, 2))
        assert plain(common.begin)(along(x), 0.0, z, p, np.empty(3)) == (KEYS.index(key), -1)
        assert z == pytest.approx([0.4] * 3, abs=1e-15)
    x = np.array([0.4, 0.21, 0.1])  # beyond the first limit, and rising: the first slider slips
    mode, _ = plain(common.begin)(along(x), 0.0, z, p, np.empty(3))
    assert KEYS[mode] == "slip+1"
    mode, _ = plain(common.begin)(along(np.array([0.4, -0.21, -0.1])), 0.0, z, p, np.empty(3))
    assert KEYS[mode] == "slip-1"


def one(x):
    """The contact of one slider, of stiffness 2 and reach .3, along a motion of its coordinate."""
    system = System(1.0, 0.1, 1.0, (HarmonicForce(1.0), Iwan(stiffnesses=(2.0,), limits=(0.6,))), omega=1.3)
    return along(x, balance=Balance(system, Layout(tuple(range(len(x) // 2 + 1)), 1), 0))


def test_a_motion_begins_on_the_side_on_which_its_slider_left_the_virgin_place(rng):
    """Within its reach of the mean it sticks there; beyond, it was dragged, and sticks where that left it if it comes back."""
    keys, seen = ("stick", "slip+1", "slip-1"), set()
    for _ in range(200):
        x = rng.normal(size=5) * (0.4, 0.3, 0.3, 0.1, 0.1)
        away, speed = x[1] + x[3], x[2] + 2.0 * x[4]
        if min(abs(abs(away) - 0.3), abs(speed)) < 1e-3:
            continue
        z, way = np.full(1, np.nan), np.sign(away)
        mode, wrote = plain(common.begin)(one(x), 0.0, z, np.empty((3, 2)), np.empty(5))
        if abs(away) < 0.3:
            expected, place = ("stick", -1), x[0]
        else:
            slip = keys.index("slip+1" if way > 0.0 else "slip-1")
            expected, place = (keys[slip] if way * speed > 0.0 else "stick", slip), x[0] + away - 0.3 * way
        assert (keys[mode], wrote) == expected and z == pytest.approx([place], abs=1e-14)
        seen.add((expected, way))
    assert len(seen) == 6


@pytest.mark.parametrize("order", [0, 1, 2, 3])
def test_a_mode_may_hold_where_its_guards_are_negative_just_after(order, rng):
    """Sticking at a phase at which the slider is at its reach with ``order`` rates zero: decided by the next one."""
    seen = set()
    for _ in range(60):
        theta, k = rng.uniform(0.0, 6.0), np.arange(1, 4)
        size, way = rng.uniform(0.02, 0.05), rng.choice([-1.0, 1.0])
        rows = np.array([[1.0 * (j == 0), *np.real(np.outer((1j * k) ** j * np.exp(1j * k * theta), (1.0, -1.0j))).ravel()]
                         for j in range(4)])  # value and rates of the motion at theta
        wanted = np.zeros(4)
        wanted[order] = size if order else 0.05
        wanted[order] *= rng.choice([-1.0, 1.0])
        wanted[order + 1:] = rng.normal(size=3 - order) * 0.01
        x, z, p = np.linalg.lstsq(rows, way * wanted + (0.3 * way, 0.0, 0.0, 0.0), rcond=None)[0], np.zeros(1), np.empty((4, 2))
        powers(theta, 4, p)
        mode = plain(common.admissible)(one(x), 0, z, p, 0.0, np.empty(7))
        assert mode == bool(wanted[order] < 0.0)
        seen.add((mode, way))
    assert len(seen) == 4


def played(u, mean):
    """Grips (samples, 3) on the second passage of a closed motion: each follows the drive at its reach, and else stands."""
    z, kept = np.full(3, mean), np.empty((len(u), 3))
    for _ in range(2):
        for n, now in enumerate(u):
            z = np.clip(z, now - np.array(REACHES), now + np.array(REACHES))
            kept[n] = z
    return kept


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("size", [0.15, 0.25, 0.4, 1.2])
def test_grips_of_a_set_follow_the_drive(seed, size):
    """Between events memory is that of the play operators, for sets of which none, one, two and all slip."""
    rng = np.random.default_rng(seed)
    x = np.concatenate([[rng.normal()], rng.normal(size=6) / np.repeat([1, 4, 9], 2)])
    theta = np.linspace(0.0, 2.0 * np.pi, 4001)[:-1]
    u = motion(x, theta) - x[0]
    x[1:] *= size / max(-u.min(), u.max())
    u = motion(x, theta)
    reach = 0.5 * (u.max() - u.min())
    kept = played(u, x[0])
    certain = [i for i, d in enumerate(REACHES) if reach > d or abs(u - x[0]).max() < d]  # others keep where they once slipped to
    balance = balance_of(3)
    status, _, _ = balance.linearised(x)
    assert status is ContactStatus.FOLLOWED
    room, start, checked = balance.room, 0.0, set()
    for n in range(room.counts[0, 0]):
        mode, stop = room.paths[0, n, common.MODE], room.ends[0, n, 0]
        inside = np.flatnonzero((theta > start) & (theta < stop))
        for i in certain:
            if inside.size and i not in SLIDING[KEYS[mode]]:
                assert np.abs(kept[inside, i] - room.zs[0, n, i]).max() < 1e-5
            elif inside.size:
                assert np.abs(kept[inside, i] - u[inside] + way_of(KEYS[mode]) * REACHES[i]).max() < 1e-12
                checked.add(i)
        start = stop
    assert stop == pytest.approx(2.0 * np.pi) and checked == {i for i, d in enumerate(REACHES) if reach > d}


def test_memory_comes_back_where_no_mode_writes_it(rng):
    x = np.array([0.3, 1.0, 0.5])
    contact = along(x)
    z = rng.normal(size=3)
    repeats = plain(common.repeats)
    for m, key in enumerate(KEYS):
        assert repeats(contact.A, m, z, z.copy(), contact.c) and repeats(contact.A, m, z, z * (1.0 + 1e-14), contact.c)
        for i in range(3):
            for way in (1.0, -1.0):
                moved = z + way * 1e-6 * np.eye(3)[i]
                assert repeats(contact.A, m, z, moved, contact.c) == (i in SLIDING[key])
    assert not repeats(contact.A, 0, np.array([0.0, np.nan, 0.0]), np.zeros(3), contact.c)


def test_what_is_told_of_an_event(rng):
    A = along(np.array([0.3, 1.0, 0.5])).A
    segments = Segments(np.zeros((4, common.FIELDS), np.int64), np.zeros((4, 2)), np.zeros((4, 3)), np.zeros(common.SOURCE),
                        np.zeros(2, np.int64))
    z = rng.normal(size=3)
    plain(common.ended)(segments, 1, 3, 1, 5, 2.5, 1.25, z)
    assert segments.path[1, [common.MODE, common.GUARD, common.AFTER, common.WROTE]].tolist() == [3, 1, 5, -1]
    assert segments.ends.tolist() == [[0, 0], [2.5, 1.25], [0, 0], [0, 0]]
    assert np.array_equal(segments.zs[1], z) and not segments.zs[[0, 2, 3]].any()
    again, last = plain(common.again), KEYS.index("slip+3")  # it writes all memory: what follows is what followed
    plain(common.ended)(segments, 1, last, 0, 0, 2.5, 2.5, z[:0])
    segments.counts[0] = 3
    assert again(A, last, 0, 0, segments, 1, 2.5 + 1e-9, 1e-8) and again(A, last, 0, 0, segments, 1, 2.5 - 1e-9, 1e-8)
    assert not again(A, last, 0, 0, segments, 1, 2.5 + 1e-7, 1e-8) and not again(A, last, 0, 0, segments, 1, 2.5 - 1e-7, 1e-8)
    assert not again(A, last, 1, 0, segments, 1, 2.5, 1e-8) and not again(A, last, 0, 2, segments, 1, 2.5, 1e-8)
    assert not again(A, last + 1, 0, 0, segments, 1, 2.5, 1e-8)
    segments.path[1, common.MODE] = KEYS.index("slip+2")
    assert not again(A, KEYS.index("slip+2"), 0, 0, segments, 1, 2.5, 1e-8)  # one slider keeps its memory
    segments.path[1, common.MODE], segments.counts[0] = last, 2
    assert not again(A, last, 0, 0, segments, 1, 2.5, 1e-8)  # the end of the period is no event
    # touches: those too far below zero are noted, the highest of them; nearer ones are followed or counted twice, there and back
    missed, source = plain(common.missed), np.zeros(common.SOURCE)
    source[common.NEXT] = -np.inf
    for height, followed in ((-0.3, True), (-0.25, False), (-0.4, True)):
        assert missed(height, 0.2, followed, source) is False
    assert source[common.NEXT] == -0.25 and source[common.PASSED] == 0.0
    assert missed(-0.1, 0.2, True, source) is True and source[common.PASSED] == 0.0
    assert missed(-0.1, 0.2, False, source) is False and source[common.PASSED] == 2.0 and source[common.NEXT] == -0.25
    # a limit that memory touches because it was written there, a period ago: round the period
    resting = plain(common.resting)
    source[common.WRITER], source[common.WRITTEN] = KEYS.index("slip+1"), 0.1
    for t, same in ((0.1, True), (0.1 - 5e-4, True), (0.102, False)):
        assert resting(A, 0, 0, t, source, 1e-3) == same
    assert resting(A, 0, 0, 2.0 * np.pi - 0.05, source, 0.16) and not resting(A, 0, 0, 2.0 * np.pi - 0.05, source, 0.14)
    assert not resting(A, 0, 1, 0.1, source, 1e-3)  # the other limit
    source[common.WRITER] = -1.0  # a virgin start
    assert not resting(A, 0, 0, 0.1, source, 1e-3)
    assert not resting(A, KEYS.index("slip+1"), 1, 0.1, source, 1e-3)


def follower(positive, then, trials=None, mode=0):
    """Return (guard, mode) that follow ``mode`` at a sample: of modes 0, 1, ... the guards that are ``positive`` there, the modes
    ``then`` behind each, and those tried in place of a mode that writes memory (-1: none)."""
    count, guards = len(positive), max(len(row) for row in positive)
    A = np.full((count + 1, guards + 1, 20), -1)
    values = np.zeros((count, guards, 1))
    for m, row in enumerate(positive):
        A[m, 0, GUARDS] = len(row)
        for g, high in enumerate(row):
            values[m, g, 0] = 0.5 if high else -0.5
            A[m, 1 + g, TRIAL] = (trials or {}).get((m, g), -1)
            behind = then.get((m, g), ())
            A[m, 1 + g, THEN:THEN + len(behind)] = behind
    A[count, 0, PAIRS] = 0
    return plain(sampled.next_of)(values, np.zeros((count, guards, 1)), A, 0, mode, np.empty(0), 0)


def test_the_mode_that_follows_at_a_sample_is_the_first_that_may_stay():
    """Behind a positive guard, in the order that it names them: not one with a positive guard of its own, unless that guard is
    judged by a trial; none behind guards that are not positive."""
    then = {(0, 0): (1, 2)}
    assert follower([[0], [0], [0]], then) == (-1, 0)
    assert follower([[1], [0], [0]], then) == (0, 1)
    assert follower([[1], [1], [0]], then) == (0, 2)
    assert follower([[1], [1], [1]], then) == (-1, 0)  # none may
    assert follower([[1], [1], [0]], then, {(1, 0): 0}) == (0, 1)  # its guard is judged by the trial of mode 0
    assert follower([[0, 1], [0], [0]], {(0, 0): (1,), (0, 1): (2,)}) == (1, 2)
    assert follower([[1], [0]], {(0, 0): (0, 1)}) == (-1, 0)  # it names the present one first: it stays


def test_a_mode_that_writes_memory_is_left_where_its_trial_may_stay():
    """A slider that slips sticks where sticking breaks no limit; where it does, the guard of the trial says what follows."""
    slips, sticks = 0, 1
    then, trials = {(slips, 0): (sticks,), (sticks, 0): (slips,), (sticks, 1): (2,)}, {(slips, 0): sticks, (2, 0): sticks}
    for own in (0, 1):
        assert follower([[own], [0, 0], [0]], then, trials) == (0, sticks)  # whatever its own guard says
    assert follower([[0], [1, 0], [0]], then, trials) == (-1, slips)
    assert follower([[1], [1, 0], [0]], then, trials) == (-1, slips)  # the trial would slip on
    assert follower([[1], [0, 1], [1]], then, trials) == (0, 2)  # slips the other way at once
    assert follower([[0], [0, 1], [0]], then, trials) == (-1, slips)
