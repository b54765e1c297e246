// SPDX-License-Identifier: Apache-2.0
import {expect, test} from 'vitest';

import {heat, kHeat, voxelsOf} from '../../../daemon/console/src/layers';
import {responseOf} from '../../../daemon/console/src/quantity_choice';
import type {Volume} from '../../../daemon/console/src/wire';

const volume = (nx: number, ny: number, nz: number): Volume => ({kind: 'volume', nx, ny, nz, brightest: 1});

test('colours go from dark to bright, through those of the bar', () => {
  expect(heat(0)).toEqual(kHeat[0]);
  expect(heat(255)).toEqual(kHeat.at(-1));
  const light = Array.from({length: 256}, (_, value) => heat(value)).map(([r, g, b]) => 0.2126 * r + 0.7152 * g + 0.0722 * b);
  for (let value = 1; value < 256; ++value) expect(light[value]).toBeGreaterThan(light[value - 1]! - 0.6);
});

test('a layer’s voxels follow those of the brightness', () => {
  const bytes = Uint8Array.from([1, 2, 3, 4, 5, 6]);
  expect([...voxelsOf(volume(2, 1, 1), bytes, 0)]).toEqual([3, 4]);
  expect([...voxelsOf(volume(2, 1, 1), bytes, 1)]).toEqual([5, 6]);
});

test('a response.json is read, and what is none is not', () => {
  const text = (change: object) => JSON.stringify({unit: 'levels (0..255) per W / (sr m2)', wavelength_nm: [500, 600], r: [0, 1], g: [1, 0], b: [0, 0], ...change});
  expect(responseOf(text({comment: 'mine'}))).toEqual({wavelength_nm: [500, 600], r: [0, 1], g: [1, 0], b: [0, 0], absolute: true});
  expect(responseOf(text({unit: 'relative'}))?.absolute).toBe(false);
  for (const wrong of ['', '[]', 'null', text({r: 'red'}), text({g: [1, 'x']}), text({unit: undefined}), text({unit: 'levels per W'})]) expect(responseOf(wrong)).toBeUndefined();
});
