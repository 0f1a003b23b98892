"""A robot's world, which is launched beside the simulator, with the scenario in its arguments."""
import sys
import time
from pathlib import Path

folder, start, boxes = sys.argv[1:]
Path(folder, "world").write_text(f"{start.removeprefix('start_x:=')} {boxes}")
print("up", flush=True)
while True:
    time.sleep(1000)
