#!/usr/bin/env python3
"""Runs the simulator of a case as a program that Sesame steps. The space of a case names it:

    simulator aisle = process "python3" "../../serve.py" "sim.py" { step 50ms }
"""

import sys

from bugs.protocol import main

main(sys.argv[1:])
