// The maths of the page, without a browser: `node --test test/maths.mjs`.

import assert from "node:assert/strict";
import { test } from "node:test";
import { runnerImport } from "vite";

const load = async (name) => (await runnerImport(`./src/${name}.ts`, { configFile: false, logLevel: "error" })).module;
const [{ Camera, project, projectLine }, v, { at, file }] = await Promise.all(["camera", "vectors", "path"].map(load));

/** Rounding of some hundred operations in double precision. */
const TINY = 1e-9;
const near = (a, b, tolerance = TINY) => assert.ok(Math.abs(a - b) <= tolerance, `${a} is not ${b}`);
const nearVector = (a, b, tolerance = TINY) => a.forEach((x, k) => near(x, b[k], tolerance));

/** Numbers in [0, 1) that are the same each time. */
function* numbers(seed) {
  for (let state = seed; ; ) {
    state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
    yield state / 2 ** 32;
  }
}

const LEVEL = [
  [1, 0, 0],
  [0, 0, -1],
  [0, 1, 0],
];
function camera() {
  const made = new Camera();
  made.stayNear([-1, -1, -1], [1, 1, 1], [0, -4, 0]);
  made.take({ eye: [0, -4, 0], axes: LEVEL, angle: 0.8, size: [400, 300] }, [0, 0, 0]);
  return made;
}

/** The axes are of unit length, across each other and right-handed, as the program demands. */
function isOrthonormal({ axes: [right, down, forward] }) {
  for (const axis of [right, down, forward]) near(v.length(axis), 1);
  near(v.dot(right, forward), 0);
  nearVector(v.cross(right, down), forward);
}

/** Moves as hands make them. */
function shake(made, count, seed) {
  const random = numbers(seed);
  const x = () => 2 * random.next().value - 1;
  for (let k = 0; k < count; k++) {
    made.orbit(3 * x(), 3 * x());
    made.look(x(), x());
    made.pan(x(), x());
    made.dolly(Math.exp(x()));
    made.fly(x(), x(), x());
  }
}

test("a turn keeps lengths, and turns by its angle", () => {
  const axis = v.unit([1, 2, -2]);
  const across = v.unit(v.cross(axis, [0, 0, 1]));
  const turned = v.turn(across, axis, 0.7);
  near(v.length(turned), 1);
  near(v.dot(turned, across), Math.cos(0.7));
  nearVector(v.turn(axis, axis, 0.7), axis);
});

test("a rotation comes back from its quaternion, whichever of its numbers is largest", () => {
  for (const axis of [[1, 0, 0], [0, 1, 0], [0, 0, 1], v.unit([1, 1, 1])]) {
    for (const angle of [0.3, 3.1, -2.9]) {
      const columns = LEVEL.map((column) => v.turn(column, axis, angle));
      const back = v.columns(v.quaternion(columns));
      back.forEach((column, k) => nearVector(column, columns[k]));
    }
  }
});

test("half of the way between two rotations is half of the angle", () => {
  const turned = LEVEL.map((column) => v.turn(column, [0, 0, 1], 1));
  const half = v.columns(v.slerp(v.quaternion(LEVEL), v.quaternion(turned), 0.5));
  half.forEach((column, k) => nearVector(column, v.turn(LEVEL[k], [0, 0, 1], 0.5)));
});

test("an orbit keeps the pivot and the distance, level or free", () => {
  for (const isLevel of [true, false]) {
    const made = camera();
    made.isLevel = isLevel;
    made.orbit(0.4, 0.9);
    nearVector(made.pivot, [0, 0, 0]);
    near(v.length(made.eye), 4);
    isOrthonormal(made);
  }
});

test("a level camera keeps its horizon, and a free one goes over the top", () => {
  const [level, free] = [camera(), camera()];
  free.isLevel = false;
  for (const made of [level, free]) for (let k = 0; k < 10; k++) made.orbit(0.1, -0.25);
  near(v.dot(level.axes[0], level.up), 0);
  assert.ok(v.dot(level.axes[1], level.up) < 0, "upright");
  assert.ok(v.dot(free.axes[1], free.up) > 0, "upside down");
  free.level();
  near(v.dot(free.axes[0], free.up), 0);
});

test("the axes stay orthonormal and the numbers finite whatever hands do", () => {
  for (const isLevel of [true, false]) {
    const made = camera();
    made.isLevel = isLevel;
    shake(made, 2000, 7);
    isOrthonormal(made);
    assert.ok(made.eye.every(Number.isFinite));
  }
});

test("no move leads farther than ten diagonals from the middle, or nearer to the pivot than a thousandth", () => {
  const made = camera();
  const diagonal = 2 * Math.sqrt(3);
  for (const factor of [Infinity, 1e9, 3, 3, 3, 1.1, 1.1, 1.1]) made.dolly(factor);
  assert.ok(v.length(made.eye) <= 10 * diagonal + TINY && v.length(made.eye) > 30, `${v.length(made.eye)}`);
  for (let k = 0; k < 100; k++) made.fly(5, 0, -5);
  assert.ok(v.length(made.eye) <= 10 * diagonal + TINY);
  for (let k = 0; k < 100; k++) made.dolly(0.1);
  near(made.distance, 1e-3 * diagonal);
});

test("from above the camera looks down, also where it was rolled", () => {
  const made = camera();
  made.isLevel = false;
  made.axes = [
    [0, 0, -1],
    [-1, 0, 0],
    [0, 1, 0],
  ];
  made.lookAlong([0, 0, -1]);
  isOrthonormal(made);
  nearVector(made.axes[2], [0, 0, -1]);
});

test("a framed box lies within the picture and fills it", () => {
  for (const [min, max] of [
    [
      [-1, -1, -1],
      [1, 1, 1],
    ],
    [
      [0.2, 0.1, 0],
      [0.3, 0.5, 0.1],
    ],
  ]) {
    const made = camera();
    made.orbit(0.5, 0.3);
    made.frame(min, max);
    const picture = made.for([400, 300]);
    const corners = Array.from({ length: 8 }, (_, k) => [0, 1, 2].map((a) => ((k >> a) & 1 ? max[a] : min[a])));
    const places = corners.map((x) => project(picture, x));
    assert.ok(places.every(({ at: [x, y], depth }) => depth > 0 && x >= 0 && x <= 400 && y >= 0 && y <= 300));
    const aside = places.flatMap(({ at: [x, y] }) => [Math.abs(x - 200), Math.abs(y - 150)]);
    near(Math.max(...aside), 150, 1e-6);
  }
});

test("the pivot is in the middle of every picture, and each shows all of the reference", () => {
  const made = camera();
  for (const size of [
    [400, 300],
    [200, 900],
    [1000, 100],
  ]) {
    const picture = made.for(size);
    nearVector(project(picture, made.pivot).at, [size[0] / 2, size[1] / 2], 1e-6);
    const edge = v.add(made.pivot, v.scale(made.axes[0], 4 * Math.tan(0.4)));
    const [x] = project(picture, edge).at;
    assert.ok(x <= size[0] + 1e-6, `${x} of ${size[0]}`);
  }
});

test("another field of view shows as much as it says, within what the program takes", () => {
  const made = camera();
  made.view = 1.2;
  near(made.view, 1.2);
  near(made.for([400, 300]).angle, 2 * Math.atan((Math.tan(0.6) * 400) / 300));
  made.view = 100;
  assert.ok(made.for([5000, 16]).angle <= 2.8);
});

test("the way back to a place leads to the same picture", () => {
  const made = camera();
  made.view = 0.5;
  const { place } = made;
  const before = structuredClone(made.for([300, 200]));
  shake(made, 3, 5);
  made.view = 1;
  made.goTo(place);
  assert.deepEqual(made.for([300, 200]), before);
});

test("a line behind the camera is not drawn, and one that passes it is cut", () => {
  const picture = camera().for([400, 300]);
  assert.equal(projectLine(picture, [0, -5, 0], [1, -6, 0]), null);
  const cut = projectLine(picture, [0, -6, 1], [0, 0, 1]);
  assert.ok(cut.flat().every(Number.isFinite));
  nearVector(cut[1], project(picture, [0, 0, 1]).at);
});

test("a path passes its keyframes, and its file has a frame for each picture", () => {
  const made = camera();
  const keys = [0, 1, 2].map(() => {
    made.orbit(0.4, 0.1);
    return structuredClone(made.for([400, 300]));
  });
  keys.forEach((key, k) => {
    const { eye, axes } = at(keys, k / 2);
    nearVector(eye, key.eye);
    axes.forEach((axis, a) => nearVector(axis, key.axes[a]));
  });
  const { camera_path, fps } = JSON.parse(file(keys, 2, 12));
  assert.deepEqual([camera_path.length, fps], [24, 12]);
  nearVector(
    [3, 7, 11].map((k) => camera_path[0].camera_to_world[k]),
    keys[0].eye,
  );
});
