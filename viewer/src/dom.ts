// Small builders of page elements.

type Child = Node | string;

export function el<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: Record<string, string | boolean> = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === true) element.setAttribute(name, "");
    else if (value !== false) element.setAttribute(name, value);
  }
  element.append(...children);
  return element;
}

export function button(text: string, title: string, click: () => void): HTMLButtonElement {
  const made = el("button", { type: "button", title }, text);
  // A sign is read by its title, without the key.
  if (!/[a-z]/i.test(text)) made.setAttribute("aria-label", title.replace(/ \(.\)$/, ""));
  made.addEventListener("click", () => click());
  return made;
}

/** A control that does not need the program. */
export function alone<T extends HTMLElement>(control: T): T {
  control.dataset.alone = "true";
  return control;
}

/** Buttons of which one is chosen. */
export class Choice<T extends string> {
  readonly element = el("div", { class: "choice", role: "group" });
  private readonly buttons = new Map<T, HTMLButtonElement>();

  constructor(label: string, options: readonly (readonly [T, string, string])[], choose: (value: T) => void) {
    this.element.setAttribute("aria-label", label);
    for (const [value, text, title] of options) {
      const made = button(text, title, () => choose(value));
      this.buttons.set(value, made);
      this.element.append(made);
    }
  }

  /** Offers only some of the options. */
  limit(offered: (value: T) => boolean): void {
    this.buttons.forEach((b, key) => (b.hidden = !offered(key)));
  }

  has(value: T): boolean {
    return this.buttons.get(value)?.hidden === false;
  }

  set(value: T): void {
    this.buttons.forEach((b, key) => b.setAttribute("aria-pressed", String(key === value)));
  }
}

export function checkbox(text: string, title: string, change: (on: boolean) => void): [HTMLElement, HTMLInputElement] {
  const box = el("input", { type: "checkbox" });
  box.addEventListener("change", () => change(box.checked));
  return [el("label", { class: "check", title }, box, text), box];
}

/** A finger that moves less than this has not begun to swipe [CSS pixel]. */
const SWIPE = 8;

/**
 * Calls `change` when a slider is moved. A finger that swipes across it scrolls what is around it: by touch, the value changes once
 * the finger moves along the slider, or is lifted where it was put down.
 */
function onSlide(input: HTMLInputElement, change: () => void): void {
  let held: { x: number; y: number; before: string; wanted: string } | null = null;
  const release = (keeps: boolean) => {
    if (!held) return;
    const { before, wanted } = held;
    held = null;
    input.value = keeps ? wanted : before;
    if (keeps && wanted !== before) change();
  };
  input.addEventListener("pointerdown", ({ pointerType, clientX, clientY }) => {
    if (pointerType === "touch") held = { x: clientX, y: clientY, before: input.value, wanted: input.value };
  });
  input.addEventListener("pointermove", ({ clientX, clientY }) => {
    if (!held) return;
    const [along, across] = [Math.abs(clientX - held.x), Math.abs(clientY - held.y)];
    if (Math.max(along, across) > SWIPE) release(along > across);
  });
  input.addEventListener("pointerup", () => release(true));
  input.addEventListener("pointercancel", () => release(false));
  input.addEventListener("input", () => {
    if (!held) return change();
    held.wanted = input.value;
    input.value = held.before;
  });
}

/** A slider with its value. */
export class Slider {
  readonly element: HTMLElement;
  readonly input: HTMLInputElement;
  private readonly shown = el("output");

  constructor(
    label: string,
    [low, high, step]: [number, number, number],
    private readonly text: (x: number) => string,
    change: (x: number) => void,
  ) {
    this.input = el("input", {
      type: "range",
      min: String(low),
      max: String(high),
      step: String(step),
      "aria-label": label,
    });
    onSlide(this.input, () => {
      this.show();
      change(this.input.valueAsNumber);
    });
    this.element = el("label", { class: "slider" }, el("span", {}, label), this.shown, this.input);
  }

  set(x: number): void {
    this.input.value = String(x);
    this.show();
  }

  private show(): void {
    this.shown.value = this.text(this.input.valueAsNumber);
    this.input.setAttribute("aria-valuetext", this.shown.value);
  }
}

export function section(title: string, ...children: Child[]): HTMLElement {
  return el("section", {}, el("h2", {}, title), ...children);
}

export function download(name: string, content: Blob): void {
  const url = URL.createObjectURL(content);
  el("a", { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 1000);
}
