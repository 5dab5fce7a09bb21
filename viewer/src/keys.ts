// Which keys belong to the control that has the focus, and which to the page.

const [STEPS, PRESS] = [/^(Arrow|Page|Home|End)/, /^(Space|Enter|NumpadEnter)$/];
/** Inputs that take no text, and the keys that they take. */
const INPUTS: Record<string, RegExp> = { range: STEPS, checkbox: PRESS, radio: STEPS, button: PRESS };

/** Keys that a control takes; null where it takes all, and undefined where it takes none. */
function takes(control: HTMLElement): RegExp | null | undefined {
  if (control instanceof HTMLInputElement) return INPUTS[control.type] ?? null;
  if (control instanceof HTMLTextAreaElement || control.isContentEditable) return null;
  if (control instanceof HTMLSelectElement) return /^(Arrow|Page|Home|End|Space|Enter|NumpadEnter|Escape)/;
  if (control.getAttribute("role") === "slider") return STEPS;
  return /^(BUTTON|A|SUMMARY)$/.test(control.tagName) ? PRESS : undefined;
}

/** A key that the focused control, an open dialog or the browser takes for itself: the page leaves it alone. */
export function isTaken(event: KeyboardEvent): boolean {
  if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]")) return true;
  const keys = event.target instanceof HTMLElement ? takes(event.target) : undefined;
  return keys === null || keys?.test(event.code) === true;
}

/** The letter on a key of this keyboard; that of a Latin one where it writes other letters. */
export function letterOf(event: KeyboardEvent): string {
  return /^[a-z]$/i.test(event.key) ? event.key.toUpperCase() : event.code.replace(/^Key/, "");
}
