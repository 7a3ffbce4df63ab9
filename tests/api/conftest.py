"""Sessions of a healthy and of a faulty unit, made through the interface."""

import pytest

import etb_hil as etb


@pytest.fixture(scope="session")
def sessions(tmp_path_factory):
    return tmp_path_factory.mktemp("sessions")


@pytest.fixture(scope="session")
def healthy(sessions):
    return etb.run("friction_check", bench="virtual_classic", serial="A-1", seed=3, folder=sessions)


@pytest.fixture(scope="session")
def faulty(sessions):
    return etb.run("friction_check", bench="virtual_classic", unit="faulty", serial="A-2", seed=3, folder=sessions)
