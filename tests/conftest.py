"""What holds for all tests."""

import pytest


@pytest.fixture(autouse=True)
def quick_searches(request, monkeypatch):
    """Searches in this process write no preview and report, which take longer than a small search; unless marked."""
    if "views" not in request.keywords:
        monkeypatch.setattr("armdesign.views.writing.write_views", lambda *_: ())
