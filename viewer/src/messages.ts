// Short messages over the picture, where they are seen whatever the panel shows.

import { button } from "./dom";

/** How long a message stays, and one with something to press [ms]. */
const [STAYS, STAYS_TO_PRESS] = [8000, 20_000];

/** Hides what is over the picture; the picture takes the focus if that was inside. */
export function hide(element: HTMLElement): void {
  if (element.contains(document.activeElement))
    document.querySelector<HTMLElement>("#stage")!.focus({ preventScroll: true });
  element.hidden = true;
}

export class Messages {
  private readonly element = document.querySelector<HTMLElement>("#message")!;
  private timer = 0;

  /** Shows a text, and a button that does something about it. */
  say(text: string, way?: { name: string; title: string; go: () => void }): void {
    this.element.replaceChildren(text);
    if (way) {
      const go = () => {
        this.clear();
        way.go();
      };
      this.element.append(" ", button(way.name, way.title, go));
    }
    this.element.hidden = false;
    this.clearIn(way ? STAYS_TO_PRESS : STAYS);
  }

  private clearIn(time: number): void {
    clearTimeout(this.timer);
    // Who has reached the button by keyboard keeps it.
    const isUsed = () => this.element.contains(document.activeElement);
    this.timer = setTimeout(() => (isUsed() ? this.clearIn(time) : this.clear()), time);
  }

  clear(): void {
    clearTimeout(this.timer);
    hide(this.element);
  }
}
