"""Work that tests hand to executors: functions of a module, which processes can be given."""
import os
import time

import numpy as np

JOB = {"problem": "squares", "options": {"seed": 0}}


def squares(payload):
    """The work of these tests: a number, its square, and how it may go wrong."""
    if payload.get("dies"):
        os._exit(9)
    if payload.get("fails"):
        raise ValueError(f"no square of {payload['number']}")
    time.sleep(payload.get("wait", 0.0))
    number = payload["number"]
    return {"number": number}, {"square": np.full(3, float(number**2)), "noise": np.random.default_rng(number).normal(size=50)}


def payloads(n, **more):
    return [{"number": i, **more.get(f"at{i}", {})} for i in range(n)]


def hardening(u, s, beta):
    """A law that only these tests know."""
    return -u - beta * u * u * u
