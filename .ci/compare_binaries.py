#!/usr/bin/env python3
"""Runs two builds of tongue-fit side by side and compares every number that they give, to the last bit.

    .ci/compare_binaries.py OLD NEW [PART ...]

PART is one of fit, batch, simulate, mesh, scene, trajectory (default: all). Fields that only the newer build has are
listed once and are no difference; times, versions and command lines are left out. Exit status 1 where anything differs.
"""
import json, os, subprocess, sys, tempfile

OLD, NEW, PARTS = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2]), sys.argv[3:]
LEFT_OUT = {"wall_s", "version", "command", "seconds", "energy_us", "force_us", "stiffness_us", "total_us", "threads", "inputs_sha256"}
SUBJECTS = {"S1": "ieao", "S2": "ieao", "S3": "ieao", "S4": "iao"}


def cases():
    for subject, vowels in SUBJECTS.items():
        for vowel in vowels:
            for kind in ("ratio", "stretch"):
                for method in ("nelder-mead", "gauss-newton"):
                    row = ["--vowel", vowel, "--subject", subject, "--target", kind, "--method", method]
                    yield "fit", row + (["--baseline", "e"] if subject == "S4" and vowel != "e" else [])
    yield "fit", ["--vowel", "a", "--muscles", "GGa,SGm,HGa,SGp"]
    yield "batch", ["batch"]
    loads = [["GGa=12", "SGm=11.5", "HGa=4.5"], ["GGp=30", "GGm=20"], ["HGp=60", "SGa=5"], ["SGp=40"]]
    for load in loads:
        given = [word for t in load for word in ("--tension", t)]
        yield "simulate", ["simulate", *given]
        yield "simulate", ["simulate", "--h", "2.75mm", *given]
        yield "trajectory", ["simulate", *given, "--trajectory", "--t-end", "0.5"]
    explicit = ["--method", "verlet", "--dt", "2e-6", "--t-end", "0.002"]
    yield "trajectory", ["simulate", "--tension", "GGa=12", "--trajectory", *explicit]
    for h in ("5.5mm", "2.75mm", "8mm"):
        yield "mesh", ["mesh", "--h", h]
    for scene in json.loads(run(OLD, ["scene", "list"])[1])["scenes"]:
        yield "scene", ["scene", "run", scene if isinstance(scene, str) else scene["name"]]


def run(binary, arguments):
    with tempfile.TemporaryDirectory() as folder:
        command = [binary, *arguments, "--json", "--out", folder]
        done = subprocess.run(command, capture_output=True, text=True, cwd=folder)
        return done.returncode, done.stdout or "{}"


def differences(old, new, path, found, added):
    if isinstance(old, dict) and isinstance(new, dict):
        for key in old.keys() - LEFT_OUT:
            if key not in new:
                found.append(f"{path}.{key} is gone")
            else:
                differences(old[key], new[key], f"{path}.{key}", found, added)
        added.update(f"{path}.{key}" for key in new.keys() - old.keys() - LEFT_OUT)
    elif isinstance(old, list) and isinstance(new, list):
        if len(old) != len(new):
            found.append(f"{path} has {len(new)} entries, not {len(old)}")
        for number, (a, b) in enumerate(zip(old, new)):
            differences(a, b, f"{path}[{number}]", found, added)
    elif old != new:
        found.append(f"{path} is {new!r}, not {old!r}")


def knows_tone(binary):
    return "--tone" in subprocess.run([binary, "--help"], capture_output=True, text=True).stdout


def as_the_other(arguments):
    """Builds that know a tone in the baseline take it for stretches, unless they are asked for the thesis's assumptions."""
    stretches = arguments[0] == "batch" or "stretch" in arguments
    return arguments + ["--preset", "thesis"] if stretches and knows_tone(OLD) and not knows_tone(NEW) else arguments


count, bad, added = 0, 0, set()
for part, arguments in cases():
    if PARTS and part not in PARTS:
        continue
    count += 1
    (old_status, old), (new_status, new) = run(OLD, as_the_other(arguments)), run(NEW, arguments)
    found = [] if old_status == new_status else [f"exit status {new_status}, not {old_status}"]
    differences(json.loads(old), json.loads(new), "", found, added)
    if found:
        bad += 1
        print(f"{' '.join(arguments)}: {len(found)} differences")
        print("\n".join(f"    {line[:160]}" for line in found[:6]))
print(f"{count} runs compared, {bad} differ; fields that only the newer has: {sorted(added) or 'none'}")
sys.exit(bad > 0)
