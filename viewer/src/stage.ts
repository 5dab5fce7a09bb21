// The picture, the photograph that it is compared with, and the lines over both.

import { draw, type Overlay } from "./overlay";
import type { PageCamera, Scene } from "./protocol";

export type Compare = "off" | "side" | "wipe" | "difference" | "error";

/** Factor on differences, which are dark otherwise. */
const GAIN = 4;
/** Mean error of the three colours, in 8-bit steps, that is shown palest. */
export const FULL_ERROR = 64;
/** From no error to the largest, as the pictures of `refraxel compare` show it. */
const ERRORS = ["#000004", "#420a68", "#932667", "#dd513a", "#fca50a", "#fcffa4"];

/** 256 colours, four numbers each. */
function errorColours(): Uint8ClampedArray {
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [256, 1];
  const ctx = canvas.getContext("2d")!;
  const gradient = ctx.createLinearGradient(0, 0, 256, 0);
  ERRORS.forEach((colour, k) => gradient.addColorStop(k / (ERRORS.length - 1), colour));
  ctx.fillStyle = gradient;
  ctx.fillRect(0, 0, 256, 1);
  return ctx.getImageData(0, 0, 256, 1).data;
}

/** Where a rendering differs from a photograph, in the size of the rendering. */
function errorMap(rendering: ImageBitmap, photograph: ImageBitmap): HTMLCanvasElement {
  const { width, height } = rendering;
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [width, height];
  const ctx = canvas.getContext("2d", { willReadFrequently: true })!;
  const pixels = (bitmap: ImageBitmap) => {
    ctx.drawImage(bitmap, 0, 0, width, height);
    return ctx.getImageData(0, 0, width, height);
  };
  const [a, b, colours] = [pixels(rendering).data, pixels(photograph), errorColours()];
  for (let k = 0; k < a.length; k += 4) {
    const sum = [0, 1, 2].reduce((sum, c) => sum + Math.abs(a[k + c]! - b.data[k + c]!), 0);
    const colour = 4 * Math.min(255, Math.round((sum * 255) / (3 * FULL_ERROR)));
    for (let c = 0; c < 3; c++) b.data[k + c] = colours[colour + c]!;
  }
  ctx.putImageData(b, 0, 0);
  return canvas;
}

export class Stage {
  readonly element = document.querySelector<HTMLElement>("#stage")!;
  readonly picture = document.querySelector<HTMLCanvasElement>("#picture")!;
  private readonly frame = document.querySelector<HTMLElement>("#frame")!;
  private readonly lines = document.querySelector<HTMLCanvasElement>("#lines")!;
  private readonly handle = document.querySelector<HTMLElement>("#wipe")!;
  private readonly side = document.querySelector<HTMLElement>("#side")!;
  private readonly photo = document.querySelector<HTMLImageElement>("#photo")!;
  private rendering: ImageBitmap | null = null;
  private photograph: ImageBitmap | null = null;
  private compare: Compare = "off";
  private boundary = 0.5;
  /** Size of the picture on the page [CSS pixel]. */
  private shown: [number, number] = [16, 16];

  constructor() {
    this.handle.addEventListener("pointerdown", (event) => {
      event.stopPropagation();
      this.handle.setPointerCapture(event.pointerId);
    });
    this.handle.addEventListener("pointermove", (event) => {
      if (!this.handle.hasPointerCapture(event.pointerId)) return;
      const box = this.picture.getBoundingClientRect();
      this.boundary = Math.max(0, Math.min(1, (event.clientX - box.left) / box.width));
      this.paint();
    });
  }

  /** Size of the picture to ask for, at most `most` pixels long, with this aspect if there is one. */
  fit(most: number, aspect: number | null): [number, number] {
    const halves = this.compare === "side" ? 2 : 1;
    let [width, height] = [this.element.clientWidth / halves, this.element.clientHeight];
    if (aspect !== null) [width, height] = [Math.min(width, height * aspect), Math.min(height, width / aspect)];
    this.shown = [width, height];
    const shrink = Math.min(1, most / Math.max(width, height));
    return [Math.max(16, Math.round(width * shrink)), Math.max(16, Math.round(height * shrink))];
  }

  layOut(): void {
    const [width, height] = this.shown;
    const ratio = Math.min(devicePixelRatio, 2);
    this.frame.style.width = `${width * (this.compare === "side" ? 2 : 1)}px`;
    this.frame.style.height = `${height}px`;
    for (const canvas of [this.picture, this.lines]) {
      canvas.style.width = `${width}px`;
      canvas.style.height = `${height}px`;
      const size = [Math.round(width * ratio), Math.round(height * ratio)] as const;
      if (canvas.width !== size[0] || canvas.height !== size[1]) [canvas.width, canvas.height] = size;
    }
    this.photo.style.width = `${width}px`;
    this.photo.style.height = `${height}px`;
    this.paint();
  }

  setCompare(compare: Compare): void {
    this.compare = compare;
    this.side.hidden = compare !== "side";
    this.frame.classList.toggle("sides", compare === "side");
  }

  showRendering(bitmap: ImageBitmap): void {
    this.rendering?.close();
    this.rendering = bitmap;
    this.paint();
  }

  showPhotograph(bitmap: ImageBitmap | null, jpeg: Blob | null): void {
    this.photograph?.close();
    this.photograph = bitmap;
    if (this.photo.src) URL.revokeObjectURL(this.photo.src);
    if (jpeg) this.photo.src = URL.createObjectURL(jpeg);
    else this.photo.removeAttribute("src");
    this.paint();
  }

  paint(): void {
    const ctx = this.picture.getContext("2d")!;
    const { width, height } = this.picture;
    ctx.globalCompositeOperation = "source-over";
    ctx.filter = "none";
    if (this.rendering) ctx.drawImage(this.rendering, 0, 0, width, height);
    this.handle.hidden = true;
    if (!this.photograph) return;
    if (this.compare === "wipe") {
      const x = this.boundary * width;
      ctx.save();
      ctx.beginPath();
      ctx.rect(0, 0, x, height);
      ctx.clip();
      ctx.drawImage(this.photograph, 0, 0, width, height);
      ctx.restore();
      this.handle.hidden = false;
      this.handle.style.left = `${100 * this.boundary}%`;
    }
    if (this.compare === "error" && this.rendering) ctx.drawImage(errorMap(this.rendering, this.photograph), 0, 0, width, height);
    if (this.compare === "difference") {
      ctx.globalCompositeOperation = "difference";
      ctx.drawImage(this.photograph, 0, 0, width, height);
      ctx.globalCompositeOperation = "source-over";
      ctx.filter = `brightness(${GAIN})`;
      ctx.drawImage(this.picture, 0, 0);
      ctx.filter = "none";
    }
  }

  overlay(camera: PageCamera, scene: Scene, what: Overlay): void {
    const ctx = this.lines.getContext("2d")!;
    const { width, height } = this.lines;
    ctx.clearRect(0, 0, width, height);
    draw(ctx, { ...camera, size: [width, height] }, scene, what, Math.min(devicePixelRatio, 2));
  }

  /** Picture and lines together as a PNG file. */
  screenshot(): Promise<Blob | null> {
    const both = document.createElement("canvas");
    [both.width, both.height] = [this.picture.width, this.picture.height];
    const ctx = both.getContext("2d")!;
    ctx.drawImage(this.picture, 0, 0);
    ctx.drawImage(this.lines, 0, 0);
    return new Promise((resolve) => both.toBlob(resolve, "image/png"));
  }
}
