"""``python -m bifurc.cli`` is the command ``bifurc``."""
import sys

from . import main

sys.exit(main())
