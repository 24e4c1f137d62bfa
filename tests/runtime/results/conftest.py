"""A browser, and a page open in it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.support.trust.browser import OpenPage, opened_browser


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    with opened_browser() as found:
        yield found


@pytest.fixture
def opened(browser: Any, page_file: Path) -> Iterator[OpenPage]:
    found = OpenPage(browser, page_file)
    found.settle()
    yield found
    assert found.messages == []
    assert found.requests == [page_file.as_uri()]  # and later none
    found.context.close()
