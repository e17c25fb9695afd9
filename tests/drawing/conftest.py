"""A page for the tests of what browsers show."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest


@pytest.fixture
def page(browser: Any) -> Iterator[Any]:
    """A fresh page without a network, on which nothing may go wrong: neither an error nor a message on the console."""
    context = browser.new_context(viewport={"width": 1300, "height": 1200}, offline=True, reduced_motion="reduce")
    opened = context.new_page()
    said: list[str] = []
    opened.on("pageerror", lambda error: said.append(str(error)))
    opened.on("console", lambda message: said.append(message.text))
    yield opened
    context.close()
    assert said == []
