"""`kill -9` at random moments, driver and workers: the result has the same bits, nothing finished is computed again."""
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from bifurc import io
from bifurc.jobs.executors import run_chunks
from bifurc.jobs.store import ChunkStore
from studies import kill
from tests.basins.work import JOB, payloads, squares

ROOT = Path(__file__).resolve().parents[2]
SLOW = {f"at{i}": {"wait": 0.05} for i in range(40)}
DRIVER = """
import sys
from bifurc.jobs.store import ChunkStore
from bifurc.jobs.executors import run_chunks
from tests.basins.test_kills import SLOW
from tests.basins.work import JOB, payloads, squares
run_chunks(ChunkStore(sys.argv[1], JOB), squares, payloads(40, **SLOW), workers=2)
"""


def test_a_driver_killed_again_and_again_loses_nothing_that_is_filed(tmp_path, rng):
    folder = tmp_path / "chunks"
    known: dict[str, int] = {}
    for _ in range(3):
        driver = subprocess.Popen([sys.executable, "-c", DRIVER, str(folder)], cwd=ROOT)
        while driver.poll() is None and len(list(folder.glob("*.npz")) if folder.exists() else []) <= len(known):
            time.sleep(0.005)
        time.sleep(float(rng.uniform(0.0, 0.3)))
        driver.send_signal(signal.SIGKILL)
        driver.wait()
        now = {path.name: path.stat().st_mtime_ns for path in folder.glob("*.npz")}
        for path in folder.glob("*.npz"):
            io.read(path, "chunk")  # every file is whole
        assert known.items() <= now.items()  # none was written again
        known = now
    found = run_chunks(ChunkStore(folder, JOB), squares, payloads(40, **SLOW))
    assert found.kept == len(known) and found.computed == 40 - len(known) and not found.failures


KILLED_WRITER = """
import os, sys
from pathlib import Path
from bifurc import io
from bifurc.jobs.store import ChunkStore
from tests.basins.work import JOB

class Result:
    def save(self, path):
        io.write(path, {"kind": "result"}, {"values": [1.0, 2.0]})

file, last = Path(sys.argv[1]), sys.argv[2]
replace = os.replace
os.replace = lambda old, new: os._exit(9) if last == "while writing" or Path(new) == file else replace(old, new)
ChunkStore.clear = lambda store: os._exit(9)
ChunkStore(f"{file}.chunks", JOB).publish(Result(), file)
"""


@pytest.mark.parametrize("last", ["while writing", "before renaming", "before clearing"])
def test_a_writer_killed_at_the_end_leaves_only_what_the_next_run_takes_away(tmp_path, last):
    file = tmp_path / "result.npz"
    program = KILLED_WRITER.replace("or Path(new) == file ", "") if last == "before clearing" else KILLED_WRITER
    assert subprocess.run([sys.executable, "-c", program, str(file), last], cwd=ROOT).returncode == 9
    assert file.exists() == (last == "before clearing")
    assert {path.name for path in tmp_path.iterdir()} <= {file.name, f"{file.name}.chunks"}
    ChunkStore(f"{file}.chunks", JOB).clear()
    assert [path.name for path in tmp_path.iterdir()] == [file.name] * file.exists()


@pytest.mark.slow
def test_twenty_kills_of_a_sweep():
    seen = kill.experiment(20, 24)
    assert seen["driver kills"] + seen["worker kills"] == 20
    bad = "wrong results", "chunks computed again", "corrupt chunks", "leftovers"
    assert {name: seen[name] for name in bad} == dict.fromkeys(bad, 0)


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="children of a process are read from /proc")
def test_a_killed_worker_is_replaced(tmp_path):
    store = ChunkStore(tmp_path / "chunks", JOB)
    pools = []

    def pool():
        pools.append(kill.pool())
        if len(pools) == 1:
            pools[0].submit(os.getpid).result()
            os.kill(next(iter(pools[0]._processes)), signal.SIGKILL)
        return pools[-1]

    found = run_chunks(store, squares, payloads(6), executor=pool)
    assert found.computed == 6 and not found.failures and len(pools) > 1
