// What the page and the program say to each other: the types of the program, written by its test `typescript`.

/** What the page asks for. */
export type Ask = { "ask": "runs" } | { "ask": "folder",
/** From the root. */
path: string, } | { "ask": "begin" } & Task | { "ask": "stop" } | { "ask": "forget" } | { "ask": "open",
/** Its folder. */
path: string, };

/** What is told of a folder. */
export type Folder = { path: string,
/** The folder above. */
parent: string | null,
/** Sorted by their names; hidden ones are left out. */
folders: Array<Place>, videos: Array<Place>,
/** Photographs in it, or in `images` below it. */
photographs: number,
/** Photographs in formats that are not read. */
unread: number,
/** It is the folder of a run. */
is_run: boolean,
/** Entries that are not listed: there are too many, or their names are no text. */
left_out: number, };

/** How far a verb is, from a line of its progress. */
export type Pace = {
/** What it does. */
task: string,
/** How much of that is done. */
percent: number,
/** The time left for that, such as 0:50, where it is known. */
left: string | null, };

/** A folder or a video. */
export type Place = { name: string, path: string, };

/** A run. */
export type Recent = {
/** Its folder, as seen from the one that is searched. */
name: string, path: string,
/** When it was saved last [s since 1970]. */
saved: number, };

/** Whether rays bend. */
export type Refraction = "auto" | "on" | "off";

/** Where a verb stands. */
export type Stage = "works" | "stops" | "done" | "stopped" | "failed";

/** A verb and its choices. */
export type Task = { "verb": "inspect",
/** A folder or a file. */
path: string, } | { "verb": "import",
/** A folder or a video. */
path: string, } | { "verb": "train",
/** A folder or a file with poses. */
path: string,
/** How long. */
minutes: number,
/** Whether rays bend. */
refraction: Refraction, };

/** What the page is told. */
export type Tell = { "tell": "home",
/** The folder in which everything is written. */
folder: string,
/** The latest first. */
runs: Array<Recent>,
/** Where to begin to look for photographs. */
places: Array<Place>, } | { "tell": "folder" } & Folder | { "tell": "work",
/** It. */
work: Work | null, } | { "tell": "opened",
/** Its address. */
url: string, } | { "tell": "refused",
/** Why, in full. */
why: string, } | { "tell": "ended",
/** Why, and what to do next. */
why: string, };

/** A verb that is at work, or was last, as the page shows it. */
export type Work = {
/** Counts those of this start of the program. */
number: number,
/** What was asked for. */
task: Task,
/** The same as people would type it. */
command: string,
/** The folder that it writes. */
out: string | null,
/** Where it stands. */
stage: Stage,
/** How far it is. */
pace: Pace | null,
/** Its last lines, without those of its progress. */
lines: Array<string>,
/** Why it has failed or stopped, in full. */
why: string | null,
/** The page of a training that is under way. */
live: string | null,
/** What `inspect` or `import` has found, line by line. */
found: string | null,
/** Poses have to be computed before anything else. */
needs_poses: boolean,
/** The folder of a run that can be looked at now. */
run: string | null, };
