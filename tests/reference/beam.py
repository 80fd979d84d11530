"""A cantilever of Euler-Bernoulli elements, two coordinates a node: a model whose frequencies and statics are known."""
import numpy as np


def cantilever(count=20):
    """Return M, K (2 count, 2 count) and names for unit length, bending stiffness and mass a length."""
    length, n = 1.0 / count, 2 * (count + 1)
    M, K = np.zeros((n, n)), np.zeros((n, n))
    k = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]]) / length**3
    m = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]]) * length / 420.0
    turn = np.array([1.0, length, 1.0, length])
    for e in range(count):
        part = slice(2 * e, 2 * e + 4)
        K[part, part] += k * np.outer(turn, turn)
        M[part, part] += m * np.outer(turn, turn)
    names = [(node if node < count else "tip", direction) for node in range(1, count + 1) for direction in ("uy", "rz")]
    return M[2:, 2:], K[2:, 2:], names
