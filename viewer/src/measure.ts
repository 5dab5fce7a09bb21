// The distance between two places of the scene that are clicked.

import { alone, button, checkbox, el, section } from "./dom";
import type { State } from "./state";
import { length, sub, type Vec3 } from "./vectors";

/** A distance with four digits, in scene units. */
export function distanceOf([from, to]: Vec3[]): string | null {
  return from && to ? `${Number(length(sub(to, from)).toPrecision(4))}` : null;
}

export class MeasurePanel {
  readonly element: HTMLElement;
  private readonly box: HTMLInputElement;
  private readonly says = el("p", { class: "hint", role: "status" });

  /** `changed` is called when lines over the picture are others. */
  constructor(
    private readonly state: State,
    private readonly changed: () => void,
  ) {
    const title = "The next clicks choose the ends of a distance (T)";
    const [label, box] = checkbox("measure a distance", title, () => this.toggle());
    this.box = box;
    const clear = alone(button("Forget it", "Takes the distance away", () => this.clear()));
    this.element = section("Distance", label, this.says, el("div", { class: "row" }, clear));
    this.update();
  }

  toggle(): void {
    this.state.measures = !this.state.measures;
    this.update();
  }

  clear(): void {
    this.state.ends = [];
    this.changed();
    this.update();
  }

  /** What a click has met: the next end of the distance. */
  take(place: Vec3): void {
    this.state.ends = this.state.ends.length === 1 ? [...this.state.ends, place] : [place];
    this.changed();
    this.update();
  }

  update(): void {
    const { measures, ends } = this.state;
    this.box.checked = measures;
    const distance = distanceOf(ends);
    const next = ends.length === 1 ? "Click its other end." : "Click two places that are solid, also through glass.";
    const places = ends.map((end) => `(${end.map((x) => Number(x.toPrecision(4))).join(", ")})`);
    this.says.textContent = distance ? `${distance} scene units, from ${places.join(" to ")}` : measures ? next : "";
    this.says.hidden = this.says.textContent === "";
    this.element.querySelector<HTMLElement>(".row")!.hidden = ends.length === 0;
  }
}
