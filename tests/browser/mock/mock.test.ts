// SPDX-License-Identifier: Apache-2.0
// The page before a daemon that plays what real rigs seldom do: states, disconnects, refusals, faults, eleven cameras at every width.
import {readdirSync, statSync} from 'node:fs';
import {fileURLToPath} from 'node:url';

import type {Browser, Page} from 'playwright-core';
import {afterAll, afterEach, beforeAll, beforeEach, describe, expect, test} from 'vitest';

import {Mock, Refusal} from './mock';
import {flamePictures, flameVolume, lampPictures} from './pictures';
import {aligning, alignment, camera, capturing, idle, iteration, locked, reconstruction, seen} from './scene';
import {openPage, screenshot, startChromium, until, type Watched} from '../support/chromium';

const kConsole = process.env.EMBERLOCK_CONSOLE ?? fileURLToPath(new URL('../../../build/release/console', import.meta.url));
const kScreen = {width: 1920, height: 1080};
const kLaptop = {width: 1280, height: 800};
const kPhone = {width: 360, height: 800};

let browser: Browser;
let lamp: Uint8Array[];
let flame: Uint8Array[];
let greyFlame: Uint8Array[];
let mock: Mock;
const opened: Watched[] = [];

beforeAll(async () => {
  browser = await startChromium();
  lamp = await lampPictures(browser, 6);
  flame = await flamePictures(browser, 12);
  greyFlame = await flamePictures(browser, 1, 'grayscale(1)');
});
afterAll(() => browser.close());

beforeEach(async () => {
  mock = new Mock(kConsole);
  mock.jpeg = (_, frame) => lamp[frame % lamp.length];
  await mock.start();
});
afterEach(async () => {
  const complaints = opened.flatMap(each => each.complaints);
  for (const {page} of opened.splice(0)) await page.context().close();
  await mock.stop();
  expect(complaints, 'what the browser complained of').toEqual([]);
});

async function open(size = kScreen): Promise<Page> {
  const watched = await openPage(browser, mock.url, size);
  opened.push(watched);
  await watched.page.waitForSelector('.link[data-connection=open]');
  return watched.page;
}
const text = (page: Page, selector: string) => page.locator(selector).first().innerText();
const overflows = (page: Page) => page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
/** Whether any pixel of this part of the page, as it is seen, has a colour. */
async function colourful(page: Page, selector: string): Promise<boolean> {
  const png = (await page.locator(selector).first().screenshot()).toString('base64');
  return page.evaluate(async data => {
    const bitmap = await createImageBitmap(new Blob([Uint8Array.from(atob(data), letter => letter.charCodeAt(0))]));
    const context = new OffscreenCanvas(bitmap.width, bitmap.height).getContext('2d')!;
    context.drawImage(bitmap, 0, 0);
    const bytes = context.getImageData(0, 0, bitmap.width, bitmap.height).data;
    return bytes.some((red, at) => at % 4 === 0 && Math.max(red, bytes[at + 1]!, bytes[at + 2]!) - Math.min(red, bytes[at + 1]!, bytes[at + 2]!) > 24);
  }, png);
}

describe('what is shown', () => {
  test('eleven cameras, orders and the header stand on one screen of 1920 x 1080, and of 1280 x 800', async () => {
    mock.status = idle();
    for (const size of [kScreen, kLaptop]) {
      const page = await open(size);
      mock.show(aligning(9));
      await page.waitForSelector('.tile[data-next]');
      await page.waitForTimeout(700);
      const boxes = await page.locator('.tile').evaluateAll(tiles => tiles.map(tile => tile.getBoundingClientRect()).map(box => ({bottom: box.bottom, width: box.width})));
      expect(boxes).toHaveLength(11);
      for (const box of boxes) {
        expect(box.bottom).toBeLessThanOrEqual(size.height);
        expect(box.width).toBeGreaterThan(150);
      }
      expect(await overflows(page)).toBe(0);
      await screenshot(page, `aligning-${size.width}`);
    }
  });

  test('who is to be reset stands first, twice as wide, and in words', async () => {
    mock.status = aligning(9);
    const page = await open();
    await page.waitForSelector('.tile[data-next]');
    const [first, second] = await page.locator('.tile').evaluateAll(tiles => tiles.slice(0, 2).map(tile => ({id: (tile as HTMLElement).dataset.camera, width: tile.getBoundingClientRect().width})));
    expect(first!.id).toBe('virtual-04');
    expect(first!.width).toBeGreaterThan(1.9 * second!.width);
    expect(await text(page, '.tile[data-next] .next-mark')).toBe('Reset this camera now');
    expect(await text(page, '.next .title')).toBe('Reset virtual-04');
    expect(await text(page, '.next .next-step')).toBe('Press the shutter of virtual-04. It is 412 rows (22.2 ms) late; 100 (5.40 ms) are allowed.');
    await page.keyboard.press('n');
    expect(await page.evaluate(() => (document.activeElement as HTMLElement).dataset.camera)).toBe('virtual-04');
  });

  test('cameras that are reset by command call nobody, and all stay on the screen', async () => {
    const byCommand = aligning(9);
    mock.status = {...byCommand, next_step: '', alignment: {...byCommand.alignment!, reset_next: ''},
                   cameras: byCommand.cameras!.map((each, index) => ({...each, reset: 'ON_COMMAND', reset_next: index === 4 || index === 5}))};
    const page = await open();
    await page.waitForSelector('.tile .next-mark:not([hidden])');
    expect(await page.locator('.tile .next-mark:visible').allInnerTexts()).toEqual(['Being reset', 'Being reset']);
    expect(await page.locator('[data-next], [data-reset]').count()).toBe(0);
    expect(await text(page, '.next')).toBe('Wait\n\nvirtual-04, virtual-05 are being reset by command.');
    for (const bottom of await page.locator('.tile').evaluateAll(tiles => tiles.map(tile => tile.getBoundingClientRect().bottom))) expect(bottom).toBeLessThanOrEqual(kScreen.height);
    await screenshot(page, 'by-command-1920');
  });

  test('a tile tells error in rows and time, drift, time left, trials and losses', async () => {
    mock.status = {...locked(), cameras: [seen(0, 30, false, {
      error_rows: -21.44, error_s: -1.158e-3, drift_ppm: 2.31, time_left_s: 412, resets: 3, lost_lately: 5,
      counts: {delivered: 900, damaged: 1, camera_gap: 0, transport: 4, resend: 0, underrun: 0, queue: 0, passed_over: 100},
    })]};
    const page = await open();
    const tile = page.locator('.tile');
    expect(await tile.locator('.error-rows').innerText()).toBe('−21.4 rows');
    expect(await tile.locator('.error-time').innerText()).toBe('−1 158 µs');
    expect(await tile.locator('dd').allInnerTexts()).toEqual(['+2.3 ppm', '6 min 52 s', '3', '5']);
    expect(await tile.locator('.word').innerText()).toBe('in tolerance');
  });

  test('every state has a word beside its colour, and a shape of its own', async () => {
    mock.status = {...idle(), phase: 'ALIGNING', alignment: alignment(1), cameras: [
      seen(0, 30, false), seen(1, 1, false, {error_rows: 440, error_s: 0.0238}), camera(2, {state: 'LOST', light: 'RED', reason: 'Went away; it is being looked for. Look at its cable.'}),
      camera(3, {state: 'QUARANTINED', light: 'RED', reason: 'Hangs. Switch it off and on.'}), camera(4, {sight: 'ambiguous', light: 'AMBER', reason: 'Two dots fit. Move the strobe.'}),
      camera(5, {state: 'STOPPED', light: 'LIGHT_UNSPECIFIED'}),
    ]};
    const page = await open();
    await page.waitForSelector('.tile');
    expect(await page.locator('.tile .word').allInnerTexts()).toEqual(['in tolerance', 'out of tolerance', 'lost', 'hangs', 'ambiguous', 'stopped']);
    const shapes = await page.locator('.tile header .sign path').evaluateAll(paths => paths.map(path => path.getAttribute('d')));
    expect(new Set([shapes[0], shapes[1], shapes[4], shapes[5]]).size).toBe(4);
    await screenshot(page, 'states-1920');
  });

  test('lamp, dot, target row and band are drawn where the daemon says, in the picture’s own pixels', async () => {
    mock.status = {...locked(), cameras: [seen(0, 30, false, {width: 640, height: 480, lamp: {x: 320, y: 400}, lamp_radius: 26, dots: [{x: 320, y: 240}], target_row: 120, band: [{first: 100, last: 140}, {first: 440, last: 479.5}]})]};
    const page = await open();
    await page.waitForFunction(() => window.emberlockDiagnostics.shown.size === 1);
    const where = await page.evaluate(() => {
      const box = (selector: string) => document.querySelector(`.tile .overlay ${selector}`)!.getBoundingClientRect();
      const frame = document.querySelector('.tile .overlay')!.getBoundingClientRect();
      const scale = Math.min(frame.width / 640, frame.height / 480);
      const left = frame.left + (frame.width - 640 * scale) / 2;
      const top = frame.top + (frame.height - 480 * scale) / 2;
      const lamp = box('.lamp');
      const dot = box('.dots path');
      return {lamp: [(lamp.left + lamp.width / 2 - left) / scale, (lamp.top + lamp.height / 2 - top) / scale, lamp.width / scale / 2],
              dot: (dot.top + dot.height / 2 - top) / scale, target: (box('.target').top - top) / scale,
              bands: [...document.querySelectorAll('.tile .overlay .band')].map(each => each.getBoundingClientRect()).map(each => [(each.top - top) / scale, each.height / scale])};
    });
    expect(where.lamp[0]).toBeCloseTo(320.5, 0);
    expect(where.lamp[1]).toBeCloseTo(400.5, 0);
    expect(where.lamp[2]).toBeCloseTo(26, 0);
    expect(where.dot).toBeCloseTo(240.5, 0);
    expect(where.target).toBeCloseTo(120.5, 0);
    expect(where.bands.flat()).toEqual([100.5, 40, 440.5, 39.5].map(rows => expect.closeTo(rows, 0)));  // a band that wraps is two
    const colour = await page.evaluate(() => {
      const canvas = document.querySelector<HTMLCanvasElement>('.tile canvas')!;
      return [...canvas.getContext('2d')!.getImageData(320, 400, 1, 1).data.slice(0, 3)];
    });
    expect(Math.min(...colour)).toBeGreaterThan(240);  // the lamp itself
  });

  test('rounds are plotted though they come apart from the status, and go as the next alignment begins', async () => {
    mock.status = aligning(12);
    const page = await open();
    await page.waitForSelector('#alignment .plot:not([hidden]) canvas');
    mock.tell({status: {...mock.status, alignment: {...mock.status.alignment, history: []}}});  // as nothing is new of them
    await page.waitForTimeout(200);
    expect(await page.locator('#alignment .plot').isVisible()).toBe(true);
    mock.show({alignment: alignment(0, {history: []})});
    await page.waitForSelector('#alignment .plot', {state: 'hidden'});
  });

  test('numbers not known yet are dashes, never zeros or NaN', async () => {
    mock.status = idle();
    mock.show({alignment: alignment(2, {worst_pair_s: undefined, cost: undefined}), cameras: [camera(0)]});
    const page = await open();
    await page.waitForSelector('.tile');
    expect(await text(page, '.tile .error-rows')).toBe('– rows');
    expect(await page.evaluate(() => document.body.innerText)).not.toMatch(/NaN|undefined|Infinity/);
  });

  test('eleven tiles live', async () => {
    mock.status = locked();
    const page = await open();
    await until(() => page.evaluate(() => window.emberlockDiagnostics.summary().cameras), cameras => cameras === 11, 'all are live');
    await until(() => text(page, '#diagnostics'), words => /^11 live · [\d.]+ fps \(least [\d.]+\) · frame to screen \d+ ms \(95 %: \d+ ms\)$/.test(words), 'the line tells of them');
    await screenshot(page, 'locked-1920');
    const enlarged = page.locator('dialog.enlarged');
    await page.locator('.tile').nth(3).press('Enter');
    await until(() => mock.wanted[0], wanted => wanted?.camera_ids.join() === 'virtual-03' && wanted.rate_hz === 24, 'only the enlarged one is asked for');
    await page.keyboard.press('ArrowRight');
    expect(await enlarged.locator('h2').innerText()).toBe('virtual-04');
    await page.waitForTimeout(500);
    await screenshot(page, 'enlarged-1920');
    await page.keyboard.press('Escape');
    expect(await enlarged.isVisible()).toBe(false);
    await until(() => page.evaluate(() => (document.activeElement as HTMLElement).dataset.camera), id => id === 'virtual-04', 'its tile has the focus');
    await until(() => mock.wanted[0], wanted => wanted?.camera_ids.length === 0, 'all are asked for again');
  });

  test('on a phone nothing is wider than the screen', async () => {
    mock.status = {...aligning(9), recording: capturing(8).recording, reconstruction: reconstruction(3)};
    mock.answers['Sessions/List'] = () => ({sessions: [{session: '2026-11-22_031500', state: 'COMPLETE', purpose: 'flame', created_utc: '2026-11-22T03:15:00Z', cameras: 11, frames: 2112, lost: 0, bytes: 649e6, error: '', calibrated: true}]});
    const page = await open(kPhone);
    await page.waitForSelector('tr[data-session]');
    await page.waitForTimeout(500);
    expect(await overflows(page)).toBe(0);
    await until(() => mock.wanted[0]?.camera_ids.length, count => count! > 0 && count! < 11, 'only tiles in sight are asked for');
    await screenshot(page, 'phone-360', true);
    await screenshot(page, 'phone-first-360');
    await page.locator('.tile').first().click();
    await page.waitForTimeout(300);
    expect(await overflows(page)).toBe(0);
    await screenshot(page, 'phone-enlarged-360');
  });
});

describe('the connection', () => {
  test('lost is shown at once, and it comes back by itself', async () => {
    mock.status = locked();
    const page = await open();
    await page.waitForSelector('.tile');
    await page.clock.install();
    await page.clock.pauseAt(Date.now() + 60_000);
    await mock.stop();
    await page.waitForSelector('.connection-lost:not([hidden])');  // while the page's clock stands still
    expect(await text(page, '.connection-lost')).toMatch(/What is shown is old/);
    await screenshot(page, 'lost-1920');
    mock.status = idle();
    await mock.start();
    await page.clock.resume();
    await page.waitForSelector('.link[data-connection=open]');
    expect(await page.locator('.connection-lost').isVisible()).toBe(false);
    expect(await text(page, 'h1')).toBe('Idle');
  });

  test('a daemon that says nothing more is found out', async () => {
    mock.status = locked();
    const page = await open();
    mock.silent = true;
    await page.waitForSelector('.connection-lost:not([hidden])');
    mock.silent = false;
    await page.waitForSelector('.link[data-connection=open]');
  });

  test('a link opens the console and leaves the address; after a new start a token or another link is asked for', async () => {
    mock.status = idle();
    mock.token = 'first start';
    mock.link = '0123';
    const watched = await openPage(browser, `${mock.url}open?link=0123`, kLaptop);
    opened.push(watched);
    const {page} = watched;
    await page.waitForSelector('.link[data-connection=open]');
    expect(page.url()).toBe(mock.url);
    mock.token = 'sesame street';
    await mock.stop();
    await mock.start();
    await page.waitForSelector('dialog.token[open]');
    expect(await text(page, 'dialog.token')).toContain('emberlock console');
    await page.fill('#token', 'open');
    await page.keyboard.press('Enter');
    await page.waitForFunction(() => document.querySelector('dialog.token .note')!.textContent === 'That is not the token.');
    await screenshot(page, 'token-1280');
    await page.fill('#token', 'sesame street');
    await page.keyboard.press('Enter');
    await page.waitForSelector('.link[data-connection=open]');
    expect(await page.locator('dialog.token').isVisible()).toBe(false);
  });

  test('a console that made room for a newer one says so and does not push that one out', async () => {
    mock.status = locked();
    const page = await open();
    mock.close(4001);
    await page.waitForSelector('.link[data-connection=displaced]');
    expect(await text(page, '.connection-lost')).toContain('Reload to take it back');
    await new Promise(resolve => setTimeout(resolve, 1500));  // longer than it waits before it connects again
    expect(mock.wanted).toEqual([]);
  });

  test('a hidden page asks for no pictures', async () => {
    mock.status = locked();
    const page = await open();
    await until(() => mock.wanted[0], wanted => wanted !== null, 'pictures are asked for');
    await page.evaluate(() => {
      Object.defineProperty(document, 'hidden', {value: true, configurable: true});
      document.dispatchEvent(new Event('visibilitychange'));
    });
    await until(() => mock.wanted[0], wanted => wanted === null, 'none is asked for');
  });
});

describe('orders', () => {
  test('a refusal’s offers are buttons that ask for exactly that', async () => {
    mock.status = idle();
    mock.show({light: 'RED', reason: 'Refused: 10 rows can’t be met by hand within 60 resets.', alignment: alignment(0, {
      verdict: 'REFUSED', tolerance_rows: 10, reason: '10 rows would take about 400 resets; 60 are allowed.', offers: [
        {policy: 'densest', tolerance_rows: 120, tolerance_s: 6.48e-3, cost: {resets: 22, resets_p95: 40, time_s: 90, time_p95_s: 160}},
        {policy: 'timed', tolerance_rows: 60.5, tolerance_s: 3.267e-3, cost: {resets: 12, resets_p95: 19, time_s: 40, time_p95_s: 75}}]})});
    const page = await open();
    expect(await page.locator('.offer').allInnerTexts()).toEqual([
      '± 6.48 ms (120 rows), densest\n22 resets in 90 s (95 %: 40 in 2 min 40 s)', expect.stringContaining('12 resets')]);
    await screenshot(page, 'refused-1920');
    await page.locator('.offer').nth(1).click();
    await page.getByRole('button', {name: 'Try it anyway'}).click();
    await until(() => mock.calls.filter(({method}) => method === 'Sync/Align').map(({request}) => request), calls => calls.length === 2, 'two orders');
    const orders = mock.calls.filter(({method}) => method === 'Sync/Align').map(({request}) => request);
    expect(orders[0]).toEqual({tolerance: '60.5rows', policy: 'timed', anyway: false});
    expect(orders[1]).toMatchObject({anyway: true});
  });

  test('what the daemon refuses is told in its words', async () => {
    mock.status = idle();
    mock.answers['Sync/Align'] = () => { throw new Refusal(400, 'FAILED_PRECONDITION', 'align: no camera films. Start them first.'); };
    const page = await open();
    await page.fill('#tolerance', '100');
    await page.getByRole('button', {name: 'Align', exact: true}).click();
    await page.waitForSelector('.toast');
    expect(await text(page, '.toast p')).toBe('align: no camera films. Start them first.');
    expect(mock.calls.find(({method}) => method === 'Sync/Align')!.request).toMatchObject({tolerance: '100ms'});
    await page.getByRole('button', {name: 'Dismiss'}).click();
    expect(await page.locator('.toast').count()).toBe(0);
  });

  const records = () => mock.calls.filter(({method}) => method.startsWith('Capture/'));

  test('locked, one press records; stopping takes two', async () => {
    mock.status = locked();
    mock.answers['Capture/Record'] = () => { mock.show(capturing(0.1)); return {}; };
    mock.answers['Capture/Stop'] = () => { mock.show({...locked(), recording: {...capturing(8).recording!, state: 'COMPLETE', verdict: '2112 frames, all accounted for.'}}); return {}; };
    const page = await open();
    await page.locator('button.record').click();
    await until(() => text(page, 'h1'), words => words === 'Recording', 'it records');
    expect(records()[0]!.request).toMatchObject({unlocked: false, purpose: 'flame', seconds: 0});
    mock.show(capturing(7.35, {lost: {recorded: 1900, camera_gap: 0, transport: 3, underrun: 0, queue: 9, disk: 0, passed_over: 0}, queue_fill: 0.83}));
    await until(() => text(page, '.clock'), words => words === '0:07.3', 'the clock runs');
    expect(await text(page, '.drops')).toBe('Lost: 9 found the queue full, 3 lost on the bus');
    expect(await text(page, '#record .numbers')).toContain('81.1 MB/s');
    await screenshot(page, 'recording-1920');
    await page.locator('button.record').click();
    expect(await text(page, 'button.record')).toMatch(/Press again/);
    expect(records()).toHaveLength(1);
    await page.locator('button.record').click();
    await until(() => text(page, '#record .verdict'), words => words === '2112 frames, all accounted for.', 'the verdict is shown');
    expect(records()).toHaveLength(2);
  });

  test('how long a take may be is said, and a longer one renews the lock first', async () => {
    mock.status = locked();
    mock.answers['Sync/Align'] = () => ({});
    mock.answers['Capture/Record'] = () => { mock.show(capturing(0.1)); return {}; };
    const page = await open();
    await until(() => text(page, '.hint'), words => words === 'A take may be 6 min 40 s long, most likely 15 min 00 s.', 'it is said');
    await page.locator('#record summary').click();
    await page.fill('input[name=seconds]', '900');
    await page.locator('button.record').click();
    await until(() => mock.calls.filter(({method}) => method === 'Sync/Align').length, many => many === 1, 'the lock is renewed');
    expect(mock.calls.find(({method}) => method === 'Sync/Align')!.request).toEqual({renew: true, hold_s: 900});
    expect(records()).toHaveLength(0);
    await until(() => text(page, '.hint'), words => words.includes('press again'), 'the next press records');
    await page.locator('button.record').click();
    await until(() => records().length, many => many === 1, 'it records');
  });

  test('not locked, a second press is needed and says why; by key always', async () => {
    mock.status = idle();
    const page = await open();
    await page.waitForSelector('.tile');
    await page.keyboard.press('r');
    expect(await text(page, 'button.record')).toBe('Press again: record unlocked');
    expect(await text(page, '.hint')).toMatch(/not be of the same instants/);
    expect(records()).toHaveLength(0);
    mock.show(locked());  // what was armed for another phase doesn't count
    await until(() => text(page, 'button.record'), words => words === 'Record', 'disarmed');
    await page.keyboard.press('r');
    expect(records()).toHaveLength(0);
    await page.keyboard.press('r');
    await until(() => records().length, many => many === 1, 'it records');
    expect(records()[0]!.request).toMatchObject({unlocked: false});
  });

  test('a letter typed into a field orders nothing', async () => {
    mock.status = locked();
    const page = await open();
    await page.locator('#record summary').click();
    await page.locator('#record input[name=name]').pressSequentially('rare arrangement');
    expect(await text(page, 'button.record')).toBe('Record');
    expect(records()).toHaveLength(0);
  });

  test('the strobe is set in Hz, ms and µs, and what it read back is shown', async () => {
    mock.status = idle();
    mock.answers['Strobe/Apply'] = () => ({output: 'FLASHING', rate_hz: 23.9762, phase_s: 0.004, width_s: 2e-5, code: []});
    const page = await open();
    await page.waitForSelector('#strobe-rate');
    await page.fill('#strobe-rate', '23.976');
    await page.fill('#strobe-phase', '4');
    await page.fill('#strobe-width', '20');
    await page.locator('label[for=strobe-FLASHING]').click();
    mock.show();  // a status that comes meanwhile overwrites nothing
    await page.waitForTimeout(100);
    await page.locator('#strobe button[type=submit]').click();
    await until(() => text(page, '#strobe .read-back'), words => words === 'Reads back: 23.976 Hz, phase +4.00 ms, width 20 µs, flashing'.replace('+', ''), 'read back');
    expect(mock.calls.find(({method}) => method === 'Strobe/Apply')!.request).toEqual({output: 'FLASHING', rate_hz: 23.976, phase_s: 0.004, width_s: expect.closeTo(2e-5, 12), code: []});
    mock.show(aligning(3));
    await page.waitForFunction(() => (document.querySelector('#strobe button') as HTMLButtonElement).disabled);
  });

  test('a fault names what happened and what to do; over, it can be acknowledged', async () => {
    mock.status = idle();
    mock.show({light: 'RED', reason: 'The strobe doesn’t answer.', faults: [
      {id: 3, kind: 'CAMERA_LOST', light: 'AMBER', subject: 'virtual-02', what: 'It went away.', remedy: 'Look at its cable.', since_utc: '2026-11-22T03:10:00Z', over: true},
      {id: 7, kind: 'STROBE_SILENT', light: 'RED', subject: 'ttyACM0', what: 'No answer for 2 s.', remedy: 'Look at its cable and power.', since_utc: '2026-11-22T03:12:00Z', over: false}]});
    const page = await open();
    expect(await page.locator('.fault p').allInnerTexts()).toEqual(['Strobe silent (ttyACM0): No answer for 2 s. Look at its cable and power.', 'Camera lost (virtual-02): It went away. Look at its cable.']);
    await screenshot(page, 'faults-1920');
    await page.locator('.fault[data-over] button').click();
    await until(() => mock.calls.find(({method}) => method === 'Daemon/Acknowledge')?.request, request => request?.fault_id === 3, 'acknowledged');
  });

  test('by keyboard alone: focus is seen, ? lists the keys', async () => {
    mock.status = locked();
    const page = await open();
    await page.waitForSelector('.tile');
    await page.keyboard.press('Tab');
    const outline = await page.evaluate(() => getComputedStyle(document.activeElement!).outlineWidth);
    expect(outline).toBe('3px');
    await page.keyboard.press('ArrowRight');
    expect(await page.evaluate(() => (document.activeElement as HTMLElement).dataset.camera)).toBe('virtual-01');
    await page.keyboard.press('?');
    expect(await page.locator('dialog.help dt').allInnerTexts()).toContain('R');
    await screenshot(page, 'help-1920');
    await page.keyboard.press('Escape');
    expect(await page.locator('dialog.help').isVisible()).toBe(false);
  });

  test('a change of phase is announced', async () => {
    mock.status = idle();
    const page = await open();
    mock.show(aligning(3));
    await until(() => page.locator('#announcements').textContent(), words => words === 'Aligning. Reset virtual-01.' || /^Aligning\. Reset/.test(words ?? ''), 'announced');
    expect(await page.locator('#announcements').getAttribute('aria-live')).toBe('assertive');
  });
});

describe('what was recorded', () => {
  const entry = {session: 'candle 1', state: 'COMPLETE' as const, purpose: 'flame', created_utc: '2026-11-22T03:15:00Z', cameras: 11, frames: 15840, lost: 0, bytes: 14.6e9, error: '', calibrated: true};

  test('sessions are listed, verified with progress, exported, reconstructed', async () => {
    mock.status = idle();
    mock.answers['Sessions/List'] = () => ({sessions: [entry, {...entry, session: 'torn', error: 'manifest.json: not JSON. Repair it.', calibrated: false}]});
    let go: () => void = () => undefined;
    mock.jobs['Sessions/Verify'] = async function* () {
      yield {fraction: 0.4, doing: 'reads virtual-03'};
      await new Promise<void>(resolve => { go = resolve; });
      const cameras = [{camera_id: 'virtual-01', recorded: 15840, good: 15838, missing: 2, problems: ['000000.mkv: ends early']}];
      yield {state: 'DONE', fraction: 1, outcome: {ok: true, verify: {cameras, to_do: 'Nothing'}}};
    };
    mock.jobs['Sessions/Export'] = async function* () { yield {state: 'DONE', fraction: 1, outcome: {ok: false}}; };
    const page = await open();
    const row = page.locator('tr[data-session="candle 1"]');
    expect(await row.locator('td').allInnerTexts()).toEqual(expect.arrayContaining(['flame', '11', '15 840', '0', '14.6 GB']));
    expect(await page.locator('tr[data-session=torn] .state').innerText()).toContain('unreadable: manifest.json: not JSON. Repair it.');
    expect(await page.getByRole('button', {name: 'Reconstruct torn'}).isDisabled()).toBe(true);
    await page.getByRole('button', {name: 'Verify candle 1'}).click();
    await until(() => row.locator('.job > span').innerText(), words => words === 'reads virtual-03 40 %', 'progress');
    go();
    await until(() => row.locator('.job > span').innerText(), words => words === 'Done: all is well', 'done');
    expect(await row.locator('.report').innerText()).toBe('15 838 of 15 840 frames are good\n2 are missing from the index\nvirtual-01: 000000.mkv: ends early\nNothing.');
    await page.getByRole('button', {name: 'Export videos candle 1'}).click();
    await until(() => row.locator('.job').getAttribute('data-ok'), ok => ok === 'false', 'failed');
    expect(mock.calls.find(({method}) => method === 'Sessions/Export')!.request).toEqual({session: 'candle 1', format: 'VIDEO'});
    await page.getByRole('button', {name: 'Reconstruct candle 1'}).click();
    await until(() => mock.calls.some(({method, request}) => method === 'Reconstruct/Start' && request.session === 'candle 1'), Boolean, 'started');
  });

  test('exported videos can be downloaded; of images the folder is told', async () => {
    mock.status = idle();
    mock.answers['Sessions/List'] = () => ({sessions: [{...entry, session: 'пламя: 1'}]});
    mock.jobs['Sessions/Export'] = async function* ({format}) {
      const video = format === 'VIDEO';
      const cameras = ['north', 'south:2'].map(camera_id => ({camera_id, file: video ? `${camera_id}.mp4` : camera_id, frames: 10}));
      yield {state: 'DONE', fraction: 1, outcome: {ok: true, export: {cameras, codec: video ? 'libx264' : '', folder: video ? '/data/exports/video' : '/data/exports/png'}}};
    };
    const page = await open();
    const report = page.locator('tr[data-session="пламя: 1"] .report');
    await page.getByRole('button', {name: 'Export videos пламя: 1'}).click();
    await until(() => report.innerText(), words => words === '20 frames in /data/exports/video\nnorth.mp4\nsouth:2.mp4', 'videos');
    const folder = '/exports/%D0%BF%D0%BB%D0%B0%D0%BC%D1%8F%3A%201/video';
    expect(await report.locator('a').evaluateAll(links => links.map(link => [link.getAttribute('href'), link.getAttribute('download')])))
      .toEqual([[`${folder}/north.mp4`, 'north.mp4'], [`${folder}/south%3A2.mp4`, 'south:2.mp4']]);
    await page.getByRole('button', {name: 'Export images пламя: 1'}).click();
    await until(() => report.innerText(), words => words.includes('png, one file a frame'), 'images');
    expect(await report.locator('a').count()).toBe(0);
  });

  test('a job that fails on its way, or breaks off, is told, and looks so', async () => {
    mock.status = idle();
    mock.answers['Sessions/List'] = () => ({sessions: [entry]});
    mock.jobs['Sessions/Repair'] = async function* () {
      yield {fraction: 0.4, doing: 'reads virtual-03'};
      yield {code: 'INTERNAL', message: 'candle 1: the disk is full. Free space.'} as object;
    };
    mock.jobs['Sessions/Export'] = async function* () { yield {fraction: 0.4, doing: 'writes virtual-03'}; };
    const page = await open();
    const row = page.locator('tr[data-session="candle 1"]');
    await page.getByRole('button', {name: 'Repair candle 1'}).click();
    await until(() => row.locator('.job').getAttribute('data-ok'), ok => ok === 'false', 'failed');
    expect(await text(page, '.toast p')).toBe('Candle 1: the disk is full. Free space.');
    await page.getByRole('button', {name: 'Export images candle 1'}).click();
    await until(() => page.locator('.toast').count(), count => count === 2, 'broke off');
    expect(await page.locator('.toast p').last().innerText()).toContain('broke off before it was done');
  });

  test('a session that is being salvaged says how far it is, and nothing else is done to it', async () => {
    mock.status = idle();
    mock.answers['Sessions/List'] = () => ({sessions: [{...entry, state: 'RECORDING' as const}, {...entry, session: 'other'}]});
    const page = await open();
    await page.waitForSelector('tr[data-session]');
    const job = {id: 7, kind: 'SALVAGE' as const, session: 'candle 1', state: 'RUNNING' as const, fraction: 0.34, doing: 'salvaging', seconds: 50, silent_s: 0};
    mock.show({jobs: [job]});
    const row = page.locator('tr[data-session="candle 1"]');
    await until(() => row.locator('.background .words').innerText(), words => words === 'being salvaged, 34 %', 'how far');
    for (const words of ['Verify', 'Export images', 'Reconstruct']) {
      expect(await page.getByRole('button', {name: `${words} candle 1`}).isDisabled()).toBe(true);
      expect(await page.getByRole('button', {name: `${words} other`}).isDisabled()).toBe(false);
    }
    mock.show({jobs: [{...job, silent_s: 41}]});
    await until(() => row.locator('.background .words').innerText(), words => words === 'being salvaged, 34 %, nothing new for 41 s', 'silent');
    await page.getByRole('button', {name: /^Cancel job .* on candle 1$/}).click();
    await until(() => mock.calls.some(({method, request}) => method === 'Jobs/Cancel' && request.id === 7), Boolean, 'cancelled');
    mock.show({jobs: []});
    await until(() => page.getByRole('button', {name: 'Export images candle 1'}).isDisabled(), disabled => !disabled, 'free again');
    expect(await row.locator('.background').isVisible()).toBe(false);
  });

  test('a reconstruction is seen after every iteration, and its volume turns', async () => {
    mock.status = locked();
    const page = await open();
    for (let at = 1; at <= 5; ++at) {
      mock.show({reconstruction: reconstruction(at)});
      mock.tell({iteration: {reconstruction: 'r1', iteration: iteration(at), camera_id: 'virtual-03'}});
      mock.tellBytes({kind: 'captured', iteration: at, camera_id: 'virtual-03'}, flame[11]!);
      mock.tellBytes({kind: 'rendered', iteration: at, camera_id: 'virtual-03'}, flame[at]!);
    }
    const {header, bytes} = flameVolume();
    mock.tellBytes(header, bytes);
    await page.waitForSelector('.pair canvas[data-iteration="5"]');
    expect(await text(page, '.latest')).toBe('Iteration 5: error 4.74 of 255, held out about 5.98');
    expect(await text(page, '#reconstruction header')).toContain('adjusts the volume · 42 %');
    await page.locator('#reconstruction').scrollIntoViewIfNeeded();
    await page.waitForSelector('.volume[data-voxels="32768"] canvas');
    await page.waitForTimeout(800);
    const picture = async () => (await page.locator('.volume').screenshot()).toString('base64');
    const before = await picture();
    const box = (await page.locator('.volume').boundingBox())!;
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    await page.mouse.down();
    await page.mouse.move(box.x + box.width / 2 + 120, box.y + box.height / 2 + 10, {steps: 5});
    await page.mouse.up();
    await until(picture, now => now !== before, 'it turned');
    await page.keyboard.press('2');
    await page.waitForTimeout(400);
    await screenshot(page, 'reconstruction-1920');
    // Of grey cameras all is grey.
    expect(await text(page, '.turn .note')).toContain('brightness in false colours');
    expect(await colourful(page, '.volume')).toBe(true);
    mock.tellBytes({kind: 'captured', iteration: 6, camera_id: 'virtual-03'}, greyFlame[0]!);
    await until(() => text(page, '.turn .note'), words => words.includes('grey as its cameras see it'), 'the volume is grey');
    expect(await colourful(page, '.volume')).toBe(false);
    expect(await colourful(page, '.pair canvas')).toBe(false);
    await page.getByRole('button', {name: 'Cancel'}).click();
    await page.getByRole('button', {name: 'Press again to cancel'}).click();
    await until(() => mock.calls.some(({method}) => method === 'Reconstruct/Cancel'), Boolean, 'cancelled');
  });

  test('the journal shows the newest line first, and each once', async () => {
    mock.status = idle();
    mock.notice('GREEN', 'Started.');
    mock.notice('AMBER', 'virtual-02 went away.');
    const page = await open();
    mock.notice('GREEN', 'virtual-02 is back.');
    await until(() => page.locator('.journal li').allInnerTexts(), lines => lines.length === 3, 'three lines');
    expect((await page.locator('.journal li').allInnerTexts())[0]).toContain('virtual-02 is back.');
  });
});

test('the page stays small: what is loaded before the first volume or stylization is below 200 kB', () => {
  const files = readdirSync(`${kConsole}/assets`).filter(name => !/^(volume|panel)-/.test(name));
  expect(files.length).toBeGreaterThan(1);
  expect(files.reduce((sum, name) => sum + statSync(`${kConsole}/assets/${name}`).size, 0)).toBeLessThan(200_000);
});
