// The renderer of the page: one fragment per pixel, in bands, so that no device is busy for long at a time.

import background from "../../crates/refraxel-gpu/src/shaders/background.wgsl?raw";
import bricks from "../../crates/refraxel-gpu/src/shaders/bricks.wgsl?raw";
import colour from "../../crates/refraxel-gpu/src/shaders/colour.wgsl?raw";
import density from "../../crates/refraxel-gpu/src/shaders/density.wgsl?raw";
import domain from "../../crates/refraxel-gpu/src/shaders/domain.wgsl?raw";
import march from "../../crates/refraxel-gpu/src/shaders/march.wgsl?raw";
import structs from "../../crates/refraxel-gpu/src/shaders/scene.wgsl?raw";
import sh from "../../crates/refraxel-gpu/src/shaders/sh.wgsl?raw";
import trilinear from "../../crates/refraxel-gpu/src/shaders/trilinear.wgsl?raw";
import type { PageCamera } from "../src/protocol";
import { scale } from "../src/vectors";
import bend from "./shaders/bend.wgsl?raw";
import picture from "./shaders/picture.wgsl?raw";
import own from "./shaders/scene.wgsl?raw";
import show from "./shaders/show.wgsl?raw";
import spline from "./shaders/spline.wgsl?raw";
import { unpack, type Document, type SharedScene } from "./scene";

/** Time that a band should take [ms]. */
const BAND = 30;
/** Place of the index and of the contrast in a region, and its size [4 bytes]. */
const [INDEX, CONTRAST, REGION] = [3, 19, 32];

export interface Edits {
  index: number[];
  straight: boolean;
}

/** The declarations of constants, which are those of the program. */
function constants({ constants: { u32, f32 } }: Document): string {
  const whole = Object.entries(u32).map(([name, value]) => `const ${name}: u32 = ${value}u;`);
  const real = Object.entries(f32).map(
    ([name, value]) =>
      `const ${name}: f32 = ${Number.isInteger(value) && Math.abs(value) < 1e6 ? value.toFixed(1) : value}f;`,
  );
  return [...whole, ...real].join("\n");
}

export class Renderer {
  private readonly view: GPUBuffer;
  private readonly regions: GPUBuffer;
  private readonly media: ArrayBuffer;
  private readonly paint: GPURenderPipeline;
  private readonly group: GPUBindGroup;
  private readonly blit: GPURenderPipeline;
  private readonly sampler: GPUSampler;
  private readonly context: GPUCanvasContext;
  private target: GPUTexture | null = null;
  /** Rows of a band. */
  private rows = 16;
  /** Pixels per millisecond of late. */
  speed = 200;
  /** Why the device has gone; until then the promise is kept waiting. */
  readonly lost: Promise<string>;
  private isLost = false;

  private constructor(
    private readonly device: GPUDevice,
    private readonly canvas: HTMLCanvasElement,
    private readonly scene: SharedScene,
    code: string,
  ) {
    this.lost = device.lost.then(({ message, reason }) => {
      this.isLost = true;
      return message || reason;
    });
    const { document: doc, bytes } = scene;
    const buffer = (data: ArrayBufferLike | ArrayBufferView<ArrayBuffer>, usage: number) => {
      const size = Math.max(16, Math.ceil(data.byteLength / 4) * 4);
      const made = device.createBuffer({ size, usage: usage | GPUBufferUsage.COPY_DST });
      device.queue.writeBuffer(made, 0, data as BufferSource);
      return made;
    };
    // Parts begin at multiples of 4 bytes, and are written so.
    const part = (name: keyof Document["parts"]) =>
      new Uint8Array(bytes, doc.parts[name].at, 4 * Math.ceil(doc.parts[name].length / 4));
    const { UNIFORM, STORAGE } = GPUBufferUsage;
    this.view = device.createBuffer({ size: 64, usage: UNIFORM | GPUBufferUsage.COPY_DST });
    this.media = new Uint8Array(part("regions")).buffer;
    this.regions = buffer(this.media, UNIFORM);
    const reals = (of: Uint8Array) => new Float32Array(bytes, of.byteOffset, of.byteLength / 4);
    const numbers = [reals(part("scales")), reals(part("planes")), ...doc.splines.map((s) => unpack(bytes, s))];
    const joined = new Float32Array(numbers.reduce((sum, n) => sum + n.length, 0));
    let at = 0;
    for (const n of numbers) {
      joined.set(n, at);
      at += n.length;
    }
    const buffers = [
      this.view,
      buffer(part("scene"), UNIFORM),
      buffer(part("task"), UNIFORM),
      this.regions,
      buffer(part("table"), STORAGE),
      buffer(part("forward"), STORAGE),
      buffer(part("occupied"), STORAGE),
      buffer(unpack(bytes, doc.density), STORAGE),
      buffer(part("colours"), STORAGE),
      buffer(part("texels"), STORAGE),
      buffer(joined, STORAGE),
      buffer(part("clearances"), STORAGE),
    ];
    const module = device.createShaderModule({ code });
    const kind = (k: number): GPUBufferBindingType => (k < 4 ? "uniform" : "read-only-storage");
    const layout = device.createBindGroupLayout({
      entries: buffers.map((_, k) => ({ binding: k, visibility: GPUShaderStage.FRAGMENT, buffer: { type: kind(k) } })),
    });
    this.group = device.createBindGroup({
      layout,
      entries: buffers.map((b, binding) => ({ binding, resource: { buffer: b } })),
    });
    this.paint = device.createRenderPipeline({
      layout: device.createPipelineLayout({ bindGroupLayouts: [layout] }),
      vertex: { module },
      fragment: { module, targets: [{ format: "rgba8unorm" }] },
    });
    const format = navigator.gpu.getPreferredCanvasFormat();
    const shown = device.createShaderModule({ code: show });
    this.blit = device.createRenderPipeline({
      layout: "auto",
      vertex: { module: shown },
      fragment: { module: shown, targets: [{ format }] },
    });
    this.sampler = device.createSampler({ magFilter: "linear", minFilter: "linear" });
    this.context = canvas.getContext("webgpu") as unknown as GPUCanvasContext;
    this.context.configure({ device, format, alphaMode: "opaque" });
  }

  /** A renderer on this canvas; an error says why there is none. */
  static async make(canvas: HTMLCanvasElement, scene: SharedScene): Promise<Renderer> {
    if (!("gpu" in navigator)) throw new Error("this browser has no WebGPU");
    const adapter = await navigator.gpu.requestAdapter({ powerPreference: "high-performance" });
    if (!adapter) throw new Error("WebGPU finds no graphics device here");
    const { maxStorageBufferBindingSize, maxBufferSize } = adapter.limits;
    const device = await adapter.requestDevice({ requiredLimits: { maxStorageBufferBindingSize, maxBufferSize } });
    const code = [
      constants(scene.document),
      structs,
      own,
      domain,
      bricks,
      trilinear,
      sh,
      density,
      background,
      colour,
      march,
      spline,
      bend,
      picture,
    ].join("\n");
    device.pushErrorScope("validation");
    device.pushErrorScope("out-of-memory");
    const renderer = new Renderer(device, canvas, scene, code);
    const errors = [await device.popErrorScope(), await device.popErrorScope()];
    const error = errors.find((e) => e !== null);
    if (error) throw new Error(error.message);
    return renderer;
  }

  /** Paints a picture of a camera and shows it; false where `isStale` has said that another one is wanted, or the device has gone. */
  async render(camera: PageCamera, edits: Edits, isStale: () => boolean): Promise<boolean> {
    const [width, height] = camera.size;
    this.tell(camera, edits);
    if (this.target?.width !== width || this.target.height !== height) {
      this.target?.destroy();
      const usage = GPUTextureUsage.RENDER_ATTACHMENT | GPUTextureUsage.TEXTURE_BINDING | GPUTextureUsage.COPY_SRC;
      this.target = this.device.createTexture({ size: [width, height], format: "rgba8unorm", usage });
    }
    const view = this.target.createView();
    for (let y = 0; y < height; ) {
      const rows = Math.min(this.rows, height - y);
      const start = performance.now();
      const commands = this.device.createCommandEncoder();
      const pass = commands.beginRenderPass({ colorAttachments: [{ view, loadOp: "load", storeOp: "store" }] });
      pass.setPipeline(this.paint);
      pass.setBindGroup(0, this.group);
      pass.setScissorRect(0, y, width, rows);
      pass.draw(3);
      pass.end();
      this.device.queue.submit([commands.finish()]);
      await this.device.queue.onSubmittedWorkDone();
      const time = Math.max(0.2, performance.now() - start);
      this.speed += 0.3 * ((rows * width) / time - this.speed);
      this.rows = Math.max(4, Math.min(4096, Math.round((this.speed * BAND) / width)));
      y += rows;
      if (this.isLost || isStale()) return false;
    }
    this.show();
    return true;
  }

  private tell({ eye, axes, angle, size }: PageCamera, { index, straight }: Edits): void {
    const pixel = (2 * Math.tan(0.5 * angle)) / size[0];
    const [right, down, forward] = axes;
    const words = new ArrayBuffer(64);
    const [reals, wholes] = [new Float32Array(words), new Uint32Array(words)];
    reals.set([...eye, 0, ...scale(right, pixel), size[0], ...scale(down, pixel), size[1], ...forward, 0]);
    wholes[3] = this.scene.document.regions.length;
    wholes[15] = straight ? 1 : 0;
    this.device.queue.writeBuffer(this.view, 0, words);
    const media = new Float32Array(this.media.slice(0));
    this.scene.document.regions.forEach((region, k) => {
      if (!region.slides) return;
      if (region.uniform) media[REGION * k + INDEX] = index[k]!;
      else media[REGION * k + CONTRAST] = (index[k]! - 1) / (region.index - 1);
    });
    this.device.queue.writeBuffer(this.regions, 0, media);
  }

  /** The picture in the size of the canvas. */
  private show(): void {
    const commands = this.device.createCommandEncoder();
    const view = this.context.getCurrentTexture().createView();
    const group = this.device.createBindGroup({
      layout: this.blit.getBindGroupLayout(0),
      entries: [
        { binding: 0, resource: this.target!.createView() },
        { binding: 1, resource: this.sampler },
      ],
    });
    const pass = commands.beginRenderPass({ colorAttachments: [{ view, loadOp: "clear", storeOp: "store" }] });
    pass.setPipeline(this.blit);
    pass.setBindGroup(0, group);
    pass.draw(3);
    pass.end();
    this.device.queue.submit([commands.finish()]);
  }

  resize(width: number, height: number): void {
    if (this.canvas.width !== width || this.canvas.height !== height)
      [this.canvas.width, this.canvas.height] = [width, height];
  }
}
