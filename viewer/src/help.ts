// What keys and gestures do.

import { button, el } from "./dom";

const KEYS: [string, string][] = [
  ["drag", "turn around the middle"],
  ["right drag, Shift drag, two fingers", "move sideways"],
  ["wheel, pinch", "nearer, farther"],
  ["middle drag", "turn; with Shift sideways, with Ctrl nearer, farther"],
  ["Ctrl drag", "look around from where you are"],
  ["click", "follow the ray of that pixel"],
  ["double click", "turn around that place from now on"],
  ["W A S D, Q E", "fly; faster with Shift"],
  ["arrows", "turn"],
  ["1 to 7", "layers"],
  ["B", "straight rays, and bent ones again"],
  ["N, P", "next, previous photograph"],
  ["C", "compare with the photograph; back to it after a look elsewhere"],
  ["G", "lines on the glass"],
  ["T", "measure: the next clicks choose the ends of a distance"],
  ["K", "add a keyframe to the camera path"],
  ["Space", "play the camera path"],
  ["R", "back to the start"],
  ["F", "what the ray meets first, or all glass, fills the picture"],
  ["Home", "all of the scene"],
  ["L", "level horizon, or free turns"],
  ["M", "bookmark this view"],
  ["Shift 1 to 9", "to a bookmark"],
  ["1, 3, 7 of the number pad", "from the front, from the right, from above"],
  ["X", "save a screenshot"],
  ["H", "hide the panel"],
  ["Esc", "forget the ray and the distance"],
  ["?", "this list"],
];

export function fill(dialog: HTMLDialogElement): void {
  const list = el("dl", { class: "keys" });
  for (const [key, meaning] of KEYS) list.append(el("dt", {}, key), el("dd", {}, meaning));
  // The title takes the focus, so that the list opens at its top.
  const title = el("h2", { id: "help-title", tabindex: "-1", autofocus: true }, "Keys and gestures");
  dialog.append(
    el(
      "header",
      {},
      title,
      button("Close", "Close (Esc)", () => dialog.close()),
    ),
    list,
  );
  dialog.addEventListener("click", (event) => {
    if (event.target === dialog) dialog.close();
  });
}
