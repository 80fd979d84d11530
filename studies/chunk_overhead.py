"""What the chunk layer costs: naming, filing and reading a chunk, beside half a second of work, and on each executor."""
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from studies.common import Setting, machine, parser, table

CHUNK = 0.5  # seconds of work
COUNTS = {Setting.SMALL: 6, Setting.FULL: 40}
CELLS = 8192  # labels, periods, impacts, states, speeds of a chunk of a basin map


def labels(payload) -> tuple[dict, dict[str, np.ndarray]]:
    """Return arrays as large as those of a chunk of a basin map, after a while."""
    end = time.perf_counter() + payload["wait"]
    rng = np.random.default_rng(payload["number"])
    arrays = {name: rng.integers(0, 40, CELLS) for name in ("labels", "periods", "impacts", "states")}
    arrays["speeds"] = rng.random(CELLS)
    while time.perf_counter() < end:
        np.sqrt(arrays["speeds"])
    return {}, arrays


def measured(count: int, wait: float, executor=None, workers: int = 1, filed: bool = True) -> tuple[float, float]:
    """Return wall and CPU seconds of the driver a chunk."""
    from bifurc.jobs.executors import run_chunks
    from bifurc.jobs.store import ChunkStore
    starts = np.zeros((CELLS, 2))
    payloads = [{"number": i, "wait": wait, "starts": starts} for i in range(count)]
    with tempfile.TemporaryDirectory() as base:
        store = ChunkStore(Path(base) / "chunks" if filed else None, {"what": "overhead"})
        run_chunks(store, labels, payloads[:2], executor=executor, workers=workers)
        wall, cpu = time.perf_counter(), time.process_time()
        run_chunks(store, labels, payloads[2:], executor=executor, workers=workers)
        return (time.perf_counter() - wall) / (count - 2), (time.process_time() - cpu) / (count - 2)


def bare(count: int, wait: float) -> float:
    """Return wall seconds a chunk of the same work without the layer."""
    begin = time.perf_counter()
    for i in range(count):
        labels({"number": i, "wait": wait})
    return (time.perf_counter() - begin) / count


def parts(count: int) -> dict[str, tuple[float, float]]:
    """Return median wall and CPU seconds of what the layer does with one chunk: name, write, read, hand to a thread."""
    from concurrent.futures import ThreadPoolExecutor

    from bifurc.jobs.store import ChunkStore
    payload = {"number": 0, "wait": 0.0, "starts": np.random.default_rng(0).random((CELLS, 2))}
    meta, arrays = labels(payload)
    with tempfile.TemporaryDirectory() as base, ThreadPoolExecutor(1) as pool:
        store = ChunkStore(Path(base) / "chunks", {"what": "overhead"})
        name = store.name(payload)
        steps = {"name": lambda: store.name(payload), "write": lambda: store.save(name, meta, arrays),
                 "read": lambda: store.load(name), "queue": lambda: pool.submit(int).result()}
        found = {}
        for what, step in steps.items():
            seen = []
            for _ in range(count):
                wall, cpu = time.perf_counter(), time.process_time()
                step()
                seen.append((time.perf_counter() - wall, time.process_time() - cpu))
            found[what] = tuple(np.median(seen, axis=0).tolist())
    return found


def main(arguments=None) -> dict:
    """Print the table."""
    chosen = parser(__doc__).parse_args(arguments)
    count = COUNTS[chosen.setting]
    rows, seen = [], {}
    work = bare(4 * count, 0.0)
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as processes:
        for name, options in (("this thread, in memory", {"filed": False}), ("this thread, filed", {}),
                              ("two threads, filed", {"workers": 2}), ("two processes, filed", {"executor": processes})):
            wall, cpu = measured(8 * count, 0.0, **options)
            inside = 0.0 if "processes" in name else work
            seen[name] = max(cpu - inside, 0.0) / CHUNK
            rows.append([name, 1e3 * (wall - work), 1e3 * max(cpu - inside, 0.0), 100 * seen[name]])
    long_ = measured(max(count // 2, 4), CHUNK)[0]
    without = bare(max(count // 2, 4) - 2, CHUNK)
    seen["wall"] = long_ / without - 1.0
    text = table(f"a chunk of {CELLS} starts; asked: at most 1 % of {CHUNK} s",
                 ["where", "wall ms more", "CPU ms of the driver", f"% of {CHUNK} s"], rows)
    seen["parts"] = parts(8 * count)
    total = [sum(values[i] for values in seen["parts"].values()) for i in (0, 1)]
    text += "\n\n" + table("one by one, medians", ["step", "wall ms", "CPU ms", f"CPU % of {CHUNK} s"], [
        [what, 1e3 * wall, 1e3 * cpu, 100 * cpu / CHUNK] for what, (wall, cpu) in
        [*seen["parts"].items(), ("together", tuple(total))]])
    text += f"\n\n{CHUNK} s chunks, this thread, filed: {100 * seen['wall']:.2f} % more wall time than bare\n\n{machine()}\n"
    sys.stdout.write(text)
    chosen.output.mkdir(parents=True, exist_ok=True)
    (chosen.output / "chunk_overhead.txt").write_text(text, encoding="utf-8")
    return seen


if __name__ == "__main__":
    main()
