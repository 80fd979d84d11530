"""What scenes of straight contacts and linear springs cost, beside another version of the package.

``--beside FOLDER`` names the checkout of the other version.  Both run in processes of their own, in turn; least times are
compared, which other work on the machine moves least.
"""
import json
import os
import subprocess
import sys
from pathlib import Path

import bifurc

from . import affine_scenes
from .common import Setting, parser, publish, table

TURNS = {Setting.SMALL: 1, Setting.FULL: 5}
ROUNDS = {Setting.SMALL: 1, Setting.FULL: 30}
CELLS = {Setting.SMALL: 20, Setting.FULL: 200}
HERE = Path(bifurc.__file__).parent.parent


def run(folder: Path, setting: Setting) -> dict[str, float]:
    """Return the least times of the version in a folder, measured in a process of its own."""
    found = subprocess.run([sys.executable, affine_scenes.__file__, str(ROUNDS[setting]), str(CELLS[setting])],
                           env={**os.environ, "PYTHONPATH": str(folder)}, cwd=folder, check=True, capture_output=True, text=True)
    return json.loads(found.stdout)


def costs(setting: Setting, other: Path | None) -> tuple[dict[str, float], dict[str, float] | None]:
    """Return the least times of this version and of the other, over all turns."""
    folders = [HERE] if other is None else [HERE, other]
    turns = [[run(folder, setting) for folder in folders] for _ in range(TURNS[setting])]
    least = [{name: min(turn[k][name] for turn in turns) for name in turns[0][k]} for k in range(len(folders))]
    return least[0], None if other is None else least[1]


def report(own: dict[str, float], other: dict[str, float] | None) -> str:
    """Return the table."""
    rows = [(name, value, None if other is None else other[name], None if other is None else value / other[name])
            for name, value in own.items()]
    return table("least CPU milliseconds", ("work", "this version", "the other", "ratio"), rows)


def picture(own: dict[str, float], other: dict[str, float] | None):
    """Draw the ratios, or the times where there is no other version."""
    from bifurc.plotting.style import figure
    fig, (ax,) = figure(6.0, 0.26 * len(own) + 0.8)
    names = list(own)[::-1]
    ax.barh(names, [own[name] / (1.0 if other is None else other[name]) for name in names])
    if other is None:
        ax.set_xscale("log")
        ax.set_xlabel("CPU time, ms")
    else:
        ax.axvline(1.0, color="black", linewidth=0.8)
        ax.set_xlabel("time over that of the other version")
    return fig


def main(arguments: list[str] | None = None) -> int:
    """Run the study."""
    made = parser(__doc__)
    made.add_argument("--beside", type=Path, help="folder with another version of the package")
    given = made.parse_args(arguments)
    own, other = costs(given.setting, given.beside)
    publish(given, "affine_cost", report(own, other), lambda: picture(own, other))
    return 0


if __name__ == "__main__":
    sys.exit(main())
