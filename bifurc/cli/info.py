"""``bifurc info [SYSTEM]``: the installation, or a system."""
import argparse
import importlib.metadata
import inspect
import sys

import bifurc as bf

from .._cache import cache_folder
from .common import system_name


def add(commands) -> None:
    """Add the command to the parser."""
    info = commands.add_parser("info", help="tell about the installation, or about a system")
    info.add_argument("system", metavar="SYSTEM", nargs="?")
    info.set_defaults(run=run_info)


def run_info(options: argparse.Namespace) -> int:
    """Print a system's equation and parameters; without a system: versions, folders, and the systems there are."""
    if options.system is not None:
        name = system_name(options.system)
        builder = getattr(bf.systems, name)
        print(f"{name}\n\n{inspect.getdoc(builder)}\n\nDefaults")
        for parameter, value in builder().parameters.items():
            print(f"  --set {parameter}={value}")
        return 0
    print(f"bifurc {bf.__version__}, Python {sys.version.split()[0]}")
    for package in ("numpy", "scipy", "numba", "networkx", "matplotlib"):
        print(f"  {package} {importlib.metadata.version(package)}")
    print(f"compiled kernels: {cache_folder()}\nsystems (bifurc info SYSTEM tells more):")
    for name in bf.systems.__all__:
        print(f"  {name:<32}{(inspect.getdoc(getattr(bf.systems, name)) or '').splitlines()[0]}")
    return 0
