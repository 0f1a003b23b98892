#!/usr/bin/env python3
"""The way of tests from simulation to a lab and back, on the stand-in for the gearbox cell (`study.sesame`):

    campaign -> confirm -> select 5 -> lab -> gap -> explore -> compensate -> campaign again -> page

    examples/kuka_cell/study.py                     one study, with what it says
    examples/kuka_cell/study.py --seeds 10          how often each gap that was built in is found, over 10 seeds
    examples/kuka_cell/study.py --seeds 10 --as-modelled
                                                    how often one is found where there is none

Needs Rust and Python 3.9 or later. Results are kept in the folder that it names.
"""

import argparse
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
SPACE = ROOT / "examples/kuka_cell/study.sesame"
# What `sesamec gap --extents` says of a gap that is there.
FOUND = {"systematic", "range", "tests", "scattered"}


def build():
    """Builds `sesamec` and the stand-in for the lab, and puts both on PATH."""
    for package in ["sesamec", "kuka_cell_lab"]:
        subprocess.run(["cargo", "build", "--release", "--package", package], cwd=ROOT, check=True)
    target = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "release"
    os.environ["PATH"] = f"{target}{os.pathsep}{os.environ['PATH']}"


class Study:
    """One study, in a folder of its own."""

    def __init__(self, folder, seed, as_modelled, talks):
        self.folder, self.seed, self.talks = folder, seed, talks
        folder.mkdir(parents=True)
        text = SPACE.read_text()
        if as_modelled:
            lab = 'process "kuka_cell_lab" { step'
            assert lab in text
            text = text.replace(lab, 'process "kuka_cell_lab" "--as-modelled" { step')
        (folder / "study.sesame").write_text(text)
        self.results = "runners/study/results"

    def sesamec(self, *arguments, shown=False):
        """Runs a command; gives what it prints."""
        arguments = [str(argument) for argument in arguments]
        if self.talks:
            print(f"\n$ sesamec {' '.join(arguments)}", flush=True)
        done = subprocess.run(["sesamec", *arguments], cwd=self.folder, capture_output=True, text=True)
        # 3 says that a requirement is violated, which is what is looked for.
        if done.returncode not in (0, 3):
            sys.exit(f"error: sesamec {' '.join(arguments)} failed in {self.folder}:\n{done.stderr}")
        if self.talks and shown:
            print(done.stdout, end="", flush=True)
        return done.stdout

    def json(self, *arguments):
        return json.loads(self.sesamec(*arguments, "--format", "json"))

    def in_lab(self, run, tests):
        """Runs tests again in simulation and in the lab; gives how far their gaps extend."""
        results = ["--results", run]
        self.sesamec("confirm", "study.sesame", *tests, "-n", 5, *results)
        self.sesamec("physical", "study.sesame", *tests, *results)
        for test in tests:
            self.sesamec("replay", "study.sesame", test, "--record", *results)
        sides = [f"{self.results}/{run}", f"{self.results}/{run}-hall"]
        self.sesamec("gap", *sides, shown=True)
        return self.json("gap", *sides, "--extents")

    def most_unlike(self, run, everywhere):
        """The test whose gap stands out most, of metrics whose gap is not the same everywhere; None without one."""
        varying = {row["of"] for row in everywhere if row["quantity"] == "metric" and row["extent"] != "systematic"}
        rows = self.json("gap", f"{self.results}/{run}", f"{self.results}/{run}-hall")
        rows = [row for row in rows if row["metric"] in varying and row["verdict"] == "different"]
        return max(rows, key=lambda row: abs(row["difference"]) / row["tolerance"])["test"] if rows else None

    def carry_out(self, compensates):
        """The whole way; gives what was found."""
        self.sesamec("run", "study.sesame", "--", "--seed", self.seed, shown=True)
        run = str(self.seed)
        chosen = [row["test"] for row in self.json("select", f"{self.results}/{run}")]
        self.sesamec("select", f"{self.results}/{run}", shown=True)
        everywhere = self.in_lab(run, chosen)
        # Whether a gap is in a part of the space shows along a dimension, around a test that has it.
        middle = self.most_unlike(run, everywhere) or chosen[0]
        self.sesamec("explore", "study.sesame", middle, "--vary", "P1", "-n", 9, "--results", run)
        around = self.in_lab(f"{run}-{middle}-P1", [f"T{at}" for at in range(1, 10)])
        found = {"seed": self.seed, "tests": chosen, "around": middle}
        found["gaps"] = [row for row in everywhere if row["extent"] in FOUND]
        found["gaps_around"] = [row for row in around if row["extent"] in FOUND]
        if compensates:
            lab = f"{self.results}/{run}-hall"
            if self.talks:
                self.sesamec("compensate", "study.sesame", lab, shown=True)
                page = ["study", f"{self.results}/{run}", lab, "--simulation", f"{lab}-compensated", "--svg", "figures"]
                self.sesamec(*page)
                print(f"\nThe page of the study is {self.folder / 'study.html'}")
            else:
                found["compensated"] = self.json("compensate", "study.sesame", lab, "--no-campaign")
        return found


def names(found):
    """Which of the gaps that were built in were found."""
    lags = [row for row in found["gaps"] if row["quantity"] == "lag"]
    # 50 ms, and the next step of the drives.
    late = [row for row in lags if row["extent"] in ("systematic", "tests") and 0.03 < row["difference"] < 0.12]
    zones = [row for row in found["gaps"] if row["of"] == "zone_distance" or row["quantity"] == "level"]
    shifted = [row for row in zones if row["extent"] in ("systematic", "tests")]
    limited = [row for row in found["gaps_around"] if row["of"] == "reach" and row["extent"] == "range"]
    return {"latency": len(late) >= 3, "zones": bool(shifted), "limit": any(row["dimension"] == "P1" for row in limited)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, help="repeat the study with the seeds 1 to N, and count")
    parser.add_argument("--as-modelled", action="store_true", help="the lab is as the model, so there is no gap to find")
    parser.add_argument("--into", type=pathlib.Path, help="a new folder for the results [default: a temporary one]")
    asked = parser.parse_args()
    if shutil.which("cargo") is None:
        sys.exit("error: there is no cargo: install Rust")
    build()
    into = asked.into or pathlib.Path(tempfile.mkdtemp(prefix="kuka-study-"))
    if asked.into:
        into.mkdir(parents=True)
    into = into.resolve()
    print(f"Results are in {into}", flush=True)
    if asked.seeds is None:
        Study(into / "study", 42, asked.as_modelled, True).carry_out(True)
        return
    studies = []
    for seed in range(1, asked.seeds + 1):
        found = Study(into / f"seed-{seed}", seed, asked.as_modelled, False).carry_out(not asked.as_modelled)
        studies.append(found)
        (into / "studies.json").write_text(json.dumps(studies, indent=1))
        if asked.as_modelled:
            wrong = found["gaps"] + found["gaps_around"]
            said = ", ".join(f"{row['of']} ({row['quantity']}, {row['extent']})" for row in wrong)
            print(f"seed {seed}: {said or 'no gap'}", flush=True)
            continue
        fit = found["compensated"]
        before, after = fit["held_out"]["discrepancy_before"], fit["held_out"]["discrepancy_after"]
        zone = next(row for row in fit["metrics"] if row["metric"] == "zone_distance")
        what = ", ".join(f"{gap} {'found' if was else 'MISSED'}" for gap, was in names(found).items())
        print(
            f"seed {seed}: {what}; traces of held-out tests {before:.3f} -> {after:.3f}, zone_distance "
            f"{zone['difference_before']:.1f} -> {zone['difference_after']:.1f} mm",
            flush=True,
        )
    if asked.as_modelled:
        wrong = sum(bool(study["gaps"] or study["gaps_around"]) for study in studies)
        print(f"A gap was found in {wrong} of {len(studies)} studies in which there is none")
        return
    for gap in ["latency", "zones", "limit"]:
        print(f"{gap}: found in {sum(names(study)[gap] for study in studies)} of {len(studies)} studies")


main()
