// The layers of a picture.

import type { Shown } from "./protocol";

export const LAYER_TITLES: Record<Shown, string> = {
  colour: "What the camera sees",
  depth: "Distance along the ray to what is seen: near is yellow",
  opacity: "How much of the background is hidden",
  index: "The index of refraction on the way that differs most from 1",
  normal: "Normals of the first refractive surface",
  reflection: "The light that surfaces mirror, alone",
  transmission: "Everything but the light that surfaces mirror",
};

/** In the order of their buttons and digits. */
export const LAYERS = Object.keys(LAYER_TITLES) as Shown[];
