#!/usr/bin/env python3
"""The figures of README.md and docs: measures them, stores them as docs/figures/NAME.json, and writes them into the pages.

usage: docs/figures.py NAME OUT […] [--publish]    measures into the folder OUT; docs/figures.py NAME --help lists the arguments
       docs/figures.py --check                     fails where a page differs from the stored figures (part of CI)
       docs/figures.py --write                     writes the stored figures into the pages again

Names: demo, results, scenes, verdicts, compared, growth, curves. Without --publish nothing changes outside OUT. A second call keeps the
runs that OUT holds, so figures can be looked at before they are published. The environment variable REFRAXEL names a program to use instead
of building one. Needs Python 3.10 or later; plots need matplotlib, pictures Pillow and numpy.
"""

import argparse
import json
import sys

from measure import compared, curves, demo, growth, pages, results, scenes, verdicts

MEASURES = {module.__name__.rpartition(".")[2]: module for module in (demo, results, scenes, verdicts, compared, growth, curves)}


def partition(words: list[str], at: str) -> tuple[list[str], list[str]]:
    """The words before and after the first such word."""
    where = words.index(at) if at in words else len(words)
    return words[:where], words[where + 1 :]


def blocks() -> dict[str, str]:
    """The generated text of every block, from the stored figures."""
    found: dict[str, str] = {}
    for name, module in MEASURES.items():
        stored = pages.STORE / f"{name}.json"
        if stored.exists():
            found |= module.blocks(json.loads(stored.read_text()))
    return found


def main() -> int:
    if sys.argv[1:] == ["--check"]:
        wrong = pages.differences(blocks())
        print("\n".join(wrong) or "the pages show the stored figures", file=sys.stderr if wrong else sys.stdout)
        return 1 if wrong else 0
    if sys.argv[1:] == ["--write"]:
        pages.write(blocks())
        return 0
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter, usage=argparse.SUPPRESS)
    names = parser.add_subparsers(dest="figure", required=True)
    for name, module in MEASURES.items():
        sub = names.add_parser(name, description=module.__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
        sub.add_argument("out", metavar="OUT", help="folder for data, runs and the figures OUT/NAME.json")
        sub.add_argument("--publish", action="store_true", help="store the figures below docs/figures and write them into the pages")
        module.arguments(sub)
    # Words after `--` are for the program that is measured.
    words, given_on = partition(sys.argv[1:], "--")
    given = parser.parse_args(words, argparse.Namespace(words=given_on))
    if given_on and given.figure != "curves":
        parser.error(f"{given.figure} has no use for words after --")
    module = MEASURES[given.figure]
    stored = pages.STORE / f"{given.figure}.json"
    before = json.loads(stored.read_text()) if stored.exists() else {}
    found, pictures = module.measure(given, before)
    pages.store(given.figure, found, pages.folder(given.out))
    print("\n\n".join(module.blocks(found).values()))
    if given.publish:
        pages.publish(given.figure, found, pictures)
        pages.write(blocks())
    return 0


if __name__ == "__main__":
    sys.exit(main())
