// SPDX-License-Identifier: Apache-2.0
// The march by WebGL 2.
import {kCells} from './bricks';
import type {Triple} from './contents';
import {type Kind, kTold, March, type Part} from './march';
import {kFragments, kWhole} from './shaders';

interface Program {
  program: WebGLProgram;
  at: (name: string) => WebGLUniformLocation | null;
}

export function linked(gl: WebGL2RenderingContext, vertex: string, fragment: string): Program {
  const program = gl.createProgram();
  for (const [type, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]] as const) {
    const shader = gl.createShader(type)!;
    gl.shaderSource(shader, source.replaceAll('CELLS', String(kCells)).replaceAll('TOLD', String(kTold)));
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

export class GlMarch extends March {
  readonly name = 'webgl';
  private readonly programs = new Map<Kind, Program>();
  private readonly values: WebGLTexture;
  private readonly leaps: WebGLTexture;
  private readonly palette: WebGLTexture;
  private readonly wholeFloats: boolean;

  constructor(private readonly gl: WebGL2RenderingContext) {
    super();
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
    this.palette = texture(kPalette, gl.TEXTURE_2D, gl.LINEAR);
  }

  setPalette(palette: readonly (readonly number[])[]): void {
    const {gl} = this;
    gl.activeTexture(gl.TEXTURE0 + kPalette);
    gl.bindTexture(gl.TEXTURE_2D, this.palette);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, palette.length, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, Uint8Array.from(palette.flat()));
  }

  protected setValues(points: Triple, lanes: 2 | 3 | 4, texels: Float32Array): void {
    const {gl} = this;
    gl.activeTexture(gl.TEXTURE0 + kValues);
    gl.bindTexture(gl.TEXTURE_3D, this.values);
    // Halves take half the memory, and show more than a screen does; without a GPU each would be converted at each look.
    const [half, whole, format] = {2: [gl.RG16F, gl.RG32F, gl.RG], 3: [gl.RGB16F, gl.RGB32F, gl.RGB], 4: [gl.RGBA16F, gl.RGBA32F, gl.RGBA]}[lanes];
    gl.texImage3D(gl.TEXTURE_3D, 0, (this.wholeFloats ? whole : half)!, ...points, 0, format!, gl.FLOAT, texels);
  }

  protected setEmptiness(size: Triple, away: Uint8Array): void {
    const {gl} = this;
    gl.activeTexture(gl.TEXTURE0 + kEmptiness);
    gl.bindTexture(gl.TEXTURE_3D, this.leaps);
    gl.texImage3D(gl.TEXTURE_3D, 0, gl.R8UI, ...size, 0, gl.RED_INTEGER, gl.UNSIGNED_BYTE, away);
  }

  protected paint(kind: Kind, told: Float32Array, [left, top, across, down]: Part, width: number, height: number): void {
    const {gl} = this;
    let made = this.programs.get(kind);
    if (!made) this.programs.set(kind, (made = linked(gl, kWhole, kFragments[kind])));
    const {program, at} = made;
    gl.useProgram(program);
    gl.uniform1i(at('values'), kValues);
    gl.uniform1i(at('emptiness'), kEmptiness);
    gl.uniform1i(at('colours'), kPalette);
    gl.uniform4fv(at('told'), told);
    gl.viewport(0, 0, width, height);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.ONE, gl.SRC_ALPHA, gl.ZERO, gl.ONE);  // light over what comes through
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(left, height - top - down, across, down);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.disable(gl.SCISSOR_TEST);
  }
}
