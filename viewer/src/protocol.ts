// What the page and the program say to each other: the types of the program, written by its test `typescript`.

/** What a page asks for. Of each kind, the latest question is answered; earlier ones may not be. */
export type Ask = { "ask": "look" } & Look | { "ask": "got",
/** Number of the last one. */
frame: number, } | { "ask": "ray",
/** Returned with the answer. */
id: number,
/** To the right, in [0, 1]. */
u: number,
/** Downwards, in [0, 1]. */
v: number, } | { "ask": "follow",
/** Returned with the answer. */
id: number,
/** Where it starts [scene unit]. */
origin: [number, number, number],
/** Its direction, of any length. */
direction: [number, number, number], } | { "ask": "photo",
/** Its number in the list of views. */
view: number, } | { "ask": "slice",
/** Number of the region, from 0. */
region: number,
/** The axis that the plane is perpendicular to: 0, 1 or 2. */
axis: number,
/** Where the plane is between the ends of the box, in [0, 1]. */
at: number, } | { "ask": "surface",
/** Number of the region, from 0. */
region: number, } | { "ask": "hull" } | { "ask": "bricks" } | { "ask": "pause",
/** Whether it waits. */
paused: boolean, } | { "ask": "stop" } | { "ask": "film" } & FilmWish | { "ask": "stop_film" };

/** A ray as the renderer follows it. Places are in world coordinates [scene unit], angles in degrees. */
export type BentRay = {
/** Corners of the path, from the camera on; at least two. */
points: Array<[number, number, number]>,
/** Start and end of the same ray if it were straight. */
straight: [[number, number, number], [number, number, number]],
/** What happens at sharp surfaces, in order. */
bounces: Array<Bounce>,
/** Angle between the first and the last direction [degree]. */
turned: number,
/** Largest index on the path. */
densest: number,
/** ∫ n ds − ∫ ds over the path, by which light is late [scene unit]. */
late: number,
/** The colour that the ray shows. */
colour: [number, number, number],
/** Share of the background that is hidden on the path. */
opacity: number,
/** Arc length from the camera to what is seen, and its place; absent where little is. */
seen: [number, [number, number, number]] | null,
/** The path is shown to its end: it left all media. */
is_whole: boolean, };

/** A sharp surface on the path of a ray. */
export type Bounce = {
/** Where it is met [scene unit]. */
place: [number, number, number],
/** Number of the region whose surface it is, from 0. */
region: number,
/** The ray is turned back by total reflection. */
total: boolean,
/** The index before and beyond the surface. */
index: [number, number],
/** Angles to the normal before and after [degree]. */
angle: [number, number],
/** Fresnel's reflectance, 0 to 1. */
reflectance: number, };

/** How the media of a scene are changed, one entry per region; those that are absent stay as they are. */
export type Edits = {
/** The index. */
index: Array<number | null>,
/** Factor on the absorption; for a clear body, the grey optical thickness over the shortest edge of its box. */
absorption: Array<number | null>,
/** Opposite corners of a box [scene unit]: of what is opaque, only that inside is shown. */
crop: [[number, number, number], [number, number, number]] | null, };

/** The files that a film may be. */
export type FilmFormat = "mp4" | "webm" | "gif";

/** How far a film is. */
export type FilmState = { "film": "renders",
/** How far that is. */
pace: Pace | null, } | { "film": "ready",
/** The name of its file on this server. */
file: string, } | { "film": "stopped" } | { "film": "failed",
/** Why, in full. */
why: string, };

/** A film that a page wishes. */
export type FilmWish = {
/** The path: the text of a `camera_path.json`. */
path: string,
/** What encodes the film. */
format: FilmFormat,
/** What is shown. */
shown: Shown,
/** Rays are straight. */
straight: boolean,
/** The index of all regions; absent where it is the learned one. */
index: number | null, };

/** The header of a picture. */
export type Header = { "picture": "frame",
/** Of the [`Look`]. */
id: number,
/** Number of the picture, counted for each page. */
frame: number,
/** Size [pixel]. */
size: [number, number],
/** Rays per pixel; 0 where the picture is coarser than what was asked for. */
rays: number,
/** No better picture follows. */
last: boolean,
/** Time of computation [ms]. */
ms: number,
/** Smallest and largest value of the colours, where the picture shows numbers. */
range?: [number, number] | null,
/** Steps of the training that the picture shows. */
step: number, } | { "picture": "photo",
/** Its number. */
view: number,
/** Size [pixel]. */
size: [number, number], } | { "picture": "slice",
/** Number of the region. */
region: number,
/** The axis across. */
axis: number,
/** Corners of the picture in the world: top left, top right, bottom right, bottom left [scene unit]. */
corners: [[number, number, number], [number, number, number], [number, number, number], [number, number, number]],
/** The index of the first and of the last colour. */
range: [number, number], };

/** A hull as lines. */
export type HullPart = {
/** Lowest corner of its box [scene unit]. */
min: [number, number, number],
/** Highest corner of its box [scene unit]. */
max: [number, number, number],
/** Pieces of lines on it. */
pieces: Array<[number, number, number, number, number, number, number, number, number]>, };

/** How the scene is looked at. */
export type Look = {
/** Returned with each picture. */
id: number,
/** The camera. */
camera: PageCamera,
/** The lens and the principal point of this photograph count. */
photo: number | null,
/** What is shown. */
shown: Shown,
/** Rays are straight. */
straight: boolean,
/** The camera moves: one coarse picture is enough. */
moving: boolean,
/** How the media are changed. */
edits: Edits, };

/** How far a verb is, from a line of its progress. */
export type Pace = {
/** What it does. */
task: string,
/** How much of that is done. */
percent: number,
/** The time left for that, such as 0:50, where it is known. */
left: string | null, };

/** A camera of a page. */
export type PageCamera = {
/** Where it is [scene unit]. */
eye: [number, number, number],
/** Its axes to the right, downwards and forward. */
axes: [[number, number, number], [number, number, number], [number, number, number]],
/** Horizontal field of view [rad]. */
angle: number,
/** Width and height of the picture [pixel]. */
size: [number, number], };

/** A refractive region. */
export type RegionFacts = {
/** Its typical index. */
index: number,
/** What it absorbs of red, green and blue [1 / scene unit]. */
absorption: [number, number, number],
/** It has a sharp surface; else its index changes smoothly. */
sharp: boolean,
/** Lowest corner of its box. */
min: [number, number, number],
/** Highest corner of its box. */
max: [number, number, number], };

/** A scene, when the page opens and when training has gone on. Places are in the user's world [scene unit]. */
export type SceneFacts = {
/** What the run is called. */
name: string,
/** Steps of the training. */
step: number,
/** What was decided about each refractive region, a line each. */
verdict: string | null,
/** Lowest corner of its box. */
min: [number, number, number],
/** Highest corner of its box. */
max: [number, number, number],
/** The upward direction. */
up: [number, number, number],
/** Where a page begins. */
start: PageCamera,
/** Its refractive regions. */
regions: Array<RegionFacts>,
/** There is a hull outside of which no ray bends. */
has_hull: boolean,
/** Something mirrors light. */
reflects: boolean,
/** Nodes of the grid along each axis. */
resolution: [number, number, number],
/** Voxels that are stored. */
voxels: number,
/** Its photographs, held-out ones first. */
views: Array<ViewFacts>, };

/** What a picture shows. */
export type Shown = "colour" | "depth" | "opacity" | "reflection" | "transmission" | "index" | "normal";

/** What the program tells a page. */
export type Tell = { "tell": "scene" } & SceneFacts | { "tell": "ray",
/** From the question. */
id: number,
/** The ray. */
ray: BentRay, } | { "tell": "surface",
/** Number of the region, from 0. */
region: number,
/** Pieces of lines on it. */
pieces: Array<[number, number, number, number, number, number, number, number, number]>, } | { "tell": "hull",
/** Each in a box of its own. */
parts: Array<HullPart>, } | { "tell": "bricks",
/** Lines between two places [scene unit]. */
lines: Array<[number, number, number, number, number, number]>,
/** Edge of the blocks that are outlined [voxel]. */
edge: number, } | { "tell": "training" } & Training | { "tell": "ended",
/** Why, and what to do next. */
why: string, } | { "tell": "film" } & FilmState | { "tell": "refused",
/** Why. */
why: string, };

/** Something that happens in a training. */
export type Training = { "kind": "record",
/** Steps done. */
step: number,
/** Steps in all; `null` where the time counts. */
steps: number | null,
/** Share of the training that is done. */
progress: number,
/** PSNR of the training rays since the last record [dB]; `null` where it is infinite. */
train_psnr: number | null,
/** PSNR of a validation view [dB], where one was rendered. */
val_psnr: number | null,
/** What the training is busy with. */
phase: string, } | { "kind": "event",
/** In a sentence. */
text: string, } | { "kind": "state",
/** It waits, or soon will. */
paused: boolean,
/** What it does beside steps, or instead. */
text: string, };

/** A photograph. */
export type ViewFacts = {
/** What it is called. */
name: string,
/** The part of the dataset that it belongs to: test, val or train. */
split: string,
/** Where it was taken. */
camera: PageCamera, };
