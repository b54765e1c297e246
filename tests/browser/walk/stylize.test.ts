// SPDX-License-Identifier: Apache-2.0
// A recorded flame is edited in the page before emberlockd: what is drawn is seen in the volume, and what is finished replays. How long a
// step takes to be seen is printed, never asked for.
import {execFileSync} from 'node:child_process';
import {existsSync, readFileSync} from 'node:fs';
import {fileURLToPath} from 'node:url';

import type {Browser, Page} from 'playwright-core';
import {afterAll, beforeAll, expect, test} from 'vitest';

import {openPage, screenshot, startChromium, until} from '../support/chromium';
import {Daemon, virtualRig} from '../support/daemon';

const kBuild = fileURLToPath(new URL('../../../build/release', import.meta.url));
const kConsole = process.env.EMBERLOCK_CONSOLE ?? `${kBuild}/console`;
const kBin = process.env.EMBERLOCK_BIN ?? `${kBuild}/bin`;
const kVoxels = Number(process.env.EMBERLOCK_VOXELS ?? 64);

const daemon = new Daemon();
const figures: Record<string, string> = {};
let browser: Browser;
let page: Page;

/** Presses at the first of these parts of the picture's width and height, and goes to the others. */
async function stroke(...at: [number, number][]): Promise<void> {
  const box = (await page.locator('#stylization .pad').boundingBox())!;
  const places = at.map(([x, y]) => [box.x + x * box.width, box.y + y * box.height] as const);
  await page.mouse.move(...places[0]!);
  await page.mouse.down();
  for (const place of places.slice(1)) await page.mouse.move(...place, {steps: 3});
  await page.mouse.up();
}
const steps = (): Promise<number> => page.locator('.stylized').getAttribute('data-steps').then(Number);
const seen = (many: number): Promise<number> => until(steps, now => now === many, `the picture shows ${many} steps`);
const waits = (): Promise<string> => until(() => page.locator('#stylization .word').innerText(), words => words.startsWith('waits'), 'it waits for a step');
/** Of the volume as it is seen in the middle, where the strokes are: the mean of its grey levels. */
const light = (): Promise<number> => page.locator('.stylized').evaluate(element => {
  const canvas = element as HTMLCanvasElement;
  const {data} = canvas.getContext('2d')!.getImageData(0.46 * canvas.width, 0.4 * canvas.height, 0.08 * canvas.width, 0.2 * canvas.height);
  return data.reduce((sum, value, at) => sum + (at % 4 < 3 ? value : 0), 0) / (0.75 * data.length);
});

beforeAll(async () => {
  if (!existsSync(`${kBin}/emberlockd`)) throw new Error(`${kBin}/emberlockd is not there: build it, or name its folder in EMBERLOCK_BIN`);
  await daemon.start(kBin, kConsole, virtualRig('virtual cameras', 11, '640x480'));
  await until(async () => (await daemon.status()).phase, phase => phase === 'IDLE', 'the rig is idle');
  await daemon.call('Capture/Record', {name: 'candle', unlocked: true, seconds: 2});
  await until(async () => (await daemon.status()).phase, phase => phase === 'IDLE', 'it is recorded');
  // Cameras that are drawn take the processor from what is measured.
  await daemon.end();
  await daemon.start(kBin, kConsole, virtualRig('virtual cameras', 1, '64x48'), kVoxels);
  browser = await startChromium();
  page = (await openPage(browser, daemon.url, {width: 1600, height: 1000})).page;
  await page.goto(daemon.link());
});
afterAll(async () => {
  await browser?.close();
  await daemon.stop();
  console.log(Object.entries(figures).map(([name, value]) => `${name.padEnd(40)} ${value}`).join('\n'));
});

test('a frame is reconstructed, and waits to be edited', async () => {
  await page.getByRole('button', {name: 'Stylize candle'}).click();
  await page.waitForSelector('#stylization .stylized[data-steps="0"]');
  await waits();
  await page.locator('#stylization').evaluate(section => section.scrollIntoView());
});

test('a stroke is seen in the volume, and undone it is gone', async () => {
  const before = await light();
  await page.getByLabel('Radius').fill('30');
  await page.getByLabel('Strength').fill('250');
  await stroke([0.48, 0.4], [0.52, 0.6]);
  await seen(1);
  await waits();
  const brighter = await light();
  expect(brighter).toBeGreaterThan(1.02 * before);
  await page.getByRole('button', {name: 'Undo'}).click();
  await seen(0);
  await waits();
  expect(Math.abs(await light() - before)).toBeLessThan(0.25 * (brighter - before));
});

test('how long it takes from the pointer\'s release to the picture that shows the step', async () => {
  await page.evaluate(() => {
    const times: number[] = [];
    let released = 0;
    let steps = document.querySelector<HTMLElement>('.stylized')!.dataset.steps;
    document.querySelector('#stylization .pad')!.addEventListener('pointerup', () => { released = performance.now(); }, {capture: true});
    new MutationObserver(() => {
      const now = document.querySelector<HTMLElement>('.stylized')!.dataset.steps;
      if (now === steps) return;
      steps = now;
      requestAnimationFrame(() => times.push(performance.now() - released));
    }).observe(document.querySelector('.stylized')!, {attributes: true, attributeFilter: ['data-steps']});
    Object.assign(window, {stepTimes: times});
  });
  const times = () => page.evaluate(() => (window as unknown as {stepTimes: number[]}).stepTimes);
  for (const whileItWorks of [false, true]) {
    const from = (await times()).length;
    const first = await steps();
    for (let at = 0; at < 9; ++at) {
      if (!whileItWorks) await waits();
      await stroke([0.45 + 0.01 * at, 0.5], [0.46 + 0.01 * at, 0.5]);
      await seen(first + at + 1);
    }
    const sorted = (await until(times, list => list.length >= from + 9, 'all are seen')).slice(from).sort((a, b) => a - b);
    figures[`step to picture, ${whileItWorks ? 'while passes go on' : 'when it waits'}`] = `${Math.round(sorted[4]!)} ms, at most ${Math.round(sorted.at(-1)!)} (${kVoxels} voxels, 11 x 640 x 480)`;
  }
  for (let at = await steps(); at > 0; --at) {
    await page.getByRole('button', {name: 'Undo'}).click();
    await seen(at - 1);
  }
});

test('a ball is put into all views, and what is finished replays', async () => {
  await page.locator('.tool-choice label', {hasText: 'Object'}).click();
  const png = await page.evaluate(() => {
    const canvas = document.createElement('canvas');
    canvas.width = canvas.height = 128;
    const context = canvas.getContext('2d')!;
    const ball = context.createRadialGradient(64, 64, 30, 64, 64, 62);
    ball.addColorStop(0, 'rgb(90 90 90)');
    ball.addColorStop(0.9, 'rgb(220 220 220)');
    ball.addColorStop(1, 'rgb(220 220 220 / 0%)');
    context.fillStyle = ball;
    context.fillRect(0, 0, 128, 128);
    return canvas.toDataURL().split(',')[1]!;
  });
  await page.getByLabel('Picture', {exact: true}).setInputFiles({name: 'ball.png', mimeType: 'image/png', buffer: Buffer.from(png, 'base64')});
  await page.waitForSelector('.tool button.primary:not(:disabled)');
  await page.getByLabel('Scale').fill('0.7');
  await page.getByRole('button', {name: 'Put into all 11 views'}).click();
  await seen(11);
  await waits();
  await screenshot(page, 'stylization');
  await page.getByRole('button', {name: 'Finish'}).click();
  const {result} = (await until(() => daemon.status(), ({reconstruction}) => reconstruction?.state !== 'RUNNING', 'it is written')).reconstruction!;
  expect(existsSync(`${result}/volume.vdb`)).toBe(true);
  const edits = JSON.parse(readFileSync(`${result}/edits.json`, 'utf8')) as {steps: {op: string; file?: string}[]};
  expect(edits.steps.filter(({op}) => op === 'object').map(({file}) => file)).toEqual(Array.from({length: 11}, () => expect.stringMatching(/^objects\/given-[0-9a-f]{16}\.png$/)));
  const again = `${daemon.folder}/again`;
  execFileSync(`${kBin}/emberlock`, ['stylize', `${daemon.folder}/sessions/candle`, '--device', 'cpu', '--edits', `${result}/edits.json`, '--out', again]);
  for (const view of ['0000', '0005']) expect(readFileSync(`${again}/views/${view}.png`).equals(readFileSync(`${result}/views/${view}.png`)), view).toBe(true);
});
