"""Sets up the Python that an example needs: a virtual environment `venv` in its folder, from its `requirements.txt`.

    python3 examples/set_up.py examples/iiwa_cell

Every package is pinned with its digests, and nothing is built. A second run does nothing unless the requirements
changed.
"""

import argparse
import hashlib
import os
import pathlib
import shutil
import subprocess
import sys

PYTHON = (3, 11)  # the only one for which there are wheels of ROS 2


def set_up(folder: pathlib.Path) -> None:
    """Creates or renews the environment of a folder."""
    requirements = folder / "requirements.txt"
    if not requirements.is_file():
        sys.exit(f"set_up.py: {requirements} does not exist; name the folder of an example")
    venv, stamp = folder / "venv", folder / "venv" / "requirements.sha256"
    digest = hashlib.sha256(requirements.read_bytes()).hexdigest()
    if stamp.is_file() and stamp.read_text() == digest:
        print(f"{venv} is up to date")
        return
    if sys.version_info[:2] != PYTHON:
        wanted, found = ".".join(map(str, PYTHON)), ".".join(map(str, sys.version_info[:2]))
        sys.exit(
            f"set_up.py: this needs Python {wanted}, for which there are wheels of ROS 2, and runs in {found}: "
            f"start it with python{wanted}"
        )
    shutil.rmtree(venv, ignore_errors=True)
    # The bootstrap of the ROS wheels marks the environment of the programs it starts; pip must start without that mark.
    environment = {name: value for name, value in os.environ.items() if name != "_ROS_WHEELS_BOOTSTRAP_COMPLETE"}
    # If this Python has pip, that installs into the environment, which takes half the time of one with its own pip.
    pip = [sys.executable, "-m", "pip", "--python"]
    if subprocess.run([*pip, sys.executable, "--version"], env=environment, capture_output=True).returncode == 0:
        run([sys.executable, "-m", "venv", "--without-pip", str(venv)], environment)
        pip.append(str(venv))
    else:
        run([sys.executable, "-m", "venv", str(venv)], environment)
        pip = [str(venv / "bin" / "python"), "-m", "pip"]
    # Only a few of the thousands of modules are ever imported, and Python compiles those then.
    options = ["--quiet", "--disable-pip-version-check", "--no-compile", "--only-binary", ":all:", "--no-deps"]
    run([*pip, "install", *options, "--require-hashes", "-r", str(requirements)], environment)
    stamp.write_text(digest)
    print(f"{venv} is ready")


def run(command: list[str], environment: dict[str, str]) -> None:
    """Runs a command, and ends this program if it fails."""
    if subprocess.run(command, env=environment).returncode != 0:
        sys.exit(f"set_up.py: this failed: {' '.join(command)}")


def main() -> None:
    """Reads the folders from the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=pathlib.Path, help="folders with a requirements.txt")
    for folder in parser.parse_args().folders:
        set_up(folder)


if __name__ == "__main__":
    main()
