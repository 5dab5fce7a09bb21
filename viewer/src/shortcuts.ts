// What keys do, beside moving the camera.

import { isTaken, letterOf } from "./keys";

export interface Shortcuts {
  /** By the letter on a key, or its code. */
  letters: Record<string, () => void>;
  /** A digit from 1 to 9, with Shift or without. */
  digit(digit: number, isShifted: boolean): void;
  help(): void;
  play(): void;
  /** The program answers; else only what needs no answer is done. */
  isLive(): boolean;
}

/** What a key does that is held: photographs go by, and nothing else happens twice. */
const HELD = /^[NP]$/;
/** What is done without the program. */
const ALONE = ["X", "H", "Escape"];

export function listenToKeys(shortcuts: Shortcuts): void {
  addEventListener("keydown", (event) => {
    const letter = letterOf(event);
    if (isTaken(event) || (event.repeat && !HELD.test(letter))) return;
    if (!shortcuts.isLive() && event.key !== "?" && !ALONE.includes(letter)) return;
    const digit = Number(/^Digit([1-9])$/.exec(event.code)?.[1]);
    const action = shortcuts.letters[letter];
    if (digit) shortcuts.digit(digit, event.shiftKey);
    else if (event.key === "?") shortcuts.help();
    else if (event.code === "Space") shortcuts.play();
    else if (action) action();
    else return;
    event.preventDefault();
  });
}
