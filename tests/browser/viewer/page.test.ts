// SPDX-License-Identifier: Apache-2.0
// The page of `emberlock view`, opened from the disk in a browser.
import {mkdtempSync, rmSync} from 'node:fs';
import {readFile} from 'node:fs/promises';
import {createRequire} from 'node:module';
import {tmpdir} from 'node:os';
import {join} from 'node:path';

import type {Browser, Page} from 'playwright-core';
import {afterAll, beforeAll, expect, test} from 'vitest';

import type {FilmingCamera, View} from '../../../daemon/console/src/viewer/contents';
import {screenshot, startChromium, until} from '../support/chromium';
import {flame, type Made, openMade, sampled} from '../support/viewer_page';

const axe = createRequire(new URL('../../../daemon/console/package.json', import.meta.url)).resolve('axe-core');

const folder = mkdtempSync(join(tmpdir(), 'emberlock-viewer-'));
let browser: Browser;
let places = 0;

beforeAll(async () => { browser = await startChromium(); }, 60_000);
afterAll(async () => {
  await browser.close();
  rmSync(folder, {recursive: true});
});

const open = (volumes: readonly Made[], more = {}) => openMade(browser, join(folder, `${places++}.html`), volumes, more);

/** Red, green and blue of the stage at shares of its width and height. */
function colourAt(page: Page, x: number, y: number): Promise<number[]> {
  return page.evaluate(([across, down]) => {
    const canvas = document.querySelector('canvas')!;
    const pixel = new Uint8Array(4);
    const gl = canvas.getContext('webgl2')!;
    gl.readPixels(Math.floor(across! * canvas.width), Math.floor((1 - down!) * canvas.height), 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    return [...pixel.subarray(0, 3)];
  }, [x, y]);
}

/** How many pixels of the stage aren't black. */
function lit(page: Page): Promise<number> {
  return page.evaluate(() => {
    const canvas = document.querySelector('canvas')!;
    const gl = canvas.getContext('webgl2')!;
    const pixels = new Uint8Array(4 * canvas.width * canvas.height);
    gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    let count = 0;
    for (let at = 0; at < pixels.length; at += 4) if (pixels[at]! + pixels[at + 1]! + pixels[at + 2]! > 6) ++count;
    return count;
  });
}

async function choose(page: Page, quantity: string): Promise<void> {
  await page.getByLabel('What is shown').selectOption(quantity);
  await page.waitForSelector(`canvas[data-shown$=" ${quantity}"]`);
}

/** An even cube of light, its middle half, before and with something that absorbs. */
function cube(density: number): Made {
  const points = [41, 41, 41] as const;
  const inside = (...at: number[]) => at.every(v => Math.abs(v) < 0.5);
  return {points, channels: [
    {name: 'emission', unit: 'grey levels (0..255) per metre', lanes: 3, values: sampled(points, 3, (x, y, z, c) => inside(x, y, z) ? [500, 250, 100][c]! : 0)},
    {name: 'density', unit: '1/m', lanes: 1, values: sampled(points, 1, (x, y, z) => inside(x, y, z) ? density : 0)}]};
}

test('light through an even cube is what the transport equation says, with and without absorption', async () => {
  for (const density of [0, 2, 30]) {
    const {page, complaints} = await open([cube(density)]);
    await page.evaluate(() => {
      const viewer = window.emberlockViewer! as unknown as {orbit: {tilt: number; turn: number}};
      viewer.orbit.tilt = 0;
      window.emberlockViewer!.drawAt(0);
    });
    // 18 edges of full light and, to either side, one in which it and what absorbs fall to nothing: as much as 19 in all.
    const depth = 0.01 * 19;
    const expected = (s: number) => density === 0 ? s * depth : s / density * (1 - Math.exp(-density * depth));
    const colour = await colourAt(page, 0.5, 0.5);
    colour.forEach((value, c) => expect(Math.abs(value - expected([500, 250, 100][c]!)), `${density}: ${colour.join()}`).toBeLessThan(1 + 0.005 * expected([500, 250, 100][c]!)));
    expect(complaints).toEqual([]);
    await page.context().close();
  }
});

test('what is leapt over changes nothing', async () => {
  const {page} = await open([flame(65)]);
  const apart = await page.evaluate(() => {
    const viewer = window.emberlockViewer! as unknown as {stage: {march: {bricks: {most: Float32Array}; over: number}; draw(): number; gl: WebGL2RenderingContext; canvas: HTMLCanvasElement}};
    const {march, gl, canvas} = viewer.stage;
    const pixels = () => {
      viewer.stage.draw();
      const out = new Uint8Array(4 * canvas.width * canvas.height);
      gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, out);
      return out;
    };
    const leaping = pixels();
    march.bricks.most.fill(1);
    march.over = NaN;
    return pixels().map((value, at) => Math.abs(value - leaping[at]!)).reduce((most, value) => Math.max(most, value), 0);
  });
  expect(apart).toBeLessThanOrEqual(1);
  await page.context().close();
});

test('it is turned by mouse, wheel and keys, and looks from the cameras', async () => {
  const red = await (async () => {
    const context = await browser.newContext();
    const page = await context.newPage();
    const uri = await page.evaluate(() => {
      const canvas = document.createElement('canvas');
      Object.assign(canvas, {width: 32, height: 24});
      const context2d = canvas.getContext('2d')!;
      context2d.fillStyle = 'rgb(200, 30, 20)';
      context2d.fillRect(0, 0, 32, 24);
      return canvas.toDataURL('image/png');
    });
    await context.close();
    return uri;
  })();
  const camera = (name: string, role: 'input' | 'held_out', rotation: readonly number[]): FilmingCamera =>
    ({name, role, size: [320, 240], focal: [300, 300], middle: [160, 120], rotation, translation: [0, 0, 1.6]});
  const seen = (error: number): View => ({rmse: [error, error, error], captured: red, rendered: red});
  const cameras = [camera('from x', 'input', [0, 1, 0, 0, 0, -1, -1, 0, 0]), camera('from y', 'held_out', [-1, 0, 0, 0, 0, -1, 0, -1, 0])];
  const {page, complaints} = await open([{...flame(33), views: [seen(1), seen(2)]}, {...flame(17), views: [seen(4), seen(3)]}], {cameras, trace: [{seconds: 1, input: 4, held_out: 5}, {seconds: 2, input: 3, held_out: 4}]});
  const stage = page.locator('canvas.stage');
  const picture = () => stage.evaluate(canvas => (canvas as HTMLCanvasElement).toDataURL());
  let before = await picture();
  const changed = async (words: string) => { before = await until(picture, now => now !== before, words); };
  const box = (await stage.boundingBox())!;
  await page.mouse.move(box.x + 200, box.y + 200);
  await page.mouse.down();
  await page.mouse.move(box.x + 260, box.y + 230, {steps: 4});
  await page.mouse.up();
  await changed('dragged');
  await page.waitForTimeout(300);
  before = await picture();
  for (const key of ['ArrowLeft', 'ArrowUp', '+', '-']) {
    await stage.press(key);
    await changed(key);
  }
  await stage.focus();
  await page.mouse.wheel(0, -200);
  await changed('wheel');
  await page.getByLabel('Cameras and their pictures').uncheck();
  await page.getByLabel('Cameras and their pictures').check();
  expect(await page.getByLabel('View', {exact: true}).inputValue(), 'held-out views come first').toBe('1');
  await page.getByRole('button', {name: 'Look from there'}).click();
  await changed('as the camera does');
  await page.waitForSelector('canvas[data-view="1"]');
  expect(await page.getByText('RMS 2.00 / 2.00 / 2.00').count()).toBe(1);
  await page.getByRole('button', {name: 'See it all'}).click();
  await changed('all');
  // Each frame has its pictures, and a plot tells which is worse.
  await page.getByLabel('Frame of the sequence').press('End');
  await until(() => page.getByText('RMS 3.00 / 3.00 / 3.00').count(), count => count === 1, 'the other frame’s view');
  expect(await page.getByRole('img', {name: 'Error of each frame'}).isVisible()).toBe(true);
  await screenshot(page, 'viewer-cameras', true);
  await page.addScriptTag({path: axe});
  const told = await page.evaluate(async () => {
    const {axe: checker} = window as unknown as {axe: {run(): Promise<{violations: {id: string; nodes: {html: string}[]}[]}>}};
    return (await checker.run()).violations.map(({id, nodes}) => `${id}: ${nodes.map(({html}) => html).join(' ')}`);
  });
  expect(told, 'what axe-core found').toEqual([]);
  expect(complaints).toEqual([]);
  await page.context().close();
});

test('temperatures have a bar in K, isotherms are surfaces and lines, and the pointer reads values', async () => {
  const {page, complaints} = await open([flame(65)]);
  await choose(page, 'temperature');
  expect(await page.locator('.colour-bar .low').textContent()).toMatch(/^1[34]\d\d K$/);
  expect(await page.locator('.colour-bar .high').textContent()).toMatch(/^19\d\d K$|^20\d\d K$/);
  const before = await lit(page);
  const slice = page.locator('canvas.slice').first();
  const white = () => slice.evaluate(canvas => {
    const {width, height} = canvas as HTMLCanvasElement;
    const {data} = (canvas as HTMLCanvasElement).getContext('2d')!.getImageData(0, 0, width, height);
    let count = 0;
    for (let at = 0; at < data.length; at += 4) if (data[at] === 255 && data[at + 1] === 255 && data[at + 2] === 255) ++count;
    return count;
  });
  expect(await white()).toBe(0);
  await page.getByLabel('How many isotherms').fill('2');
  await until(white, count => count > 40, 'isotherms in the slice');
  // Nothing but surfaces: one at each level, none of them where it is colder.
  await page.getByLabel('Opacity', {exact: true}).fill('0');
  await until(() => lit(page), count => count > 0 && count < before, 'isotherms alone in space');
  await screenshot(page, 'viewer-isotherms', true);
  await page.getByLabel('How many isotherms').fill('0');
  await until(() => lit(page), count => count === 0, 'neither opacity nor isotherms: nothing');
  const box = (await slice.boundingBox())!;
  await slice.hover({position: {x: box.width / 2, y: box.height / 2}});
  await until(() => page.locator('.below').textContent(), text => /^1\d\d\d K$|^20\d\d K$/.test(text ?? ''), 'a temperature');
  expect(complaints).toEqual([]);
  await page.context().close();
});

test('a curve says how opaque each value is, by pointer and by keys', async () => {
  const {page, complaints} = await open([flame(33)]);
  await choose(page, 'temperature');
  const before = await lit(page);
  expect(before).toBeGreaterThan(1000);
  const knots = page.locator('.transfer circle');
  expect(await knots.count()).toBe(2);
  expect(await page.locator('.transfer .counts').getAttribute('d'), 'the values are counted').toMatch(/V0\.0H/);
  // Nothing but what is hot: opaque from two thirds on.
  const box = (await page.locator('.transfer').boundingBox())!;
  await page.mouse.move(box.x + box.width * 0.66, box.y + box.height * 0.3);
  await page.mouse.down();
  await page.mouse.move(box.x + box.width * 0.66, box.y + box.height, {steps: 3});
  await page.mouse.up();
  expect(await knots.count()).toBe(3);
  const hot = await until(() => lit(page), count => count < 0.8 * before, 'what is colder is gone');
  expect(hot).toBeGreaterThan(100);
  await screenshot(page, 'viewer-curve');
  await knots.nth(1).press('ArrowUp');
  expect(await knots.nth(1).getAttribute('aria-valuetext')).toBe('5 %');
  await until(() => lit(page), count => count > hot, 'a little of it is back');
  await knots.nth(1).press('Delete');
  await knots.nth(0).press('Insert');
  expect(await knots.count()).toBe(3);
  await page.getByRole('button', {name: 'Straight'}).click();
  await until(() => lit(page), count => count === before, 'as in the beginning');
  expect(complaints).toEqual([]);
  await page.context().close();
});

test('the frames of a sequence are gone through, and keep what is chosen', async () => {
  const {page, complaints} = await open([4, 5, 7].map(frame => ({...flame(17 + frame), frame})));
  const label = page.locator('.player .label');
  expect(await label.textContent()).toBe('frame 4');
  await choose(page, 'temperature');
  await page.getByLabel('Frame of the sequence').press('End');
  await until(() => label.textContent(), text => text === 'frame 7', 'the last one');
  expect(await page.locator('canvas.stage').getAttribute('data-shown')).toBe('2 temperature');
  await page.getByRole('button', {name: 'Play'}).click();
  await until(() => label.textContent(), text => text === 'frame 4', 'it begins again');
  await until(() => label.textContent(), text => text === 'frame 5', 'it goes on');
  await page.getByRole('button', {name: 'Pause'}).click();
  expect(complaints).toEqual([]);
  await page.context().close();
});

test('screenshots and turntable videos are files', async () => {
  const {page, complaints} = await open([flame(33)]);
  const [shot] = await Promise.all([page.waitForEvent('download'), page.getByRole('button', {name: 'Screenshot'}).click()]);
  const png = await readFile(await shot.path());
  expect(png.subarray(1, 4).toString()).toBe('PNG');
  const size = await page.locator('canvas.stage').evaluate(canvas => [(canvas as HTMLCanvasElement).width, (canvas as HTMLCanvasElement).height]);
  expect([png.readUInt32BE(16), png.readUInt32BE(20)]).toEqual(size);
  const [film] = await Promise.all([page.waitForEvent('download'), page.getByRole('button', {name: 'Turntable video'}).click()]);
  const video = await readFile(await film.path());
  expect(video.length).toBeGreaterThan(5000);
  expect(film.suggestedFilename()).toMatch(/^emberlock\.(mp4|webm)$/);
  // It plays, and shows more than one picture.
  const played = await page.evaluate(async ([type, base64]) => {
    const element = document.createElement('video');
    element.muted = true;
    element.src = `data:video/${type!};base64,${base64!}`;
    await new Promise((resolve, reject) => { element.onloadeddata = resolve; element.onerror = reject; });
    return [element.videoWidth, element.videoHeight];
  }, [film.suggestedFilename().split('.')[1]!, video.toString('base64')]);
  expect(played.map((length, n) => Math.abs(length - size[n]!) <= 1)).toEqual([true, true]);
  expect(complaints).toEqual([]);
  await page.context().close();
});

test('a damaged page says so', async () => {
  const made = flame(17);
  const {page} = await open([made], {version: 2 as 1});
  expect(await page.locator('.fault').textContent()).toMatch(/format 2/);
  await page.context().close();
});
