"""The words of `refraxel demo`, as a newcomer sees them."""

import argparse
import re
from pathlib import Path

from .pages import folder
from .program import call, stamp


def arguments(parser: argparse.ArgumentParser) -> None:
    del parser


def measure(given: argparse.Namespace, before: dict) -> tuple[dict, dict[Path, str]]:
    del before
    said = call("demo", cwd=folder(given.out))
    return {**stamp(), "said": said[said.index("PSNR") : said.index("\n\npicture")].splitlines()}, {}


def blocks(figures: dict) -> dict[str, str]:
    said = "\n".join(figures["said"])
    seconds = re.search(r"\((\d+) s in all\)", said)
    took = f"The demo took {seconds[1]} s" if seconds else "The demo ran"
    where = f"on {figures['machine']}{figures.get('beside', '')} (revision {figures['revision']})"
    return {
        "demo": f"```text\n{said}\n```\n\n{took} {where}. It writes `refraxel-demo/comparison.png`, which shows these views, "
        f"and a run that `refraxel view refraxel-demo/bent` opens."
    }
