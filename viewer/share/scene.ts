// The scene in the page: a document, and numbers that were packed for the way.

import type { PageCamera } from "../src/protocol";
import type { Vec3 } from "../src/vectors";

export interface Region {
  /** The index that the slider begins with. */
  index: number;
  /** The slider changes it: a bubble stays as it is. */
  slides: boolean;
  /** The body has one index; else n − 1 is multiplied. */
  uniform: boolean;
}

export interface Part {
  /** Place and length [byte]. */
  at: number;
  length: number;
}

/** Numbers of 16 bits that stand for low + step × number. */
export interface Packed extends Part {
  low: number;
  step: number;
}

export interface Document {
  name: string;
  up: Vec3;
  /** Corners of the scene's box. */
  min: Vec3;
  max: Vec3;
  start: PageCamera;
  /** Constants of the shaders. */
  constants: { u32: Record<string, number>; f32: Record<string, number> };
  regions: Region[];
  parts: Record<
    | "scene"
    | "task"
    | "regions"
    | "table"
    | "forward"
    | "occupied"
    | "colours"
    | "scales"
    | "planes"
    | "texels"
    | "clearances",
    Part
  >;
  density: Packed;
  /** Coefficients of level sets and fields, in the order of the shader. */
  splines: Packed[];
}

export interface SharedScene {
  document: Document;
  bytes: ArrayBuffer;
}

/** Reads what the program has put into the page: both are in elements that scripts do not run. */
export async function read(): Promise<SharedScene> {
  const document_ = JSON.parse(document.querySelector("#document")!.textContent!) as Document;
  const text = document.querySelector("#numbers")!.textContent!.trim();
  const binary = atob(text);
  const packed = new Uint8Array(binary.length);
  for (let k = 0; k < binary.length; k++) packed[k] = binary.charCodeAt(k);
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return { document: document_, bytes: await new Response(stream).arrayBuffer() };
}

/** Numbers of a part as they were. */
export function unpack(bytes: ArrayBuffer, { at, length, low, step }: Packed): Float32Array<ArrayBuffer> {
  const codes = new Uint16Array(bytes, at, length / 2);
  return Float32Array.from(codes, (c) => low + step * c);
}
