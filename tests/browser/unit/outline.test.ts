// SPDX-License-Identifier: Apache-2.0
// Where a region of the volume lies in a view's picture.
import {expect, test} from 'vitest';

import {edgesOf, ellipses, project} from '../../../daemon/console/src/stylize/outline';

// At the origin, along z, 100 pixels focal length, its axis at (50, 40).
const kCamera = [100, 0, 50, 0, 0, 100, 40, 0, 0, 0, 1, 0];

test('a place is where a pinhole sees it, and nowhere behind it', () => {
  expect(project([1, 2, 10], kCamera)).toEqual({x: 60, y: 60});
  expect(project([1, 2, -10], kCamera)).toBeUndefined();
});

test('a box has twelve edges, each as long as its side at its distance', () => {
  const edges = edgesOf({center: [0, 0, 10], size: [2, 4, 10]}, kCamera);
  expect(edges).toHaveLength(12);
  const along = edges.slice(0, 4).map(([a, b]) => b!.x - a!.x);  // those along x, at z = 5 and 15
  expect(along.filter(length => Math.abs(length - 2 * 100 / 5) < 1e-9)).toHaveLength(2);
  expect(along.filter(length => Math.abs(length - 2 * 100 / 15) < 1e-9)).toHaveLength(2);
});

test('a section of an ellipsoid is closed and lies on it', () => {
  const [, , across] = ellipses({center: [0, 0, 10], size: [2, 4, 6]}, kCamera);  // at z = 10
  expect(across!.at(-1)!.x).toBeCloseTo(across![0]!.x, 9);
  for (const {x, y} of across!) expect(((x - 50) / 10) ** 2 + ((y - 40) / 20) ** 2).toBeCloseTo(1, 9);
});
