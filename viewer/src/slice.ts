// The index of refraction in a plane through a region.

import { Choice, el, section, Slider } from "./dom";
import { indexLegend, words } from "./legend";
import type { SceneFacts } from "./protocol";
import { regionChoice } from "./regions";
import type { State } from "./state";

export class SlicePanel {
  readonly element: HTMLElement;
  private readonly canvas = el("canvas", {
    width: "16",
    height: "16",
    hidden: true,
    role: "img",
    "aria-label": "Index in the plane",
  });
  private readonly scale = el("p", { class: "scale", hidden: true });
  private readonly regions = el("div");
  /** The region that is cut. */
  private region = 0;

  constructor(
    private readonly state: State,
    private readonly changed: () => void,
  ) {
    const axes = new Choice<string>(
      "Axis across",
      [
        ["0", "x", "Across the x axis"],
        ["1", "y", "Across the y axis"],
        ["2", "z", "Across the z axis"],
        ["none", "off", "No slice"],
      ],
      (axis) => {
        const at = state.slice?.at ?? 0.5;
        state.slice = axis === "none" ? null : { region: this.region, at, axis: Number(axis) };
        axes.set(axis);
        this.canvas.hidden = this.scale.hidden = axis === "none";
        changed();
      },
    );
    axes.set("none");
    const place = new Slider(
      "place",
      [0, 1, 0.01],
      (x) => x.toFixed(2),
      (x) => {
        if (state.slice) state.slice.at = x;
        changed();
      },
    );
    place.set(0.5);
    const parts = [this.regions, axes.element, place.element, this.canvas, this.scale];
    this.element = section("Slice of the index", ...parts);
  }

  take(scene: SceneFacts): void {
    this.region = 0;
    this.element.hidden = scene.regions.length === 0;
    const choice = regionChoice("Region to cut", scene, [], (k) => {
      this.region = k;
      if (this.state.slice) this.state.slice.region = k;
      this.changed();
    });
    this.regions.replaceChildren(...choice);
    if (this.state.slice) this.state.slice.region = 0;
  }

  show(bitmap: ImageBitmap, range: [number, number]): void {
    [this.canvas.width, this.canvas.height] = [bitmap.width, bitmap.height];
    this.canvas.getContext("2d")!.drawImage(bitmap, 0, 0);
    const legend = indexLegend(range);
    this.canvas.setAttribute("aria-label", `Index in the plane: ${words(legend)}`);
    const bar = el("i");
    bar.style.background = `linear-gradient(to right, ${legend.scale!.colours.join()})`;
    const [low, high] = legend.scale!.ends;
    this.scale.replaceChildren(el("span", {}, legend.name), el("span", {}, low), bar, el("span", {}, high));
  }
}
