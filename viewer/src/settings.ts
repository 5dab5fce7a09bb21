// What the page remembers from one start of the viewer to the next: how things are shown, and nothing of the scene.

/** A cookie, since what else a browser keeps belongs to one port, and each start of the viewer has another. */
const NAME = "refraxel_settings";
const YEAR = 365 * 24 * 3600;

const DEFAULTS = {
  /** Longest edge of the picture [pixel]; null: as the screen. */
  pixels: null as number | null,
  boxes: false,
  cameras: false,
  surfaces: false,
  hull: false,
  bricks: false,
  /** The panel is hidden. */
  alone: false,
  /** The horizon stays level. */
  level: true,
  /** Length of the camera path [s], and its frames per second. */
  seconds: 6,
  fps: 24,
};
export type Settings = typeof DEFAULTS;

/** Numbers that make sense. */
const RANGES: Partial<Record<keyof Settings, [number, number]>> = {
  pixels: [16, 2048],
  seconds: [1, 60],
  fps: [10, 60],
};

function isSetting(name: keyof Settings, value: unknown): boolean {
  if (value === null) return name === "pixels";
  const range = RANGES[name];
  if (range) return typeof value === "number" && value >= range[0] && value <= range[1];
  return typeof value === "boolean";
}

/** The settings of the last time; where there are none, or the browser keeps none, those to begin with. */
export function load(): Settings {
  const settings = { ...DEFAULTS };
  try {
    const text = document.cookie.split("; ").find((c) => c.startsWith(`${NAME}=`));
    const kept = JSON.parse(decodeURIComponent(text?.slice(NAME.length + 1) ?? "{}")) as Record<string, unknown>;
    const names = (Object.keys(DEFAULTS) as (keyof Settings)[]).filter(
      (name) => name in kept && isSetting(name, kept[name]),
    );
    for (const name of names) Object.assign(settings, { [name]: kept[name] });
  } catch {
    // Cookies are refused, or somebody else wrote this one.
  }
  return settings;
}

export function save(settings: Settings): void {
  const names = Object.keys(DEFAULTS) as (keyof Settings)[];
  const kept = Object.fromEntries(names.map((name) => [name, settings[name]]));
  try {
    document.cookie = `${NAME}=${encodeURIComponent(JSON.stringify(kept))}; max-age=${YEAR}; path=/; samesite=strict`;
  } catch {
    // Cookies are refused: the next start begins anew.
  }
}
