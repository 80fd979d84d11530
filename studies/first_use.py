"""What a new law costs at its first use: a force of three lines that no process of this machine has seen.

Every case runs in a process of its own, with the kernels that are the same for all laws in the cache.  Columns: CPU seconds to
the first orbit and functions compiled for it, of a new law and of the same law in the next process.
"""
import json
import subprocess
import sys
import tempfile
import uuid
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .common import Setting, parser, publish, table

LAWS = {  # three lines each; UNIQUE makes their text new
    "magnet, differenced": ("", """
def law(u, s, strength, distance):
    pull = strength / (distance - u) ** 2
    return pull - strength / distance ** 2 + 0.0 * UNIQUE
""", "strength=0.05, distance=3.0"),
    "cubic with its derivative": ("def jacobian(u, s, c):\n    return -3.0 * c * u * u + 0.0 * UNIQUE, 0.0\n", """
def law(u, s, c):
    cube = u * u * u
    return -c * cube + 0.0 * UNIQUE
""", "c=1.0, jacobian=jacobian"),
    "friction that falls, differenced": ("import math\n", """
def law(u, s, mu, width):
    slip = s / width
    return -mu * math.tanh(slip) + 0.0 * UNIQUE
""", "mu=0.1, width=0.1"),
}
CASES = {Setting.SMALL: 1, Setting.FULL: 3}
RUN = """
import json, sys, time
import bifurc as bf
from numba.core import event
count = 0
class Counted(event.Listener):
    def on_start(self, happening):
        global count
        count += 1
    def on_end(self, happening):
        pass
event.register("numba:compile", Counted())
sys.path.insert(0, sys.argv[1])
from one_law import law, jacobian
force = bf.elements.Force(law, {arguments}, label="mine")
system = bf.System(1.0, 0.1, 1.0, [bf.elements.HarmonicForce(0.4), force], omega=0.8)
start = time.process_time()
orbit = bf.find_orbit(system)
print(json.dumps([time.process_time() - start, count, bool(orbit.success)]))
"""


@dataclass(frozen=True)
class Use:
    """First orbits with one law.

    Attributes
    ----------
    law : str
    seconds, again : float
        CPU time to the first orbit; the same in the next process.
    compiled, compiled_again : int
        Functions compiled.
    success : bool
    """

    law: str
    seconds: float
    again: float
    compiled: int
    compiled_again: int
    success: bool


def use(name: str) -> Use:
    """Return the measured first use of a law whose text is new; one whose text is older comes before, for what all laws share."""
    before, text, arguments = LAWS[name]
    found = []
    for unique in ("1.0", repr(1.0 + uuid.uuid4().int % 10**9 * 1e-6)):
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "one_law.py").write_text((("jacobian = None\n" + before) + text).replace("UNIQUE", unique))
            for _ in range(2):
                made = subprocess.run([sys.executable, "-c", RUN.replace("{arguments}", arguments), folder], check=True,
                                      capture_output=True, text=True)
                found.append(json.loads(made.stdout.splitlines()[-1]))
    (seconds, compiled, good), (again, compiled_again, still) = found[-2:]
    return Use(name, seconds, again, compiled, compiled_again, good and still)


def uses(setting: Setting) -> list[Use]:
    """Return the measured first uses."""
    return [use(name) for name in list(LAWS)[:CASES[setting]]]


def report(rows: list[Use]) -> str:
    """Return the table."""
    return table("First orbit with a new law", ("law", "CPU s", "functions compiled", "next process, CPU s", "compiled"),
                 [(row.law, row.seconds, row.compiled, row.again, row.compiled_again) for row in rows])


def picture(rows: list[Use]):
    """Draw both uses side by side."""
    from bifurc.plotting.style import figure
    fig, (ax,) = figure(6.0, 2.6)
    place = np.arange(len(rows))
    ax.barh(place - 0.2, [row.seconds for row in rows], 0.38, label="a new law")
    ax.barh(place + 0.2, [row.again for row in rows], 0.38, label="the same law in the next process")
    ax.set_yticks(place, [row.law for row in rows])
    ax.invert_yaxis()
    ax.set_xlabel("CPU time to the first orbit, s")
    ax.legend(frameon=False)
    return fig


def main(arguments: list[str] | None = None) -> int:
    """Run the study."""
    given = parser(__doc__).parse_args(arguments)
    rows = uses(given.setting)
    publish(given, "first_use", report(rows), lambda: picture(rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
