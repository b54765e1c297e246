// SPDX-License-Identifier: Apache-2.0
// Temperature and errors: asked for with a session, shown after each iteration and of the result, with a bar in K.
import {mkdtempSync, rmSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';

import type {Page} from 'playwright-core';
import {describe, expect, test} from 'vitest';

import {bench, kPhone, overflows, text} from './bench';
import {flameVolume, hotFlameVolume} from './pictures';
import {idle, locked, reconstruction} from './scene';
import {screenshot, until} from '../support/chromium';

const rig = bench();
const entry = {session: 'candle 1', state: 'COMPLETE' as const, purpose: 'flame', created_utc: '2026-11-22T03:15:00Z', cameras: 11, frames: 22000, lost: 0, bytes: 14.6e9, error: '', calibrated: true};
const kShow = 'What is shown of the volume';

function tell({header, bytes}: {header: object; bytes: Uint8Array}): void {
  rig.mock.tellBytes(header, bytes);
}

/** Red, green and blue of the slice, this far from its left and its top; all 0 where nothing is drawn. */
const sliceAt = (page: Page, x: number, y: number) => page.locator('canvas.slice').evaluate((canvas: HTMLCanvasElement, [right, down]) =>
  [...canvas.getContext('2d')!.getImageData(Math.floor(right! * canvas.width), Math.floor(down! * canvas.height), 1, 1).data.slice(0, 3)], [x, y]);

/** How many pixels of the volume, as it is seen, are orange or yellow, and how many violet. */
async function colours(page: Page): Promise<{warm: number; violet: number}> {
  const png = (await page.locator('.volume').screenshot()).toString('base64');
  return page.evaluate(async data => {
    const bitmap = await createImageBitmap(new Blob([Uint8Array.from(atob(data), letter => letter.charCodeAt(0))]));
    const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d')!;
    context.drawImage(bitmap, 0, 0);
    const {data: bytes} = context.getImageData(0, 0, bitmap.width, bitmap.height);
    const seen = {warm: 0, violet: 0};
    for (let at = 0; at < bytes.length; at += 4) {
      const [red, green, blue] = [bytes[at]!, bytes[at + 1]!, bytes[at + 2]!];
      if (red > blue + 60 && red > 120) ++seen.warm;
      if (red > green + 20 && blue > green + 20) ++seen.violet;
    }
    return seen;
  }, png);
}

describe('asked for', () => {
  const response = '{"unit": "relative", "wavelength_nm": [500, 600], "r": [0, 1], "g": [1, 0], "b": [0, 0]}';
  const asked = () => rig.mock.calls.filter(({method}) => method === 'Reconstruct/Start').map(({request}) => request);
  const quantity = 'What of candle 1 to reconstruct';
  const emitter = 'What glows in candle 1';
  const lines = 'What shines beside it in candle 1';

  test('colour, its errors, or temperature by an emitter, lines and a response', async () => {
    rig.mock.status = idle();
    rig.mock.answers['Sessions/List'] = () => ({sessions: [entry]});
    const page = await rig.open();
    const start = () => page.getByRole('button', {name: 'Reconstruct candle 1'}).click();
    await page.getByLabel(quantity).selectOption('errors');
    expect(await page.getByLabel(emitter).isVisible()).toBe(false);
    await start();
    await page.getByLabel(quantity).selectOption('temperature');
    await start();
    await page.getByLabel(emitter).selectOption('soot');
    await page.getByLabel(lines).selectOption('sodium,c2');
    const file = page.getByLabel('Camera response of candle 1');
    await file.setInputFiles({name: 'response.json', mimeType: 'application/json', buffer: Buffer.from(response)});
    await start();
    await until(async () => asked().length, many => many === 3, 'all are asked for');
    expect(asked()).toEqual([{session: 'candle 1', errors: true}, {session: 'candle 1', quantity: 'temperature'},
      {session: 'candle 1', quantity: 'temperature', emitter: 'soot', lines: 'sodium,c2',
       response: {wavelength_nm: [500, 600], r: [0, 1], g: [1, 0], b: [0, 0], absolute: false}}]);
    await file.setInputFiles({name: 'photo.json', mimeType: 'application/json', buffer: Buffer.from('{"unit": 3}')});
    await start();
    await until(() => file.evaluate((input: HTMLInputElement) => input.validationMessage), words => words.startsWith('This is no camera response'), 'it is refused');
    expect(asked()).toHaveLength(3);
  });

  test('as in the paper, no lines', async () => {
    rig.mock.status = idle();
    rig.mock.answers['Sessions/List'] = () => ({sessions: [{...entry, lost: rig.mock.calls.length}]});
    const page = await rig.open();
    await page.getByLabel(quantity).selectOption('temperature');
    await page.getByLabel(lines).selectOption('sodium');
    await page.getByLabel(emitter).selectOption('paper');
    expect(await page.getByLabel(lines).isDisabled()).toBe(true);
    // Each list enables anew what may be done.
    const lost = page.locator('tr[data-session] td[data-name=Lost]');
    const before = await lost.innerText();
    await page.getByRole('button', {name: 'Read again'}).click();
    await until(() => lost.innerText(), words => words !== before, 'the list is read again');
    expect(await page.getByLabel(lines).isDisabled()).toBe(true);
    await page.getByRole('button', {name: 'Reconstruct candle 1'}).click();
    await until(async () => asked().length, many => many === 1, 'it is asked for');
    expect(asked()).toEqual([{session: 'candle 1', quantity: 'temperature', emitter: 'paper'}]);
    await page.getByLabel(emitter).selectOption('grey');
    expect(await page.getByLabel(lines).isDisabled()).toBe(false);
  });

  test('a response that can’t be read any more is refused', async () => {
    rig.mock.status = idle();
    rig.mock.answers['Sessions/List'] = () => ({sessions: [entry]});
    const page = await rig.open();
    await page.getByLabel(quantity).selectOption('temperature');
    const folder = mkdtempSync(join(tmpdir(), 'emberlock-response-'));
    try {
      const path = join(folder, 'response.json');
      writeFileSync(path, response);
      const file = page.getByLabel('Camera response of candle 1');
      await file.setInputFiles(path);
      rmSync(path);  // as where it has changed, which the browser doesn’t always notice
      await page.getByRole('button', {name: 'Reconstruct candle 1'}).click();
      await until(() => file.evaluate((input: HTMLInputElement) => input.validationMessage), words => words.includes('it has changed'), 'it is refused');
      expect(asked()).toEqual([]);
      writeFileSync(path, response);
      await file.setInputFiles(path);
      await page.getByRole('button', {name: 'Reconstruct candle 1'}).click();
      await until(async () => asked().length, many => many === 1, 'chosen again, it is taken');
      expect(await file.evaluate((input: HTMLInputElement) => input.validationMessage)).toBe('');
    } finally {
      rmSync(folder, {recursive: true});
    }
  });

  test('on a phone nothing is wider than the screen', async () => {
    rig.mock.status = {...locked(), reconstruction: reconstruction(3)};
    rig.mock.answers['Sessions/List'] = () => ({sessions: [entry]});
    const page = await rig.open(kPhone);
    await page.getByLabel(quantity).selectOption('temperature');
    tell(hotFlameVolume(false));
    await page.locator('.layers').waitFor();
    expect(await overflows(page)).toBe(0);
  });
});

describe('shown', () => {
  test('a bar in K, hot below and cold above, during the run and of the result', async () => {
    rig.mock.status = {...locked(), reconstruction: reconstruction(3)};
    const page = await rig.open();
    tell(hotFlameVolume(true));
    await page.locator('.layers[data-shown=TEMPERATURE][data-quick]').waitFor();
    expect(await text(page, '.colour-bar .low')).toBe('1400 K');
    expect(await text(page, '.colour-bar .high')).toBe('1900 K');
    expect(await text(page, '.layers .note')).toContain('looked up');
    const [below, above, outside] = [await sliceAt(page, 0.5, 0.9), await sliceAt(page, 0.5, 0.35), await sliceAt(page, 0.02, 0.5)];
    const light = (rgb: number[]) => rgb.reduce((sum, value) => sum + value, 0);
    expect(light(below)).toBeGreaterThan(light(above) + 60);
    expect(light(above)).toBeGreaterThan(0);
    expect(outside).toEqual([0, 0, 0]);
    // Only what is measured has the bar's colours: violet is none of a glow's.
    await until(() => colours(page), ({warm, violet}) => warm > 20 && violet > 20, 'the volume has them too');
    await page.locator('.turn').scrollIntoViewIfNeeded();
    await screenshot(page, 'temperature-mock');
    rig.mock.show({reconstruction: reconstruction(12, {state: 'DONE', temperature: ['1650 K on average', 'read from a grey glow']})});
    tell(hotFlameVolume(false));
    await page.locator('.layers[data-shown=TEMPERATURE]:not([data-quick])').waitFor();
    expect(await text(page, '.layers .note')).not.toContain('looked up');
    expect(await page.locator('.progress').innerText()).toContain('1650 K on average');
  });

  test('what somebody chose stays from iteration to iteration, and the next reconstruction begins anew', async () => {
    rig.mock.status = {...locked(), reconstruction: reconstruction(3)};
    const page = await rig.open();
    tell(hotFlameVolume(false));
    const shown = page.getByLabel(kShow);
    await shown.selectOption('TEMPERATURE_SIGMA');
    await page.locator('.layers[data-shown=TEMPERATURE_SIGMA]').waitFor();
    expect(await text(page, '.colour-bar .high')).toBe('40.0 K');
    tell(hotFlameVolume(false));
    await page.waitForTimeout(300);
    expect(await shown.inputValue()).toBe('TEMPERATURE_SIGMA');
    await shown.selectOption('BRIGHTNESS');
    await until(() => text(page, '.turn .note'), words => words.includes('brightness in false colours'), 'brightness is shown');
    expect(await page.locator('.colour-bar').isVisible()).toBe(false);
    rig.mock.show({reconstruction: reconstruction(1, {id: 'r2'})});
    tell(hotFlameVolume(true));
    await until(() => shown.inputValue(), value => value === 'TEMPERATURE', 'temperature again');
    tell(flameVolume());
    await page.locator('.layers').waitFor({state: 'hidden'});
  });

  test('brightness stands in while a volume doesn’t tell what is chosen', async () => {
    rig.mock.status = {...locked(), reconstruction: reconstruction(3)};
    const page = await rig.open();
    tell(hotFlameVolume(false));
    const shown = page.getByLabel(kShow);
    await shown.selectOption('TEMPERATURE_SIGMA');
    await page.locator('.layers[data-shown=TEMPERATURE_SIGMA]').waitFor();
    tell(hotFlameVolume(true));
    await page.locator('.layers[data-shown=BRIGHTNESS]').waitFor();
    expect(await shown.inputValue()).toBe('BRIGHTNESS');
    expect(await page.locator('.colour-bar').isVisible()).toBe(false);
    await until(() => colours(page), ({warm, violet}) => warm > 20 && violet === 0, 'it glows');
    tell(hotFlameVolume(false));
    await page.locator('.layers[data-shown=TEMPERATURE_SIGMA]').waitFor();
    expect(await text(page, '.colour-bar .high')).toBe('40.0 K');
  });
});
