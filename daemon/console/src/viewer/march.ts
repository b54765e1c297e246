// SPDX-License-Identifier: Apache-2.0
// What is drawn of a volume and how: what every renderer has in common.
import {type Bricks, bricksOf, emptiness, filledPart} from './bricks';
import type {Triple} from './contents';
import {type Eye, seen} from './eye';

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

/** What a ray gathers: light alone, or with what is lost of it; a quantity alone, or with its isotherms. */
export type Kind = 'light' | 'absorbed' | 'quantity' | 'surfaces';
export const kKinds: readonly Kind[] = ['light', 'absorbed', 'quantity', 'surfaces'];

/** Of a picture: left, top, width and height, pixels. */
export type Part = readonly [number, number, number, number];

/** Vectors of four that a shader is told: see asTold(). */
export const kTold = 10;

export abstract class March {
  private grid: GridPlace = {points: [2, 2, 2], edge: 1, origin: [0, 0, 0]};
  private bricks?: Bricks;
  private absorbs = false;
  private scale: readonly number[] = [1, 1, 1, 1];
  private unit = 1;  // of a quantity's values
  private over = NaN;
  private filled?: readonly [Triple, Triple];  // the corners of what isn't empty, in voxel edges
  /** Voxel edges from sample to sample, as `emberlock reconstruct --step` has it. */
  stride = 1;

  abstract readonly name: string;
  /** The colours of a quantity, from its lowest to its highest: red, green, blue and opacity of 256 values, 0..255. */
  abstract setPalette(palette: readonly (readonly number[])[]): void;
  protected abstract setValues(points: Triple, lanes: 2 | 3 | 4, texels: Float32Array): void;
  /** For each brick how many away the next is that isn't empty. */
  protected abstract setEmptiness(size: Triple, away: Uint8Array): void;
  /** Light over what comes through of the picture at hand. */
  protected abstract paint(kind: Kind, told: Float32Array, part: Part, width: number, height: number): void;

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
    this.grid = grid;
    this.bricks = bricksOf(grid.points, most);
    this.over = NaN;
    this.setValues(grid.points, lanes, texels);
  }

  /** Over what is in the picture already. */
  draw(eye: Eye, look: Look, width: number, height: number): void {
    if (!this.bricks) return;
    this.leapOver(look);
    const part = this.partOf(eye, width, height);
    if (!part) return;
    const kind = look.mode === 'colour' ? (this.absorbs ? 'absorbed' : 'light') : look.levels.length > 0 ? 'surfaces' : 'quantity';
    this.paint(kind, this.asTold(eye, look, height), part, width, height);
  }

  /** In this order: the eye's place, and the picture's rows; right, and the stride; down; forward; focal lengths and principal point;
   *  key points; bricks; what values are times; low, high and depth, or brightness; isotherms, beyond all values where they aren't used. */
  private asTold(eye: Eye, look: Look, rows: number): Float32Array {
    const {grid, unit} = this;
    const place = [0, 1, 2].map(axis => (eye.place[axis]! - grid.origin[axis]!) / grid.edge);
    const low = look.mode === 'colour' ? look.gain : look.low / unit;
    const [high, depth, levels] = look.mode === 'colour' ? [0, 0, []] : [Math.max(look.high / unit, low + 1e-6), look.depth / Math.max(...grid.points), look.levels];
    return Float32Array.from([
      ...place, rows, ...eye.right, this.stride, ...eye.down, 0, ...eye.forward, 0, ...eye.focal, ...eye.middle, ...grid.points, 0, ...this.bricks!.size, 0,
      ...this.scale, low, high, depth, 0, ...[0, 1, 2, 3].map(n => (levels[n] ?? 1e30) / unit)]);
  }

  /** Left, top, width and height of the picture's part in which what isn't empty is seen. */
  private partOf(eye: Eye, width: number, height: number): Part | undefined {
    if (!this.filled) return undefined;
    const {grid, filled} = this;
    const corners = Array.from({length: 8}, (_, n) =>
      seen(eye, [0, 1, 2].map(axis => grid.origin[axis]! + grid.edge * filled[n >> axis & 1]![axis]!) as unknown as Triple));
    if (corners.some(([, , far]) => far <= 0)) return [0, 0, width, height];
    const [left, right, top, bottom] = [Math.min(...corners.map(([x]) => x)), Math.max(...corners.map(([x]) => x)), Math.min(...corners.map(([, y]) => y)), Math.max(...corners.map(([, y]) => y))];
    const within = (value: number, most: number) => Math.max(0, Math.min(most, value));
    const [x0, x1] = [within(Math.floor(left) - 1, width), within(Math.ceil(right) + 1, width)];
    const [y0, y1] = [within(Math.floor(top) - 1, height), within(Math.ceil(bottom) + 1, height)];
    return x1 > x0 && y1 > y0 ? [x0, y0, x1 - x0, y1 - y0] : undefined;
  }

  /** Where there is no light, or where nothing is above what is shown. */
  private leapOver(look: Look): void {
    const over = look.mode === 'colour' ? 0 : Math.max(0, Math.min(look.low, ...look.levels)) / this.unit;
    if (over === this.over) return;
    this.over = over;
    this.filled = filledPart(this.bricks!, over);
    this.setEmptiness(this.bricks!.size, emptiness(this.bricks!, over));
  }
}

/** Of values that are told, which are above 0; 0 of none. */
export function largest(values: Float32Array): number {
  let most = 0;
  for (const value of values) if (value > most) most = value;
  return most;
}
