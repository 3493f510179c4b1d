"""Options of the test suite."""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # small matrices: threads would only wait for each other


def pytest_addoption(parser):
    parser.addoption("--full", action="store_true", help="also run the tests marked full: large samples, long sweeps")


def pytest_configure(config):
    config.addinivalue_line("markers", "full: takes long, runs with --full only")


def pytest_collection_modifyitems(config, items):
    """Tests marked full are left out, not skipped: a skipped test would be one that could not run here."""
    if config.getoption("--full"):
        return
    left_out = [item for item in items if item.get_closest_marker("full")]
    config.hook.pytest_deselected(items=left_out)
    items[:] = [item for item in items if item not in left_out]
