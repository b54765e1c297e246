// SPDX-License-Identifier: Apache-2.0
// A sequence of frames: chosen, followed while it is reconstructed, and played.
import type {Page} from 'playwright-core';
import {describe, expect, test} from 'vitest';

import {bench, kPhone, kSizes, overflows, text} from './bench';
import {Refusal} from './mock';
import {flameVolume, hotFlameVolume} from './pictures';
import {idle, iteration, locked, sequence} from './scene';
import {screenshot, until} from '../support/chromium';
import type {Layer} from '../../../daemon/console/src/wire';

const rig = bench();
const entry = {session: 'candle 1', state: 'COMPLETE' as const, purpose: 'flame', created_utc: '2026-11-22T03:15:00Z', cameras: 11, frames: 22000, lost: 0, bytes: 14.6e9, error: '', calibrated: true};
const frame = 'Frame of candle 1 to reconstruct';
const last = 'Last frame of candle 1 to reconstruct, of several';
const every = 'Of candle 1, each frame of so many';

/** The daemon's answer for a frame: volumes of so many voxels along an edge, so that each can be told. */
function volume(edge: number, {header, bytes} = flameVolume(edge)) {
  const {nx, ny, nz, box, brightest, layers = []} =
    header as {nx: number; ny: number; nz: number; box: {center: number[]; size: number[]}; brightest: number; layers?: Layer[]};
  const part = (at: number) => Buffer.from(bytes.subarray(at * edge ** 3, (at + 1) * edge ** 3)).toString('base64');
  return {volume: {nx, ny, nz, box, brightest, voxels: part(0), layers: layers.map((layer, at) => ({...layer, voxels: part(at + 1)}))}};
}
const edgeOf = (at: number) => 8 + (at - 10) / 2;
function serveFrames(): void {
  rig.mock.answers['Reconstruct/Frame'] = request => {
    expect(request.reconstruction).toBe('s1');
    if (request.frame === 14) throw new Refusal(404, 'NOT_FOUND', 'frame: it is no longer held.');
    const edge = edgeOf(request.frame!);
    return volume(edge, request.frame === 12 ? hotFlameVolume(false, edge) : undefined);  // of one a temperature is known
  };
}
const fetched = () => rig.mock.calls.filter(({method}) => method === 'Reconstruct/Frame').map(({request}) => request.frame);
const seen = (page: Page, edge: number) => page.waitForSelector(`.volume[data-voxels="${edge ** 3}"]`);
const live = (edge: number) => {
  const {header, bytes} = flameVolume(edge);
  rig.mock.tellBytes(header, bytes);
};

describe('chosen', () => {
  async function start(page: Page, values: Record<string, string>): Promise<void> {
    for (const label of [frame, last, every]) await page.getByLabel(label, {exact: true}).fill(values[label] ?? '');
    await page.getByRole('button', {name: 'Reconstruct candle 1'}).click();
  }
  const asked = () => rig.mock.calls.filter(({method}) => method === 'Reconstruct/Start').map(({request}) => request);

  test('the middle frame, one, or several', async () => {
    rig.mock.status = idle();
    rig.mock.answers['Sessions/List'] = () => ({sessions: [entry]});
    const page = await rig.open();
    await page.waitForSelector('tr[data-session]');
    await start(page, {});
    await start(page, {[frame]: '0'});
    await start(page, {[frame]: '12', [last]: '90'});
    await start(page, {[frame]: '12', [last]: '1999', [every]: '2'});
    await until(async () => asked().length, many => many === 4, 'all are asked for');
    expect(asked()).toEqual([{session: 'candle 1'}, {session: 'candle 1', frame: 0}, {session: 'candle 1', frame: 12, last_frame: 90, every: 1},
                             {session: 'candle 1', frame: 12, last_frame: 1999, every: 2}]);
  });

  test('frames that there are not, or too many of, are refused where they stand', async () => {
    rig.mock.status = idle();
    rig.mock.answers['Sessions/List'] = () => ({sessions: [entry]});
    const page = await rig.open();
    await page.waitForSelector('tr[data-session]');
    const refusals: [Record<string, string>, string][] = [[{[last]: '12'}, last], [{[frame]: '12', [last]: '11'}, last], [{[frame]: '12', [last]: '2000'}, last],
      [{[frame]: '0', [last]: '1000'}, last], [{[every]: '2'}, every], [{[frame]: '2000'}, frame]];
    for (const [values, label] of refusals) {
      await start(page, values);
      expect(await page.evaluate(() => document.activeElement!.getAttribute('aria-label')), JSON.stringify(values)).toBe(label);
      expect(await page.getByLabel(label, {exact: true}).evaluate((input: HTMLInputElement) => input.validationMessage)).not.toBe('');
    }
    expect(asked()).toEqual([]);
  });
});

describe('followed', () => {
  test('how many are done, which failed and why, and the live volume', async () => {
    serveFrames();
    rig.mock.status = {...locked(), reconstruction: sequence('dfdr--')};
    const page = await rig.open();
    await page.waitForSelector('.sequence');
    expect(await text(page, '.sequence .tally')).toBe('Frames: 2 of 6 done, 1 failed');
    expect(await page.locator('.sequence li').allInnerTexts()).toEqual(['frame 12: It crashed by SIGSEGV. Try device cpu.']);
    expect(await text(page, '#reconstruction header')).toContain('frame 16 (4 of 6): iterating · 50 %');
    live(20);
    await seen(page, 20);
    expect(await text(page, '.player .label')).toBe('live');
    expect(fetched()).toEqual([]);
    // Each frame's iterations are its own.
    rig.mock.tell({iteration: {reconstruction: 's1', frame: '18', iteration: {...iteration(1), input_rmse: 9}, camera_id: 'virtual-03'}});
    await until(() => text(page, '.latest'), words => words.startsWith('Iteration 1: error 9.00'), 'the next frame');
    rig.mock.show({reconstruction: sequence('dfddr-', {iterations: []})});
    await until(() => text(page, '.sequence .tally'), words => words === 'Frames: 3 of 6 done, 1 failed', 'one more');
    for (let at = 0; at < 2; ++at) live(21 + at);
    await seen(page, 22);
  });

  test('of many that failed a few are told, and all are named', async () => {
    rig.mock.status = {...locked(), reconstruction: sequence(`d${'f'.repeat(300)}`, {state: 'FAILED', doing: 'failed', error: '300 of 301 frames failed.'})};
    const page = await rig.open();
    await page.waitForSelector('.sequence li');
    expect(await page.locator('.sequence li').count()).toBe(8);
    expect(await text(page, '.sequence .note')).toContain('610');
    expect(await text(page, '#reconstruction > header .word')).toBe('done in part');
  });
});

describe('played', () => {
  test('a browser that comes later sees the last frame that is done, picks and plays, and fetches each once', async () => {
    serveFrames();
    rig.mock.status = {...locked(), reconstruction: sequence('ddddf', {state: 'FAILED', doing: 'failed'})};
    const page = await rig.open();
    await seen(page, edgeOf(16));
    expect(await text(page, '.player .label')).toBe('frame 16, 4 of 5: error 2.30');
    const slider = page.getByRole('slider', {name: 'Frame of the sequence'});
    await slider.press('Home');
    await seen(page, edgeOf(10));
    expect(await text(page, '.player .label')).toBe('frame 10, 1 of 5: error 2.00');
    expect(await slider.getAttribute('aria-valuetext')).toBe('frame 10, 1 of 5: error 2.00');
    expect(await page.locator('.layers').isVisible()).toBe(false);
    await slider.press('ArrowRight');
    await seen(page, edgeOf(12));
    await page.locator('.layers[data-shown=TEMPERATURE]').waitFor();
    expect(await text(page, '.colour-bar .high')).toBe('1900 K');
    await slider.press('ArrowRight');
    await until(() => text(page, '.player .label'), words => words === 'frame 14, 3 of 5: no longer held', 'what is gone is told');
    expect(await page.getByRole('button', {name: 'Live'}).isVisible()).toBe(false);
    await page.getByRole('button', {name: 'Play'}).press('Enter');
    for (const at of [16, 10, 12, 16]) await seen(page, edgeOf(at));
    await page.getByRole('button', {name: 'Pause'}).press('Enter');
    const stood = await text(page, '.player .label');
    await page.waitForTimeout(400);
    expect(await text(page, '.player .label')).toBe(stood);
    expect(fetched().sort()).toEqual([10, 12, 14, 16]);
    await page.locator('#reconstruction').scrollIntoViewIfNeeded();
    await screenshot(page, 'sequence');
  });

  test('while it runs a frame that is picked stays, until the live one is asked for', async () => {
    serveFrames();
    rig.mock.status = {...locked(), reconstruction: sequence('ddr-')};
    const page = await rig.open();
    await page.waitForSelector('.player');
    live(20);
    await seen(page, 20);
    await page.getByRole('slider').press('Home');
    await seen(page, edgeOf(10));
    live(21);
    rig.mock.show({reconstruction: sequence('dddr')});
    await page.waitForTimeout(300);
    expect(await page.locator('.volume').getAttribute('data-voxels')).toBe(String(edgeOf(10) ** 3));
    await page.getByRole('button', {name: 'Live'}).click();
    await seen(page, 21);
    expect(await text(page, '.player .label')).toBe('live');
  });

  test('the daemon that does not answer ends the play, and is told once', async () => {
    rig.mock.answers['Reconstruct/Frame'] = request => {
      if (request.frame !== 12) throw new Refusal(503, 'UNAVAILABLE', 'the daemon is ending. Start it again.');
      return volume(9);
    };
    rig.mock.status = {...locked(), reconstruction: sequence('ddr-')};
    const page = await rig.open();
    await page.getByRole('button', {name: 'Play'}).click();
    await page.waitForSelector('.toast');
    expect(await page.getByRole('button', {name: 'Play'}).isVisible()).toBe(true);
    expect(await page.locator('.toast').count()).toBe(1);
  });

  test.each(kSizes)('fits at $width x $height, with controls to touch', async size => {
    serveFrames();
    rig.mock.status = {...locked(), reconstruction: sequence('ddfdr'.padEnd(400, '-'))};
    rig.mock.answers['Sessions/List'] = () => ({sessions: [entry]});
    const page = await rig.open(size);
    await page.waitForSelector('.player');
    await page.waitForSelector('.frame-choice');
    expect(await overflows(page)).toBe(0);
    await page.locator('#sessions').scrollIntoViewIfNeeded();
    await screenshot(page, `sequence-choice-${size.width}`);
    if (size !== kPhone) return;
    for (const input of await page.locator('.frame-choice input').all()) expect((await input.boundingBox())!.height).toBeGreaterThanOrEqual(44);
    await page.getByRole('slider').press('Home');
    for (const control of ['.player .play', '.player input', '.player .quiet']) {
      expect((await page.locator(control).boundingBox())!.height, control).toBeGreaterThanOrEqual(44);
    }
    await page.locator('.player').scrollIntoViewIfNeeded();
    await screenshot(page, 'sequence-phone');
  });
});
