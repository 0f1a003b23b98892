"""Robustness by rtamt, for comparison: reads a case per line of standard input, as JSON, answers each with a line.

A case is {"formula": "always[0:2] (x > 1)", "x": [...], "y": [...]}, its signals sampled once per second from 0 s on.
An answer is the robustness at 0 s and the seconds that computing it took, parsing left out.
"""

import json
import sys
import time

import rtamt

for line in sys.stdin:
    case = json.loads(line)
    monitor = rtamt.StlDiscreteTimeSpecification()
    monitor.declare_var("x", "float")
    monitor.declare_var("y", "float")
    monitor.spec = case["formula"]
    monitor.parse()
    trace = {"time": list(range(len(case["x"]))), "x": case["x"], "y": case["y"]}
    start = time.perf_counter()
    robustness = monitor.evaluate(trace)[0][1]
    print(float(robustness), time.perf_counter() - start, flush=True)
