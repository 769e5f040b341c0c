"""The wheel has what a package index and the licences require."""

from __future__ import annotations

import re
from importlib.metadata import distribution
from pathlib import Path

import pytest

import tongue_fit as tf

ROOT = Path(__file__).resolve().parents[2]


def test_the_version_is_one_that_packages_can_have() -> None:
    assert re.fullmatch(r"\d+(\.\d+)+", tf.__version__)
    assert tf.VERSION.startswith(tf.__version__)


def test_the_wheel_has_its_licence_and_says_what_it_is() -> None:
    try:
        wheel = distribution("tongue-fit")
    except ModuleNotFoundError:
        pytest.skip("the package is imported from its folder")
    assert wheel.version == tf.__version__
    licences = [file for file in wheel.files or [] if file.name == "LICENSE"]
    assert [Path(str(file.locate())).read_text() for file in licences] == [(ROOT / "LICENSE").read_text()]
    said = wheel.metadata.get_all("Classifier") or []
    assert "Programming Language :: Python :: 3.10" in said and "Intended Audience :: Science/Research" in said


def test_the_readme_reads_on_an_index() -> None:
    """A link to a file of the repository would be broken on the package index."""
    links = re.findall(r"\]\(([^)]*)\)", (ROOT / "python/README.md").read_text(encoding="utf-8"))
    assert [link for link in links if not link.startswith("https://")] == []
