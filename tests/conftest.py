"""What holds for all tests."""

import pytest

NOT_AT_HAND = "the shared recordings are not at hand"
"""Why a test on a third-party recording is skipped in a plain clone: such recordings are not ours to ship."""


def pytest_addoption(parser):
    parser.addoption(
        "--fail-on-skip", action="store_true", help="a skipped test is a failure, but for one on a shared recording"
    )


def pytest_sessionfinish(session):
    reporter = session.config.pluginmanager.get_plugin("terminalreporter")
    if reporter is None or not session.config.getoption("--fail-on-skip"):
        return
    skipped = [report for report in reporter.stats.get("skipped", ()) if NOT_AT_HAND not in str(report.longrepr)]
    for report in skipped:
        reporter.write_line(f"SKIPPED, which is a failure here: {report.nodeid}: {report.longrepr}", red=True)
    if skipped and session.exitstatus == 0:
        session.exitstatus = 1


@pytest.fixture(autouse=True)
def quick_searches(request, monkeypatch):
    """Searches in this process write no preview and report, which take longer than a small search; unless marked."""
    if "views" not in request.keywords:
        monkeypatch.setattr("armdesign.views.writing.write_views", lambda *_: ())
