"""Local coordinates on a circle for compiled laws: normal n = p / |p|, tangent t = (-n_y, n_x), their turning, reactions.

With the position p from the centre, r = |p|, the speeds n . v and w = t . v along both,

    dn = t (t . dp) / r,      dt = -n (t . dp) / r,

which is all that curvature adds: d(n . v) = n . dv + w (t . dp) / r,  d(t . v) = t . dv - (n . v) (t . dp) / r.  In a frame
that turns with ``spin``, sliding is measured with the speed spin r more.
"""
import math

from .._jit import njit

DEPENDENT = 1e-20  # the square of the cosine between a row and what is free to move: the row is held already


@njit
def polar(x, y, vx, vy):
    """Return normal (2), radius, and speeds along normal and tangent; the normal at the centre itself is (1, 0)."""
    r = math.hypot(x, y)
    if r == 0.0:
        return 1.0, 0.0, 0.0, vx, vy
    nx, ny = x / r, y / r
    return nx, ny, r, nx * vx + ny * vy, nx * vy - ny * vx


@njit
def turned(r):
    """Return 1 / r; at the centre 0, where nothing has a direction to turn."""
    return 1.0 / r if r > 0.0 else 0.0


@njit
def scalar_slope(nx, ny, r, sn, w, g_u, g_n, g_t):
    """Derivatives (x, y, vx, vy) of g(|p|, n . v, t . v) from those by its arguments."""
    along = (g_n * w - g_t * sn) * turned(r)
    return (g_u * nx - along * ny, g_u * ny + along * nx, g_n * nx - g_t * ny, g_n * ny + g_t * nx)


@njit
def vector_slope(nx, ny, r, sn, w, fn, ft, by_n, by_t):
    """Derivatives (x, y, vx, vy) of both components of n fn + t ft, from those of fn and ft (3 each) by |p|, n . v, t . v."""
    a0, a1, a2, a3 = scalar_slope(nx, ny, r, sn, w, by_n[0], by_n[1], by_n[2])
    b0, b1, b2, b3 = scalar_slope(nx, ny, r, sn, w, by_t[0], by_t[1], by_t[2])
    turn = turned(r)
    kx, ky = -ny * turn, nx * turn  # the angle by x and by y
    gx, gy = -ny * fn - nx * ft, nx * fn - ny * ft  # what the angle does to the force: t fn - n ft
    return (nx * a0 - ny * b0 + gx * kx, nx * a1 - ny * b1 + gx * ky, nx * a2 - ny * b2, nx * a3 - ny * b3,
            ny * a0 + nx * b0 + gy * kx, ny * a1 + nx * b1 + gy * ky, ny * a2 + nx * b2, ny * a3 + nx * b3)


@njit
def level(x, y, vx, vy, cx, cy, factor, radius):
    """factor (|p|^2 - radius^2) / (2 radius): polynomial, and to first order factor (|p| - radius)."""
    return factor * ((x - cx) * (x - cx) + (y - cy) * (y - cy) - radius * radius) / (2.0 * radius)


@njit
def level_slope(x, y, vx, vy, cx, cy, factor, radius):
    """Derivatives of `level`."""
    return factor * (x - cx) / radius, factor * (y - cy) / radius, 0.0, 0.0


@njit
def affine_scalar(u, none, sn, st, c, by_u, by_n, by_t):
    """Affine expression in depth and speeds."""
    return c + by_u * u + by_n * sn + by_t * st


@njit
def affine_scalar_slope(u, none, sn, st, c, by_u, by_n, by_t):
    """Derivatives of `affine_scalar`."""
    return by_u, 0.0, by_n, by_t


@njit
def affine_pair(u, none, sn, st, c, by_u, by_n, by_t, d, e_u, e_n, e_t):
    """Affine radial and tangential force in depth and speeds."""
    return c + by_u * u + by_n * sn + by_t * st, d + e_u * u + e_n * sn + e_t * st


@njit
def affine_pair_slope(u, none, sn, st, c, by_u, by_n, by_t, d, e_u, e_n, e_t):
    """Derivatives of `affine_pair`."""
    return by_u, 0.0, by_n, by_t, e_u, 0.0, e_n, e_t


@njit
def multipliers(x, y, vx, vy, ax, ay, held):
    """Return the multipliers (two) that keep a row of the circle at rest, and the force (2) they give.

    ``rows`` = 0: n . v stays, the reaction has the direction n dn + t dt; 1: t . v stays, same direction; 2: both stay, the
    multipliers are the radial and the tangential force.  ``a`` is the acceleration without them, ``w`` = R M^-1 R^T.  ``held`` are
    the values of a `reaction`: centre (2), drift, spin, rows, w (xx, xy, yy), direction (2).  NaN: another contact holds that row.
    """
    cx, cy, drift, spin, rows, wxx, wxy, wyy, dn, dt = held
    nx, ny, r, sn, w = polar(x - cx, y - cy, vx, vy)
    turn = turned(r)
    if rows == 2.0:
        bn, bt = -w * w * turn - nx * ax - ny * ay, sn * (w * turn - spin) - nx * ay + ny * ax
        bx, by = nx * bn - ny * bt, ny * bn + nx * bt
        det = wxx * wyy - wxy * wxy
        if det <= DEPENDENT * (wxx + wyy) * (wxx + wyy):
            return math.nan, math.nan, math.nan, math.nan
        fx, fy = (wyy * bx - wxy * by) / det, (wxx * by - wxy * bx) / det
        return nx * fx + ny * fy, nx * fy - ny * fx, fx, fy
    px, py = nx * dn - ny * dt, ny * dn + nx * dt
    if rows == 0.0:
        hx, hy, bend = nx, ny, w * w * turn
    else:
        hx, hy, bend = -ny, nx, spin * sn - sn * w * turn
    meets = hx * (wxx * px + wxy * py) + hy * (wxy * px + wyy * py)
    if hx * (wxx * hx + wxy * hy) + hy * (wxy * hx + wyy * hy) <= DEPENDENT * (wxx + wyy):
        return math.nan, math.nan, math.nan, math.nan
    lam = -(hx * ax + hy * ay + bend) / meets
    return lam, 0.0, px * lam, py * lam


@njit
def varied(x, y, vx, vy, ax, ay, held, k):
    """Return the derivative of `multipliers` by argument number ``k`` of the first six."""
    cx, cy, drift, spin, rows, wxx, wxy, wyy, dn, dt = held
    nx, ny, r, sn, w = polar(x - cx, y - cy, vx, vy)
    turn = turned(r)
    ex, ey = 1.0 if k == 0 else 0.0, 1.0 if k == 1 else 0.0
    gx, gy = 1.0 if k == 2 else 0.0, 1.0 if k == 3 else 0.0
    bx, by = 1.0 if k == 4 else 0.0, 1.0 if k == 5 else 0.0
    tau = (nx * ey - ny * ex) * turn
    radial = nx * ex + ny * ey
    nx1, ny1 = -ny * tau, nx * tau
    sn1, w1 = nx * gx + ny * gy + tau * w, nx * gy - ny * gx - tau * sn
    turn1 = -radial * turn * turn
    if rows == 2.0:
        cn, ct = -w * w * turn - nx * ax - ny * ay, sn * (w * turn - spin) - nx * ay + ny * ax
        cn1 = -2.0 * w * w1 * turn - w * w * turn1 - nx1 * ax - ny1 * ay - nx * bx - ny * by
        ct1 = (sn1 * w + sn * w1) * turn + sn * w * turn1 - spin * sn1 - nx1 * ay + ny1 * ax - nx * by + ny * bx
        qx = nx * cn1 - ny * ct1 + nx1 * cn - ny1 * ct
        qy = ny * cn1 + nx * ct1 + ny1 * cn + nx1 * ct
        det = wxx * wyy - wxy * wxy
        px, py = nx * cn - ny * ct, ny * cn + nx * ct
        fx, fy = (wyy * px - wxy * py) / det, (wxx * py - wxy * px) / det
        fx1, fy1 = (wyy * qx - wxy * qy) / det, (wxx * qy - wxy * qx) / det
        return (nx * fx1 + ny * fy1 + nx1 * fx + ny1 * fy, nx * fy1 - ny * fx1 + nx1 * fy - ny1 * fx, fx1, fy1)
    px, py = nx * dn - ny * dt, ny * dn + nx * dt
    px1, py1 = nx1 * dn - ny1 * dt, ny1 * dn + nx1 * dt
    if rows == 0.0:
        hx, hy, hx1, hy1 = nx, ny, nx1, ny1
        bend, bend1 = w * w * turn, 2.0 * w * w1 * turn + w * w * turn1
    else:
        hx, hy, hx1, hy1 = -ny, nx, -ny1, nx1
        bend, bend1 = spin * sn - sn * w * turn, spin * sn1 - (sn1 * w + sn * w1) * turn - sn * w * turn1
    wx, wy = wxx * px + wxy * py, wxy * px + wyy * py
    meets = hx * wx + hy * wy
    meets1 = hx1 * wx + hy1 * wy + hx * (wxx * px1 + wxy * py1) + hy * (wxy * px1 + wyy * py1)
    lam = -(hx * ax + hy * ay + bend) / meets
    lam1 = -(hx1 * ax + hy1 * ay + hx * bx + hy * by + bend1 + lam * meets1) / meets
    return lam1, 0.0, px1 * lam + px * lam1, py1 * lam + py * lam1


@njit
def variations(x, y, vx, vy, ax, ay, held):
    """Return the derivatives of each of the four results of `multipliers` by (x, y, vx, vy, ax, ay)."""
    l0, m0, f0, g0 = varied(x, y, vx, vy, ax, ay, held, 0)
    l1, m1, f1, g1 = varied(x, y, vx, vy, ax, ay, held, 1)
    l2, m2, f2, g2 = varied(x, y, vx, vy, ax, ay, held, 2)
    l3, m3, f3, g3 = varied(x, y, vx, vy, ax, ay, held, 3)
    l4, m4, f4, g4 = varied(x, y, vx, vy, ax, ay, held, 4)
    l5, m5, f5, g5 = varied(x, y, vx, vy, ax, ay, held, 5)
    return (l0, l1, l2, l3, l4, l5), (m0, m1, m2, m3, m4, m5), (f0, f1, f2, f3, f4, f5), (g0, g1, g2, g3, g4, g5)


@njit
def reaction(x, y, vx, vy, ax, ay, *held):
    """Force (2) of a constraint, see `multipliers`."""
    _, _, fx, fy = multipliers(x, y, vx, vy, ax, ay, held)
    return fx, fy


@njit
def reaction_slope(x, y, vx, vy, ax, ay, *held):
    """Derivatives of `reaction` by (x, y, vx, vy, ax, ay), the first force first."""
    _, _, first, second = variations(x, y, vx, vy, ax, ay, held)
    return first + second


@njit
def limit(x, y, vx, vy, ax, ay, *values):
    """Affine expression in depth, speeds and the multipliers of a constraint, whose values are the first ten."""
    held, (radius, c, by_u, by_n, by_t, by_0, by_1) = values[:10], values[10:]
    cx, cy, drift, spin = held[:4]
    _, _, r, sn, w = polar(x - cx, y - cy, vx, vy)
    l0, l1, _, _ = multipliers(x, y, vx, vy, ax, ay, held)
    return c + by_u * (r - radius) + by_n * sn + by_t * (w + drift + spin * r) + by_0 * l0 + by_1 * l1


@njit
def limit_slope(x, y, vx, vy, ax, ay, *values):
    """Derivatives of `limit` by (x, y, vx, vy, ax, ay)."""
    held, (_, _, by_u, by_n, by_t, by_0, by_1) = values[:10], values[10:]
    cx, cy, _, spin = held[:4]
    nx, ny, r, sn, w = polar(x - cx, y - cy, vx, vy)
    g0, g1, g2, g3 = scalar_slope(nx, ny, r, sn, w, by_u + spin * by_t, by_n, by_t)
    first, second, _, _ = variations(x, y, vx, vy, ax, ay, held)
    return (g0 + by_0 * first[0] + by_1 * second[0], g1 + by_0 * first[1] + by_1 * second[1],
            g2 + by_0 * first[2] + by_1 * second[2], g3 + by_0 * first[3] + by_1 * second[3],
            by_0 * first[4] + by_1 * second[4], by_0 * first[5] + by_1 * second[5])


@njit
def unrest(x, y, vx, vy, cx, cy, radius, drift, spin, rows):
    """Return the largest speed of the rows that should rest, and for a normal row the depth, relative to the radius."""
    _, _, r, sn, w = polar(x - cx, y - cy, vx, vy)
    slide = 0.0 if rows == 0.0 else abs(w + drift + spin * r)
    if rows == 1.0:
        return slide, 0.0
    return max(slide, abs(sn)), (r - radius) / (r + abs(cx) + abs(cy))


@njit
def put_at_rest(x, y, vx, vy, cx, cy, radius, drift, spin, rows):
    """Return what must be added to (x, y, vx, vy) for the rows of `unrest` to be at rest, and on the circle."""
    nx, ny, r, sn, w = polar(x - cx, y - cy, vx, vy)
    out = 0.0 if rows == 1.0 else radius - r
    stop = 0.0 if rows == 1.0 else -sn
    slide = 0.0 if rows == 0.0 else -(w + drift + spin * (r + out))
    return out * nx, out * ny, stop * nx - slide * ny, stop * ny + slide * nx


@njit
def rest_slope(x, y, vx, vy, cx, cy, radius, drift, spin, rows):
    """Derivatives of `put_at_rest`: of what is added to the position by the position (4 numbers, a row at a time), of what is added
    to the velocity by the position (4) and by the velocity (4)."""
    nx, ny, r, sn, w = polar(x - cx, y - cy, vx, vy)
    turn = turned(r)
    kx, ky = -ny * turn, nx * turn  # the angle by x and by y
    on, off = 0.0 if rows == 1.0 else 1.0, 0.0 if rows == 0.0 else 1.0
    out, stop, slide = on * (radius - r), -on * sn, -off * (w + drift + spin * (r + on * (radius - r)))
    kept = spin * (1.0 - on)  # the radius after it turns with the position only where it stays
    sx, sy = -on * w * kx, -on * w * ky  # stop by x and by y
    lx, ly = off * (sn * kx - kept * nx), off * (sn * ky - kept * ny)  # slide by x and by y
    gx, gy = -ny * stop - nx * slide, nx * stop - ny * slide  # what the angle does to stop n + slide t
    return (-on * nx * nx - out * ny * kx, -on * nx * ny - out * ny * ky, -on * ny * nx + out * nx * kx,
            -on * ny * ny + out * nx * ky, sx * nx - lx * ny + gx * kx, sy * nx - ly * ny + gx * ky,
            sx * ny + lx * nx + gy * kx, sy * ny + ly * nx + gy * ky,
            -on * nx * nx - off * ny * ny, (off - on) * nx * ny, (off - on) * nx * ny, -on * ny * ny - off * nx * nx)
