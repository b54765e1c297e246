// SPDX-License-Identifier: Apache-2.0
// The page with three faults at once, on a desk's screen, a laptop's and a phone's: what is said is said whole, and goes with its cause.
import type {Page} from 'playwright-core';
import {describe, expect, test} from 'vitest';

import {bench, drawn, kPhone, kSizes, overflows, text} from './bench';
import {faultyAligning, faultyCapturing, noLamp} from './faulty';
import {Refusal} from './mock';
import {aligning, cameraId, capturing, idle, kCameras, locked, seen} from './scene';
import {screenshot, until} from '../support/chromium';
import {grey} from '../support/shown';

const rig = bench();

/** Texts of such elements of which part is not to be seen: beyond its own box, or an ancestor's that hides what is. */
const cut = (page: Page, selector: string): Promise<string[]> => page.locator(selector).evaluateAll(elements => elements.filter(element => {
  if (!element.checkVisibility() || !element.textContent) return false;
  const range = document.createRange();
  range.selectNodeContents(element);
  const box = range.getBoundingClientRect();
  for (let holder: Element | null = element; holder && holder !== document.body; holder = holder.parentElement) {
    if (getComputedStyle(holder).overflow === 'visible') continue;
    const bounds = holder.getBoundingClientRect();
    if (box.left < bounds.left - 1 || box.right > bounds.right + 1 || box.top < bounds.top - 1 || box.bottom > bounds.bottom + 1) return true;
  }
  return false;
}).map(element => element.textContent!));

/** Of each tile: how far its lower edge is above the screen's, its picture's aspect, and the part that this fills of the side it leans on. */
const tiles = (page: Page) => page.locator('.tile').evaluateAll(list => list.map(tile => {
  const picture = tile.querySelector('.picture')!.getBoundingClientRect();
  return {id: (tile as HTMLElement).dataset.camera!, below: tile.getBoundingClientRect().bottom - innerHeight, aspect: picture.width / picture.height,
          fills: Math.max(picture.width / tile.clientWidth, picture.height / tile.clientHeight)};
}));

/** What watches sizes has had its say: it is called between two frames. */
const laidOut = (page: Page) => page.evaluate(async () => { for (let frame = 0; frame < 4; ++frame) await new Promise(requestAnimationFrame); });

/** All is said whole, and pictures fill their tiles; on one screen where that is `large`. */
async function whole(page: Page, large: boolean): Promise<void> {
  expect(await cut(page, '.top .reason, .top .next-step, .top .title, .fault p, .tally, .tile h3, .tile .word, .tile dt, .tile dd, .tile .error-rows, .disk')).toEqual([]);
  const shown = await tiles(page);
  expect(shown.map(tile => tile.id).sort()).toEqual(Array.from({length: kCameras}, (_, index) => cameraId(index)));
  for (const tile of shown) {
    if (large) expect(tile.below, tile.id).toBeLessThanOrEqual(0);
    expect(tile.aspect, tile.id).toBeCloseTo(4 / 3, 1);
    expect(tile.fills, tile.id).toBeGreaterThan(0.7);
  }
}

describe.each(kSizes)('three faults at $width x $height', size => {
  const large = size.width > 1000;

  test('sentences, names and counts are whole, pictures fill their tiles; without the lamp in sight, the advice is to make it visible', async () => {
    rig.mock.status = faultyAligning();
    const page = await rig.open(size);
    await drawn(page, large ? kCameras - 1 : 1);
    for (const [name, status] of Object.entries({aligning: faultyAligning(), capturing: faultyCapturing(7.3)})) {
      rig.mock.show(status);
      await page.waitForSelector(`.top[data-phase=${name.toUpperCase()}]`);
      await laidOut(page);
      await screenshot(page, `faults-${name}-${size.width}`);
      expect(await page.locator('.fault').count()).toBe(3);
      expect(await text(page, '.top .tally')).toBe('3 faults · 10 of 11 cameras film');
      await whole(page, large);
      expect(await overflows(page)).toBe(0);
    }
    rig.mock.show({...noLamp(), recording: undefined, alignment: undefined});
    await page.waitForSelector('.top[data-phase=IDLE]');
    const advice = 'Make the lamp visible: expose for longer, up to the whole frame (41.7 ms),';
    expect(await text(page, '.next .next-step')).toContain(advice);
    expect(await text(page, 'body')).not.toContain('wider tolerance');
    await laidOut(page);
    expect(await cut(page, '.top .reason, .top .next-step, .fault p')).toEqual([]);
    await screenshot(page, `no-lamp-${size.width}`);
  });
});

test('names and counts are whole without faults too', async () => {
  rig.mock.status = aligning(9);
  const page = await rig.open();
  await drawn(page, kCameras);
  for (const status of [aligning(9), locked()]) {
    rig.mock.show(status);
    await page.waitForSelector(`.top[data-phase=${status.phase}]`);
    for (const size of [{width: 1920, height: 1080}, {width: 1280, height: 800}]) {
      await page.setViewportSize(size);
      await laidOut(page);
      await whole(page, true);
      await screenshot(page, `whole-${status.phase}-${size.width}`);
    }
  }
});

test('tolerance is marked at the picture’s edges, and nothing is while a flame is recorded', async () => {
  rig.mock.status = {...locked(), cameras: [seen(0, 30, false, {lamp: undefined, dots: []})]};
  const page = await rig.open();
  await drawn(page, 1);
  const look = () => grey(page, page.locator('.tile .picture'));
  const marked = await look();
  await page.evaluate(() => { document.querySelector<SVGElement>('.overlay')!.style.visibility = 'hidden'; });
  const bare = await look();
  const middle = (column: number) => column > 0.12 * bare.width && column < 0.88 * bare.width;
  const differ = bare.levels.map((level, at) => [at % bare.width, Math.abs(level - marked.levels[at]!)] as const).filter(([, by]) => by > 6);
  expect(differ.length).toBeGreaterThan(0);
  expect(differ.filter(([column]) => middle(column))).toEqual([]);
  await page.evaluate(() => { document.querySelector<SVGElement>('.overlay')!.style.visibility = ''; });
  rig.mock.show({...capturing(3), cameras: [seen(0, 30, false)]});
  await page.waitForSelector('.tile .overlay', {state: 'hidden'});
  rig.mock.show({...capturing(3, {purpose: 'alignment'}), cameras: [seen(0, 30, false)]});
  await page.waitForSelector('.tile .overlay', {state: 'visible'});
});

test('complaints go when their cause does', async () => {
  rig.mock.status = idle();
  const page = await rig.open();
  const toasts = () => page.locator('.toast p').allInnerTexts();
  const align = () => page.getByRole('button', {name: 'Align', exact: true}).click();
  const refuse = (code: string, words: string) => { rig.mock.answers['Sync/Align'] = () => { throw new Refusal(400, code, words); }; };
  // Of the rig's state: when that is another.
  refuse('FAILED_PRECONDITION', 'emberlockd: a recording runs. Stop it first.');
  await align();
  await until(toasts, now => now.length === 1, 'a refusal is told');
  rig.mock.show({uptime_s: 9});  // nothing that matters
  rig.mock.notice('GREEN', 'Heard.');
  await page.waitForSelector('.journal li');
  expect(await toasts()).toHaveLength(1);
  rig.mock.show({strobe: {...idle().strobe!, light: 'AMBER'}});
  await until(toasts, now => now.length === 0, 'the refusal goes');
  // Of a mistake: when the order is given again and carried out. Given again in vain, it is told once.
  refuse('INVALID_ARGUMENT', '"1banana" is no tolerance.');
  await align();
  await until(toasts, now => now.length === 1, 'a mistake is told');
  refuse('INVALID_ARGUMENT', '"2bananas" is no tolerance.');
  await align();
  await until(toasts, now => now.length === 1 && now[0]!.includes('2bananas'), 'the newer one alone');
  rig.mock.answers['Sync/Align'] = () => ({});
  await align();
  await until(toasts, now => now.length === 0, 'the mistake goes');
  // Of silence: when the daemon answers again.
  await rig.mock.stop();
  await align();
  await until(toasts, now => now.length === 1 && now[0]!.startsWith('The daemon does not answer'), 'silence is told');
  await rig.mock.start();
  await until(toasts, now => now.length === 0, 'silence goes');
});

describe('on a phone', () => {
  const inSight = (page: Page, selector: string) => page.locator(selector).first().evaluate(element => {
    const box = element.getBoundingClientRect();
    const top = document.elementFromPoint(box.left + box.width / 2, box.top + box.height / 2);
    return top !== null && (element === top || element.contains(top));
  });

  test('state, Record and Stop stay on the screen, and the order’s second press is explained beside it', async () => {
    rig.mock.status = locked();
    rig.mock.answers['Capture/Record'] = () => { rig.mock.show(faultyCapturing(0.4)); return {}; };
    const page = await rig.open(kPhone);
    await page.waitForSelector('.tile');
    for (const y of [0, 1e6]) {
      await page.evaluate(to => { scrollTo({top: to}); }, y);
      expect(await inSight(page, 'button.record')).toBe(true);
      expect(await inSight(page, '.bar-state strong')).toBe(true);
    }
    expect(await text(page, '.bar-state')).toContain('Locked');
    await page.locator('button.record').click();
    await until(() => text(page, '.bar-state'), words => words.includes('Recording') && words.includes('3 faults'), 'the state follows');
    const since = () => text(page, '.fault[data-light=AMBER] .note');
    const first = await until(since, words => /, \d+ s$/.test(words), 'how long a fault has lasted is told');
    await until(since, words => words !== first && /, \d+ s$/.test(words), 'it counts without a status');
    await page.locator('button.record').click();
    expect(await text(page, '.bar .hint')).toContain('Within 5 seconds');
    expect(await inSight(page, '.bar .hint')).toBe(true);
    await page.locator('button.record').click();
    await until(() => rig.mock.calls.some(({method}) => method === 'Capture/Stop'), Boolean, 'it is stopped');
    rig.mock.show(faultyAligning());
    await page.waitForSelector('.bar .stop:not([disabled])');
    expect(await inSight(page, '.bar .stop')).toBe(true);
    await page.setViewportSize(kSizes[0]);  // turned, or moved to another screen
    await page.waitForSelector('#alignment .stop');
    expect(await page.locator('#record button.record').count()).toBe(1);
    expect(await page.locator('.bar').isVisible()).toBe(false);
  });

  test('what is pressed is 44 px or more', async () => {
    rig.mock.status = faultyAligning();
    rig.mock.status.faults = rig.mock.status.faults!.map(fault => ({...fault, over: true}));
    rig.mock.answers['Sessions/List'] = () => ({sessions: [{session: 'candle 1', state: 'COMPLETE', purpose: 'flame', created_utc: '2026-11-22T03:15:00Z', cameras: 11, frames: 2112, lost: 0, bytes: 649e6, error: '', calibrated: true}]});
    const page = await rig.open(kPhone);
    await page.waitForSelector('tr[data-session]');
    const small = () => page.locator('button, select, summary, input:not([type=radio]), .choice label').evaluateAll(list => list.filter(each => each.checkVisibility()).map(each => {
      const box = each.getBoundingClientRect();
      return {what: each.getAttribute('aria-label') ?? each.textContent!, width: box.width, height: box.height};
    }).filter(({width, height}) => width < 44 || height < 44));
    expect(await small()).toEqual([]);
    await page.locator('#record summary').click();
    expect(await small()).toEqual([]);
    await page.locator('.tile').first().click();
    await page.waitForSelector('.enlarged[open]');
    expect(await small()).toEqual([]);
    await screenshot(page, 'enlarged-390', true);
  });
});
