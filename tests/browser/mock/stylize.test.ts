// SPDX-License-Identifier: Apache-2.0
// A stylization edited in the page: by pointer, by keys and by numbers; what is refused is told, and what was done can be undone.
import type {Locator, Page} from 'playwright-core';
import {describe, expect, test} from 'vitest';

import {bench, kSizes, overflows, text} from './bench';
import {flamePictures, paint} from './pictures';
import {locked, reconstruction} from './scene';
import {StylizedFlame} from './stylize_scene';
import {screenshot, until} from '../support/chromium';

const rig = bench();
let pictures: Promise<Uint8Array[]> | undefined;

async function stylize(size?: {width: number; height: number}): Promise<{page: Page; flame: StylizedFlame}> {
  pictures ??= flamePictures(rig.browser, 8);
  const flame = new StylizedFlame(rig.mock, await pictures);
  const page = await rig.open(size);
  flame.preview();
  await page.waitForSelector('#stylization .stylized[data-view="virtual-00"]');
  await page.locator('#stylization').scrollIntoViewIfNeeded();
  return {page, flame};
}
const pad = (page: Page): Locator => page.locator('#stylization .pad');
const tool = (page: Page, name: string): Promise<void> => page.locator('.tool-choice label', {hasText: name}).click();
const seen = (page: Page, steps: number): Promise<unknown> => page.waitForSelector(`.stylized[data-steps="${steps}"]`);
/** The first step, as the tool's. */
const first = <T>(flame: StylizedFlame): T & Record<string, unknown> => flame.steps[0] as unknown as T & Record<string, unknown>;
const asked = () => rig.mock.calls.filter(({method}) => method === 'Reconstruct/Edit').map(({request}) => request);

/** Presses at the first of these parts of the picture's width and height, and goes to the others. */
async function stroke(page: Page, ...at: [number, number][]): Promise<void> {
  const box = (await pad(page).boundingBox())!;
  const places = at.map(([x, y]) => [box.x + x * box.width, box.y + y * box.height] as const);
  await page.mouse.move(...places[0]!);
  await page.mouse.down();
  for (const place of places.slice(1)) await page.mouse.move(...place, {steps: 4});
  await page.mouse.up();
}

describe('on the picture', () => {
  test('a stroke of the brush becomes a step in the picture\'s pixels, and is undone and redone', async () => {
    const {page, flame} = await stylize();
    await page.getByLabel('Radius').fill('12');
    await stroke(page, [0.5, 0.5], [0.6, 0.5]);
    await seen(page, 1);
    const step = first<{points: [number, number][]}>(flame);
    expect(step).toMatchObject({op: 'brush', view: 'virtual-00', radius: 12, mode: 'add', strength: 80});
    expect(step.points[0]![0]).toBeCloseTo(320, 0);
    expect(step.points.at(-1)![0]).toBeCloseTo(384, 0);
    expect(step.points.every(([, y]) => Math.abs(y - 240) < 1)).toBe(true);
    const word = 'goes on · 1 pass · 1 step · residual 3.41 of 255';  // it comes by another message than the picture
    await until(() => text(page, '#stylization .word'), shown => shown === word, word);
    await page.getByRole('button', {name: 'Undo'}).click();
    await seen(page, 0);
    expect(await page.getByRole('button', {name: 'Undo'}).isDisabled()).toBe(true);
    await pad(page).press('Control+Shift+z');
    await seen(page, 1);
    await pad(page).press('Control+z');
    await seen(page, 0);
    expect(flame.steps.map(({op}) => op)).toEqual(['brush', 'undo', 'redo', 'undo']);
  });

  test('by keys alone: the cross is moved, and Enter uses the tool there', async () => {
    const {page, flame} = await stylize();
    await page.getByLabel('Light is').selectOption('erase');
    expect(await page.getByLabel('Strength').isVisible()).toBe(false);
    await pad(page).focus();
    for (const key of ['ArrowRight', 'Shift+ArrowUp', 'Enter']) await pad(page).press(key);
    await seen(page, 1);
    const width = (await pad(page).boundingBox())!.width;
    const step = first<{points: [number, number][]; mode: string}>(flame);
    expect(step.mode).toBe('erase');
    expect(step.points[0]![0]).toBeCloseTo(320 + 5 * 640 / width, 0);
    expect(step.points[0]![1]).toBeCloseTo(240 - 25 * 640 / width, 0);
    expect(step).not.toHaveProperty('strength');
  });

  test('corners become a mask that keeps or cuts', async () => {
    const {page, flame} = await stylize();
    await tool(page, 'Mask');
    expect(await page.getByRole('button', {name: 'Keep inside'}).isDisabled()).toBe(true);
    for (const at of [[0.3, 0.2], [0.7, 0.2], [0.7, 0.8], [0.3, 0.8]] as [number, number][]) await stroke(page, at);
    await screenshot(page, 'stylize-mask');
    await page.getByRole('button', {name: 'Keep inside'}).click();
    await seen(page, 1);
    const step = first<{polygon: [number, number][]}>(flame);
    expect(step).toMatchObject({op: 'mask', view: 'virtual-00', part: 'keep'});
    expect(step.polygon.map(point => point.map(Math.round))).toEqual([[192, 96], [448, 96], [448, 384], [192, 384]]);
    expect(await text(page, '.tool [role=status]')).toBe('No corner yet.');
  });

  test('an object is chosen, dragged to its place, and put into one view or all, as bytes and never by a path', async () => {
    const {page, flame} = await stylize();
    await tool(page, 'Object');
    expect(await page.getByRole('button', {name: 'Put into this view'}).isDisabled()).toBe(true);
    const [jpeg] = await paint(rig.browser, 1, context => {
      context.fillStyle = '#fff';
      context.fillRect(160, 120, 320, 240);
    });
    await page.getByLabel('Picture', {exact: true}).setInputFiles({name: 'box.jpg', mimeType: 'image/jpeg', buffer: Buffer.from(jpeg!)});
    await page.waitForSelector('.tool button.primary:not(:disabled)');
    await page.getByLabel('Rotation').fill('30');
    await page.getByLabel('Opacity').fill('0.8');
    await page.getByLabel('Where both shine').selectOption('add');
    await stroke(page, [0.5, 0.5], [0.4, 0.6]);
    await screenshot(page, 'stylize-object');
    await page.getByRole('button', {name: 'Put into this view'}).click();
    await seen(page, 1);
    const step = first<{position: [number, number]}>(flame);
    expect(step).toMatchObject({op: 'object', view: 'virtual-00', scale: 0.4, rotation: 30, opacity: 0.8, strength: 1, combine: 'add'});
    expect(step.position[0]).toBeCloseTo(256, 0);
    expect(step.position[1]).toBeCloseTo(288, 0);
    expect(Object.keys(step)).not.toContain('file');
    expect(Buffer.from(String(asked()[0]!.picture), 'base64').subarray(1, 4).toString()).toBe('PNG');
    expect(asked()[0]!.mask).toBeUndefined();
    await page.getByRole('button', {name: 'Put into all 10 views'}).click();
    await seen(page, 11);
    expect(new Set(flame.steps.slice(1).map(({view}) => view)).size).toBe(10);
  });

  test('what is transparent of an object goes along as its mask; what is no picture is refused where it stands', async () => {
    const {page} = await stylize();
    await tool(page, 'Object');
    const png = await page.evaluate(() => {
      const canvas = document.createElement('canvas');
      canvas.width = canvas.height = 64;
      const context = canvas.getContext('2d')!;
      context.arc(32, 32, 30, 0, 7);
      context.fill();
      return canvas.toDataURL().split(',')[1]!;
    });
    await page.getByLabel('Picture', {exact: true}).setInputFiles({name: 'disc.png', mimeType: 'image/png', buffer: Buffer.from(png, 'base64')});
    await page.waitForSelector('.tool button.primary:not(:disabled)');
    await page.getByRole('button', {name: 'Put into this view'}).click();
    await seen(page, 1);
    expect(Buffer.from(String(asked()[0]!.mask), 'base64').subarray(1, 4).toString()).toBe('PNG');
    await page.getByLabel('Picture', {exact: true}).setInputFiles({name: 'a.png', mimeType: 'image/png', buffer: Buffer.from('none')});
    await until(() => page.getByLabel('Picture', {exact: true}).evaluate((input: HTMLInputElement) => input.validationMessage), words => words !== '', 'it says so');
  });
});

describe('by numbers', () => {
  test('a region begins within the volume, in millimetres, and is told in metres', async () => {
    const {page, flame} = await stylize();
    await tool(page, 'Region');
    expect(await page.locator('.three input').evaluateAll(inputs => inputs.map(input => (input as HTMLInputElement).value))).toEqual(['0', '0', '200', '150', '150', '200']);
    await page.getByLabel('Brightness').fill('3');
    await page.getByLabel('Soft edge').fill('10');
    await screenshot(page, 'stylize-region');
    await page.getByRole('button', {name: 'Set brightness'}).click();
    await seen(page, 1);
    await page.getByLabel('Shape').selectOption('box');
    await page.getByRole('button', {name: 'Cut this out'}).click();
    await seen(page, 2);
    expect(flame.steps).toEqual([
      {op: 'brightness', region: {shape: 'ellipsoid', center: [0, 0, 0.2], size: [0.15, 0.15, 0.2], edge: 0.01}, factor: 3},
      {op: 'cut', region: {shape: 'box', center: [0, 0, 0.2], size: [0.15, 0.15, 0.2]}}]);
  });

  test('a curve of colours rises, in whatever order its stops were made', async () => {
    const {page, flame} = await stylize();
    await tool(page, 'Colour');
    await page.getByRole('button', {name: 'Add a stop'}).click();
    await page.locator('.stops li').last().getByLabel('at').fill('1000');
    await page.locator('.stops li').last().locator('input[type=color]').fill('#ff0000');
    await page.locator('.stops li').nth(1).getByRole('button', {name: 'Remove the stop'}).click();
    await screenshot(page, 'stylize-colour');
    await page.getByRole('button', {name: 'Set colours'}).click();
    await seen(page, 1);
    expect(flame.steps).toEqual([{op: 'colour', curve: [{kelvin: 1000, colour: [255, 0, 0], gain: 1}, {kelvin: 1300, colour: [0, 48, 255], gain: 1},
                                                        {kelvin: 2300, colour: [255, 255, 255], gain: 1}]}]);
  });
});

describe('what the daemon says', () => {
  test('a step that is refused is told, and changes nothing', async () => {
    const {page, flame} = await stylize();
    await page.getByLabel('Radius').fill('9999');
    await stroke(page, [0.5, 0.5]);
    await page.waitForSelector('.toast');
    expect(await text(page, '.toast p')).toBe('step: view: "virtual-10" is held out. Give one of virtual-00, virtual-01.');
    expect(flame.status.steps).toBe(0);
    await screenshot(page, 'stylize-refused');
    await page.getByLabel('Radius').fill('10');
    await stroke(page, [0.5, 0.5]);
    await seen(page, 1);
    await until(() => page.locator('.toast').count(), many => many === 0, 'the complaint goes with the next step');
  });

  test('strokes go one after the other, however long each takes', async () => {
    const {page, flame} = await stylize();
    const edit = rig.mock.answers['Reconstruct/Edit']!;
    let within = 0;
    rig.mock.answers['Reconstruct/Edit'] = async request => {
      expect(++within).toBe(1);
      await new Promise(resolve => setTimeout(resolve, 100));
      --within;
      return edit(request);
    };
    for (const x of [0.2, 0.4, 0.6]) await stroke(page, [x, 0.5]);
    await seen(page, 3);
    const places = (flame.steps as unknown as {points: [number, number][]}[]).map(({points}) => Math.round(points[0]![0] / 64));
    expect(places).toEqual([2, 4, 6]);
  });

  test('another view is asked for; one that is held out can\'t be', async () => {
    const {page} = await stylize();
    await page.getByRole('combobox', {name: 'View'}).selectOption('virtual-04');
    await page.waitForSelector('.stylized[data-view="virtual-04"]');
    expect(asked()).toEqual([{view: 'virtual-04'}]);
    expect(await page.locator('#stylization option[disabled]').evaluateAll(options => options.map(option => (option as HTMLOptionElement).value))).toEqual(['virtual-10']);
    expect(await text(page, '#stylization figcaption')).toBe('Input picture of virtual-04, as edited');
  });

  test('it is there while a stylization runs, and is finished by a button', async () => {
    const {page} = await stylize();
    await page.getByRole('button', {name: 'Finish'}).click();
    await until(() => rig.mock.calls.some(({method}) => method === 'Reconstruct/Finish'), Boolean, 'it is asked for');
    rig.mock.show({reconstruction: reconstruction(12, {id: 'e1', state: 'DONE', doing: 'done', result: '/var/lib/emberlock/results/a/frame-3-stylized'})});
    await until(() => page.locator('#stylization').isVisible(), shown => !shown, 'it is gone');
    expect(await text(page, '#reconstruction .result')).toBe('Written to /var/lib/emberlock/results/a/frame-3-stylized');
    rig.mock.show({...locked(), reconstruction: reconstruction(3)});
    await page.waitForTimeout(100);
    expect(await page.locator('#stylization').isVisible()).toBe(false);
  });

  test('is started for a frame of a session', async () => {
    rig.mock.status = locked();
    rig.mock.answers['Sessions/List'] = () => ({sessions: [{session: 'candle 1', state: 'COMPLETE', purpose: 'flame', created_utc: '2026-11-22T03:15:00Z', cameras: 11, frames: 22000, lost: 0, bytes: 14.6e9, error: '', calibrated: true}]});
    const page = await rig.open();
    await page.getByLabel('Frame of candle 1 to reconstruct', {exact: true}).fill('40');
    await page.getByRole('button', {name: 'Stylize candle 1'}).click();
    await until(() => rig.mock.calls.filter(({method}) => method === 'Reconstruct/Start').map(({request}) => request), calls => calls.length === 1, 'it is asked for');
    expect(rig.mock.calls.find(({method}) => method === 'Reconstruct/Start')!.request).toEqual({session: 'candle 1', frame: 40, stylize: true});
  });

  test.each(kSizes)('fits at $width x $height', async size => {
    const {page} = await stylize(size);
    for (const name of ['Object', 'Region', 'Colour', 'Brush']) {
      await tool(page, name);
      expect(await overflows(page), name).toBe(0);
    }
    await page.locator('#stylization').evaluate(section => section.scrollIntoView());
    await stroke(page, [0.5, 0.5], [0.6, 0.4]);
    await seen(page, 1);
    await screenshot(page, `stylize-${size.width}`);
    if (size.width > 700) return;
    for (const control of await page.locator('#stylization :is(button, input:not([type=radio]), select)').all()) {
      if (await control.isVisible()) expect((await control.boundingBox())!.height).toBeGreaterThanOrEqual(44);
    }
  });
});
