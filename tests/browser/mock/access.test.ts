// SPDX-License-Identifier: Apache-2.0
// The page for whoever doesn't see it, or has no mouse: axe-core finds nothing in any of its states, and the keyboard suffices.
import {readFileSync} from 'node:fs';
import {fileURLToPath} from 'node:url';

import type {Page} from 'playwright-core';
import {describe, expect, test} from 'vitest';

import type {AlignmentStatus} from '../../../daemon/console/src/api.gen';
import {bench, drawn, kPhone, kSizes} from './bench';
import {faultyAligning, faultyCapturing, noLamp} from './faulty';
import {Refusal} from './mock';
import {flamePictures} from './pictures';
import {alignment, capturing, idle, locked, reconstruction, sequence} from './scene';
import {StylizedFlame} from './stylize_scene';
import {until} from '../support/chromium';

const kAxe = readFileSync(fileURLToPath(new URL('../../../daemon/console/node_modules/axe-core/axe.min.js', import.meta.url)), 'utf8');
const rig = bench();
const sessions = () => ({sessions: [
  {session: 'candle 1', state: 'COMPLETE' as const, purpose: 'flame', created_utc: '2026-11-22T03:15:00Z', cameras: 11, frames: 2112, lost: 3, bytes: 649e6, error: '', calibrated: true},
  {session: 'torn', state: 'COMPLETE' as const, purpose: 'flame', created_utc: '2026-11-22T03:25:00Z', cameras: 11, frames: 0, lost: 0, bytes: 0, error: 'manifest.json: not JSON. Repair it.', calibrated: false}]});

/** What axe finds: each rule with the elements that break it. */
async function findings(page: Page): Promise<string[]> {
  if (!(await page.evaluate(() => 'axe' in window))) await page.evaluate(kAxe);
  return page.evaluate(async () => {
    const {axe} = window as unknown as {axe: {run(root: Document, options: object): Promise<{violations: {id: string; help: string; nodes: {target: string[]; failureSummary: string}[]}[]}>}};
    const {violations} = await axe.run(document, {resultTypes: ['violations'], preload: false});
    return violations.map(({id, help, nodes}) => `${id}: ${help}: ${nodes.map(node => `${node.target.join(' ')} (${node.failureSummary})`).slice(0, 3).join('; ')}`);
  });
}

describe.each([kSizes[0], kPhone])('axe at $width x $height', size => {
  test('finds nothing in any state', async () => {
    rig.mock.status = idle();
    rig.mock.answers['Sessions/List'] = sessions;
    rig.mock.answers['Ar/Results'] = () => ({results: [{session: 'candle 1', middle_frame: false, frames: [3]}], dictionaries: ['4X4_50']});
    rig.mock.answers['Sync/Align'] = () => { throw new Refusal(400, 'INVALID_ARGUMENT', '"1banana" is no tolerance.'); };
    const page = await rig.open(size);
    await page.waitForSelector('tr[data-session]');
    await drawn(page, 1);
    const over = faultyAligning();
    const offers = [{policy: 'densest', tolerance_rows: 120, cost: {resets: 22, resets_p95: 40, time_s: 90, time_p95_s: 160}}] as AlignmentStatus['offers'];
    const states = {
      aligning: {...faultyAligning(), jobs: [{id: 7, kind: 'SALVAGE' as const, session: 'candle 1', state: 'RUNNING' as const, fraction: 0.34, doing: 'salvaging', seconds: 50, silent_s: 0}]},
      'faults that are over': {...over, faults: over.faults!.map(fault => ({...fault, over: true})), jobs: []},
      recording: {...faultyCapturing(7.3), reconstruction: reconstruction(3)},
      locked: {...locked(), faults: [], recording: {...capturing(8).recording!, state: 'COMPLETE' as const, verdict: '2112 frames, all accounted for.'}},
      'a sequence': {...locked(), reconstruction: sequence('dfdr--')},
      'several hosts': {...locked(), hosts: [{host: 'lab-2:7143', light: 'GREEN' as const, reason: 'answers', connected: true, cameras: 1, clock_ahead_s: 5, clock_sigma_s: 8e-5, round_trip_s: 1.6e-4, parts_wanting: 0},
                                             {host: 'lab-3:7143', light: 'RED' as const, reason: 'it does not answer', connected: false, cameras: 0, clock_sigma_s: 0, round_trip_s: 0, parts_wanting: 1}],
                        cameras: locked().cameras!.map((each, index) => ({...each, host: index === 10 ? 'lab-2:7143' : ''})),
                        recording: {...capturing(8).recording!, state: 'COMPLETE' as const, hosts: [
                          {host: 'lab-3:7143', session: 'candle 1', camera_ids: ['far'], state: 'MISSING' as const, why: 'it does not answer', clock: [], frames: 0, lost: 0, until_ns: 0}]}},
      lent: {...idle(), hosts: [], lent_to: 'dome at lab-1'},
      refused: {...noLamp(), lent_to: '', alignment: alignment(0, {verdict: 'REFUSED', reason: '10 rows would take about 400 resets; 60 are allowed.', offers})},
    };
    for (const [words, status] of Object.entries(states).filter(([words]) => size !== kPhone || ['recording', 'refused', 'a sequence', 'several hosts', 'lent'].includes(words))) {
      rig.mock.show(status);
      rig.mock.notice('AMBER', words);
      await page.waitForFunction(last => document.querySelector('.journal li')?.textContent?.endsWith(last), words);
      expect(await findings(page), words).toEqual([]);
    }
    await page.getByRole('button', {name: 'Align', exact: true}).click();
    await page.waitForSelector('.toast');
    await page.locator('#record summary').click();
    expect(await findings(page), 'a complaint').toEqual([]);
    await page.locator('.tile').first().press('Enter');
    await page.waitForSelector('.enlarged[open]');
    expect(await findings(page), 'enlarged').toEqual([]);
    await page.getByText('Flame on a marker').click();
    await page.getByRole('option', {name: 'candle 1: frame 3'}).waitFor({state: 'attached'});
    expect(await findings(page), 'a flame is chosen').toEqual([]);
    rig.mock.show({ar: {state: 'SHOWN', camera_id: await page.locator('.enlarged h2').innerText(), session: 'candle 1', result: 'frame-3', marker: 'aruco:4X4_50:7:80mm', calibrated: true, pose: 'HELD', without: 2, residual_px: 0, rate_hz: 21, delay_s: 0.04, seen_instead: '', error: ''}});
    await page.getByRole('button', {name: 'Stop the flame'}).waitFor();
    expect(await findings(page), 'a flame is shown').toEqual([]);
    await page.keyboard.press('Escape');
    await page.keyboard.press('?');
    await page.waitForSelector('.help[open]');
    expect(await findings(page), 'keys').toEqual([]);
  });

  test('finds nothing in a stylization, whichever tool is at hand', async () => {
    const flame = new StylizedFlame(rig.mock, await flamePictures(rig.browser, 2));
    const page = await rig.open(size);
    flame.preview();
    await page.waitForSelector('#stylization .stylized[data-view="virtual-00"]');
    for (const name of ['Brush', 'Object', 'Mask', 'Region', 'Colour']) {
      await page.locator('.tool-choice label', {hasText: name}).click();
      expect(await findings(page), name).toEqual([]);
    }
  });
});

describe('by keyboard alone', () => {
  const focused = (page: Page) => page.evaluate(() => {
    const element = document.activeElement as HTMLElement;
    return element.dataset.camera ?? element.getAttribute('aria-label') ?? (element.closest('label')?.innerText || element.innerText || element.id);
  });
  /** Goes on by Tab until this has the focus; each stop on the way is seen, and shows that it has it. */
  async function tabTo(page: Page, words: RegExp): Promise<void> {
    const passed: string[] = [];
    for (let at = 0; at < 80; ++at) {
      await page.keyboard.press('Tab');
      const now = await focused(page);
      passed.push(now);
      if (words.test(now)) return;
    }
    throw new Error(`${String(words)} is not reached by Tab: ${passed.join(' | ')}`);
  }

  test('every control is reached, seen, and shows its focus', async () => {
    rig.mock.status = faultyAligning();
    rig.mock.status.faults = rig.mock.status.faults!.map(fault => ({...fault, over: true}));
    rig.mock.answers['Sessions/List'] = sessions;
    const page = await rig.open(kSizes[1]);
    await page.waitForSelector('tr[data-session]');
    const expected = await page.locator('button, select, summary, input, [tabindex="0"]').evaluateAll(list => list.filter(each => each.checkVisibility() && !(each as HTMLButtonElement).disabled && !each.closest('dialog')).length);
    const stops = new Set<number>();
    for (let at = 0; at < expected + 5; ++at) {
      await page.keyboard.press('Tab');
      const stop = await page.evaluate(() => {
        const element = document.activeElement as HTMLElement;
        if (element === document.body) return undefined;
        const box = (element.matches('.choice input') ? element.nextElementSibling! : element).getBoundingClientRect();
        const middle = document.elementFromPoint(box.left + box.width / 2, box.top + Math.min(box.height / 2, 40));
        const outlined = element.matches('.choice input') ? element.nextElementSibling! : element;
        return {index: [...document.querySelectorAll('*')].indexOf(element), name: element.outerHTML.slice(0, 120), seen: middle !== null && (outlined.contains(middle) || middle.contains(outlined)), outline: getComputedStyle(outlined).outlineWidth};
      });
      if (!stop) break;
      expect(stop.seen, stop.name).toBe(true);
      expect(stop.outline, stop.name).toBe('3px');
      stops.add(stop.index);
    }
    expect(stops.size).toBeGreaterThanOrEqual(expected - 2);  // of a group of radios one is a stop
  });

  test('from the strobe to the volume', async () => {
    rig.mock.status = idle();
    rig.mock.answers['Sessions/List'] = sessions;
    rig.mock.answers['Strobe/Apply'] = () => ({output: 'FLASHING', rate_hz: 24, phase_s: 0, width_s: 2e-5, code: []});
    const page = await rig.open(kSizes[1]);
    await page.waitForSelector('tr[data-session]');
    const called = (method: string) => until(() => rig.mock.calls.find(call => call.method === method)?.request, request => request !== undefined, method);
    await tabTo(page, /^strobe-OFF$/);
    await page.keyboard.press('ArrowRight');  // flashing
    await tabTo(page, /^Apply$/);
    await page.keyboard.press('Enter');
    expect(await called('Strobe/Apply')).toMatchObject({output: 'FLASHING'});
    await page.keyboard.press('a');
    await called('Sync/Align');
    rig.mock.show({...faultyAligning(), faults: []});
    await page.waitForSelector('.tile[data-next]');
    await page.keyboard.press('n');
    expect(await focused(page)).toBe('virtual-04');
    await page.keyboard.press('Enter');
    await page.waitForSelector('.enlarged[open]');
    await tabTo(page, /mark clipped/);
    await page.keyboard.press('Space');
    expect(await page.locator('#exposure-marks').isChecked()).toBe(false);
    await page.keyboard.press('Escape');
    expect(await focused(page)).toBe('virtual-04');
    rig.mock.show(locked());
    await page.waitForSelector('button.record:not([disabled])');
    await page.keyboard.press('r');
    await page.keyboard.press('r');
    await called('Capture/Record');
    rig.mock.show(capturing(3));
    await page.waitForSelector('button.record[data-recording]');
    await page.keyboard.press('r');
    await page.keyboard.press('r');
    await called('Capture/Stop');
    rig.mock.show(locked());
    await tabTo(page, /^Reconstruct candle 1$/);
    await page.keyboard.press('Tab');
    await page.keyboard.type('250');  // beyond the last: the browser says so, there
    await page.keyboard.press('Shift+Tab');
    await page.keyboard.press('Enter');
    expect(await focused(page)).toBe('Frame of candle 1 to reconstruct');
    await page.keyboard.press('Control+a');
    await page.keyboard.type('120');
    await page.keyboard.press('Shift+Tab');
    await page.keyboard.press('Enter');
    expect(await called('Reconstruct/Start')).toEqual({session: 'candle 1', frame: 120});
  });
});
