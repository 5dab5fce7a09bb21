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
    this.input = el("input", { type: "range", min: String(low), max: String(high), step: String(step), "aria-label": label });
    this.input.addEventListener("input", () => {
      this.shown.value = this.text(this.input.valueAsNumber);
      change(this.input.valueAsNumber);
    });
    this.element = el("label", { class: "slider" }, el("span", {}, label), this.shown, this.input);
  }

  set(x: number): void {
    this.input.value = String(x);
    this.shown.value = this.text(x);
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
