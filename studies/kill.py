"""What a `kill -9` costs: a sweep killed at random moments, driver or worker, resumed until it is done.

After every kill all chunk files are read, and those that were there are checked to be the same files after the next run:
nothing corrupt is accepted, nothing finished is computed again.  The result must equal that of a run left alone, bit for bit.
"""
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from studies.common import Setting, machine, parser, table

ROOT = Path(__file__).resolve().parents[1]
KILLS = {Setting.SMALL: 4, Setting.FULL: 20}
VALUES = {Setting.SMALL: 10, Setting.FULL: 24}


def pool() -> ProcessPoolExecutor:
    """Return two worker processes; a function, so that the sweep can make them again."""
    return ProcessPoolExecutor(2, mp_context=get_context("spawn"))


def drive(folder: str, processes: bool, values: int) -> None:
    """Run the sweep that is killed, and print the hash of its result."""
    import bifurc as bf
    from bifurc.jobs.store import fingerprint
    system = bf.systems.impact_oscillator(zeta=0.02, omega=2.6, amplitude=1.0, gap=0.0, restitution=0.8)
    found = bf.sweep(system, "omega", np.linspace(2.5, 2.65, values), {"q0": (-2.5, 0), "v0": (-3, 3)}, samples=300, chunk=1,
                     executor=pool if processes else None, workers=2, file=Path(folder) / "sweep.npz")
    header, arrays = found.to_record()
    header.pop("key")
    print(json.dumps({"hash": fingerprint([header, arrays]), "failures": len(found.failures)}))


def start(folder: Path, processes: bool, values: int) -> subprocess.Popen:
    """Start a driver in a process of its own."""
    return subprocess.Popen([sys.executable, "-m", "studies.kill", "--drive", str(folder), "--values", str(values),
                             *(["--processes"] if processes else [])], cwd=ROOT, stdout=subprocess.PIPE, text=True,
                            start_new_session=True)


def workers_of(driver: subprocess.Popen) -> list[int]:
    """Return the worker processes of a driver."""
    try:
        children = Path(f"/proc/{driver.pid}/task/{driver.pid}/children").read_text().split()
    except OSError:
        return []
    found = []
    for child in children:
        try:
            if "spawn_main" in Path(f"/proc/{child}/cmdline").read_text():
                found.append(int(child))
        except OSError:
            pass
    return found


def files(folder: Path) -> dict[str, int]:
    """Return the chunk files and when they were written; every one must be readable."""
    from bifurc import io
    found = {}
    for path in (folder / "sweep.npz.chunks").glob("*.npz"):
        io.read(path, "chunk")
        found[path.name] = path.stat().st_mtime_ns
    return found


def experiment(kills: int, values: int, seed: int = 0) -> dict:
    """Kill until the number of kills is reached; return what was seen."""
    rng = random.Random(seed)
    seen = {"driver kills": 0, "worker kills": 0, "sweeps finished": 0, "wrong results": 0, "chunks computed again": 0,
            "corrupt chunks": 0, "chunks found at restarts": 0, "leftovers": 0}
    with tempfile.TemporaryDirectory() as base:
        reference = result_of(start(new(base, "alone"), False, values))
        done, number = 0, 0
        while done < kills:
            folder, processes = new(base, str(number)), number % 2 == 1
            number += 1
            known: dict[str, int] = {}
            while True:
                driver = start(folder, processes, values)
                wait_for_more(driver, folder, len(known), rng.uniform(0.0, 1.5))
                if driver.poll() is None and done < kills:
                    done += 1
                    victims = workers_of(driver)
                    if processes and victims and rng.random() < 0.6:
                        os.kill(rng.choice(victims), signal.SIGKILL)
                        seen["worker kills"] += 1
                        result = result_of(driver)  # it must go on by itself
                    else:
                        os.killpg(driver.pid, signal.SIGKILL)
                        driver.communicate()  # and close its pipes
                        seen["driver kills"] += 1
                        result = None
                else:
                    result = result_of(driver)
                if result is not None:
                    seen["sweeps finished"] += 1
                    seen["wrong results"] += result != reference
                    seen["leftovers"] += len(list(folder.iterdir())) - 1
                    break
                try:
                    now = files(folder)
                except ValueError:
                    seen["corrupt chunks"] += 1
                    now = {}
                if not (folder / "sweep.npz").exists():  # then the chunks may go
                    seen["chunks computed again"] += sum(now.get(name) != when for name, when in known.items())
                seen["chunks found at restarts"] += len(now)
                known = now
    return seen


def new(base: str, name: str) -> Path:
    """Return a new folder."""
    folder = Path(base) / name
    folder.mkdir()
    return folder


def wait_for_more(driver: subprocess.Popen, folder: Path, before: int, further: float) -> None:
    """Wait until one more chunk is there, and a while; or until the driver is done."""
    chunks = folder / "sweep.npz.chunks"
    while driver.poll() is None and len(list(chunks.glob("*.npz")) if chunks.exists() else []) <= before:
        time.sleep(0.02)
    end = time.monotonic() + further
    while driver.poll() is None and time.monotonic() < end:
        time.sleep(0.01)


def result_of(driver: subprocess.Popen) -> dict | None:
    """Return what a driver printed when it finished."""
    out, _ = driver.communicate()
    return json.loads(out.splitlines()[-1]) if driver.returncode == 0 and out.strip() else None


def main(arguments=None) -> dict:
    """Print the table of the experiment."""
    made = parser(__doc__)
    made.add_argument("--drive", metavar="FOLDER")
    made.add_argument("--processes", action="store_true")
    made.add_argument("--values", type=int, default=24)
    chosen = made.parse_args(arguments)
    if chosen.drive:
        drive(chosen.drive, chosen.processes, chosen.values)
        return {}
    begin = time.monotonic()
    seen = experiment(KILLS[chosen.setting], VALUES[chosen.setting])
    text = table("kill -9 at random moments of a sweep, then the same call again", ["what", "number"], list(seen.items()))
    text += f"\n\n{time.monotonic() - begin:.0f} s; {machine()}\n"
    sys.stdout.write(text)
    chosen.output.mkdir(parents=True, exist_ok=True)
    (chosen.output / "kill.txt").write_text(text, encoding="utf-8")
    return seen


if __name__ == "__main__":
    main()
