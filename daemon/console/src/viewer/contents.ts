// SPDX-License-Identifier: Apache-2.0
// What a page of `emberlock view` holds, as report/viewer_page.h writes it: a header in JSON, and blocks of values.

export type Triple = readonly [number, number, number];

/** A quantity at every key point. Its block: a bit for each brick of 8 x 8 x 8 points (x fastest, lowest bit first), then the values of
 *  those whose bit is set, as planes of bytes, the lowest byte of all first; half or float32 times `scale`. */
export interface Channel {
  name: string;
  unit: string;
  lanes: 1 | 3;
  type: 'half' | 'float32';
  scale: number;
  block: number;
}

export interface Frame {
  frame: number | null;  // of a sequence
  points: Triple;        // along x, y, z
  edge: number;          // from point to point, metres
  origin: Triple;        // of point (0, 0, 0), metres
  channels: Channel[];
  views: View[];         // of each camera, or none
}

/** What a camera saw of a frame. Pictures are data: addresses of one size. */
export interface View {
  rmse: Triple | null;  // grey levels
  captured: string | null;
  rendered: string | null;
}

/** A pinhole with OpenCV's axes: x right, y down, z forward. */
export interface FilmingCamera {
  name: string;
  role: 'input' | 'held_out';
  size: readonly [number, number];
  focal: readonly [number, number];   // pixels
  middle: readonly [number, number];
  rotation: readonly number[];        // of camera from world, row by row
  translation: Triple;
}

export interface TracePoint {
  seconds: number;
  input: number;
  held_out: number | null;
}

export interface Contents {
  version: 1;
  title: string;
  input: string;
  up: Triple;
  frames: Frame[];
  cameras: FilmingCamera[];
  trace: TracePoint[];
}

export const kBrick = 8;
export const kDifferenceGain = 4;

export function readContents(text: string): Contents {
  const told = JSON.parse(text) as Contents;
  if (told.version !== 1) throw new Error(`this page's volume has format ${String(told.version)}, which this viewer can't read`);
  if (told.frames.length === 0) throw new Error('this page holds no volume');
  return told;
}

/** Every half as a number: 65536 of them, made once. */
const halves = (() => {
  let table: Float32Array | undefined;
  return (): Float32Array => table ??= Float32Array.from({length: 65536}, (_, bits) => {
    const sign = bits & 0x8000 ? -1 : 1;
    const exponent = bits >> 10 & 31;
    const fraction = bits & 1023;
    if (exponent === 31) return fraction ? NaN : sign * Infinity;
    return exponent === 0 ? sign * fraction * 2 ** -24 : sign * (1 + fraction / 1024) * 2 ** (exponent - 15);
  });
})();

/** The planes of bytes put together: values in this machine's memory, all of which are little-endian where browsers run. */
function gathered(planes: Uint8Array, count: number, width: number): Uint8Array {
  const out = new Uint8Array(count * width);
  for (let byte = 0; byte < width; ++byte) {
    for (let at = 0, from = byte * count, to = byte; at < count; ++at, ++from, to += width) out[to] = planes[from]!;
  }
  return out;
}

/** The values of a channel at all points, x fastest, lanes interleaved, from its block when that is inflated. */
export function decode(points: Triple, channel: Channel, block: Uint8Array): Float32Array {
  const [nx, ny, nz] = points;
  const [bx, by, bz] = points.map(n => Math.ceil(n / kBrick)) as [number, number, number];
  const width = channel.type === 'half' ? 2 : 4;
  const filled: number[] = [];
  for (let brick = 0; brick < bx * by * bz; ++brick) if (block[brick >> 3]! >> (brick & 7) & 1) filled.push(brick);
  const mask = Math.ceil(bx * by * bz / 8);
  const inBrick = kBrick ** 3 * channel.lanes;
  const count = filled.length * inBrick;
  if (block.length !== mask + count * width) throw new Error(`the values of ${channel.name} are damaged: ${block.length} bytes instead of ${mask + count * width}`);
  const bytes = gathered(block.subarray(mask), count, width);
  const table = halves();
  const values = channel.type === 'half' ? Float32Array.from(new Uint16Array(bytes.buffer), bits => table[bits]!) : new Float32Array(bytes.buffer);
  const out = new Float32Array(nx * ny * nz * channel.lanes);
  filled.forEach((brick, place) => {
    const [i0, j0, k0] = [brick % bx, Math.floor(brick / bx) % by, Math.floor(brick / (bx * by))].map(b => kBrick * b) as [number, number, number];
    const row = Math.min(kBrick, nx - i0) * channel.lanes;
    for (let k = 0; k < Math.min(kBrick, nz - k0); ++k) {
      for (let j = 0; j < Math.min(kBrick, ny - j0); ++j) {
        const from = place * inBrick + (j + kBrick * k) * kBrick * channel.lanes;
        out.set(values.subarray(from, from + row), (i0 + nx * (j0 + j + ny * (k0 + k))) * channel.lanes);
      }
    }
  });
  if (channel.type === 'half' && channel.scale !== 1) for (let at = 0; at < out.length; ++at) out[at]! *= channel.scale;
  return out;
}

/** Base64 of zlib's format, as blocks stand in the page. */
export async function inflated(base64: string): Promise<Uint8Array> {
  const letters = atob(base64.trim());
  const bytes = new Uint8Array(letters.length);
  for (let at = 0; at < letters.length; ++at) bytes[at] = letters.charCodeAt(at);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** A frame's values by the channel's name. */
export type Values = Map<string, Float32Array>;

export async function readFrame(frame: Frame, block: (index: number) => string): Promise<Values> {
  const read = frame.channels.map(async channel => [channel.name, decode(frame.points, channel, await inflated(block(channel.block)))] as const);
  return new Map(await Promise.all(read));
}
