// The picture, the photograph that it is compared with, and the lines and legends over both.

import { ERRORS, FULL_ERROR, GAIN, Labels, words, type Compare, type Legend } from "./legend";
import { draw, type Overlay } from "./overlay";
import type { PageCamera, SceneFacts } from "./protocol";
import type { Bounds } from "./sharpness";

/** Steps of the wipe's boundary by the arrow keys, and by the page keys. */
const STEPS: Record<string, number> = {
  ArrowLeft: -0.02,
  ArrowDown: -0.02,
  ArrowRight: 0.02,
  ArrowUp: 0.02,
  PageDown: -0.1,
  PageUp: 0.1,
};

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
  const [a, image, colours] = [pixels(rendering).data, pixels(photograph), errorColours()];
  const b = image.data;
  for (let k = 0; k < b.length; k += 4) {
    const sum = Math.abs(a[k]! - b[k]!) + Math.abs(a[k + 1]! - b[k + 1]!) + Math.abs(a[k + 2]! - b[k + 2]!);
    const colour = 4 * Math.min(255, Math.round((sum * 255) / (3 * FULL_ERROR)));
    for (let c = 0; c < 3; c++) b[k + c] = colours[colour + c]!;
  }
  ctx.putImageData(image, 0, 0);
  return canvas;
}

export class Stage {
  readonly element = document.querySelector<HTMLElement>("#stage")!;
  readonly picture = document.querySelector<HTMLCanvasElement>("#picture")!;
  private readonly frame = document.querySelector<HTMLElement>("#frame")!;
  private readonly lines = document.querySelector<HTMLCanvasElement>("#lines")!;
  private readonly handle = document.querySelector<HTMLElement>("#wipe")!;
  private rendering: ImageBitmap | null = null;
  private photograph: ImageBitmap | null = null;
  private compare: Compare = "off";
  private boundary = 0.5;
  /** Size of the rendering on the page [CSS pixel]. */
  private shown: [number, number] = [16, 16];

  /** `moved` is called when the boundary of the wipe has another place. */
  constructor(private readonly moved: () => void) {
    this.handle.addEventListener("pointerdown", (event) => {
      event.stopPropagation();
      this.handle.setPointerCapture(event.pointerId);
    });
    this.handle.addEventListener("pointermove", (event) => {
      if (!this.handle.hasPointerCapture(event.pointerId)) return;
      const box = this.picture.getBoundingClientRect();
      this.wipeTo((event.clientX - box.left) / box.width);
    });
    for (const name of ["click", "dblclick"]) this.handle.addEventListener(name, (event) => event.stopPropagation());
    this.handle.addEventListener("keydown", (event) => {
      const ends: Record<string, number> = { Home: 0, End: 1 };
      const step = STEPS[event.key];
      const to = step === undefined ? ends[event.key] : this.boundary + step;
      if (to === undefined) return;
      event.preventDefault();
      this.wipeTo(to);
    });
  }

  private wipeTo(boundary: number): void {
    this.boundary = Math.max(0, Math.min(1, boundary));
    this.paint();
    this.moved();
  }

  /** Parts of the stage side by side. */
  private get halves(): number {
    return this.compare === "side" ? 2 : 1;
  }

  /** Place in the rendering, in [0, 1], of a place in what is shown: the photograph on its left shows the same. */
  inView(u: number): number {
    return (u * this.halves) % 1;
  }

  /** Size of a rendering of this aspect, if there is one, on the page [CSS pixel]. */
  private room(aspect: number | null): [number, number] {
    const [width, height] = [this.element.clientWidth / this.halves, this.element.clientHeight];
    return aspect === null ? [width, height] : [Math.min(width, height * aspect), Math.min(height, width / aspect)];
  }

  /** Size of the picture to ask for: the pixels of the screen within some bounds. */
  fit({ edge, pixels }: Bounds, aspect: number | null): [number, number] {
    const [width, height] = this.room(aspect);
    const density = Math.min(devicePixelRatio, edge / Math.max(width, height), Math.sqrt(pixels / (width * height)));
    return [Math.max(16, Math.round(width * density)), Math.max(16, Math.round(height * density))];
  }

  layOut(aspect: number | null): void {
    this.shown = this.room(aspect);
    const [width, height] = [this.shown[0] * this.halves, this.shown[1]];
    const ratio = devicePixelRatio;
    for (const element of [this.frame, this.picture, this.lines]) {
      element.style.width = `${width}px`;
      element.style.height = `${height}px`;
    }
    for (const canvas of [this.picture, this.lines]) {
      const size = [Math.round(width * ratio), Math.round(height * ratio)] as const;
      if (canvas.width !== size[0] || canvas.height !== size[1]) [canvas.width, canvas.height] = size;
    }
    this.paint();
  }

  setCompare(compare: Compare): void {
    this.compare = compare;
  }

  showRendering(bitmap: ImageBitmap): void {
    this.rendering?.close();
    this.rendering = bitmap;
    this.paint();
  }

  showPhotograph(bitmap: ImageBitmap | null): void {
    this.photograph?.close();
    this.photograph = bitmap;
    this.paint();
  }

  paint(): void {
    const ctx = this.picture.getContext("2d")!;
    const { height } = this.picture;
    const width = this.picture.width / this.halves;
    ctx.globalCompositeOperation = "source-over";
    const put = (image: CanvasImageSource | null, x: number) => image && ctx.drawImage(image, x, 0, width, height);
    put(this.rendering, (this.halves - 1) * width);
    this.handle.hidden = this.compare !== "wipe" || !this.photograph;
    if (!this.photograph) return;
    if (this.compare === "side") put(this.photograph, 0);
    if (this.compare === "wipe") this.paintWipe(ctx, width, height);
    if (this.compare === "error" && this.rendering) put(errorMap(this.rendering, this.photograph), 0);
    if (this.compare === "difference") {
      ctx.globalCompositeOperation = "difference";
      put(this.photograph, 0);
      // Twice itself, as often as the factor asks for.
      ctx.globalCompositeOperation = "lighter";
      for (let gain = 1; gain < GAIN; gain *= 2) put(this.picture, 0);
    }
  }

  private paintWipe(ctx: CanvasRenderingContext2D, width: number, height: number): void {
    ctx.save();
    ctx.beginPath();
    ctx.rect(0, 0, this.boundary * width, height);
    ctx.clip();
    ctx.drawImage(this.photograph!, 0, 0, width, height);
    ctx.restore();
    const percent = `${Math.round(100 * this.boundary)}`;
    this.handle.style.left = `${percent}%`;
    this.handle.setAttribute("aria-valuenow", percent);
    this.handle.setAttribute("aria-valuetext", `${percent} % photograph`);
  }

  /** Draws what is over the picture; the photograph is called `name`. */
  overlay(camera: PageCamera, scene: SceneFacts, what: Overlay, legend: Legend | null, name: string | null): void {
    const ctx = this.lines.getContext("2d")!;
    const { width: whole, height } = this.lines;
    const [unit, width] = [devicePixelRatio, whole / this.halves];
    ctx.clearRect(0, 0, whole, height);
    ctx.save();
    ctx.translate(whole - width, 0);
    ctx.beginPath();
    ctx.rect(0, 0, width, height);
    ctx.clip();
    draw(ctx, { ...camera, size: [width, height] }, scene, what, unit);
    ctx.restore();
    this.drawLabels(new Labels(ctx, unit), legend, name ?? "photograph");
  }

  private drawLabels(labels: Labels, legend: Legend | null, name: string): void {
    const [width, height] = this.shown;
    const start = this.compare === "side" ? width : 0;
    const parts = ["Rendering"];
    if (this.photograph && this.halves === 2) {
      labels.name(name, 0, "left");
      labels.name("rendering", width, "left");
      parts.unshift(`Photograph ${name} on the left`);
    }
    if (this.photograph && this.compare === "wipe") {
      if (this.boundary > 0) labels.name(name, 0, "left");
      if (this.boundary < 1) labels.name("rendering", width, "right");
      parts.unshift(`Photograph ${name} on the left of the boundary`);
    }
    if (legend) {
      labels.legend(legend, start, height, width * this.halves);
      parts.push(words(legend));
    }
    this.lines.setAttribute("aria-label", parts.join("; "));
  }

  /** Picture, lines, labels and legend together as a PNG file. */
  screenshot(): Promise<Blob | null> {
    const both = document.createElement("canvas");
    [both.width, both.height] = [this.picture.width, this.picture.height];
    const ctx = both.getContext("2d")!;
    ctx.drawImage(this.picture, 0, 0);
    ctx.drawImage(this.lines, 0, 0);
    return new Promise((resolve) => both.toBlob(resolve, "image/png"));
  }
}
