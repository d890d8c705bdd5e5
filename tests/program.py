"""The program under test, as a user starts it."""

import sys

COMMAND = (sys.executable, "-m", "ghest_rt.cli.main")
