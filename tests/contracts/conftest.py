"""Contracts of an item are chosen by the name of its file, too: ``-k free_play`` as ``-k free-play``."""

import pytest


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Give each contract its name with underscores as a further keyword."""
    for item in items:
        if "-" in item.name:
            item.extra_keyword_matches.add(item.name.replace("-", "_"))
