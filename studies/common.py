"""What the studies share: command line, interleaved CPU times, plain tables, pictures, the name of the machine."""
import argparse
import platform
import statistics
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from enum import StrEnum
from pathlib import Path

OUTPUT = Path("studies") / "output"


class Setting(StrEnum):
    """How much is run."""

    SMALL = "small"  # seconds; what the tests run
    FULL = "full"  # what the README of the studies quotes


def parser(doc: str | None) -> argparse.ArgumentParser:
    """Return a command line with the setting and the folder of the results."""
    made = argparse.ArgumentParser(description=(doc or "").splitlines()[0])
    made.add_argument("--setting", type=Setting, choices=list(Setting), default=Setting.FULL)
    made.add_argument("--output", type=Path, default=OUTPUT, help="folder of the picture and the table")
    return made


def interleaved(calls: Mapping[str, Callable[[], object]], rounds: int) -> dict[str, float]:
    """Return the median CPU seconds of each call, measured in turn (A B A B ...), after one call of each unmeasured."""
    times: dict[str, list[float]] = {name: [] for name in calls}
    for call in calls.values():
        call()
    for _ in range(rounds):
        for name, call in calls.items():
            start = time.process_time()
            call()
            times[name].append(time.process_time() - start)
    return {name: statistics.median(found) for name, found in times.items()}


def table(title: str, header: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    """Return a plain text table; the first column is flush left."""
    cells = [list(header), *([_text(value) for value in row] for row in rows)]
    widths = [max(len(row[i]) for row in cells) for i in range(len(header))]
    lines = ["  ".join(cell.ljust(width) if i == 0 else cell.rjust(width)
                       for i, (cell, width) in enumerate(zip(row, widths, strict=True))).rstrip() for row in cells]
    return "\n".join([title, lines[0], "-" * (sum(widths) + 2 * (len(widths) - 1)), *lines[1:]])


def _text(value: object) -> str:
    if value is None:
        return "-"
    if isinstance(value, float):
        return f"{value:.3g}"
    return str(value)


def machine() -> str:
    """Return processor, Python, numpy and numba."""
    import numba
    import numpy
    name = platform.processor() or platform.machine()
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            name = next(line.split(":", 1)[1].strip() for line in file if line.startswith("model name"))
    except (OSError, StopIteration):
        pass
    return (f"{name}, {platform.system()}; Python {platform.python_version()}, numpy {numpy.__version__}, "
            f"numba {numba.__version__}; CPU time, medians")


def publish(arguments: argparse.Namespace, name: str, text: str, picture: Callable[[], object]) -> None:
    """Print the tables, and write them and the figure that ``picture`` draws into the folder of the results."""
    from bifurc.plotting.style import save_figure, styled
    text = f"{text}\n\n{machine()}\n"
    sys.stdout.write(text)
    arguments.output.mkdir(parents=True, exist_ok=True)
    (arguments.output / f"{name}.txt").write_text(text, encoding="utf-8")
    sys.stdout.write(f"picture: {save_figure(styled(picture)(), arguments.output / f'{name}.png')}\n")
