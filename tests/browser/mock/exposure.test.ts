// SPDX-License-Identifier: Apache-2.0
// A camera enlarged: how its picture is exposed and focused.
import type {Page} from 'playwright-core';
import {describe, expect, test} from 'vitest';

import {exposureAdvice, marks, measure} from '../../../daemon/console/src/exposure';
import {bench, drawn, text} from './bench';
import {noLamp} from './faulty';
import {paint} from './pictures';
import {idle} from './scene';
import {screenshot, until} from '../support/chromium';

const rig = bench();

/** A grey picture of these levels. */
function picture(width: number, height: number, level: (x: number, y: number) => number): Uint8ClampedArray {
  const rgba = new Uint8ClampedArray(4 * width * height);
  for (let at = 0; at < width * height; ++at) rgba.fill(level(at % width, Math.floor(at / width)), 4 * at, 4 * at + 3);
  return rgba;
}

describe('figures of a picture', () => {
  test('every pixel is in one bin; clipped and dark ones are counted', () => {
    const f = measure(picture(40, 30, (x, y) => (y < 3 ? 255 : y < 9 ? 0 : 100 + (x % 2))), 40, 30);
    expect(f.bins.reduce((sum, part) => sum + part, 0)).toBeCloseTo(1);
    expect(f.clipped).toBeCloseTo(0.1);
    expect(f.dark).toBeCloseTo(0.2);
    expect(f.bins[63]).toBeCloseTo(0.1);
    expect(f.bins[0]).toBeCloseTo(0.2);
    expect(f.bins[25]).toBeCloseTo(0.7);
    expect([100, 101]).toContain(f.median);
    expect(f.brightest).toBe(255);
  });

  test('one colour at its end is clipped, though the grey level isn’t', () => {
    const rgba = picture(40, 30, () => 0);
    for (let at = 0; at < rgba.length; at += 4) rgba[at] = 255;
    expect(measure(rgba, 40, 30).clipped).toBe(1);
  });

  test('sharpness falls as a disk is blurred, and doesn’t heed the exposure', () => {
    const disk = (blur: number, gain: number) => measure(picture(80, 60, (x, y) => gain / (1 + Math.exp((Math.hypot(x - 40, y - 30) - 12) / blur))), 80, 60).sharpness;
    expect(disk(0.5, 200)).toBeGreaterThan(1.3 * disk(1, 200));
    expect(disk(1, 200)).toBeGreaterThan(1.3 * disk(2, 200));
    expect(disk(1, 60)).toBeCloseTo(disk(1, 240), 2);
    expect(disk(1, 0)).toBe(0);
  });

  test('advice: the lamp first, then what is clipped, then what is dark', () => {
    const f = {bins: [], clipped: 0, dark: 0.9, median: 3, brightest: 20, sharpness: 0.1};
    expect(exposureAdvice(f, true)).toMatch(/^Too dark for the lamp: expose for longer/);
    expect(exposureAdvice(f, false)).toMatch(/^Dark: expose for longer/);
    expect(exposureAdvice({...f, brightest: 255, clipped: 0.1}, false)).toMatch(/clipped: expose for a shorter time/);
    expect(exposureAdvice({...f, brightest: 200}, false)).toMatch(/^Nothing is clipped/);
  });

  test('marks cover what is clipped or dark, and leave all else alone', () => {
    const drawing = marks(picture(60, 60, (_, y) => (y < 20 ? 255 : y < 40 ? 120 : 0)), 60, 60);
    const marked = (from: number, to: number) => Array.from({length: 60 * (to - from)}, (_, at) => drawing[4 * (60 * from + at) + 3]!).filter(alpha => alpha > 0).length / (60 * (to - from));
    expect(marked(0, 20)).toBeCloseTo(0.5);
    expect(marked(20, 40)).toBe(0);
    expect(marked(40, 60)).toBeGreaterThan(0.01);
    expect(marked(40, 60)).toBeLessThan(0.1);
  });
});

describe('enlarged', () => {
  const number = (words: string, pattern: RegExp) => Number(pattern.exec(words)?.[1]);
  const focus = async (page: Page) => number(await text(page, '.focus'), /(\d+) %/);

  test('histogram, marks and focus follow the live picture; the lamp comes first', async () => {
    const [bright, dim, blurred] = await paint(rig.browser, 3, (context, at) => {
      context.fillStyle = ['#303030', '#000', '#303030'][at]!;
      context.fillRect(0, 0, 640, 480);
      context.filter = at === 2 ? 'blur(12px)' : 'none';
      context.fillStyle = at === 1 ? '#181818' : '#fff';
      context.fillRect(240, 160, 160, 160);  // a twelfth of the picture
      context.filter = 'none';
    });
    let shown = bright;
    rig.mock.jpeg = () => shown;
    rig.mock.status = idle();
    const page = await rig.open();
    await drawn(page, 1);
    await page.locator('.tile').nth(2).press('Enter');
    const words = () => text(page, '.exposure-words');
    const clipped = async () => number(await words(), /Clipped ([\d.]+) %/);
    await until(clipped, part => part > 7.5 && part < 9, 'a twelfth is clipped');
    expect(await text(page, '.exposure-advice')).toContain('shorter time');
    await until(() => focus(page), part => part === 100, 'it is the best seen');
    const alpha = (x: number, y: number) => page.locator('.enlarged .marks').evaluate((canvas, [px, py]) => {
      const {data} = (canvas as HTMLCanvasElement).getContext('2d')!.getImageData(px - 6, py - 6, 12, 12);
      return data.filter((_, at) => at % 4 === 3 && data[at]! > 0).length / 144;
    }, [x, y] as const);
    expect(await alpha(240, 180)).toBeCloseTo(0.5, 1);
    expect(await alpha(60, 60)).toBe(0);
    await screenshot(page, 'exposure-1600');
    shown = blurred;
    await until(() => focus(page), part => part < 60, 'it is out of focus');
    shown = dim;
    await until(clipped, part => part === 0, 'nothing is clipped');
    expect(await text(page, '.exposure-advice')).toMatch(/^Dark:/);
    expect(await page.locator('.histogram').getAttribute('aria-label')).toMatch(/^Histogram: Clipped 0 %, dark 92 %/);
    await page.locator('#exposure-marks').uncheck();
    expect(await page.locator('.enlarged .marks').isVisible()).toBe(false);
    rig.mock.show(noLamp());
    await until(() => text(page, '.lamp-advice'), now => now.startsWith('Make the lamp visible: expose for longer, up to the whole frame (41.7 ms),'), 'advice');
    await until(() => text(page, '.exposure-advice'), now => now.startsWith('Too dark for the lamp'), 'and what this picture is');
    await screenshot(page, 'exposure-no-lamp-1600');
  });
});
