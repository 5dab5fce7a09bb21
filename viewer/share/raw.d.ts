/** The text of a file. */
declare module "*.wgsl?raw" {
  const text: string;
  export default text;
}
declare module "*.css";

// Numbers of the standard that the types of the language leave out.
declare const GPUBufferUsage: { readonly COPY_DST: number; readonly UNIFORM: number; readonly STORAGE: number };
declare const GPUShaderStage: { readonly FRAGMENT: number };
declare const GPUTextureUsage: {
  readonly COPY_SRC: number;
  readonly TEXTURE_BINDING: number;
  readonly RENDER_ATTACHMENT: number;
};
