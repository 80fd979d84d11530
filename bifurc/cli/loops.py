"""``bifurc hysteresis SYSTEM``: forces of contacts whose motion is prescribed."""
import argparse
import inspect

import bifurc as bf

from .common import check_outputs, folder_of, say_saved, set_values, system_name


def add(commands, shared) -> None:
    """Add the command to the parser."""
    loops = commands.add_parser("hysteresis", parents=[shared], help="force over displacement of a driven contact",
                                description=inspect.getdoc(run_hysteresis))
    loops.set_defaults(run=run_hysteresis)


def run_hysteresis(options: argparse.Namespace) -> int:
    """Find the periodic loops of a contact driven by a displacement; print events, work a period and slip; draw them."""
    name = system_name(options.system)
    system = getattr(bf.systems, name)(**set_values(name, options.set))
    check_outputs(options)
    print(repr(system))
    loops = bf.hysteresis(system).loops
    figure, axes = bf.plotting.figure(3.6 * len(loops), 3.0, columns=len(loops))
    for loop, ax in zip(loops, axes, strict=True):
        print(f"{loop.label}: work a period {loop.work:.9g}, force {loop.force_min:.9g} to {loop.force_max:.9g}; {loop.message}")
        for event in loop.events[:40]:
            print(f"  omega t = {event.angle:.10f}  {event.kind}")
        loop.plot(ax)
        ax.set_title(loop.label, loc="left", fontsize=8)
    say_saved(bf.plotting.save_figure(figure, folder_of(options.out) / f"{name}_loops.{options.format}"))
    return 0
