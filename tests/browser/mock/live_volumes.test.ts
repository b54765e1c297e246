// SPDX-License-Identifier: Apache-2.0
// Live volumes of a recording: asked for with it, and shown with their delay.
import type {Page} from 'playwright-core';
import {expect, test} from 'vitest';

import type {LiveStatus} from '../../../daemon/console/src/api.gen';
import {bench, kPhone, kSizes, overflows, text} from './bench';
import {flameVolume} from './pictures';
import {capturing, idle, locked, reconstruction} from './scene';
import {screenshot, until} from '../support/chromium';

const rig = bench();
const session = capturing(0).recording!.session;
const seen = (page: Page, edge: number) => page.waitForSelector(`.volume[data-voxels="${edge ** 3}"]`);

/** Of a volume whose frame was filmed so many seconds ago. */
function live(ago: number, change: Partial<LiveStatus> = {}): LiveStatus {
  const filmed = Number(process.hrtime.bigint()) - 1e9 * ago;
  return {session, state: 'RUNNING', reason: '', every: 0, voxels: 48, device: 'cuda', volumes: 11, skipped: 109, without_flame: 0, frame: 120, filmed_ns: filmed,
          delay_s: ago, takes_s: 0.41, keeps_up: true, holds_every: 10, holds_voxels: 0, ...change};
}
/** As the daemon tells of a volume: its numbers, then its voxels. */
function volume(frame: number, edge: number): void {
  rig.mock.tell({iteration: {reconstruction: `${session} live`, frame: String(frame), camera_id: '', iteration: {iteration: 1, seconds: 0.41, input_rmse: 0}, live_delay_s: 0.9}});
  const {header, bytes} = flameVolume(edge);
  rig.mock.tellBytes(header, bytes);
}

test('the newest volume is shown, how old it is, what it takes and what was skipped', async () => {
  rig.mock.status = {...capturing(5), live: live(0.9)};
  const page = await rig.open();
  volume(120, 12);
  await seen(page, 12);
  await until(() => text(page, '.live-age'), words => /^frame 120, [0-9]+\.[0-9] s ago$/.test(words), 'the delay');
  rig.mock.show({live: live(0.9)});
  await until(() => text(page, '.live-age'), words => /^frame 120, (0\.9|1\.[0-9]) s ago$/.test(words), 'the delay now');
  expect(await text(page, '.live-volumes .live-effort')).toBe('0.41 s a volume of 48 voxels · on cuda · 11 shown, 109 skipped (they are recorded)');
  expect(await text(page, '#reconstruction header .word')).toBe('live');
  expect(await page.locator('#reconstruction .pair').isVisible()).toBe(false);
  rig.mock.show({live: live(3)});
  await until(() => text(page, '.live-age'), words => /^frame 120, 3\.[0-9] s ago$/.test(words), 'it grows old');
  volume(130, 13);
  await seen(page, 13);
  await page.locator('#reconstruction').scrollIntoViewIfNeeded();
  await screenshot(page, 'live-volumes');
});

test.each([
  ['does not keep up', {keeps_up: false, reason: 'Doesn\'t keep up: a volume of 48 voxels takes 0.41 s. --every 10 or --voxels 32 would hold.'}, 'live, does not keep up'],
  ['is paused', {state: 'PAUSED' as const, reason: 'The recording goes first: its fullest queue is at 40 %.'}, 'live, paused'],
  ['was stopped', {state: 'STOPPED' as const, reason: 'Stopped for the rest of the recording, which lost 1 frame to too much work.'}, 'live, stopped'],
  ['failed', {state: 'FAILED' as const, reason: 'Its process was killed: most likely the memory ran out.'}, 'live, failed'],
])('one that %s says why', async (_, change, word) => {
  rig.mock.status = {...capturing(5), live: live(0.9, change)};
  const page = await rig.open();
  await until(() => text(page, '#reconstruction header .word'), words => words === word, word);
  expect(await text(page, '.live-reason')).toBe(change.reason);
});

test('it stays when the recording has ended, with the delay that it had, until something is reconstructed', async () => {
  rig.mock.status = {...capturing(5), live: live(0.9)};
  const page = await rig.open();
  volume(120, 12);
  await seen(page, 12);
  rig.mock.show({...locked(), live: live(0.9, {state: 'ENDED', filmed_ns: 0})});
  await until(() => text(page, '.live-age'), words => words === 'frame 120, 0.9 s after it was filmed', 'its delay');
  rig.mock.show({reconstruction: reconstruction(2)});
  await page.locator('.live-volumes').waitFor({state: 'hidden'});
  await page.locator('#reconstruction .pair').waitFor();
});

test('a browser that comes between two volumes is told without one', async () => {
  rig.mock.status = {...capturing(1), live: live(0, {state: 'STARTING', frame: undefined, volumes: 0, skipped: 0, device: ''})};
  const page = await rig.open();
  await until(() => text(page, '#reconstruction header .word'), words => words === 'live, no volume yet', 'it starts');
  expect(await page.locator('.live-age').innerText()).toBe('');
});

test('a recording is asked for with live volumes, each frame of so many and voxels', async () => {
  rig.mock.status = locked();
  const page = await rig.open();
  await page.locator('#record summary').click();
  expect(await page.getByLabel('Each frame of so many').isVisible()).toBe(false);
  await page.getByLabel('Live volumes').check();
  await page.getByLabel('Each frame of so many').fill('0');
  await page.locator('button.record').click();
  expect(await page.getByLabel('Each frame of so many').evaluate((input: HTMLInputElement) => input.validationMessage)).not.toBe('');
  expect(rig.mock.calls.filter(({method}) => method === 'Capture/Record')).toEqual([]);
  await page.getByLabel('Each frame of so many').fill('12');
  await page.getByLabel('Voxels').fill('64');
  await page.locator('button.record').click();
  const asked = await until(async () => rig.mock.calls.find(({method}) => method === 'Capture/Record')?.request, request => request !== undefined, 'it is asked for');
  expect(asked).toMatchObject({live: {every: 12, voxels: 64}});
});

test('without the switch none are asked for', async () => {
  rig.mock.status = locked();
  const page = await rig.open();
  await page.locator('button.record').click();
  const asked = await until(async () => rig.mock.calls.find(({method}) => method === 'Capture/Record')?.request, request => request !== undefined, 'it is asked for');
  expect(asked).not.toHaveProperty('live');
});

test.each([kSizes[1], kPhone])('fits at $width x $height', async size => {
  rig.mock.status = {...idle(), ...capturing(5), live: live(0.9, {keeps_up: false, reason: 'Doesn\'t keep up: a volume of 48 voxels takes 0.41 s, and each 6 frames are asked for. --every 10 or --voxels 32 would hold.'})};
  const page = await rig.open(size);
  await page.waitForSelector('.live-reason');
  await page.locator('#record summary').click();
  await page.getByLabel('Live volumes').check();
  expect(await overflows(page)).toBe(0);
});
