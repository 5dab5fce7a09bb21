// Buttons that choose a refractive region, where there are several.

import { Choice, el } from "./dom";
import type { SceneFacts } from "./protocol";

export function regionChoice(
  label: string,
  scene: SceneFacts,
  others: [string, string, string][],
  choose: (k: number) => void,
): HTMLElement[] {
  if (scene.regions.length < 2) return [];
  const each = scene.regions.map((_, k): [string, string, string] => [String(k), String(k + 1), `Region ${k + 1}`]);
  const choice = new Choice<string>(label, [...others, ...each], (value) => {
    choice.set(value);
    choose(Number(value));
  });
  choice.set([...others, ...each][0]![0]);
  return [el("p", { class: "label" }, label.toLowerCase()), choice.element];
}
