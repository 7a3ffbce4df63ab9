import pytest
import served


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """A page with a station, shared by the tests of a file; each leaves the bench idle and released."""
    folder = tmp_path_factory.mktemp("page")
    with served.Served(folder, "--station", str(served.station(folder))) as one:
        yield one


@pytest.fixture(scope="session")
def browser(tmp_path_factory):
    if served.CHROMIUM is None or served.DRIVER is None:
        pytest.skip("no Chromium with its driver")
    driver = served.open_browser(tmp_path_factory.mktemp("profile"))
    yield driver
    driver.quit()
