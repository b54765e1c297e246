// SPDX-License-Identifier: Apache-2.0
// A flame on a marker in live pictures: the built page before emberlockd, whose camera replays a recording of a marker with truth
// (tests/support/marker_session). Times are printed, never asked for.
import {execFileSync} from 'node:child_process';
import {existsSync, readFileSync} from 'node:fs';
import {fileURLToPath} from 'node:url';

import type {Browser, Page} from 'playwright-core';
import {afterAll, afterEach, beforeAll, expect, test} from 'vitest';

import {unpack, type Picture} from '../../../daemon/console/src/wire';
import {openPage, screenshot, startChromium, until, type Watched} from '../support/chromium';
import {Daemon} from '../support/daemon';
import {number} from '../support/shown';

const kBuild = fileURLToPath(new URL('../../../build/release', import.meta.url));
const kConsole = process.env.EMBERLOCK_CONSOLE ?? `${kBuild}/console`;
const kBin = process.env.EMBERLOCK_BIN ?? `${kBuild}/bin`;
const kSeconds = 120;  // of the recording: a busy machine takes its time until the flame is shown

const daemon = new Daemon();
const figures: Record<string, string> = {};
/** Pictures as they came, by the frame's number. */
const came: {header: Picture; jpeg: Uint8Array}[] = [];
let truth: [number, number, number, number][];
let browser: Browser;
let watched: Watched;
let page: Page;
let failed = false;
const told = () => page.locator('.live-flame .told').innerText();

beforeAll(async () => {
  for (const program of ['emberlockd', 'marker_session']) {
    if (!existsSync(`${kBin}/${program}`)) throw new Error(`${kBin}/${program} is not there: build it, or name its folder in EMBERLOCK_BIN`);
  }
  execFileSync(`${kBin}/marker_session`, [daemon.folder, String(kSeconds)], {stdio: 'inherit'});
  truth = JSON.parse(readFileSync(`${daemon.folder}/truth.json`, 'utf8')) as typeof truth;
  browser = await startChromium();
  await daemon.start(kBin, kConsole, `[rig.replay]\nsession = "${daemon.folder}/film"\n[[rig.camera]]\ndriver = "replay"\n`);
  watched = await openPage(browser, daemon.url, {width: 1600, height: 900});
  page = watched.page;
  page.on('websocket', socket => socket.on('framereceived', ({payload}) => {
    if (typeof payload === 'string') return;
    const bytes = Uint8Array.from(payload);
    const [header, jpeg] = unpack(bytes.buffer);
    if (header.kind === 'picture') came.push({header, jpeg});
  }));
  await page.goto(daemon.link());
});
afterEach(({task}) => { failed ||= task.result?.state === 'fail'; });
afterAll(async () => {
  if (failed && page) await screenshot(page, 'failed');
  await browser?.close();
  await daemon.stop();
  console.log(failed ? `emberlockd said last:\n${daemon.log.split('\n').slice(-40).join('\n')}` : Object.entries(figures).map(([name, value]) => `${name.padEnd(40)} ${value}`).join('\n'));
});

/** Of a picture: how many pixels are redder than blue, as nothing else in the grey film is; their middle, and how low they reach. */
async function flameIn(jpeg: Uint8Array): Promise<{count: number; x: number; lowest: number}> {
  return page.evaluate(async data => {
    const bitmap = await createImageBitmap(new Blob([Uint8Array.from(atob(data), letter => letter.charCodeAt(0))]));
    const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d')!;
    context.drawImage(bitmap, 0, 0);
    const {data: bytes} = context.getImageData(0, 0, bitmap.width, bitmap.height);
    const seen = {count: 0, x: 0, lowest: 0};
    for (let at = 0; at < bytes.length; at += 4) {
      if (bytes[at]! - bytes[at + 2]! < 90) continue;
      seen.count += 1;
      seen.x += (at / 4) % bitmap.width;
      seen.lowest = Math.floor(at / 4 / bitmap.width);
    }
    return {...seen, x: seen.x / Math.max(1, seen.count)};
  }, Buffer.from(jpeg).toString('base64'));
}

test('before: the camera is live, as it films', async () => {
  await page.locator('.tile[data-camera=hand]').click();
  await until(() => came.length, pictures => pictures > 3, 'pictures come');
  expect((await flameIn(came.at(-1)!.jpeg)).count).toBe(0);
});

test('the flame stands on the marker, and follows it', async () => {
  await page.getByText('Flame on a marker').click();
  await page.getByLabel('Result').selectOption({label: 'candle: middle frame'});
  await page.getByLabel('Number').fill('7');
  await page.getByLabel('Flame’s size').fill('0.5');
  await screenshot(page, 'live-flame-form');
  await page.getByRole('button', {name: 'Show the flame'}).click();
  await until(told, words => words.includes('Marker found'), 'the marker is found');
  came.length = 0;
  await until(() => came.length, pictures => pictures > 36, 'pictures come');
  const markers: number[] = [];
  for (const {header, jpeg} of came.filter((_, at) => at % 6 === 0)) {
    const flame = await flameIn(jpeg);
    // Which frames come is up to the machine: each is held against the truth of its own frame. The flame's middle is near 4 cm above the marker.
    const [x, y, middleX] = truth[header.frame_id]!;
    expect(flame.count, `frame ${header.frame_id}`).toBeGreaterThan(300);
    expect(Math.abs(flame.x - middleX), `on the marker in frame ${header.frame_id}`).toBeLessThan(4);
    expect(Math.abs(flame.lowest - y), `above the marker in frame ${header.frame_id}`).toBeLessThan(25);
    markers.push(x);
  }
  expect(Math.max(...markers) - Math.min(...markers), 'the marker moved').toBeGreaterThan(15);
  // What is on the screen is what came.
  const seen = await page.locator('.enlarged .picture canvas').first().evaluate((canvas: HTMLCanvasElement) => {
    const {data} = canvas.getContext('2d')!.getImageData(0, 0, canvas.width, canvas.height);
    let count = 0;
    for (let at = 0; at < data.length; at += 4) count += data[at]! - data[at + 2]! < 90 ? 0 : 1;
    return {count, width: canvas.width};
  });
  expect(seen.count).toBeGreaterThan(300);
  expect(seen.width).toBe(640);
  await screenshot(page, 'live-flame');
});

test('how fast, and how late', async () => {
  await until(async () => number((await told()).split('·')[1] ?? ''), rate => rate > 0, 'its rate is known');
  const {ar} = await daemon.status();
  const shown = await page.evaluate(() => window.emberlockDiagnostics.summary());
  figures['pictures with the flame'] = `${ar!.rate_hz.toFixed(1)} a second, ${(1000 * ar!.delay_s).toFixed(0)} ms after their frame came; residual ${ar!.residual_px.toFixed(3)} px`;
  figures['on the screen'] = `${shown.fps_mean.toFixed(1)} a second, frame to screen ${shown.latency_median_ms.toFixed(0)} ms (95 %: ${shown.latency_p95_ms.toFixed(0)} ms)`;
});

test('another marker is asked for: the page says what lies there instead', async () => {
  await page.getByRole('button', {name: 'Stop the flame'}).click();
  await page.getByLabel('Dictionary').selectOption('5X5_50');
  await page.getByRole('button', {name: 'Show the flame'}).click();
  await until(told, words => words.includes('instead there is a marker of 4X4_50, number 7'), 'it is named');
  await page.getByRole('button', {name: 'Stop the flame'}).click();
  await until(() => page.locator('.live-flame .told').isVisible(), shown => !shown, 'it has ended');
  came.length = 0;
  await until(() => came.length, pictures => pictures > 3, 'pictures come');
  expect((await flameIn(came.at(-1)!.jpeg)).count, 'plain again').toBe(0);
  expect(watched.complaints).toEqual([]);
});
