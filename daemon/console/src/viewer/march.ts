// SPDX-License-Identifier: Apache-2.0
// Draws a volume with WebGL 2.
import {type Bricks, bricksOf, emptiness, filledPart, kCells} from './bricks';
import type {Triple} from './contents';
import {type Eye, seen} from './eye';
import {kColour, kQuantity, kWhole} from './shaders';

/** Light and what it loses, as a camera would see it: `gain` times as bright. */
export interface ColourLook {
  mode: 'colour';
  gain: number;
}
/** A quantity from `low` on in the palette's colours; `depth`: what it takes of the light along the volume's longest edge (optical
 *  depth) where the palette is opaque. Isotherms are at `levels`, which rise. */
export interface QuantityLook {
  mode: 'quantity';
  low: number;
  high: number;
  depth: number;
  levels: readonly number[];
}
export type Look = ColourLook | QuantityLook;

export interface GridPlace {
  points: Triple;
  edge: number;
  origin: Triple;
}

interface Program {
  program: WebGLProgram;
  at: (name: string) => WebGLUniformLocation | null;
}

export function linked(gl: WebGL2RenderingContext, vertex: string, fragment: string): Program {
  const program = gl.createProgram();
  for (const [type, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]] as const) {
    const shader = gl.createShader(type)!;
    gl.shaderSource(shader, source.replaceAll('CELLS', String(kCells)));
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(`a shader: ${gl.getShaderInfoLog(shader) ?? 'lost'}`);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(`shaders: ${gl.getProgramInfoLog(program) ?? 'lost'}`);
  const places = new Map<string, WebGLUniformLocation | null>();
  return {program, at: name => {
    if (!places.has(name)) places.set(name, gl.getUniformLocation(program, name));
    return places.get(name)!;
  }};
}

/** As texture units. */
const kValues = 0;
const kEmptiness = 1;
const kPalette = 2;

/** Whether there is no GPU. */
function software(gl: WebGL2RenderingContext): boolean {
  const told = gl.getExtension('WEBGL_debug_renderer_info');
  return told !== null && /SwiftShader|llvmpipe|softpipe|Basic Render/i.test(String(gl.getParameter(told.UNMASKED_RENDERER_WEBGL)));
}

export class March {
  private readonly programs = new Map<string, Program>();
  private readonly values: WebGLTexture;
  private readonly leaps: WebGLTexture;
  private grid: GridPlace = {points: [2, 2, 2], edge: 1, origin: [0, 0, 0]};
  private bricks?: Bricks;
  private absorbs = false;
  private scale: readonly number[] = [1, 1, 1, 1];
  private unit = 1;  // of a quantity's values
  private over = NaN;
  private filled?: readonly [Triple, Triple];  // the corners of what isn't empty, in voxel edges
  private readonly wholeFloats: boolean;
  /** Voxel edges from sample to sample, as `emberlock reconstruct --step` has it. */
  stride = 1;

  constructor(readonly gl: WebGL2RenderingContext) {
    const texture = (unit: number, target: GLenum, filter: GLenum) => {
      const made = gl.createTexture();
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(target, made);
      for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(target, name, filter);
      for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T, gl.TEXTURE_WRAP_R]) gl.texParameteri(target, name, gl.CLAMP_TO_EDGE);
      return made;
    };
    this.wholeFloats = software(gl) && gl.getExtension('OES_texture_float_linear') !== null;
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    this.values = texture(kValues, gl.TEXTURE_3D, gl.LINEAR);
    this.leaps = texture(kEmptiness, gl.TEXTURE_3D, gl.NEAREST);
    texture(kPalette, gl.TEXTURE_2D, gl.LINEAR);
  }

  /** The colours of a quantity, from its lowest to its highest: red, green, blue and opacity of 256 values, 0..255. */
  setPalette(palette: readonly (readonly number[])[]): void {
    const {gl} = this;
    const bytes = Uint8Array.from(palette.flat());
    gl.activeTexture(gl.TEXTURE0 + kPalette);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, palette.length, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
  }

  /** Light in grey levels a metre, RGB at each point, and the extinction a metre where anything is lost. */
  setLight(grid: GridPlace, emission: Float32Array, extinction?: Float32Array): void {
    const count = emission.length / 3;
    const [bright, dense] = [largest(emission) || 1, extinction ? largest(extinction) : 0];
    this.absorbs = dense > 0;
    const lanes = this.absorbs ? 4 : 3;
    const texels = new Float32Array(lanes * count);
    for (let point = 0; point < count; ++point) {
      for (let c = 0; c < 3; ++c) texels[lanes * point + c] = emission[3 * point + c]! / bright;
      if (this.absorbs) texels[lanes * point + 3] = extinction![point]! / dense;
    }
    const {edge} = grid;
    this.scale = [bright * edge, bright * edge, bright * edge, dense * edge];
    const any = (point: number) => {
      let most = 0;
      for (let c = 0; c < lanes; ++c) most = Math.max(most, texels[lanes * point + c]!);
      return most;
    };
    this.take(grid, texels, lanes, any);
  }

  /** A quantity at each point; what isn't above 0 is not told. Its opacity can have a weight at each point, 0..1. */
  setQuantity(grid: GridPlace, values: Float32Array, weight: (point: number) => number = () => 1): void {
    const texels = new Float32Array(2 * values.length);
    this.unit = largest(values) || 1;
    values.forEach((value, point) => {
      if (!(value > 0)) return;
      const told = weight(point);
      texels[2 * point] = told * value / this.unit;
      texels[2 * point + 1] = told;
    });
    this.take(grid, texels, 2, point => texels[2 * point + 1]! > 0 ? values[point]! / this.unit : 0);
  }

  private take(grid: GridPlace, texels: Float32Array, lanes: 2 | 3 | 4, most: (point: number) => number): void {
    const {gl} = this;
    this.grid = grid;
    this.bricks = bricksOf(grid.points, most);
    this.over = NaN;
    gl.activeTexture(gl.TEXTURE0 + kValues);
    gl.bindTexture(gl.TEXTURE_3D, this.values);
    // Halves take half the memory, and show more than a screen does; without a GPU each would be converted at each look.
    const [half, whole, format] = {2: [gl.RG16F, gl.RG32F, gl.RG], 3: [gl.RGB16F, gl.RGB32F, gl.RGB], 4: [gl.RGBA16F, gl.RGBA32F, gl.RGBA]}[lanes];
    gl.texImage3D(gl.TEXTURE_3D, 0, (this.wholeFloats ? whole : half)!, ...grid.points, 0, format!, gl.FLOAT, texels);
  }

  /** Over what is in the picture already. */
  draw(eye: Eye, look: Look, width: number, height: number): void {
    const {gl, grid} = this;
    if (!this.bricks) return;
    this.look(look);
    const part = this.partOf(eye, width, height);
    if (!part) return;
    const {program, at} = this.program(look);
    gl.useProgram(program);
    gl.uniform1i(at('values'), kValues);
    gl.uniform1i(at('emptiness'), kEmptiness);
    gl.uniform1i(at('colours'), kPalette);
    gl.uniform3f(at('points'), ...grid.points);
    gl.uniform3i(at('bricks'), ...this.bricks.size);
    const place = [0, 1, 2].map(axis => (eye.place[axis]! - grid.origin[axis]!) / grid.edge) as [number, number, number];
    gl.uniform3f(at('eye'), ...place);
    gl.uniformMatrix3fv(at('axes'), false, [...eye.right, ...eye.down, ...eye.forward]);
    gl.uniform4f(at('lens'), ...eye.focal, ...eye.middle);
    gl.uniform1f(at('rows'), height);
    gl.uniform1f(at('stride'), this.stride);
    gl.uniform4fv(at('scale'), this.scale as number[]);
    if (look.mode === 'colour') gl.uniform4f(at('range'), look.gain, 0, 0, 0);
    else {
      const [low, high] = [look.low / this.unit, look.high / this.unit];
      gl.uniform4f(at('range'), low, Math.max(high, low + 1e-6), look.depth / Math.max(...grid.points), 0);
      gl.uniform4f(at('levels'), ...([0, 1, 2, 3].map(n => (look.levels[n] ?? 1e30) / this.unit) as [number, number, number, number]));
    }
    gl.viewport(0, 0, width, height);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.ONE, gl.SRC_ALPHA, gl.ZERO, gl.ONE);  // light over what comes through
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(...part);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.disable(gl.SCISSOR_TEST);
  }

  /** Left, bottom, width and height of the picture's part in which what isn't empty is seen. */
  private partOf(eye: Eye, width: number, height: number): [number, number, number, number] | undefined {
    if (!this.filled) return undefined;
    const {grid, filled} = this;
    const corners = Array.from({length: 8}, (_, n) =>
      seen(eye, [0, 1, 2].map(axis => grid.origin[axis]! + grid.edge * filled[n >> axis & 1]![axis]!) as unknown as Triple));
    if (corners.some(([, , far]) => far <= 0)) return [0, 0, width, height];
    const [left, right, top, bottom] = [Math.min(...corners.map(([x]) => x)), Math.max(...corners.map(([x]) => x)), Math.min(...corners.map(([, y]) => y)), Math.max(...corners.map(([, y]) => y))];
    const within = (value: number, most: number) => Math.max(0, Math.min(most, value));
    const [x0, x1] = [within(Math.floor(left) - 1, width), within(Math.ceil(right) + 1, width)];
    const [y0, y1] = [within(Math.floor(top) - 1, height), within(Math.ceil(bottom) + 1, height)];
    return x1 > x0 && y1 > y0 ? [x0, height - y1, x1 - x0, y1 - y0] : undefined;
  }

  private program(look: Look): Program {
    const [key, source] = look.mode === 'colour'
      ? [`colour ${this.absorbs}`, kColour(this.absorbs)]
      : [`quantity ${look.levels.length > 0}`, kQuantity(look.levels.length > 0)];
    let made = this.programs.get(key);
    if (!made) this.programs.set(key, (made = linked(this.gl, kWhole, source)));
    return made;
  }

  /** What is leapt over: where there is no light, or where nothing is above what is shown. */
  private look(look: Look): void {
    const over = look.mode === 'colour' ? 0 : Math.max(0, Math.min(look.low, ...look.levels)) / this.unit;
    if (over === this.over) return;
    this.over = over;
    this.filled = filledPart(this.bricks!, over);
    const {gl} = this;
    gl.activeTexture(gl.TEXTURE0 + kEmptiness);
    gl.bindTexture(gl.TEXTURE_3D, this.leaps);
    gl.texImage3D(gl.TEXTURE_3D, 0, gl.R8UI, ...this.bricks!.size, 0, gl.RED_INTEGER, gl.UNSIGNED_BYTE, emptiness(this.bricks!, over));
  }
}

/** Of values that are told, which are above 0; 0 of none. */
export function largest(values: Float32Array): number {
  let most = 0;
  for (const value of values) if (value > most) most = value;
  return most;
}
