"""The clamped beam whose responses are known in closed form."""

import pytest
from clamped_beam import LAB


@pytest.fixture(scope="session")
def lab():
    return LAB
