// What refracts: the index and the absorption of each region, and glass that it can be made of.

import { button, el, section, Slider } from "./dom";
import type { RegionFacts, SceneFacts } from "./protocol";
import { regionChoice } from "./regions";
import type { State } from "./state";

/** Indices of the slider, and those of known materials. */
const INDICES: [number, number, number] = [1, 2.5, 0.005];
const MATERIALS: [string, number][] = [
  ["air", 1],
  ["water", 1.33],
  ["glass", 1.5],
  ["diamond", 2.42],
];

const isClear = (region: RegionFacts) => region.absorption.every((a) => a === 0);

export class MediaPanel {
  readonly element = section("Index of refraction");
  private sliders: { index: Slider; absorption: Slider }[] = [];
  /** The region whose glass the buttons set; null for all. */
  private chosen: number | null = null;

  /** `changed` is called when the picture is another; true while it goes on changing. */
  constructor(
    private readonly state: State,
    private readonly changed: (moving: boolean) => void,
  ) {}

  /** The training has gone on. Sliders stay as they are where a hand may have been on them. */
  follow(scene: SceneFacts): void {
    this.sliders.forEach((s, k) => this.state.index[k] === null && s.index.set(scene.regions[k]!.index));
  }

  take(scene: SceneFacts): void {
    const { state } = this;
    this.chosen = null;
    this.element.hidden = scene.regions.length === 0;
    this.sliders = scene.regions.map((_, k) => this.slidersOf(scene, k));
    state.index = scene.regions.map((_, k) => state.index[k] ?? null);
    state.absorption = scene.regions.map((_, k) => state.absorption[k] ?? null);
    const target = regionChoice("Glass of region", scene, [["NaN", "all", "Every region"]], (k) => {
      this.chosen = Number.isNaN(k) ? null : k;
    });
    const materials = MATERIALS.map(([name, n]) => button(name, `n = ${n}`, () => this.set(scene, n)));
    const learned = button("learned", "As the run has found it", () => this.set(scene, null));
    const parts = this.sliders.flatMap((s) => [s.index.element, s.absorption.element]);
    const row = el("div", { class: "row" }, ...materials, learned);
    this.element.replaceChildren(this.element.firstElementChild!, ...parts, ...target, row);
  }

  private slidersOf(scene: SceneFacts, k: number): { index: Slider; absorption: Slider } {
    const { state } = this;
    const [region, isOne] = [scene.regions[k]!, scene.regions.length === 1];
    const index = new Slider(
      isOne ? "n" : `region ${k + 1}`,
      INDICES,
      (x) => x.toFixed(3),
      (x) => {
        state.index[k] = x;
        this.changed(true);
      },
    );
    // Of clear glass there is nothing to multiply: it becomes grey.
    const clear = isClear(region);
    const shown = (x: number) => (clear ? `${Math.round(100 * (1 - Math.exp(-x)))} % grey` : `× ${x.toFixed(2)}`);
    const absorption = new Slider(isOne ? "absorption" : `absorption ${k + 1}`, [0, 5, 0.05], shown, (x) => {
      state.absorption[k] = x;
      this.changed(true);
    });
    index.set(state.index[k] ?? region.index);
    absorption.set(state.absorption[k] ?? (clear ? 0 : 1));
    return { index, absorption };
  }

  /** Makes the chosen region of this index, or of the learned one. */
  private set(scene: SceneFacts, n: number | null): void {
    const { state } = this;
    this.sliders.forEach((s, k) => {
      if (this.chosen !== null && this.chosen !== k) return;
      state.index[k] = n;
      s.index.set(n ?? scene.regions[k]!.index);
      if (n !== null) return;
      state.absorption[k] = null;
      s.absorption.set(isClear(scene.regions[k]!) ? 0 : 1);
    });
    this.changed(false);
  }
}
