"""``pytest tests/cases --refresh-cases`` writes what scripts say now into the case files (review the difference)."""

import pytest


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--refresh-cases", action="store_true", default=False, help="rewrite the expected diagnostics of tests/cases"
    )
