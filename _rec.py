import numpy as np, time
from bifurc._jit import fused, leaf, njit
ns, n, MANY, G = 2, 1, 12, 2
guard = np.dtype([("value", float, ns), ("constant", float), ("series", float, (ns, MANY)), ("hit", np.int64), ("modes", np.int64, 6)])
mode = np.dtype([("h", float), ("flow", float, (ns, ns)), ("guards", guard, (G,)), ("count", np.int64)])
@fused
def look(W, full, g, own):
    guard = own.guards[g]
    v0, v1, c = guard.value[0], guard.value[1], guard.constant
    s = guard.series[1, 3]
    for l in range(full):
        W[l] = v0 * W[100 + l] + v1 * W[200 + l] + c + s
@leaf
def run(W, numbers):
    for m in range(numbers.shape[0]):
        for g in range(numbers[m].count):
            look(W, 96, g, numbers[m])
            W[0] += numbers[m].guards[g].modes[2]
@njit
def outer(W, numbers):
    run(W, numbers)
N = np.zeros(3, mode); N["count"] = 2; N["guards"]["value"] = 1.0; N["guards"]["modes"][..., 2] = 5
W = np.arange(400.0)
t = time.time(); outer(W, N); print(W[:5], time.time() - t)
