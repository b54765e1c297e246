// SPDX-License-Identifier: Apache-2.0
// Cameras of several hosts: who answers, which camera is whose, what each keeps of a recording; and the console of a host that lends its cameras.
import type {Page} from 'playwright-core';
import {expect, test} from 'vitest';

import type {DaemonStatus, HostPart, HostStatus} from '../../../daemon/console/src/api.gen';
import {clockWords, hostWords, shortHost} from '../../../daemon/console/src/hosts';
import {bench, drawn, kPhone, kSizes, overflows, text} from './bench';
import {aligning, capturing, idle, locked} from './scene';
import {screenshot, until} from '../support/chromium';

const rig = bench();
const kFirst = 'lab-2:7143';
const kSecond = 'lab-3:7143';

function host(name: string, change: Partial<HostStatus> = {}): HostStatus {
  return {host: name, light: 'GREEN', reason: 'answers', connected: true, cameras: 4, clock_ahead_s: 5, clock_sigma_s: 80e-6, round_trip_s: 160e-6, parts_wanting: 0, ...change};
}
const gone = (change: Partial<HostStatus> = {}) => host(kSecond, {light: 'RED', connected: false, cameras: 3, clock_ahead_s: undefined, reason: 'Nobody answers at lab-3:7143. It is asked again every second.', ...change});

function part(name: string, state: HostPart['state'], change: Partial<HostPart> = {}): HostPart {
  return {host: name, session: '2026-11-22_031500', camera_ids: ['a', 'b', 'c'], state, why: '', clock: [], frames: 0, lost: 0, until_ns: 0, ...change};
}

/** The last seven of eleven cameras are others': four of one host, three of another. */
function spread(status: Partial<DaemonStatus>, hosts = [host(kFirst), host(kSecond, {cameras: 3})]): Partial<DaemonStatus> {
  return {...status, hosts, cameras: status.cameras!.map((camera, index) => ({...camera, driver: index < 4 ? 'virtual' : 'remote', host: index < 4 ? '' : index < 8 ? kFirst : kSecond}))};
}

/** Whose text is cut off, or lies below its tile. */
async function cut(page: Page, selector: string): Promise<string[]> {
  return page.locator(selector).evaluateAll(all => all.filter(each => {
    const box = each.getBoundingClientRect();
    const tile = each.closest('.tile')!.getBoundingClientRect();
    return box.height > 0 && (each.scrollWidth > each.clientWidth + 1 || box.right > tile.right + 1 || box.bottom > tile.bottom + 1);
  }).map(each => each.textContent!));
}

const line = (page: Page, name: string, where = '#hosts') => page.locator(`${where} li[data-host="${name}"]`);

test('each host with its light, word, cameras, clock and round trip', async () => {
  rig.mock.status = spread(locked(), [host(kFirst), gone({parts_wanting: 2})]);
  const page = await rig.open();
  await line(page, kFirst).waitFor();
  expect(await text(page, '#hosts header .note')).toBe('1 of 2 connected');
  expect((await line(page, kFirst).innerText()).split(/\n+/)).toEqual([kFirst, 'connected', '4 cameras · clock 5.000 s ahead ± 80 µs · round trip 160 µs']);
  expect((await line(page, kSecond).innerText()).split(/\n+/)).toEqual([kSecond, 'not connected', '3 cameras', '2 parts of recordings wanting', 'Nobody answers at lab-3:7143. It is asked again every second.']);
  const shapes = await page.locator('#hosts .sign path').evaluateAll(paths => paths.map(path => path.getAttribute('d')));
  expect(new Set(shapes).size).toBe(2);
  rig.mock.show({hosts: [host(kFirst, {light: 'AMBER', reason: 'its clock is known to 40 ms alone'}), host(kSecond)]});
  await until(() => text(page, '#hosts header .note'), words => words === 'all connected', 'it is back');
  expect(await line(page, kFirst).locator('.word').innerText()).toBe('connected, look');
  expect(await line(page, kFirst).locator('.reason').innerText()).toBe('Its clock is known to 40 ms alone.');
});

test('a rig of one host has no panel of hosts, no parts and no banner', async () => {
  rig.mock.status = capturing(3);
  const page = await rig.open();
  await page.waitForSelector('.tile');
  for (const part of ['#hosts', '.parts', '.lent', '.tile .at']) expect(await page.locator(part).first().isVisible(), part).toBe(false);
  expect(await text(page, '.drops')).toBe('No frame lost');
});

test.each(kSizes)('tiles say whose a camera is at $width x $height, and nothing is cut', async size => {
  rig.mock.status = spread(aligning(9));
  const page = await rig.open(size);
  await page.waitForSelector('.tile[data-next]');
  const at = await page.locator('.tile').evaluateAll(tiles => tiles.map(tile => {
    const seen = [...tile.querySelectorAll<HTMLElement>('.at')].filter(each => each.checkVisibility());
    return [(tile as HTMLElement).dataset.camera, ...seen.flatMap(each => [each.textContent, each.title])];
  }));
  const of = (id: string) => at.find(([camera]) => camera === id)!.slice(1);
  expect(of('virtual-03')).toEqual([]);
  expect(of('virtual-07')).toEqual(['lab-2', kFirst]);
  expect(of('virtual-08')).toEqual(['lab-3', kSecond]);
  await page.waitForTimeout(300);
  expect(await cut(page, '.tile h3, .tile .error-more, .tile .word, .tile dd')).toEqual([]);
  expect(await overflows(page)).toBe(0);
  await drawn(page, 1);
  await screenshot(page, `hosts-aligning-${size.width}`, size === kPhone);
  await page.locator('.tile[data-camera=virtual-08]').press('Enter');
  const facts = await page.locator('.enlarged .facts').innerText();
  expect(facts).toMatch(/host\s+lab-3:7143/);
  await page.keyboard.press('Escape');
  await page.locator('.enlarged').waitFor({state: 'hidden'});
  await page.locator('.tile[data-camera=virtual-03]').press('Enter');
  await until(() => page.locator('.enlarged h2').innerText(), title => title === 'virtual-03', 'it is shown');
  expect(await page.locator('.enlarged .facts').innerText()).not.toMatch(/host/);
});

test('of cameras that are lost with their host the tile says which', async () => {
  const status = spread(locked(), [host(kFirst), gone()]);
  rig.mock.status = {...status, cameras: status.cameras!.map(each => each.host === kSecond ? {...each, state: 'LOST', light: 'RED', reason: 'Its host does not answer.'} : each)};
  const page = await rig.open(kSizes[1]);
  await page.waitForSelector('.tile[data-state=LOST]');
  expect(await page.locator('.tile[data-state=LOST] h3').allInnerTexts()).toEqual(['virtual-08 lab-3', 'virtual-09 lab-3', 'virtual-10 lab-3']);
  expect(await page.locator('.tile[data-state=FILMING] h3 .at:visible').count()).toBe(0);
  expect(await cut(page, '.tile h3, .tile .error-more, .tile .word, .tile dd')).toEqual([]);
  await drawn(page, 8);
  await screenshot(page, 'hosts-lost-1280');
});

test('a recording lists the other hosts’ parts, and says that its own counts are its own', async () => {
  const recording = capturing(7).recording!;
  rig.mock.status = spread(capturing(7, {hosts: [part(kFirst, 'RECORDING', {frames: 480}), part(kSecond, 'MISSING', {why: 'It does not answer; it goes on there, and is asked for until it is known.'})]}), [host(kFirst), gone({parts_wanting: 1})]);
  const page = await rig.open();
  await line(page, kFirst, '.parts').waitFor();
  expect((await line(page, kFirst, '.parts').innerText()).split(/\n+/)).toEqual([kFirst, 'recording', '3 cameras, 480 frames, none lost']);
  expect((await line(page, kSecond, '.parts').innerText()).split(/\n+/)).toEqual([kSecond, 'missing', '3 cameras', 'It does not answer; it goes on there, and is asked for until it is known.']);
  expect(await text(page, '.drops')).toBe('No frame lost here');
  await drawn(page, 11);
  await screenshot(page, 'hosts-recording');
  rig.mock.show({...spread(locked()), recording: {...recording, state: 'COMPLETE', verdict: 'All frames of this host are accounted for.',
    hosts: [part(kFirst, 'WHOLE', {frames: 672, lost: 2}), part(kSecond, 'SHORT', {frames: 72, why: 'It was started again after 3 s.'})]}});
  await until(() => line(page, kFirst, '.parts').locator('.word').innerText(), word => word === 'whole', 'it is whole');
  expect(await line(page, kFirst, '.parts').locator('.note').innerText()).toBe('3 cameras, 672 frames, 2 lost');
  expect((await line(page, kSecond, '.parts').innerText()).split(/\n+/)).toEqual([kSecond, 'short', '3 cameras, 72 frames, none lost', 'It was started again after 3 s.']);
  rig.mock.show({...locked(), hosts: [], recording: {...recording, state: 'COMPLETE', hosts: []}});
  await page.locator('.parts').waitFor({state: 'hidden'});
});

test('sessions say where their parts are and how many are wanting, and are read again when one has come', async () => {
  const entry = {session: 'candle 1', state: 'COMPLETE' as const, purpose: 'flame', created_utc: '2026-11-22T03:15:00Z', cameras: 4, frames: 2112, bytes: 649e6, calibrated: true};
  let wanting = 1;
  rig.mock.answers['Sessions/List'] = () => ({sessions: [{...entry, hosts: 2, hosts_wanting: wanting}, {...entry, session: 'candle 2', led_by: 'dome at lab-1'}, {...entry, session: 'candle 3'}]});
  rig.mock.status = spread(idle(), [host(kFirst), gone({parts_wanting: 1})]);
  const page = await rig.open();
  const row = (session: string) => page.locator(`tr[data-session="${session}"]`);
  await row('candle 1').waitFor();
  expect(await row('candle 1').locator('.hosts').innerText()).toBe('2 other hosts, 1 part wanting');
  expect(await row('candle 1').locator('.state').innerText()).toBe('complete here');
  expect(await row('candle 1').locator('.state .sign').getAttribute('data-light')).toBe('AMBER');
  expect(await row('candle 2').locator('.hosts').innerText()).toBe('led by dome at lab-1');
  expect(await row('candle 3').locator('.hosts').isVisible()).toBe(false);
  expect(await row('candle 3').locator('.state').innerText()).toBe('complete');
  await row('candle 1').scrollIntoViewIfNeeded();
  await screenshot(page, 'hosts-sessions');
  wanting = 0;
  rig.mock.show({hosts: [host(kFirst), host(kSecond)]});
  await until(() => row('candle 1').locator('.hosts').innerText(), words => words === '2 other hosts', 'it is whole again');
  expect(await row('candle 1').locator('.state .sign').getAttribute('data-light')).toBe('GREEN');
});

test.each([kSizes[1], kPhone])('a host whose cameras are lent says to whom at $width x $height', async size => {
  rig.mock.status = {...idle(), lent_to: 'dome at lab-1'};
  const page = await rig.open(size);
  await page.waitForSelector('.lent:not([hidden])');
  expect(await text(page, '.lent')).toBe('These cameras are lent to dome at lab-1: align and record there.');
  expect(await text(page, '#hosts .lent-to')).toBe('Lends its cameras to dome at lab-1.');
  expect(await page.locator('#hosts li').count()).toBe(0);
  expect(await overflows(page)).toBe(0);
  await screenshot(page, `hosts-lent-${size.width}`, size === kPhone);
  rig.mock.show({lent_to: ''});
  await page.locator('.lent').waitFor({state: 'hidden'});
  await page.locator('#hosts').waitFor({state: 'hidden'});
});

test('words of clocks and names', () => {
  expect(clockWords(-0.0321, 0.0015)).toBe('32.1 ms behind ± 1.50 ms');
  expect(clockWords(0, 42e-6)).toBe('0 µs ahead ± 42 µs');
  expect(clockWords(-93784.5, 42e-6)).toBe('93784.500 s behind ± 42 µs');
  expect(hostWords(host(kFirst, {connected: false, cameras: 1, clock_ahead_s: undefined}))).toBe('1 camera');
  expect(shortHost(kFirst, [host(kFirst), host(kSecond)])).toBe('lab-2');
  expect(shortHost('127.0.0.1:7143', [host('127.0.0.1:7143'), host('127.0.0.1:7144')])).toBe('127.0.0.1:7143');
  expect(shortHost('[fe80::1]:7143', [])).toBe('[fe80::1]');
  expect(shortHost('', [host(kFirst)])).toBe('');
});
