"""What the tests share: a small dataset of a glass ball, and a short run on it."""

import pytest

import refraxel

STRAIGHT = {"run.steps": 40, "refraction.bend": "off", "grid.resolution": 32, "run.seed": 3}


@pytest.fixture(scope="session")
def data() -> refraxel.Dataset:
    return refraxel.Scene("glass_ball").dataset(size=(32, 32), views=(12, 0, 2), spp=4)


@pytest.fixture(scope="session")
def run(data: refraxel.Dataset) -> refraxel.Run:
    return refraxel.train(data, options=STRAIGHT)
