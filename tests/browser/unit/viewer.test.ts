// SPDX-License-Identifier: Apache-2.0
import {expect, test} from 'vitest';

import {bricksOf, emptiness, filledPart, kCells} from '../../../daemon/console/src/viewer/bricks';
import {difference, errorOf} from '../../../daemon/console/src/viewer/compare';
import {type Channel, decode, type FilmingCamera, type Frame, inflated, type Triple} from '../../../daemon/console/src/viewer/contents';
import {cross, dot, eyeOf, Orbit, placeOf, seen} from '../../../daemon/console/src/viewer/eye';
import {usualRange} from '../../../daemon/console/src/viewer/quantities';
import {words} from '../../../daemon/console/src/viewer/slices';
import {histogram, type Knot, moved, opacityAt} from '../../../daemon/console/src/viewer/transfer';
import {packed} from '../support/viewer_page';

const points: Triple = [11, 19, 9];
const channel = (lanes: 1 | 3, type: 'half' | 'float32', scale = 1): Channel => ({name: 'emission', unit: '', lanes, type, scale, block: 0});

test('float32 comes back to the bit, also -0 and what is smallest', () => {
  for (const lanes of [1, 3] as const) {
    const values = new Float32Array(lanes * 11 * 19 * 9);
    for (let at = 5; at < values.length; at += 7) values[at] = Math.sin(at) * 2 ** (at % 60 - 30);
    values[3] = -0;
    values[4] = 2 ** -149;
    const back = decode(points, channel(lanes, 'float32'), packed(points, lanes, values));
    expect(new Uint32Array(back.buffer)).toEqual(new Uint32Array(values.buffer));
  }
});

test('all halves are read as IEEE 754 has them', () => {
  // One brick of 8 x 8 x 8: its 512 values, 128 times.
  const size: Triple = [8, 8, 8];
  for (let first = 0; first < 65536; first += 512) {
    const block = new Uint8Array(1 + 1024);
    block[0] = 1;
    for (let at = 0; at < 512; ++at) [block[1 + at], block[513 + at]] = [(first + at) & 255, (first + at) >> 8];
    const values = decode(size, channel(1, 'half', 4), block);
    for (let at = 0; at < 512; ++at) {
      const [exponent, fraction] = [(first + at) >> 10 & 31, (first + at) & 1023];
      if (exponent === 31) continue;
      const expected = 4 * (exponent === 0 ? fraction / 2 ** 24 : 2 ** (exponent - 25) * (1024 + fraction)) * ((first + at) & 0x8000 ? -1 : 1);
      expect(values[at]).toBe(expected);
    }
  }
});

test('a block that was cut is refused', async () => {
  const block = packed(points, 1, new Float32Array(11 * 19 * 9).fill(1));
  expect(() => decode(points, channel(1, 'float32'), block.subarray(0, block.length - 1))).toThrow(/emission are damaged/);
  await expect(inflated('AAAA')).rejects.toThrow();
});

test('bricks know the largest value at any of their points, and how far the next one is', () => {
  const size: Triple = [21, 14, 30];
  const value = (point: number) => point % 389 === 7 && point > 4000 ? point : 0;
  const bricks = bricksOf(size, value);
  expect(bricks.size).toEqual([5, 4, 8]);
  const expected = Array.from({length: 160}, (_, brick) => {
    const low = [brick % 5, Math.floor(brick / 5) % 4, Math.floor(brick / 20)].map(b => kCells * b);
    let most = 0;
    for (let k = low[2]!; k <= Math.min(29, low[2]! + kCells); ++k) for (let j = low[1]!; j <= Math.min(13, low[1]! + kCells); ++j) for (let i = low[0]!; i <= Math.min(20, low[0]! + kCells); ++i) {
      most = Math.max(most, value(i + 21 * (j + 14 * k)));
    }
    return most;
  });
  expect([...bricks.most]).toEqual(expected);
  const away = emptiness(bricks, 0);
  const at = (brick: number) => [brick % 5, Math.floor(brick / 5) % 4, Math.floor(brick / 20)];
  const full = expected.flatMap((most, brick) => most > 0 ? [at(brick)] : []);
  expect(full.length).toBeGreaterThan(5);
  expected.forEach((_, brick) => {
    const nearest = Math.min(...full.map(other => Math.max(...at(brick).map((b, axis) => Math.abs(b - other[axis]!)))));
    expect(away[brick]).toBe(nearest);
  });
  expect(Math.min(...emptiness(bricks, 1e9))).toBe(255);
  expect(filledPart(bricks, 1e9)).toBeUndefined();
  const of = (pick: (...values: number[]) => number) => [0, 1, 2].map(axis => pick(...full.map(brick => brick[axis]!)));
  expect(filledPart(bricks, 0)).toEqual([of(Math.min).map(at => kCells * at), of(Math.max).map(at => kCells * (at + 1))]);
});

test('an orbit is upright and looks at its middle, whatever is up', () => {
  for (const up of [[0, 0, 1], [0, -1, 0], [1, 0, 0]] as const) {
    const orbit = new Orbit([1, 2, 3], up, 0.5);
    for (const tilt of [-200, 30, 300]) {
      orbit.by(50, tilt);
      const eye = orbit.eye(640, 480);
      const [x, y, far] = seen(eye, [1, 2, 3]);
      expect([x, y, far].map(v => Math.round(1e6 * v) / 1e6)).toEqual([320, 240, 1.6]);
      expect(dot(eye.right, up)).toBeCloseTo(0, 9);
      expect(dot(eye.down, up)).toBeLessThan(0);
      expect(cross(eye.right, eye.down).map((v, axis) => v - eye.forward[axis]!).every(v => Math.abs(v) < 1e-9)).toBe(true);
    }
    orbit.from(orbit.eye(10, 10).place);
    expect(orbit.tilt).toBeCloseTo(89, 6);
  }
});

test('a filming camera’s eye sees what it saw where it saw it', () => {
  const camera = {name: '', role: 'input', size: [320, 240], focal: [300, 310], middle: [150, 130], rotation: [0, -1, 0, 0, 0, -1, 1, 0, 0], translation: [0.1, 0.2, 1.5]} as const;
  expect(placeOf(camera).map(v => Math.round(1e9 * v) / 1e9)).toEqual([-1.5, 0.1, 0.2]);
  const world: Triple = [0.2, 0.05, -0.1];
  const [x, y, z] = [-world[1] + 0.1, -world[2] + 0.2, world[0] + 1.5];
  const [px, py] = [300 * x / z + 150, 310 * y / z + 130];
  const shown = seen(eyeOf(camera, 960, 480), world);
  expect(shown[0]).toBeCloseTo(480 + 2 * (px - 160), 6);
  expect(shown[1]).toBeCloseTo(2 * py, 6);
});

test('few stray values don’t set the colours, and words have the digits that matter', () => {
  const values = new Float32Array(1000).fill(1500);
  values.set([9000, 1, 0, -5]);
  values.fill(1700, 500);
  expect(usualRange(values)).toEqual([1500, 1700]);
  expect(usualRange(new Float32Array(4))).toEqual([0, 1]);
  expect([words(1873.4, 'K'), words(12.345, 'K'), words(0.01234, '1/m'), words(0, 'K')]).toEqual(['1873 K', '12.3 K', '0.0123 1/m', '0 K']);
  expect([...difference(Uint8ClampedArray.from([10, 0, 200, 255]), Uint8ClampedArray.from([0, 5, 20, 255]), 4)]).toEqual([40, 20, 255, 255]);
});

test('a curve of opacity goes straight from knot to knot, which keep their order, and all values in range are counted', () => {
  const knots: Knot[] = [[0, 0.25], [0.5, 1], [0.5, 0], [1, 0.5]];
  expect([0, 0.25, 0.5, 0.75, 1].map(x => opacityAt(knots, x))).toEqual([0.25, 0.625, 1, 0.25, 0.5]);
  expect(moved(knots, 1, [0.9, 2])[1]).toEqual([0.5, 1]);
  expect(moved(knots, 1, [-1, 0.5])[1]).toEqual([0, 0.5]);
  expect([moved(knots, 0, [0.3, 0])[0], moved(knots, 3, [0.3, 0])[3]]).toEqual([[0, 0], [1, 0]]);
  expect(histogram(Float32Array.from([0, 1, 1.4, 2, 3, 3.1, NaN]), 1, 3, 2)).toEqual([2, 2]);
});

test('a frame’s error is the mean square of its views’ by role, of those that are told', () => {
  const cameras = ['input', 'held_out', 'input', 'input'].map(role => ({role}) as FilmingCamera);
  const rmse: (Triple | null)[] = [[3, 0, 0], [1, 2, 2], null, [0, 3, 0]];
  const frame = {views: rmse.map(one => ({rmse: one, captured: null, rendered: null}))} as Frame;
  expect(errorOf(frame, cameras, 'input')).toBeCloseTo(Math.sqrt(3), 12);
  expect(errorOf(frame, cameras, 'held_out')).toBeCloseTo(Math.sqrt(3), 12);
  expect(errorOf({views: [] as Frame['views']} as Frame, cameras, 'input')).toBeNull();
});
