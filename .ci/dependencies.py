#!/usr/bin/env python3
"""Checks deny.toml's licences, bans and sources, and that every dependency of Cargo.toml is used by a source file.

What `cargo deny --all-features check licenses bans sources` and `cargo machete` check, from `cargo metadata` alone: to build those two takes
longer than everything else that .ci/run does.
"""
import json, pathlib, re, subprocess, sys, tomllib

ROOT = pathlib.Path(__file__).resolve().parent.parent
DENY = tomllib.loads((ROOT / "deny.toml").read_text())
CARGO = tomllib.loads((ROOT / "Cargo.toml").read_text())
MEMBERS = [".", *(p.parent for pattern in CARGO["workspace"]["members"] for p in ROOT.glob(f"{pattern}/Cargo.toml"))]
CRATES_IO = "registry+https://github.com/rust-lang/crates.io-index"


def allowed(expression):
    """Whether the licences allowed meet an SPDX expression: OR needs one of its terms, AND all, and AND binds closer."""
    tokens = re.findall(r"[()]|[^\s()]+", expression.replace("/", " OR ").replace(" WITH ", "+WITH+"))
    licences = {name.replace(" WITH ", "+WITH+") for name in DENY["licenses"]["allow"]}
    words = {"OR": "or", "AND": "and", "(": "(", ")": ")"}
    return eval(" ".join(words.get(t, str(t in licences)) for t in tokens))  # nothing but the four words, True and False


def problems():
    command = ["cargo", "metadata", "--format-version", "1", "--locked", "--all-features"]
    packages = json.loads(subprocess.run(command, cwd=ROOT, check=True, capture_output=True).stdout)["packages"]
    banned = {ban["name"] for ban in DENY["bans"]["deny"]}
    for package in packages:
        name = f"{package['name']} {package['version']}"
        if not allowed(package["license"] or "none"):
            yield f"{name} has the licence {package['license']}, which deny.toml does not allow"
        if package["source"] not in (CRATES_IO, None):
            yield f"{name} comes from {package['source']}, not from crates.io"
        if package["name"] in banned:
            yield f"{name} is banned by deny.toml"
    for member in MEMBERS:
        yield from unused(ROOT / member)


def unused(package):
    """Dependencies of a package that none of its sources names, or that it takes in any version."""
    cargo = tomllib.loads((package / "Cargo.toml").read_text())
    source = "\n".join(p.read_text() for folder in ("src", "tests", "benches", "examples") for p in (package / folder).rglob("*.rs"))
    tables = [cargo, *cargo.get("target", {}).values()]
    dependencies = {k: v for t in tables for kind in ("dependencies", "dev-dependencies") for k, v in t.get(kind, {}).items()}
    ignored = cargo["package"].get("metadata", {}).get("cargo-machete", {}).get("ignored", [])
    for name, wanted in dependencies.items():
        if (wanted if isinstance(wanted, str) else wanted.get("version")) == "*":
            yield f"{name} is wanted in any version"
        library = name.replace("tongue-fit-", "tongue_").replace("-", "_")  # the crates of the workspace have short names
        if name not in ignored and not re.search(rf"\b{library}\b", source):
            yield f"no source file of {package.relative_to(ROOT)} uses {name}"


found = list(problems())
print("\n".join(found) or "licences, bans, sources and use of all dependencies are in order")
# The database of advisories is in no package registry. Known by hand: `paste` (RUSTSEC-2024-0436, unmaintained), through argmin and gemm.
print("not checked: security advisories (run `cargo audit` where the database can be fetched)")
sys.exit(bool(found))
