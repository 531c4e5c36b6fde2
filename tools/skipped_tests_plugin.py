"""A pytest plugin that lists skipped tests and fails if one was skipped for no accepted reason.

Accepted: a test marked `recordings` whose reason says that a recording is absent. Used by .ci/run.
"""

from collections import Counter

import pytest

MARKER = "recordings"
WORD = "recording"  # must occur in the reason


def skipped_reports(config: pytest.Config) -> list[pytest.TestReport | pytest.CollectReport]:
    """The reports of everything that was skipped; empty in a worker process."""
    reporter = config.pluginmanager.get_plugin("terminalreporter")
    return reporter.stats.get("skipped", []) if reporter else []


def reason_of(report: pytest.TestReport | pytest.CollectReport) -> str:
    """Why a test was skipped."""
    where = report.longrepr
    return where[2].removeprefix("Skipped: ") if isinstance(where, tuple) else str(where)


def is_accepted(report: pytest.TestReport | pytest.CollectReport) -> bool:
    """Whether a test may be skipped: it needs real recordings, and they are not here."""
    return MARKER in getattr(report, "keywords", {}) and WORD in reason_of(report).lower()


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session: pytest.Session) -> None:
    """Turn a pass into a failure if something was skipped that should have run."""
    if not all(map(is_accepted, skipped_reports(session.config))):
        session.exitstatus = session.exitstatus or pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(
    terminalreporter: pytest.TerminalReporter, config: pytest.Config
) -> None:
    """Print how many tests were skipped, and why."""
    reports = skipped_reports(config)
    terminalreporter.section("skipped tests")
    terminalreporter.line(f"{len(reports)} skipped")
    for reason, count in Counter(map(reason_of, reports)).most_common():
        terminalreporter.line(f"{count:5d}  {reason}")
    for report in reports:
        if not is_accepted(report):
            terminalreporter.line(f"not accepted: {report.nodeid}: {reason_of(report)}", red=True)
