"""``python -m bifurc`` is the command ``bifurc``."""
import sys

from .cli import main

if __name__ == "__main__":
    sys.exit(main())
