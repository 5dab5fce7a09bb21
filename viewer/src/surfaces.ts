// Lines on the surface of each refractive region, asked for one region after the other.

import type { Ask, Piece, Region } from "./protocol";
import type { Vec3 } from "./vectors";

/** Steps of places on surfaces from one end of a region's box to the other, and the length of normals. */
const [STEPS, NORMAL] = [4095, 100];

export class Surfaces {
  /** As far as they are known. */
  private readonly known = new Map<number, Piece[]>();

  constructor(private readonly send: (ask: Ask) => void) {}

  get pieces(): Piece[] {
    return [...this.known.values()].flat();
  }

  forget(): void {
    this.known.clear();
  }

  /** Asks for the next one: of several questions of a kind, the program answers the latest. */
  ask(regions: Region[]): void {
    const region = regions.findIndex((_, k) => !this.known.has(k));
    if (region >= 0) this.send({ ask: "surface", region });
  }

  take(region: number, { min, max }: Region, pieces: number[][]): void {
    const place = (at: number[]): Vec3 =>
      [0, 1, 2].map((k) => min[k]! + (at[k]! / STEPS) * (max[k]! - min[k]!)) as Vec3;
    const piece = (p: number[]): Piece => ({
      ends: [place(p.slice(0, 3)), place(p.slice(3, 6))],
      normal: p.slice(6).map((x) => x / NORMAL) as Vec3,
    });
    this.known.set(region, pieces.map(piece));
  }
}
