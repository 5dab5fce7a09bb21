// A box outside of which nothing opaque is shown.

import { checkbox, el, section, Slider } from "./dom";
import type { SceneFacts } from "./protocol";
import type { State } from "./state";
import { mix, type Vec3 } from "./vectors";

/** The box of a crop in the scene; null where there is none. */
export function cropBox({ crop }: State, { min, max }: SceneFacts): [Vec3, Vec3] | null {
  if (!crop.on) return null;
  const at = (side: number) => [0, 1, 2].map((k) => mix(min, max, crop.sides[k]![side]!)[k]!) as Vec3;
  return [at(0), at(1)];
}

/** The least width of a box, as a part of that of the scene. */
const LEAST = 0.01;

export class CropPanel {
  readonly element: HTMLElement;

  /** `changed` is called when the picture is another; true while it goes on changing. */
  constructor(state: State, changed: (moving: boolean) => void) {
    const { crop } = state;
    const sliders = ["x", "y", "z"].flatMap((axis, k) =>
      ["from", "to"].map((side, end) => {
        const slider = new Slider(
          `${axis} ${side}`,
          [0, 1, 0.01],
          (x) => `${Math.round(100 * x)} %`,
          (x) => {
            const sides = crop.sides[k]!;
            sides[end] = end === 0 ? Math.min(x, sides[1] - LEAST) : Math.max(x, sides[0] + LEAST);
            slider.set(sides[end]!);
            changed(true);
          },
        );
        slider.set(end);
        return slider.element;
      }),
    );
    const all = el("div", { class: "sliders" }, ...sliders);
    all.hidden = true;
    const title = "What is opaque is shown only inside a box; glass stays. The run, films and exports are not cut";
    const [label, box] = checkbox("show only a box", title, (on) => {
      crop.on = on;
      all.hidden = !on;
      changed(false);
    });
    box.checked = crop.on;
    this.element = section("Crop", label, all);
  }
}
