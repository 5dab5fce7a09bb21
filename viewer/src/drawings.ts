// Lines on surfaces and hulls, and around what the grid stores: asked for when they are shown, one after the other.

import type { Ask, RegionFacts, SceneFacts, Tell } from "./protocol";
import type { Vec3 } from "./vectors";

/** Steps of places on surfaces from one end of a box to the other, and the length of normals. */
const [STEPS, NORMAL] = [4095, 100];

/** A piece of a line on a surface: its ends, and the outward normal between them. */
export interface Piece {
  ends: [Vec3, Vec3];
  normal: Vec3;
}

/** What is shown of them. */
export interface Wanted {
  surfaces: boolean;
  hull: boolean;
  bricks: boolean;
}

export class Drawings {
  /** As far as they are known. */
  private readonly regions = new Map<number, Piece[]>();
  hull: Piece[] | null = null;
  /** Lines around stored bricks, and the edge of the blocks that they are around [voxel]. */
  bricks: { lines: [Vec3, Vec3][]; edge: number } | null = null;

  constructor(private readonly send: (ask: Ask) => void) {}

  get surfaces(): Piece[] {
    return [...this.regions.values()].flat();
  }

  forget(): void {
    this.regions.clear();
    this.hull = this.bricks = null;
  }

  /** Asks for what is shown and not known: of several questions of a kind, the program answers the latest. */
  ask(wanted: Wanted, scene: SceneFacts): void {
    const region = scene.regions.findIndex((_, k) => !this.regions.has(k));
    if (wanted.surfaces && region >= 0) this.send({ ask: "surface", region });
    if (wanted.hull && scene.has_hull && !this.hull) this.send({ ask: "hull" });
    if (wanted.bricks && !this.bricks) this.send({ ask: "bricks" });
  }

  takeSurface(region: number, box: RegionFacts, pieces: number[][]): void {
    this.regions.set(region, unpack(box, pieces));
  }

  takeHull({ parts }: Tell & { tell: "hull" }): void {
    this.hull = parts.flatMap((part) => unpack(part, part.pieces));
  }

  takeBricks({ lines, edge }: Tell & { tell: "bricks" }): void {
    this.bricks = {
      lines: lines.map(([a, b, c, d, e, f]) => [
        [a, b, c],
        [d, e, f],
      ]),
      edge,
    };
  }
}

function unpack({ min, max }: { min: Vec3; max: Vec3 }, pieces: number[][]): Piece[] {
  const place = (at: number[]): Vec3 => [0, 1, 2].map((k) => min[k]! + (at[k]! / STEPS) * (max[k]! - min[k]!)) as Vec3;
  return pieces.map((p) => ({
    ends: [place(p.slice(0, 3)), place(p.slice(3, 6))],
    normal: p.slice(6).map((x) => x / NORMAL) as Vec3,
  }));
}
