#!/usr/bin/env python3
"""Builds the page: one file with the library for wasm32, packed, and with style and script.

    rustup target add wasm32-wasip1 && web/build.py [FILE, by default web/tongue.html]
"""
import base64, gzip, os, pathlib, subprocess, sys

WEB = pathlib.Path(__file__).resolve().parent
ROOT = WEB.parent
TARGET = "wasm32-wasip1"


def main():
    out = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else WEB / "tongue.html"
    command = ["cargo", "build", "--quiet", "--locked", "--package", "tongue-page", "--profile", "web", "--target", TARGET]
    # Registers of 128 bits, which browsers have had since 2023 at the latest, double the speed where many equilibria are solved at once.
    flags = {"CARGO_TARGET_WASM32_WASIP1_RUSTFLAGS": "-C target-feature=+simd128"}
    subprocess.run(command, cwd=ROOT, check=True, env=os.environ | flags)
    target = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    wasm = (target / TARGET / "web" / "tongue_page.wasm").read_bytes()
    parts = WEB / "page"
    style = (ROOT / "crates" / "files" / "src" / "report" / "page.css").read_text() + (parts / "page.css").read_text()
    script = "\n".join((parts / name).read_text() for name in ("engine.js", "mouth.js", "space.js", "sound.js", "page.js"))
    page = (parts / "page.html").read_text()
    for name, text in [("style", style), ("script", script), ("wasm", base64.b64encode(gzip.compress(wasm, 9, mtime=0)).decode())]:
        assert page.count("{{" + name + "}}") == 1, name
        page = page.replace("{{" + name + "}}", text)
    out.write_text(page)
    print(f"{out}: {len(page.encode()) / 1e6:.2f} MB, of which the library {len(wasm) / 1e6:.2f} MB before packing")


main()
