// SPDX-License-Identifier: Apache-2.0
// A flame on a marker in a camera's live pictures: what is asked for, and what is told of the marker. walk/live_flame.test.ts has the daemon.
import type {Page} from 'playwright-core';
import {describe, expect, test} from 'vitest';

import type {ArStatus} from '../../../daemon/console/src/api.gen';
import {bench, kPhone, overflows} from './bench';
import {Refusal} from './mock';
import {cameraId, idle} from './scene';
import {screenshot, until} from '../support/chromium';

const rig = bench();
const results = {
  results: [{session: 'candle 2', middle_frame: true, frames: [3, 12]}, {session: 'plume', middle_frame: false, frames: [7]}],
  dictionaries: ['4X4_50', '5X5_100'],
};

function ar(change: Partial<ArStatus> = {}): ArStatus {
  return {state: 'SHOWN', camera_id: cameraId(3), session: 'candle 2', result: 'frame-12', marker: 'aruco:4X4_50:7:80mm', calibrated: true, pose: 'FOUND',
          without: 0, residual_px: 0.083, rate_hz: 21.4, delay_s: 0.041, seen_instead: '', error: '', ...change};
}

async function openCamera(index = 3, size?: {width: number; height: number}): Promise<Page> {
  rig.mock.status = idle();
  rig.mock.answers['Ar/Results'] = () => results;
  const page = await rig.open(size);
  await page.locator(`.tile[data-camera="${cameraId(index)}"]`).click();
  await page.getByText('Flame on a marker').click();
  await until(() => page.getByLabel('Result').locator('option').count(), many => many > 0, 'results are listed');
  return page;
}
const asked = () => rig.mock.calls.filter(({method}) => method.startsWith('Ar/') && method !== 'Ar/Results');
const told = (page: Page) => page.locator('.live-flame .told').innerText();

describe('asked for', () => {
  test('a result and a marker, from those listed', async () => {
    const page = await openCamera();
    expect(await page.getByLabel('Result').locator('option').allInnerTexts()).toEqual(
      ['candle 2: middle frame', 'candle 2: 2 frames in turn', 'candle 2: frame 3', 'candle 2: frame 12', 'plume: frame 7']);
    rig.mock.answers['Ar/Start'] = () => ar();
    await page.getByLabel('Result').selectOption({label: 'candle 2: frame 12'});
    await page.getByLabel('Number').fill('7');
    await page.getByLabel('Flame’s size').fill('0.5');
    await page.getByRole('button', {name: 'Show the flame'}).click();
    await until(() => asked().length, many => many === 1, 'it is asked for');
    expect(asked()[0]).toEqual({method: 'Ar/Start', request: {camera_id: cameraId(3), session: 'candle 2', result: 'frame-12', marker: 'aruco:4X4_50:7:80mm', scale: 0.5, brightness: 1, linear: false}});
    rig.mock.show({ar: ar()});
    await page.getByRole('button', {name: 'Stop the flame'}).click();
    await until(() => asked().length, many => many === 2, 'it is stopped');
    expect(asked()[1]!.method).toBe('Ar/Stop');
  });

  test('a board, frames in turn, a focal length', async () => {
    const page = await openCamera();
    await page.getByLabel('Result').selectOption({label: 'candle 2: 2 frames in turn'});
    await page.getByLabel('Marker', {exact: true}).selectOption('charuco');
    await page.getByLabel('Dictionary').selectOption('5X5_100');
    await page.getByLabel('Squares across').fill('7');
    await page.getByLabel('Focal length').fill('812.5');
    await page.getByLabel(/in proportion to light/).check();
    await page.getByRole('button', {name: 'Show the flame'}).click();
    await until(() => asked().length, many => many === 1, 'it is asked for');
    expect(asked()[0]!.request).toEqual({camera_id: cameraId(3), session: 'candle 2', result: '', marker: 'charuco:7x4:30mm:22mm:5X5_100', scale: 1, brightness: 1, focal_px: 812.5, linear: true});
  });

  test('what the daemon refuses is told, and can be asked again', async () => {
    const page = await openCamera();
    rig.mock.answers['Ar/Start'] = () => { throw new Refusal(400, 'INVALID_ARGUMENT', `${cameraId(3)}: its lens isn't known. Calibrate the rig, or give the focal length in pixels`); };
    await page.getByRole('button', {name: 'Show the flame'}).click();
    await until(() => page.locator('.toast').allInnerTexts(), list => list.some(words => words.includes("its lens isn't known")), 'it is told');
    expect(await page.getByRole('button', {name: 'Show the flame'}).isEnabled()).toBe(true);
  });

  test('without a result there is nothing to show, and the page says what to do', async () => {
    rig.mock.status = idle();
    rig.mock.answers['Ar/Results'] = () => ({results: [], dictionaries: ['4X4_50']});
    const page = await rig.open();
    await page.locator(`.tile[data-camera="${cameraId(0)}"]`).click();
    await page.getByText('Flame on a marker').click();
    await page.getByText('Nothing has been reconstructed yet').waitFor();
    expect(await page.getByRole('button', {name: 'Show the flame'}).isDisabled()).toBe(true);
  });
});

describe('told', () => {
  test('how well the marker is seen, by light, word and numbers', async () => {
    const page = await openCamera();
    const cases: [Partial<ArStatus>, string, RegExp][] = [
      [{}, 'GREEN', /Marker found\s+to 0.08 px · 21 pictures\/s, 41 ms later/],
      [{pose: 'HELD', without: 3}, 'AMBER', /Marker covered: the flame is held\s+for 3 frames/],
      [{pose: 'LOST', without: 40}, 'RED', /Marker lost: no flame is shown\s+for 40 frames/],
      [{pose: 'LOST', without: 40, seen_instead: 'a marker of 5X5_50, number 3'}, 'RED', /instead there is a marker of 5X5_50, number 3/],
      [{pose: 'POSE_UNSPECIFIED', rate_hz: 0}, 'LIGHT_UNSPECIFIED', /Waits for a picture/],
      [{state: 'FAILED', error: 'left: its pictures have changed their size. Start the flame again'}, 'RED', /The flame ended\s+left: its pictures have changed their size/],
    ];
    for (const [change, light, words] of cases) {
      rig.mock.show({ar: ar(change)});
      await until(() => told(page), shown => words.test(shown), String(words));
      expect(await page.locator('.live-flame .told .sign').getAttribute('data-light')).toBe(light);
    }
  });

  test('pictures with a flame are marked as such, and not judged for their exposure', async () => {
    const page = await openCamera();
    const marks = page.locator('.flame-mark:visible');
    expect(await page.locator('.exposure').isVisible()).toBe(true);
    rig.mock.show({ar: ar()});
    await until(() => page.locator('.enlarged .flame-mark').isVisible(), Boolean, 'the enlarged picture is marked');
    expect(await page.locator('.exposure').isVisible()).toBe(false);
    await page.keyboard.press('Escape');
    await until(() => marks.count(), many => many === 1, 'one tile is marked');
    expect(await page.locator(`.tile[data-camera="${cameraId(3)}"] .flame-mark`).isVisible()).toBe(true);
    rig.mock.show({ar: ar({state: 'STOPPED'})});
    await until(() => marks.count(), many => many === 0, 'none is marked');
  });

  test('another camera says where the flame is', async () => {
    const page = await openCamera(5);
    rig.mock.show({ar: ar()});
    await page.getByText(`The flame is shown by ${cameraId(3)}`).waitFor();
    expect(await page.getByRole('button', {name: 'Stop the flame'}).isVisible()).toBe(false);
  });
});

test('on a phone nothing is wider than the screen', async () => {
  const page = await openCamera(3, kPhone);
  await screenshot(page, 'live-flame-phone');
  expect(await overflows(page)).toBe(0);
  const wide = await page.locator('.live-flame input:visible, .live-flame select:visible, .live-flame button:visible').evaluateAll(list => list.filter(each => each.getBoundingClientRect().right > innerWidth).map(each => each.outerHTML));
  expect(wide).toEqual([]);
});
