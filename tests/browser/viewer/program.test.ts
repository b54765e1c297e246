// SPDX-License-Identifier: Apache-2.0
// What `emberlock view` writes shows what `emberlock render` renders.
import {execFileSync} from 'node:child_process';
import {mkdtempSync, readFileSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';

import type {Browser} from 'playwright-core';
import {afterAll, beforeAll, expect, test} from 'vitest';

import {decode, inflated, readContents} from '../../../daemon/console/src/viewer/contents';
import {startChromium} from '../support/chromium';
import {kPrograms, openFile} from '../support/viewer_page';

const folder = mkdtempSync(join(tmpdir(), 'emberlock-view-'));
const volume = join(folder, 'flame/truth/frame-0000.vdb');
const emberlock = (...words: string[]) => execFileSync(join(kPrograms, 'emberlock'), words, {stdio: ['ignore', 'pipe', 'ignore']}).toString();
let browser: Browser;

beforeAll(async () => {
  emberlock('simulate', 'flame', '--out', join(folder, 'flame'), '--frames', '1', '--cells', '16', '--image', '64x64', '--rig', 'virtual:3');
  browser = await startChromium();
});
afterAll(async () => {
  await browser.close();
  rmSync(folder, {recursive: true});
});

/** The page's channels, all values, from its text. */
async function channelsOf(page: string): Promise<Map<string, Float32Array>> {
  const html = readFileSync(page, 'utf8');
  const told = readContents(/id="emberlock-result">(.*?)<\/script>/s.exec(html)![1]!);
  const blocks = [...html.matchAll(/class="emberlock-block">(.*?)<\/script>/gs)].map(found => found[1]!);
  const [frame] = told.frames;
  return new Map(await Promise.all(frame!.channels.map(async channel =>
    [channel.name, decode(frame!.points, channel, await inflated(blocks[channel.block]!))] as const)));
}

test('halves are within their bound of what float32 holds', async () => {
  emberlock('view', volume, '--out', join(folder, 'half.html'));
  emberlock('view', volume, '--float32', '--out', join(folder, 'whole.html'));
  const [half, whole] = [await channelsOf(join(folder, 'half.html')), await channelsOf(join(folder, 'whole.html'))];
  expect([...whole.keys()]).toEqual(expect.arrayContaining(['emission', 'density', 'temperature']));
  for (const [name, values] of whole) {
    const largest = values.reduce((most, value) => Math.max(most, Math.abs(value)), 0);
    expect(largest, name).toBeGreaterThan(0);
    values.forEach((value, at) => {
      const apart = Math.abs(half.get(name)![at]! - value);
      if (apart > Math.max(2 ** -11 * Math.abs(value), 2 ** -39 * largest)) throw new Error(`${name}: ${value} became ${half.get(name)![at]!}`);
    });
  }
});

test('a camera’s picture is the one that emberlock render makes, within one grey level at 9999 of 10000 values', async () => {
  const from = [0.12, -0.19, 0.06];
  const {page, complaints} = await openFile(browser, join(folder, 'half.html'));
  const frame = readContents(await page.locator('#emberlock-result').textContent() ?? '').frames[0]!;
  const middle = frame.points.map((n, axis) => frame.origin[axis]! + frame.edge * (n - 1) / 2);
  emberlock('render', volume, '--out', join(folder, 'picture'), '--camera', from.join(), '--look-at', middle.join(), '--image', '320x240', '--device', 'cpu');
  const png = readFileSync(join(folder, 'picture/frame-0000.png')).toString('base64');
  const apart = await page.evaluate(async ([picture, place]) => {
    const image = new Image();
    image.src = `data:image/png;base64,${picture as string}`;
    await image.decode();
    const canvas = Object.assign(document.createElement('canvas'), {width: 320, height: 240});
    const context = canvas.getContext('2d')!;
    context.drawImage(image, 0, 0);
    const rendered = context.getImageData(0, 0, 320, 240).data;
    const viewer = window.emberlockViewer! as unknown as {orbit: {from(place: unknown): void; distance: number; about: number[]}; stage: {canvas: HTMLCanvasElement; gl: WebGL2RenderingContext; draw(): void}};
    const {orbit, stage} = viewer;
    orbit.from(place);
    orbit.distance = Math.hypot(...(place as number[]).map((v, axis) => v - orbit.about[axis]!));
    stage.canvas.style.cssText = 'width: 320px; height: 240px; min-height: 0';
    stage.draw();
    const shown = new Uint8Array(4 * 320 * 240);
    stage.gl.readPixels(0, 0, 320, 240, stage.gl.RGBA, stage.gl.UNSIGNED_BYTE, shown);
    let [off, sum, brightest] = [0, 0, 0];
    for (let y = 0; y < 240; ++y) for (let x = 0; x < 320; ++x) for (let c = 0; c < 3; ++c) {
      const value = rendered[4 * (x + 320 * y) + c]!;
      const away = Math.abs(value - shown[4 * (x + 320 * (239 - y)) + c]!);
      if (away > 1) ++off;
      [sum, brightest] = [sum + away * away, Math.max(brightest, value)];
    }
    return {off: off / (3 * 320 * 240), rms: Math.sqrt(sum / (3 * 320 * 240)), brightest};
  }, [png, from]);
  expect(apart.brightest).toBeGreaterThan(60);
  // Both take their samples at the same places, but where a ray's length is all but a whole number of steps, which rounding tells.
  expect(apart.off).toBeLessThan(1e-4);
  expect(apart.rms).toBeLessThan(0.1);
  expect(complaints).toEqual([]);
  await page.context().close();
});
