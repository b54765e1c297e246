// SPDX-License-Identifier: Apache-2.0
import {expect, test} from 'vitest';

import {arrange, pictureIn} from '../../../daemon/console/src/arrange';
import {gaugePlace} from '../../../daemon/console/src/overlay';

test('columns, and words below or beside, that leave the largest pictures', () => {
  expect(arrange(12, 1490, 940, 4 / 3)).toEqual({columns: 3, beside: true});
  expect(arrange(1, 700, 700, 4 / 3)).toEqual({columns: 1, beside: false});
  expect(arrange(2, 1490, 500, 16 / 9)).toEqual({columns: 2, beside: false});
  expect(arrange(2, 700, 1400, 16 / 9)).toEqual({columns: 1, beside: false});
  expect(arrange(1, 100, 100, 1)).toEqual({columns: 1, beside: false});
});

test('no other arrangement leaves pictures a third wider, and the chosen one fills its tile', () => {
  for (const cells of [1, 3, 5, 8, 12]) {
    for (const [width, height] of [[1490, 940], [1180, 640], [930, 510], [2400, 1300]] as const) {
      const inTile = (columns: number, beside: boolean) => {
        const rows = Math.ceil(cells / columns);
        return pictureIn((width - 8 * (columns - 1)) / columns, (height - 8 * (rows - 1)) / rows, 4 / 3, beside);
      };
      const {columns, beside} = arrange(cells, width, height, 4 / 3);
      const chosen = inTile(columns, beside);
      expect(chosen.fills, `${cells} in ${width} x ${height}`).toBeGreaterThan(0.65);
      for (let other = 1; other <= 8; ++other) for (const way of [false, true]) expect(1.34 * chosen.width).toBeGreaterThanOrEqual(inTile(other, way).width);
    }
  }
});

test('the needle stands at the edge of the band at one tolerance, and stays in sight', () => {
  expect(gaugePlace(100, 100)).toBeCloseTo(1 / 3);
  expect(gaugePlace(-50, 100)).toBeCloseTo(-1 / 6);
  expect(gaugePlace(9000, 100)).toBe(0.95);
  expect(gaugePlace(-9000, 100)).toBe(-0.95);
});
