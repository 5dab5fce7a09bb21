"""The pages, and the blocks in them that stored figures make: between `<!-- figures: NAME -->` and `<!-- end -->`."""

import json
import os
import re
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

from .program import ROOT

STORE = ROOT / "docs" / "figures"
BLOCK = re.compile(r"^<!-- figures: (?P<name>\S+) -->\n(?P<text>.*?)^<!-- end -->", re.DOTALL | re.MULTILINE)
MARK = re.compile(r"^<!-- (?:figures: \S+|end) -->$", re.MULTILINE)


def folder(path: str | Path) -> Path:
    """A folder that exists."""
    made = Path(path).resolve()
    made.mkdir(parents=True, exist_ok=True)
    return made


def put(path: Path, text: str) -> None:
    """Writes a file whole or not at all."""
    new = path.with_name(path.name + ".tmp")
    with open(new, "w") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    new.replace(path)


def store(name: str, figures: dict, where: Path = STORE) -> None:
    put(folder(where) / f"{name}.json", json.dumps(figures, indent=1, ensure_ascii=False) + "\n")


def publish(name: str, figures: dict, pictures: dict[Path, str]) -> None:
    """Stores figures, and copies pictures to their names below docs."""
    store(name, figures)
    for source, target in pictures.items():
        shutil.copyfile(source, folder((ROOT / "docs" / target).parent) / Path(target).name)


def all_pages() -> Iterator[Path]:
    yield ROOT / "README.md"
    yield from sorted((ROOT / "docs").glob("*.md"))


def write(blocks: dict[str, str]) -> None:
    for page in all_pages():
        text = page.read_text()
        new = BLOCK.sub(lambda block: f"<!-- figures: {block['name']} -->\n{blocks.get(block['name'], '')}\n<!-- end -->", text)
        if new != text:
            print(f"{page.relative_to(ROOT)}: written", file=sys.stderr)
            put(page, new)


def differences(blocks: dict[str, str]) -> list[str]:
    """What is wrong with the pages, if anything is."""
    wrong, met = [], set()
    for page in all_pages():
        name, text = page.relative_to(ROOT), page.read_text()
        found = list(BLOCK.finditer(text))
        if len(MARK.findall(text)) != 2 * len(found):
            wrong.append(f"{name}: a marker of figures has no partner")
        for block in found:
            met.add(block["name"])
            line = text[: block.start()].count("\n") + 1
            if block["name"] not in blocks:
                wrong.append(f"{name}:{line}: no figures are stored for '{block['name']}'")
            elif block["text"] != blocks[block["name"]] + "\n":
                wrong.append(f"{name}:{line}: '{block['name']}' is not what docs/figures says; run docs/figures.py --write")
    return wrong + [f"docs/figures: no page has a block for '{name}'" for name in blocks.keys() - met]
