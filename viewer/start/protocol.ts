// What the program and the start page say to each other; see crates/refraxel/src/start/protocol.rs.

export interface Place {
  name: string;
  path: string;
}

export interface Folder {
  path: string;
  parent: string | null;
  folders: Place[];
  videos: Place[];
  photographs: number;
  unread: number;
  is_run: boolean;
  left_out: number;
}

export interface Recent {
  name: string;
  path: string;
  /** [s since 1970] */
  saved: number;
}

export type Refraction = "auto" | "on" | "off";
export type Task =
  | { verb: "inspect"; path: string }
  | { verb: "import"; path: string }
  | { verb: "train"; path: string; minutes: number; refraction: Refraction };

export interface Work {
  number: number;
  task: Task;
  command: string;
  out: string | null;
  stage: "works" | "stops" | "done" | "stopped" | "failed";
  pace: { task: string; percent: number; left: string | null } | null;
  lines: string[];
  why: string | null;
  live: string | null;
  found: string | null;
  needs_poses: boolean;
  run: string | null;
}

export interface Home {
  folder: string;
  runs: Recent[];
  places: Place[];
}

export type Tell =
  | ({ tell: "home" } & Home)
  | ({ tell: "folder" } & Folder)
  | { tell: "work"; work: Work | null }
  | { tell: "opened"; url: string }
  | { tell: "refused"; why: string }
  | { tell: "ended"; why: string };

export type Ask =
  | { ask: "runs" }
  | { ask: "folder"; path: string }
  | ({ ask: "begin" } & Task)
  | { ask: "stop" }
  | { ask: "forget" }
  | { ask: "open"; path: string };
