// What the page shows, as the controls beside the picture set it.

import type { Compare } from "./legend";
import type { BentRay, PageCamera, Shown } from "./protocol";
import type { Settings } from "./settings";
import type { Vec3 } from "./vectors";

export interface State extends Settings {
  layer: Shown;
  straight: boolean;
  /** Index per region; null as learned. */
  index: (number | null)[];
  /** Factor on the absorption per region; null as learned. */
  absorption: (number | null)[];
  photo: number | null;
  compare: Compare;
  slice: { region: number; axis: number; at: number } | null;
  /** Keyframes of the camera path that is chosen. */
  keys: PageCamera[];
  ray: BentRay | null;
  /** Of what is opaque, only that in a box is shown: from where to where along each axis, as parts of the scene's box. */
  crop: { on: boolean; sides: [number, number][] };
  /** Clicks choose the ends of a distance. */
  measures: boolean;
  /** Those ends, as far as they are chosen. */
  ends: Vec3[];
}

export function initial(settings: Settings): State {
  return {
    ...settings,
    layer: "colour",
    straight: false,
    index: [],
    absorption: [],
    photo: null,
    compare: "off",
    slice: null,
    keys: [],
    ray: null,
    crop: { on: false, sides: [0, 1, 2].map(() => [0, 1]) },
    measures: false,
    ends: [],
  };
}
