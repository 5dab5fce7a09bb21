"""Scores of rendered test views as `refraxel eval` defines them (docs/theory.md, section 5), by scikit-image.

usage: scores.py SCENE RENDERED EVERY     prints PSNR [dB], inside and outside the masks, and SSIM: means over each EVERY-th test view
"""

import json
import sys
from pathlib import Path

import numpy as np
from PIL import Image
from scene import read_views
from skimage.metrics import structural_similarity

LEAST = 64  # pixels of a region that has a score


def psnr(error: np.ndarray) -> float:
    return float(-10 * np.log10(error.mean()))


def score(truth: np.ndarray, rendered: np.ndarray, mask: np.ndarray | None) -> dict[str, float]:
    """Of one picture; both hold 8-bit values / 255, `mask` is true inside refractive bodies."""
    error = (rendered - truth) ** 2
    ssim = structural_similarity(
        rendered, truth, data_range=1, channel_axis=-1, gaussian_weights=True, sigma=1.5, use_sample_covariance=False
    )
    scores = {"psnr": psnr(error), "ssim": float(ssim)}
    for name, region in (("psnr_inside", mask), ("psnr_outside", None if mask is None else ~mask)):
        if region is not None and region.sum() >= LEAST:
            scores[name] = psnr(error[region])
    return scores


def main() -> None:
    folder, out = Path(sys.argv[1]), Path(sys.argv[2])
    rows = []
    for view in read_views(folder, "test", int(sys.argv[3])):
        rendered = np.asarray(Image.open(out / view.name).convert("RGB"), np.float64) / 255
        mask = folder / "masks" / "test" / view.name
        inside = np.asarray(Image.open(mask).convert("L")) > 127 if mask.exists() else None
        rows.append(score(np.round(view.colour.astype(np.float64) * 255) / 255, rendered, inside))
    keys = ("psnr", "psnr_inside", "psnr_outside", "ssim")
    means = {key: float(np.mean([r[key] for r in rows if key in r])) for key in keys if any(key in r for r in rows)}
    print(json.dumps({"pictures": len(rows), **means}))


if __name__ == "__main__":
    main()
