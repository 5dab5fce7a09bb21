// What the program and the page say to each other; see crates/refraxel/src/viewer/protocol.rs.

import type { Vec3 } from "./vectors";

export interface PageCamera {
  eye: Vec3;
  /** To the right, downwards, forward. */
  axes: [Vec3, Vec3, Vec3];
  /** Horizontal field of view [rad]. */
  angle: number;
  /** [pixel] */
  size: [number, number];
}

export const LAYERS = ["colour", "depth", "opacity", "index", "normal", "reflection", "transmission"] as const;
export type Layer = (typeof LAYERS)[number];

export interface Region {
  index: number;
  absorption: Vec3;
  sharp: boolean;
  min: Vec3;
  max: Vec3;
}

/** A piece of a line on the surface of a region: its ends, and the outward normal between them. */
export interface Piece {
  ends: [Vec3, Vec3];
  normal: Vec3;
}

export interface View {
  name: string;
  split: string;
  camera: PageCamera;
}

export interface Scene {
  name: string;
  step: number;
  /** What was decided about each refractive region, a line each. */
  verdict: string | null;
  min: Vec3;
  max: Vec3;
  up: Vec3;
  start: PageCamera;
  regions: Region[];
  index_range: [number, number];
  reflects: boolean;
  resolution: Vec3;
  voxels: number;
  views: View[];
}

export interface Bounce {
  place: Vec3;
  region: number;
  total: boolean;
  index: [number, number];
  angle: [number, number];
  reflectance: number;
}

export interface BentRay {
  points: Vec3[];
  straight: [Vec3, Vec3];
  bounces: Bounce[];
  turned: number;
  densest: number;
  late: number;
  colour: Vec3;
  opacity: number;
  seen: [number, Vec3] | null;
  is_whole: boolean;
}

export interface Training {
  /** "record", "event" or "state". */
  kind: string;
  text?: string;
  step?: number;
  /** Steps in all; absent or null where the time counts. */
  steps?: number | null;
  progress?: number;
  seconds?: number;
  train_psnr?: number;
  val_psnr?: number;
  phase?: string;
  paused?: boolean;
}

/** How far a verb of the program is. */
export interface Pace {
  task: string;
  percent: number;
  left: string | null;
}

export type FilmFormat = "mp4" | "webm" | "gif";
export type FilmState =
  | { film: "renders"; pace: Pace | null }
  | { film: "ready"; file: string }
  | { film: "stopped" }
  | { film: "failed"; why: string };

export type Tell =
  | ({ tell: "scene" } & Scene)
  | { tell: "ray"; id: number; ray: BentRay }
  | { tell: "surface"; region: number; pieces: number[][] }
  | ({ tell: "training" } & Training)
  | { tell: "ended"; why: string }
  | ({ tell: "film" } & FilmState)
  | { tell: "refused"; why: string };

export type Header =
  | {
      picture: "frame";
      id: number;
      frame: number;
      size: [number, number];
      rays: number;
      last: boolean;
      ms: number;
      range?: [number, number];
      step: number;
    }
  | { picture: "photo"; view: number; size: [number, number] }
  | { picture: "slice"; region: number; axis: number; corners: Vec3[]; range: [number, number] };

export interface Edits {
  index: (number | null)[];
  absorption: (number | null)[];
  /** Opposite corners of a box, outside of which nothing opaque is shown. */
  crop: [Vec3, Vec3] | null;
}

export interface Look {
  id: number;
  camera: PageCamera;
  photo: number | null;
  shown: Layer;
  straight: boolean;
  moving: boolean;
  edits: Edits;
}

export type Ask =
  | ({ ask: "look" } & Look)
  | { ask: "got"; frame: number }
  | { ask: "ray"; id: number; u: number; v: number }
  | { ask: "follow"; id: number; origin: Vec3; direction: Vec3 }
  | { ask: "photo"; view: number }
  | { ask: "slice"; region: number; axis: number; at: number }
  | { ask: "surface"; region: number }
  | { ask: "pause"; paused: boolean }
  | { ask: "stop" }
  | { ask: "film"; path: string; format: FilmFormat; shown: Layer; straight: boolean; index: number | null }
  | { ask: "stop_film" };
