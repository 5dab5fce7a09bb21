// How large a picture may be: as sharp as the screen, as far as the program is fast enough.

import type { Header } from "./protocol";

/** Largest edge that the program paints [pixel]. */
const LARGEST = 2048;
/** A resting camera's picture with one ray per pixel may take so long [s]. */
const RESTING = 10;
/** That of a moving camera would [s]: the program paints down to an eighth of its edges first, and shows that at once. */
const MOVING = 3;
/** Rays per second before any were measured, and the share of a new measurement in the mean. */
const [FIRST, NEW] = [150_000, 0.3];

/** Bounds on a picture [pixel]. */
export interface Bounds {
  edge: number;
  pixels: number;
}

export class Sharpness {
  private speed = FIRST;

  /** A picture has arrived. */
  learn({ size, rays, ms }: Header & { picture: "frame" }, moving: boolean): void {
    const pixels = size[0] * size[1];
    // Of a resting camera, passes of 1/4, 1/16, … of the pixels came before.
    const traced = moving ? pixels : (Math.max(1, rays) + 1 / 3) * pixels;
    this.speed += NEW * ((1000 * traced) / Math.max(ms, 1) - this.speed);
  }

  /** Bounds on the next picture; `chosen` is the longest edge that was asked for, or null for one that fits the screen. */
  bounds(chosen: number | null, moving: boolean): Bounds {
    if (chosen !== null) return { edge: chosen, pixels: Infinity };
    return { edge: LARGEST, pixels: this.speed * (moving ? MOVING : RESTING) };
  }
}
