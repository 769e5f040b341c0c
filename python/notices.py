#!/usr/bin/env python3
"""Writes THIRD_PARTY_NOTICES.txt: the licences of all crates that are in the wheel. With --check it only checks that the file names them all.

Which crates these are says `cargo metadata`; their texts are in cargo's registry. Texts that several crates share stand there once.
"""
import json, pathlib, subprocess, sys

HERE = pathlib.Path(__file__).resolve().parent
FILE = HERE / "THIRD_PARTY_NOTICES.txt"
NAMES = ("LICENSE", "LICENCE", "COPYING", "NOTICE", "UNLICENSE", "COPYRIGHT")


def crates():
    """The packages that are linked into the module, without our own."""
    command = ["cargo", "metadata", "--format-version", "1", "--locked", "--manifest-path", str(HERE / "Cargo.toml")]
    told = json.loads(subprocess.run([*command, "--filter-platform", "x86_64-unknown-linux-gnu"], check=True, capture_output=True).stdout)
    packages, nodes = {p["id"]: p for p in told["packages"]}, {n["id"]: n for n in told["resolve"]["nodes"]}
    root = next(p["id"] for p in told["packages"] if p["name"] == "tongue-fit-python")
    seen, waiting = set(), [root]
    while waiting:
        one = waiting.pop()
        if one not in seen:
            seen.add(one)
            normal = lambda d: any(kind["kind"] is None for kind in d["dep_kinds"])
            waiting += [d["pkg"] for d in nodes[one]["deps"] if normal(d)]
    return sorted((packages[i] for i in seen if packages[i]["source"]), key=lambda p: (p["name"], p["version"]))


def texts(package):
    folder = pathlib.Path(package["manifest_path"]).parent
    files = sorted(p for p in folder.iterdir() if p.is_file() and p.name.upper().startswith(NAMES))
    return [p.read_text(errors="replace").strip().replace("\r\n", "\n") for p in files]


def head(package):
    return f"{package['name']} {package['version']} ({package['license']})"


def main():
    packages = crates()
    if "--check" in sys.argv:
        known = set(FILE.read_text().splitlines())
        missing = [head(p) for p in packages if head(p) not in known]
        print("\n".join(f"{FILE.name} lacks {m}; run python/notices.py" for m in missing) or f"{FILE.name} names all crates of the wheel")
        return bool(missing)
    whose = {}
    for package in packages:
        for text in texts(package) or [f"(The crate comes without a text of its licence, {package['license']}.)"]:
            whose.setdefault(text, []).append(head(package))
    title = "The wheel of tongue-fit contains these crates under these licences.\n"
    parts = ["\n".join(heads) + "\n\n" + text for text, heads in sorted(whose.items(), key=lambda item: item[1])]
    FILE.write_text(title + "".join(f"\n{'=' * 80}\n{part}\n" for part in parts))
    print(f"{len(packages)} crates, {len(whose)} texts, {FILE.stat().st_size} bytes")
    return False


sys.exit(main())
