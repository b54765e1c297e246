// SPDX-License-Identifier: Apache-2.0
// The flame's volume as it is solved, to be turned: by the march of `emberlock view`. It is loaded when the first volume comes.
import {el} from './dom';
import {heat} from './layers';
import type {Triple} from './viewer/contents';
import {Orbit} from './viewer/eye';
import type {GridPlace} from './viewer/march';
import {Stage} from './viewer/stage';
import type {Volume} from './wire';

type Stop = readonly [number, readonly [number, number, number]];  // brightness of a voxel, 0..255; red, green, blue
const kGlow: readonly Stop[] = [[0, [0, 0, 0]], [40, [89, 5, 5]], [110, [230, 77, 5]], [190, [255, 191, 51]], [255, [255, 255, 217]]];

function glow(value: number): number[] {
  const next = Math.max(1, kGlow.findIndex(([at]) => value <= at));
  const [[low, from], [high, to]] = [kGlow[next - 1]!, kGlow[next]!];
  return from.map((channel, c) => Math.round(channel + (value - low) / (high - low) * (to[c]! - channel)));
}

const kPalettes = {
  glow: Array.from({length: 256}, (_, value) => [...glow(value), value]),
  grey: Array.from({length: 256}, (_, value) => [value, value, value, value]),
  heat: Array.from({length: 256}, (_, value) => [...heat(value), 255]),
};
// Optical depth along the longest edge. What is measured shows the colours of what lies in front rather than all light along a ray.
const kClear = 24;
const kDense = 120;

export class VolumeView {
  private readonly canvas = el('canvas');
  private readonly stage = new Stage(this.canvas, new Orbit([0, 0, 0], [0, 0, 1], 1));
  private size = '';
  private shown?: Parameters<VolumeView['show']>;

  constructor(container: HTMLElement) {
    container.append(this.canvas);
    this.stage.renewed = () => { if (this.shown) this.show(...this.shown); };
  }

  /** Its brightness, grey or as a flame glows, through red and orange to nearly white; or what is `measured`, as opaque as it is bright. */
  show(header: Volume, bytes: Uint8Array, grey: boolean, measured?: Uint8Array): void {
    this.shown = [header, bytes, grey, measured];
    const {nx, ny, nz} = header;
    const many = nx * ny * nz;
    if (bytes.length !== many * (1 + (header.layers ?? []).length)) throw new Error(`a volume of ${nx} x ${ny} x ${nz} voxels with ${bytes.length} bytes`);
    const brightness = bytes.subarray(0, many);
    const size = (header.box?.size ?? [1, 1, 1]) as unknown as Triple;
    const center = (header.box?.center ?? [0, 0, 0]) as unknown as Triple;
    const edge = size[0] / nx;
    const grid: GridPlace = {points: [nx, ny, nz], edge, origin: [0, 1, 2].map(axis => center[axis]! - (size[axis]! - edge) / 2) as unknown as Triple};
    const {march} = this.stage;
    march.setPalette(measured ? kPalettes.heat : grey ? kPalettes.grey : kPalettes.glow);
    if (measured) march.setQuantity(grid, Float32Array.from(measured), voxel => brightness[voxel]! / 255);
    else march.setQuantity(grid, Float32Array.from(brightness));
    this.stage.look = {mode: 'quantity', low: 0, high: 255, depth: measured ? kDense : kClear, levels: []};
    // The operator's view stays from iteration to iteration, and from frame to frame.
    const key = JSON.stringify([size, center]);
    if (key !== this.size) {
      this.size = key;
      this.stage.orbit = new Orbit(center, [0, 0, 1], Math.hypot(...size) / 2);
      this.stage.orbit.zoom(1.2);
    }
    this.stage.draw();
  }

  /** By degrees, around the upright axis and over it. */
  turn(azimuth: number, elevation: number): void {
    this.stage.move(azimuth, elevation, 1);
  }
}
