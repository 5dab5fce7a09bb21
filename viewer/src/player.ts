// Plays a camera path.

import { at } from "./path";
import type { PageCamera } from "./protocol";

export class Player {
  /** The play that goes on; 0 where none does. */
  private run = 0;

  /** `show` is called with each camera; the last one has `isLast`. */
  constructor(private readonly show: (camera: PageCamera, isLast: boolean) => void) {}

  get isPlaying(): boolean {
    return this.run !== 0;
  }

  stop(): void {
    this.run = 0;
  }

  play(keys: PageCamera[], seconds: number): void {
    const start = performance.now();
    this.run = start;
    // Who wants less motion sees the keyframes one after the other.
    const cuts = matchMedia("(prefers-reduced-motion: reduce)").matches ? keys.length - 1 : Infinity;
    const step = (now: number) => {
      if (this.run !== start) return;
      const t = (now - start) / (1000 * seconds);
      if (t >= 1) this.run = 0;
      this.show(at(keys, Number.isFinite(cuts) ? Math.floor(t * cuts) / cuts : t), t >= 1);
      if (t < 1) requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }
}
