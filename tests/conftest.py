"""What every run of the tests shares: how long property tests search, and which tests need a browser.

``pytest`` alone is the quick suite: the options in ``pyproject.toml`` leave out what is marked ``slow`` or
``browser``, and property tests try fewer examples. ``pytest -m ""`` runs everything, as CI does.
"""

from __future__ import annotations

import os
import shutil
import signal

import pytest
from hypothesis import HealthCheck, settings
from hypothesis.internal.conjecture import providers

# Each worker of pytest-xdist keeps a processor busy. Threads of OpenBLAS beside them wait for each other, spinning: a
# calibration of 0.2 s took 10 s. To be set before NumPy is imported; the programs that tests start inherit it.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# derandomized: the same robots in every run, so that a failure is one of the code and not of the day
settings.register_profile(
    "full", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow], max_examples=50
)
settings.register_profile("quick", settings.get_profile("full"), max_examples=6)
settings.register_profile("thorough", settings.get_profile("full"), derandomize=False, max_examples=500)

# property tests try constants of the modules that are loaded, too; without them, which examples a test tries does not
# depend on which others run with it. There is no setting for it.
vars(providers)["_get_local_constants"] = lambda: providers._local_constants


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add what is asked for by hand."""
    parser.addoption(
        "--slow-page", type=int, metavar="SEED", help="delay what pages of the viewer draw and send, at random"
    )


def pytest_configure(config: pytest.Config) -> None:
    """Choose how many examples property tests try, unless ``--hypothesis-profile thorough`` says it.

    What a script starts in the background with ``&`` ignores SIGINT, and so would the programs that tests interrupt.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if config.getoption("hypothesis_profile", None) is None:
        settings.load_profile("quick" if "not slow" in config.getoption("markexpr") else "full")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark the tests that drive a browser by the fixture that they use; one that fails is run twice more.

    A browser is a program of others, which may be killed for want of memory or not get a processor for a minute; what
    is wrong fails three times. ``-p no:rerunfailures`` shows what fails once.
    """
    for item in items:
        if "browser" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.browser)
            if config.pluginmanager.hasplugin("rerunfailures"):
                item.add_marker(pytest.mark.flaky(reruns=2))


@pytest.fixture(scope="session")
def own_mounts(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The command that runs another with mounts of its own; skips where that is not allowed."""
    from tests.program import shell

    command = "unshare -m" if os.geteuid() == 0 else "unshare -rm"
    probe = f"""{command} sh -c 'mount -t tmpfs -o size=16k none "$OUT"'"""
    if shutil.which("unshare") is None or shell(probe, OUT=str(tmp_path_factory.mktemp("probe"))).status != 0:
        pytest.skip("needs the right to mount a small file system (unshare and mount)")
    return command
