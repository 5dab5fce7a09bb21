// What the colours of a picture mean: a name, and a scale where they stand for numbers.

import type { Shown } from "./protocol";

export type Compare = "off" | "side" | "wipe" | "difference" | "error";

/** Factor on differences, which are dark otherwise. */
export const GAIN = 4;
/** Mean error of the three colours, in 8-bit steps, that is shown palest. */
export const FULL_ERROR = 64;
/** From no error to the largest, as the pictures of `refraxel compare` show it. */
export const ERRORS = ["#000004", "#420a68", "#932667", "#dd513a", "#fca50a", "#fcffa4"];
const VIRIDIS = ["#440154", "#414487", "#2a788e", "#22a884", "#7ad151", "#fde725"];
const GREY = ["#000000", "#ffffff"];

export interface Legend {
  name: string;
  /** The colours of a scale from its smallest number, and the numbers at its ends. */
  scale?: { colours: string[]; ends: [string, string] };
}

/** The legend of a layer whose colours reach over a range, or of a comparison with a photograph. */
export function legendOf(layer: Shown, compare: Compare, range: [number, number] | undefined): Legend | null {
  if (compare === "error") {
    const name = "mean error of red, green and blue [of 255]";
    return { name, scale: { colours: ERRORS, ends: ["0", `≥ ${FULL_ERROR}`] } };
  }
  if (compare === "difference") {
    const name = `difference of photograph and rendering, × ${GAIN} [of 255]`;
    return { name, scale: { colours: GREY, ends: ["0", `≥ ${Math.floor(255 / GAIN)}`] } };
  }
  if (layer === "normal") return { name: "normal: red to the right, green upwards, blue towards you" };
  if (!range) return null;
  const ends = range.map((x) => x.toFixed(layer === "index" ? 3 : 2)) as [string, string];
  if (layer === "depth") {
    return { name: "distance along the ray [scene unit]", scale: { colours: [...VIRIDIS].reverse(), ends } };
  }
  const isIndex = layer === "index";
  const name = isIndex ? "index of refraction n" : "opacity";
  return { name, scale: { colours: isIndex ? VIRIDIS : GREY, ends } };
}

/** Legend of a slice of the index. */
export function indexLegend(range: [number, number]): Legend {
  return legendOf("index", "off", range)!;
}

/** A legend in words. */
export function words({ name, scale }: Legend): string {
  return scale ? `${name}, ${scale.ends[0]} to ${scale.ends[1]}` : name;
}

/** Sizes of legends and labels [CSS pixel]. */
const [FONT, EDGE, PAD, BAR] = ["12px system-ui, sans-serif", 10, 8, [120, 10]] as const;
const TALL = 22;

/** Draws texts and bars on a canvas with so many pixels per CSS pixel. */
export class Labels {
  constructor(
    private readonly ctx: CanvasRenderingContext2D,
    private readonly unit: number,
  ) {}

  private box(x: number, y: number, width: number, height: number): void {
    this.ctx.fillStyle = "rgb(0 0 0 / 68%)";
    this.ctx.beginPath();
    this.ctx.roundRect(x, y, width, height, 6);
    this.ctx.fill();
    this.ctx.fillStyle = "white";
  }

  private inCssPixels(draw: () => void): void {
    const { ctx, unit } = this;
    ctx.save();
    ctx.scale(unit, unit);
    ctx.font = FONT;
    ctx.textBaseline = "middle";
    draw();
    ctx.restore();
  }

  /** A name in the upper corner that begins, or ends, at `x` [CSS pixel]. */
  name(text: string, x: number, side: "left" | "right"): void {
    this.inCssPixels(() => {
      const width = this.ctx.measureText(text).width + 2 * PAD;
      const left = side === "left" ? x + EDGE : x - EDGE - width;
      this.box(left, EDGE, width, TALL);
      this.ctx.fillText(text, left + PAD, EDGE + TALL / 2);
    });
  }

  /** A legend in the lower left corner of a picture that begins at `x`, on a canvas of this width [CSS pixel]. */
  legend({ name, scale }: Legend, x: number, bottom: number, whole: number): void {
    this.inCssPixels(() => {
      const { ctx } = this;
      const widthOf = (text: string) => ctx.measureText(text).width;
      const ends = scale ? scale.ends.map(widthOf) : [];
      const row = scale ? ends[0]! + BAR[0] + ends[1]! + 2 * PAD : 0;
      const [width, height] = [Math.max(widthOf(name), row) + 2 * PAD, scale ? 2 * TALL - 2 : TALL];
      // On a narrow picture it is moved, and made smaller.
      const fit = Math.min(1, (whole - 2 * EDGE) / width);
      ctx.translate(Math.max(EDGE, Math.min(x + EDGE, whole - EDGE - width)), bottom - EDGE);
      ctx.scale(fit, fit);
      const [left, top] = [0, -height];
      this.box(left, top, width, height);
      ctx.fillText(name, left + PAD, top + TALL / 2);
      if (!scale) return;
      const middle = top + 1.5 * TALL - 4;
      const bar = left + PAD + ends[0]! + PAD;
      ctx.fillText(scale.ends[0], left + PAD, middle);
      ctx.fillText(scale.ends[1], bar + BAR[0] + PAD, middle);
      const gradient = ctx.createLinearGradient(bar, 0, bar + BAR[0], 0);
      scale.colours.forEach((colour, k) => gradient.addColorStop(k / (scale.colours.length - 1), colour));
      ctx.fillStyle = gradient;
      ctx.fillRect(bar, middle - BAR[1] / 2, ...BAR);
      ctx.strokeStyle = "white";
      ctx.strokeRect(bar, middle - BAR[1] / 2, ...BAR);
    });
  }
}
