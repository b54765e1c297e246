// SPDX-License-Identifier: Apache-2.0
// The cameras that filmed, in space: a pyramid of lines each, with its picture at the base.
import type {FilmingCamera, Triple, View} from './contents';
import {add, dot, type Eye, placeOf, seen} from './eye';
import {linked} from './march_gl';
import {kLines, kPicture, kPlaced} from './shaders';

interface Placed {
  camera: FilmingCamera;
  place: Triple;
  corners: Triple[];  // of the picture: top left, top right, bottom right, bottom left
  address?: string | undefined;  // of the picture that is wanted
  picture?: WebGLTexture | undefined;
}

const kPictureUnit = 3;

export class PlacedCameras {
  private readonly pictures;
  private readonly lines;
  private readonly buffer;
  private readonly placed: Placed[];
  chosen = -1;

  /** `reach`: how long their pyramids are, metres. `changed` is called when a picture has come. */
  constructor(private readonly gl: WebGL2RenderingContext, cameras: readonly FilmingCamera[], reach: number, private readonly changed: () => void) {
    this.pictures = linked(gl, kPlaced, kPicture);
    this.lines = linked(gl, kPlaced, kLines);
    this.buffer = gl.createBuffer();
    this.placed = cameras.map(camera => {
      const place = placeOf(camera);
      const [width, height] = camera.size;
      const corners = ([[0, 0], [width, 0], [width, height], [0, height]] as const).map(([x, y]) => {
        const way: Triple = [(x - camera.middle[0]) / camera.focal[0], (y - camera.middle[1]) / camera.focal[1], 1];
        const r = camera.rotation;
        return [0, 1, 2].map(axis => place[axis]! + reach * (r[axis]! * way[0] + r[3 + axis]! * way[1] + r[6 + axis]!)) as unknown as Triple;
      });
      return {camera, place, corners};
    });
  }

  /** A frame's pictures, as soon as each is there. */
  show(views: readonly View[]): void {
    this.placed.forEach((one, n) => {
      const address = views[n]?.captured ?? undefined;
      if (address === one.address) return;
      one.address = address;
      if (address) void this.load(one, address);
      else this.put(one, undefined);
    });
  }

  private put(one: Placed, picture: WebGLTexture | undefined): void {
    if (one.picture) this.gl.deleteTexture(one.picture);
    one.picture = picture;
    this.changed();
  }

  private async load(one: Placed, address: string): Promise<void> {
    const image = new Image();
    image.src = address;
    await image.decode().catch(() => undefined);
    if (one.address !== address) return;  // another one is wanted by now
    this.put(one, image.naturalWidth > 0 ? this.textureOf(image) : undefined);
  }

  private textureOf(image: HTMLImageElement): WebGLTexture {
    const {gl} = this;
    const texture = gl.createTexture();
    gl.activeTexture(gl.TEXTURE0 + kPictureUnit);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, image);
    gl.generateMipmap(gl.TEXTURE_2D);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
    return texture;
  }

  /** Those that stand behind `middle` as the eye sees it, or those before it; far ones first. */
  draw(eye: Eye, width: number, height: number, middle: Triple, behind: boolean): void {
    const {gl} = this;
    const far = (place: Triple) => dot(add(place, eye.place, -1), eye.forward);
    const those = this.placed.filter(one => (far(one.place) > far(middle)) === behind).sort((a, b) => far(b.place) - far(a.place));
    if (those.length === 0) return;
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.ONE, gl.SRC_ALPHA, gl.ZERO, gl.ONE);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    for (const {program, at} of [this.pictures, this.lines]) {
      gl.useProgram(program);
      gl.uniform3f(at('eye'), ...eye.place);
      gl.uniformMatrix3fv(at('axes'), false, [...eye.right, ...eye.down, ...eye.forward]);
      gl.uniform4f(at('lens'), ...eye.focal, ...eye.middle);
      gl.uniform2f(at('whole'), width, height);
    }
    gl.enableVertexAttribArray(0);
    gl.enableVertexAttribArray(1);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 20, 0);
    gl.vertexAttribPointer(1, 2, gl.FLOAT, false, 20, 12);
    for (const one of those) this.drawOne(one);
    gl.disableVertexAttribArray(0);
    gl.disableVertexAttribArray(1);
  }

  private drawOne({camera, place, corners, picture}: Placed): void {
    const {gl} = this;
    const fill = (places: readonly Triple[]) => {
      const spots = [[0, 0], [1, 0], [1, 1], [0, 1]] as const;
      gl.bufferData(gl.ARRAY_BUFFER, Float32Array.from(places.flatMap((p, n) => [...p, ...spots[n % 4]!])), gl.STREAM_DRAW);
    };
    if (picture) {
      gl.useProgram(this.pictures.program);
      gl.activeTexture(gl.TEXTURE0 + kPictureUnit);
      gl.bindTexture(gl.TEXTURE_2D, picture);
      gl.uniform1i(this.pictures.at('picture'), kPictureUnit);
      gl.uniform1f(this.pictures.at('share'), 0.9);
      fill(corners);
      gl.drawArrays(gl.TRIANGLE_FAN, 0, 4);
    }
    gl.useProgram(this.lines.program);
    const ink = this.placed[this.chosen]?.camera === camera ? [0.94, 0.89, 0.26, 1] : camera.role === 'held_out' ? [0.9, 0.62, 0, 0.9] : [0.34, 0.71, 0.91, 0.9];
    gl.uniform4f(this.lines.at('ink'), ...(ink as [number, number, number, number]));
    fill(corners.flatMap((corner, n) => [place, corner, corner, corners[(n + 1) % 4]!]));
    gl.drawArrays(gl.LINES, 0, 16);
  }

  /** The camera whose picture or place is nearest to a pixel, if any is within `reach` pixels; -1 otherwise. */
  at(eye: Eye, x: number, y: number, reach: number): number {
    let best = -1;
    let least = reach;
    this.placed.forEach(({place, corners}, n) => {
      const middle = corners.reduce((sum, corner) => add(sum, corner, 1 / 4), [0, 0, 0] as Triple);
      for (const spot of [place, middle]) {
        const [px, py, far] = seen(eye, spot);
        const away = Math.hypot(px - x, py - y);
        if (far > 0 && away < least) [best, least] = [n, away];
      }
    });
    return best;
  }
}
