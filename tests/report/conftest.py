"""What the report's browser tests share: the pages to look at, and one browser.

`CDPR_REPORT` names a finished report.html to test; without it, a sample of each verdict is made by
the example `sample_report`. Without a Chromium on the machine the tests are skipped, and the
summary says so; with `CDPR_REQUIRE_BROWSER=1` that is a failure instead.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from programs import run_example
from report import chromium

VERDICTS = ("named", "ambiguous", "partly_named", "unnamed", "no_missing_effect")
NO_BROWSER = (
    "THE REPORT WAS NOT TESTED IN A BROWSER: no Chromium found "
    f"({', '.join(chromium.NAMES)}); Debian: apt-get install chromium"
)


def pytest_generate_tests(metafunc):
    if "report" in metafunc.fixturenames:
        given = os.environ.get("CDPR_REPORT")
        metafunc.parametrize("report", [given] if given else VERDICTS, indirect=True)


def pytest_terminal_summary(terminalreporter):
    if chromium.find() is None:
        terminalreporter.write_line(NO_BROWSER, red=True, bold=True)


@pytest.fixture(scope="session")
def samples(tmp_path_factory):
    """Makes the sample of a verdict once."""
    folder = tmp_path_factory.mktemp("reports")

    def sample(verdict: str) -> Path:
        page = folder / f"{verdict}.html"
        if not page.exists():
            run_example("cdpr-discovery", "sample_report", page, verdict)
        return page

    return sample


@pytest.fixture
def report(request, samples) -> Path:
    """The page under test."""
    given = os.environ.get("CDPR_REPORT")
    if not given:
        return samples(request.param)
    page = Path(given)
    assert page.is_file(), f"CDPR_REPORT names {page}, which is not a file"
    return page


@pytest.fixture(scope="session")
def browser():
    """A headless Chromium."""
    program = chromium.find()
    if program is None:
        if os.environ.get("CDPR_REQUIRE_BROWSER") == "1":
            pytest.fail(NO_BROWSER)
        pytest.skip(NO_BROWSER)
    running = chromium.Browser(program)
    yield running
    running.close()
