// SPDX-License-Identifier: Apache-2.0
// The march by WebGPU: into two pictures of its own, light and what comes through, which are then laid over that of WebGL.
import type {Triple} from './contents';
import {type Kind, kKinds, kTold, March, type Part} from './march';
import {linked} from './march_gl';
import {kGpuShaders} from './shaders_gpu';
import {kLaid, kWhole} from './shaders';

const kFormat = 'rgba8unorm';
/** As texture units of WebGL. */
const kLight = 4;
const kThrough = 5;

/** A canvas that WebGPU draws, and the texture it becomes in WebGL. */
interface Sheet {
  canvas: OffscreenCanvas;
  context: GPUCanvasContext;
  unit: number;
  texture: WebGLTexture;
}

function sheet(gl: WebGL2RenderingContext, device: GPUDevice, unit: number): Sheet {
  const canvas = new OffscreenCanvas(1, 1);
  const context = canvas.getContext('webgpu');
  if (!context) throw new Error('no picture of WebGPU');
  context.configure({device, format: kFormat, alphaMode: 'opaque'});
  const texture = gl.createTexture();
  gl.activeTexture(gl.TEXTURE0 + unit);
  gl.bindTexture(gl.TEXTURE_2D, texture);
  for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
  return {canvas, context, unit, texture};
}

class GpuMarch extends March {
  readonly name = 'webgpu';
  private readonly laid;
  private readonly sheets: readonly [Sheet, Sheet];
  private readonly layout: GPUBindGroupLayout;
  private readonly told: GPUBuffer;
  private readonly sampler: GPUSampler;
  private readonly palette: GPUTexture;
  private readonly pipelines = new Map<Kind, GPURenderPipeline>();
  private values?: GPUTexture;
  private leaps?: GPUTexture;
  private bound?: GPUBindGroup;

  /** `wholeFloats`: values as float32, else as halves. */
  constructor(private readonly gl: WebGL2RenderingContext, private readonly device: GPUDevice, private readonly wholeFloats: boolean) {
    super();
    this.laid = linked(gl, kWhole, kLaid);
    this.sheets = [sheet(gl, device, kLight), sheet(gl, device, kThrough)];
    this.told = device.createBuffer({size: 16 * kTold, usage: GPUBufferUsage.UNIFORM | GPUBufferUsage.COPY_DST});
    this.sampler = device.createSampler({magFilter: 'linear', minFilter: 'linear'});
    this.palette = this.texture([256, 1, 1], '2d', 'rgba8unorm');
    const visibility = GPUShaderStage.FRAGMENT;
    this.layout = device.createBindGroupLayout({entries: [
      {binding: 0, visibility, buffer: {}},
      {binding: 1, visibility, texture: {viewDimension: '3d'}},
      {binding: 2, visibility, texture: {viewDimension: '3d', sampleType: 'uint'}},
      {binding: 3, visibility, texture: {}},
      {binding: 4, visibility, sampler: {}},
    ]});
  }

  /** All it draws with. */
  async prepare(): Promise<void> {
    const {device} = this;
    const layout = device.createPipelineLayout({bindGroupLayouts: [this.layout]});
    await Promise.all(kKinds.map(async kind => {
      const module = device.createShaderModule({code: kGpuShaders[kind]});
      this.pipelines.set(kind, await device.createRenderPipelineAsync({
        layout, vertex: {module}, fragment: {module, targets: [{format: kFormat}, {format: kFormat}]}}));
    }));
  }

  private texture(size: Triple, dimension: GPUTextureDimension, format: GPUTextureFormat): GPUTexture {
    return this.device.createTexture({size: [...size], dimension, format, usage: GPUTextureUsage.TEXTURE_BINDING | GPUTextureUsage.COPY_DST});
  }

  private write(texture: GPUTexture, data: ArrayBufferView<ArrayBuffer>): void {
    const {width, height, depthOrArrayLayers} = texture;
    const bytesPerRow = data.byteLength / (height * depthOrArrayLayers);
    this.device.queue.writeTexture({texture}, data, {bytesPerRow, rowsPerImage: height}, [width, height, depthOrArrayLayers]);
  }

  setPalette(palette: readonly (readonly number[])[]): void {
    this.write(this.palette, Uint8Array.from(palette.flat()));
  }

  protected setValues(points: Triple, lanes: 2 | 3 | 4, texels: Float32Array): void {
    const kept = lanes === 2 ? 2 : 4;
    const Values = this.wholeFloats ? Float32Array : Float16Array;
    const data = new Values(texels.length / lanes * kept);
    if (kept === lanes) data.set(texels);
    else for (let at = 0; at < texels.length; ++at) data[at + Math.floor(at / lanes)] = texels[at]!;
    this.values?.destroy();
    this.values = this.texture(points, '3d', `${kept === 2 ? 'rg' : 'rgba'}${this.wholeFloats ? '32' : '16'}float`);
    this.write(this.values, data);
    this.bound = undefined;
  }

  protected setEmptiness(size: Triple, away: Uint8Array): void {
    this.leaps?.destroy();
    this.leaps = this.texture(size, '3d', 'r8uint');
    this.write(this.leaps, Uint8Array.from(away));
    this.bound = undefined;
  }

  protected paint(kind: Kind, told: Float32Array, part: Part, width: number, height: number): void {
    const {device} = this;
    this.bound ??= device.createBindGroup({layout: this.layout, entries: [
      {binding: 0, resource: {buffer: this.told}},
      ...[this.values!, this.leaps!, this.palette].map((texture, n) => ({binding: n + 1, resource: texture.createView()})),
      {binding: 4, resource: this.sampler},
    ]});
    device.queue.writeBuffer(this.told, 0, Float32Array.from(told));
    for (const {canvas} of this.sheets) if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, {width, height});
    const encoder = device.createCommandEncoder();
    const pass = encoder.beginRenderPass({colorAttachments: this.sheets.map(({context}) =>
      ({view: context.getCurrentTexture().createView(), loadOp: 'clear' as const, storeOp: 'store' as const}))});
    pass.setPipeline(this.pipelines.get(kind)!);
    pass.setBindGroup(0, this.bound);
    pass.setScissorRect(...part);
    pass.draw(3);
    pass.end();
    device.queue.submit([encoder.finish()]);
    this.lay(part, width, height);
  }

  /** Over the picture at hand. */
  private lay([left, top, across, down]: Part, width: number, height: number): void {
    const {gl} = this;
    for (const {canvas, unit, texture} of this.sheets) {
      const drawn = canvas.transferToImageBitmap();  // of the canvas itself not all browsers have what was drawn just now
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, drawn);
      drawn.close();
    }
    gl.useProgram(this.laid.program);
    gl.uniform1i(this.laid.at('light'), kLight);
    gl.uniform1i(this.laid.at('through'), kThrough);
    gl.viewport(0, 0, width, height);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.ONE, gl.SRC_ALPHA, gl.ZERO, gl.ONE);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(left, height - top - down, across, down);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.disable(gl.SCISSOR_TEST);
  }
}

/** The march by WebGPU where it answers: nothing where it doesn't, and where it is without a GPU, unless that is wanted. `failed` is told
 *  when it can't go on: the device is lost, or did something it can't. */
export async function gpuMarch(gl: WebGL2RenderingContext, wanted: boolean, failed: () => void): Promise<March | undefined> {
  try {
    const adapter = 'gpu' in navigator && 'Float16Array' in globalThis ? await navigator.gpu.requestAdapter() : null;
    if (!adapter) return undefined;
    const software = adapter.info.isFallbackAdapter;
    if (software && !wanted) return undefined;  // WebGL is as quick there
    const wholeFloats = software && adapter.features.has('float32-filterable');
    const device = await adapter.requestDevice({requiredFeatures: wholeFloats ? ['float32-filterable'] : []});
    const march = new GpuMarch(gl, device, wholeFloats);
    void device.lost.then(failed);
    device.addEventListener('uncapturederror', ({error}) => {
      console.warn('WebGPU can’t go on, WebGL does:', error.message);
      failed();
    });
    await march.prepare();
    return march;
  } catch (error) {
    console.warn('WebGPU can’t draw here, WebGL does:', error);
    return undefined;
  }
}
