"""Runs the program, with whose JSON the answers of the module are compared bit by bit."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def program() -> str:
    """The binary: TONGUE_FIT, or that of `cargo build --release`."""
    return os.environ.get("TONGUE_FIT", str(ROOT / "target/release/tongue-fit"))


@pytest.fixture
def asked(program: str, tmp_path: Path) -> Callable[..., dict[str, Any]]:
    """The JSON of the program without provenance and times."""

    def ask(*words: str) -> dict[str, Any]:
        done = subprocess.run([program, *words, "--json"], cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode in (0, 1, 3), done.stderr
        return plain(json.loads(done.stdout))

    return ask


@pytest.fixture
def told(program: str, tmp_path: Path) -> Callable[..., str]:
    """The message of the program for input that it refuses."""

    def tell(*words: str) -> str:
        done = subprocess.run([program, *words], cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode in (1, 2), (words, done.returncode, done.stdout)
        return done.stderr

    return tell


def plain(record: dict[str, Any]) -> dict[str, Any]:
    """A record without the keys that differ from run to run. Python's floats keep every bit of the numbers in JSON."""
    return {name: value for name, value in record.items() if name not in ("version", "command", "wall_s")}
