"""A browser for the tests of what browsers show: Debian's Chromium, through Playwright; and an end for long runs."""

from __future__ import annotations

import gc
import os
import shutil
import signal
import sys
import time
from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import HealthCheck, settings

from tests.command import BYTECODE

gc.set_threshold(200_000, 50, 100)  # as the command has it; see `pytest_collection_finish`
for library in ("OPENBLAS", "MKL", "OMP"):  # as the command has it: processes of a run do not wait for each other
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")
if sys.dont_write_bytecode:  # else each process, and each run, compiles the package and all tests again: 7 s
    sys.dont_write_bytecode, sys.pycache_prefix = False, str(BYTECODE)
BEGUN = time.monotonic()
CHROMIUMS = ("chromium", "chromium-browser", "google-chrome")

# How long anything takes depends on what else the machine does: no test fails by it.
settings.register_profile("unhurried", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("unhurried")

# A shell lets what it runs in the background ignore Ctrl-C, and `nohup` a closed terminal. The commands that are
# tested would inherit that.
for name in ("SIGINT", "SIGHUP", "SIGQUIT"):
    if hasattr(signal, name) and signal.getsignal(getattr(signal, name)) is signal.SIG_IGN:
        signal.signal(getattr(signal, name), signal.default_int_handler if name == "SIGINT" else signal.SIG_DFL)


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    """One browser for all tests of a process (two would not get on with each other)."""
    playwright = pytest.importorskip("playwright.sync_api", reason="no Playwright: pip install '.[dev]'")
    path = next(filter(None, map(shutil.which, CHROMIUMS)), None)
    if path is None:
        pytest.skip("no Chromium: apt-get install chromium")
    # As root, Chromium needs to be told that it has no sandbox.
    with playwright.sync_playwright() as running:
        started = running.chromium.launch(executable_path=path, args=["--no-sandbox"] * (os.name == "posix"))
        yield started
        started.close()


def pytest_addoption(parser: pytest.Parser) -> None:
    """``--minutes``: for runs that must end in time; in random order, each looks at other tests of a large set."""
    parser.addoption("--minutes", type=float, help="skip the tests that would begin later than that")


def pytest_collection_finish() -> None:
    """What thousands of tests consist of stays to the end: the garbage collector, which would go through all of it
    again and again, is told to leave it alone. That takes a quarter of the time of all tests.
    """
    gc.collect()
    gc.freeze()


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip a test for which there is no time left."""
    minutes: float | None = item.config.getoption("--minutes")
    if minutes is not None and time.monotonic() - BEGUN > 60.0 * minutes:
        pytest.skip("no time left (--minutes)")
