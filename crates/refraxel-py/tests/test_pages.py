"""The Python of README.md and docs/python.md: every name exists, and the README's example runs."""

import ast
import importlib
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import refraxel

ROOT = Path(__file__).parent.parent.parent.parent
PAGES = {name: (ROOT / name).read_text() for name in ("README.md", "docs/python.md")}


def examples(page: str) -> list[str]:
    return re.findall(r"^```python\n(.*?)^```", page, re.DOTALL | re.MULTILINE)


@pytest.mark.parametrize("page", PAGES.values(), ids=PAGES.keys())
def test_every_name_of_an_example_exists(page: str) -> None:
    found = examples(page)
    assert found
    for node in (node for example in found for node in ast.walk(ast.parse(example))):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "refraxel":
            assert hasattr(refraxel, node.attr), node.attr
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("refraxel"):
            try:
                module = importlib.import_module(node.module)
            except ModuleNotFoundError as error:
                assert error.name in ("torch", "jax"), error
                continue
            assert all(hasattr(module, alias.name) for alias in node.names), node.module


def test_the_example_of_the_readme_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With a small dataset in place of the folder `scene`, and a short training."""
    data = refraxel.Scene("glass_ball").dataset(size=(32, 32), views=(12, 0, 1))
    origins, directions = data.cameras[0].rays()
    train = refraxel.train

    def short(data: Any, out: Any, options: dict[str, Any]) -> Any:
        assert set(options) <= {option["name"] for option in refraxel.options()}
        return train(data, tmp_path / out, options={"run.steps": 40, "grid.resolution": 32, "refraction.bend": "off"})

    class Opened:
        open = staticmethod(lambda folder: data)

    monkeypatch.setattr(refraxel, "train", short)
    monkeypatch.setattr(refraxel, "Dataset", Opened)
    names: dict[str, Any] = {"refraxel": refraxel, "origins": origins, "directions": directions}
    for example in examples(PAGES["README.md"]):
        exec(example, names)
    assert np.shape(names["colour"]) == np.shape(origins) and np.shape(names["depth"]) == np.shape(origins)[:-1]
