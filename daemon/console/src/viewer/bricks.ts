// SPDX-License-Identifier: Apache-2.0
// Where a volume is empty: what the march leaps over.
import type {Triple} from './contents';

/** Cells along a brick's edge. Its values are those of its key points, also of the far side's, which the next bricks share. */
export const kCells = 4;

export interface Bricks {
  size: Triple;
  most: Float32Array;  // the largest value at any of a brick's key points
}

/** The largest of `value(point)` in each brick. */
export function bricksOf([nx, ny, nz]: Triple, value: (point: number) => number): Bricks {
  const size = [nx, ny, nz].map(n => Math.max(1, Math.ceil((n - 1) / kCells))) as [number, number, number];
  const most = new Float32Array(size[0] * size[1] * size[2]).fill(-Infinity);
  // A point on the border of two bricks counts in both.
  const homes = [nx, ny, nz].map((n, axis) => Array.from({length: n}, (_, at) => {
    const high = Math.min(size[axis]! - 1, Math.floor(at / kCells));
    return at % kCells === 0 && at > 0 ? [Math.floor(at / kCells) - 1, high] : [high, high];
  }));
  for (let k = 0, point = 0; k < nz; ++k) {
    for (let j = 0; j < ny; ++j) {
      for (let i = 0; i < nx; ++i, ++point) {
        const v = value(point);
        const [x, y, z] = [homes[0]![i]!, homes[1]![j]!, homes[2]![k]!];
        for (let c = z[0]!; c <= z[1]!; ++c) {
          for (let b = y[0]!; b <= y[1]!; ++b) {
            for (let a = x[0]!; a <= x[1]!; ++a) {
              const at = a + size[0] * (b + size[1] * c);
              if (v > most[at]!) most[at] = v;
            }
          }
        }
      }
    }
  }
  return {size, most};
}

/** For each brick how many bricks away the next one is that has more than `over`, along the farthest axis: 0 for such ones themselves,
 *  at most 255. Exact: three passes, each of which looks along one axis (the maximum norm separates). */
export function emptiness({size, most}: Bricks, over: number): Uint8Array {
  let away = Uint8Array.from(most, value => value > over ? 0 : 255);
  const steps = [1, size[0], size[0] * size[1]];
  size.forEach((length, axis) => {
    const step = steps[axis]!;
    const next = new Uint8Array(away.length);
    for (let at = 0; at < away.length; ++at) {
      const place = Math.floor(at / step) % length;
      let nearest = away[at]!;
      for (let far = 1; far < nearest; ++far) {
        if (place - far >= 0) nearest = Math.min(nearest, Math.max(far, away[at - far * step]!));
        if (place + far < length) nearest = Math.min(nearest, Math.max(far, away[at + far * step]!));
        if (place - far < 0 && place + far >= length) break;
      }
      next[at] = nearest;
    }
    away = next;
  });
  return away;
}

/** The lowest and highest corner of all bricks that have more than `over`, in cells. */
export function filledPart({size, most}: Bricks, over: number): readonly [Triple, Triple] | undefined {
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  most.forEach((value, brick) => {
    if (!(value > over)) return;
    [brick % size[0], Math.floor(brick / size[0]) % size[1], Math.floor(brick / (size[0] * size[1]))].forEach((at, axis) => {
      low[axis] = Math.min(low[axis]!, kCells * at);
      high[axis] = Math.max(high[axis]!, kCells * (at + 1));
    });
  });
  return low[0] === Infinity ? undefined : [low as unknown as Triple, high as unknown as Triple];
}
