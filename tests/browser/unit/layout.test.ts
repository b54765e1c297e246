// SPDX-License-Identifier: Apache-2.0
import {expect, test} from 'vitest';

import {bestColumns} from '../../../daemon/console/src/cameras';
import {gaugePlace} from '../../../daemon/console/src/overlay';

test('the number of columns that leaves the largest pictures', () => {
  expect(bestColumns(12, 1490, 940, 4 / 3)).toBe(4);
  expect(bestColumns(12, 1490, 940, 16 / 9)).toBe(4);
  expect(bestColumns(2, 1490, 940, 16 / 9)).toBe(2);
  expect(bestColumns(2, 700, 1400, 16 / 9)).toBe(1);
  expect(bestColumns(1, 100, 100, 1)).toBe(1);
});

test('no other number of columns leaves larger ones', () => {
  const picture = (columns: number, cells: number, width: number, height: number, aspect: number) =>
    Math.min((width - 8 * (columns - 1)) / columns, ((height - 8 * (Math.ceil(cells / columns) - 1)) / Math.ceil(cells / columns) - 96) * aspect);
  for (const cells of [1, 3, 5, 8, 12, 17]) {
    for (const [width, height] of [[1490, 940], [900, 690], [2400, 1300]] as const) {
      const chosen = picture(bestColumns(cells, width, height, 16 / 9), cells, width, height, 16 / 9);
      for (let columns = 1; columns <= cells; ++columns) expect(chosen).toBeGreaterThanOrEqual(picture(columns, cells, width, height, 16 / 9));
    }
  }
});

test('the needle stands at the edge of the band at one tolerance, and stays in sight', () => {
  expect(gaugePlace(100, 100)).toBeCloseTo(1 / 3);
  expect(gaugePlace(-50, 100)).toBeCloseTo(-1 / 6);
  expect(gaugePlace(9000, 100)).toBe(0.95);
  expect(gaugePlace(-9000, 100)).toBe(-0.95);
});
