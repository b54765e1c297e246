// SPDX-License-Identifier: Apache-2.0
// The whole walk of an operator, from strobe to volume: the built page before emberlockd with eleven virtual cameras in real
// time. What the page shows is held against what the API says. Times are printed, never asked for.
import {existsSync} from 'node:fs';
import {fileURLToPath} from 'node:url';

import type {Browser, Locator, Page} from 'playwright-core';
import {afterAll, afterEach, beforeAll, expect, test} from 'vitest';

import type {DaemonStatus, ListSessionsResponse, Manifest, ReconstructionStatus} from '../../../daemon/console/src/api.gen';
import {decode} from '../../../daemon/console/src/wire';
import {openPage, screenshot, startChromium, until, type Watched} from '../support/chromium';
import {Daemon, virtualRig} from '../support/daemon';
import {correlation, facts, grey, number, numbers, seconds} from '../support/shown';
import {frameToScreen} from './figures';

const kBuild = fileURLToPath(new URL('../../../build/release', import.meta.url));
const kConsole = process.env.EMBERLOCK_CONSOLE ?? `${kBuild}/console`;
const kBin = process.env.EMBERLOCK_BIN ?? `${kBuild}/bin`;
const kCameras = 11;
const kTolerance = 30;  // rows
const kRig = virtualRig('eleven virtual cameras', kCameras, '320x240');

const daemon = new Daemon();
const figures: Record<string, string> = {};
let browser: Browser;
let watched: Watched;
let page: Page;
let failed = false;
const text = (selector: string) => page.locator(selector).first().innerText();
const rounded = (value: number | undefined, digits: number) => Number(value?.toFixed(digits)) + 0;
const lostBy = (status: DaemonStatus) => status.cameras.reduce((sum, {counts: c}) => sum + c!.damaged + c!.camera_gap + c!.transport + c!.resend + c!.underrun + c!.queue, 0);
const totalLost = (status: DaemonStatus) => {
  const {recorded, passed_over, ...lost} = status.recording!.lost!;
  return Object.values(lost).reduce((sum, frames) => sum + frames, 0);
};

/** What the page shows comes to be what the daemon tells: both change meanwhile, so they are read again until they agree. */
async function agrees<T>(words: string, shown: () => Promise<T>, told: (status: DaemonStatus) => T): Promise<void> {
  const pair = async () => {
    const before = JSON.stringify(told(await daemon.status()));
    const seen = JSON.stringify(await shown());
    return {seen, told: [before, JSON.stringify(told(await daemon.status()))]};
  };
  await until(pair, ({seen, told: [before, after]}) => seen === before || seen === after, `the page shows what the daemon tells: ${words}`);
}

/** As agrees(), of a number that changes all the time: what is shown lies between what was told before and after, to `grain`. */
async function follows(words: string, shown: () => Promise<number>, told: (status: DaemonStatus) => number, grain: number): Promise<void> {
  const triple = async () => [told(await daemon.status()), await shown(), told(await daemon.status())] as const;
  await until(triple, ([before, seen, after]) => seen >= Math.min(before, after) - grain && seen <= Math.max(before, after) + grain, `the page follows the daemon: ${words}`);
}

beforeAll(async () => {
  if (!existsSync(`${kBin}/emberlockd`)) throw new Error(`${kBin}/emberlockd is not there: build it, or name its folder in EMBERLOCK_BIN`);
  await daemon.start(kBin, kConsole, kRig);
  browser = await startChromium();
  watched = await openPage(browser, daemon.url, {width: 1920, height: 1080});
  page = watched.page;
});
afterEach(({task}) => { failed ||= task.result?.state === 'fail'; });
afterAll(async () => {
  if (failed && page) await screenshot(page, 'failed');
  await browser?.close();
  await daemon.stop();
  console.log(failed ? `emberlockd said last:\n${daemon.log.split('\n').slice(-60).join('\n')}` : Object.entries(figures).map(([name, value]) => `${name.padEnd(40)} ${value}`).join('\n'));
});

test('a browser that nobody let in is told what to do; the link opens the console, once, and leaves the address', async () => {
  expect(await text('h1')).toContain('by a link');
  expect(await text('pre')).toBe('emberlock console');
  await screenshot(page, 'stranger');
  const link = daemon.link();
  await page.goto(link);
  await until(() => text('h1'), words => words === 'Idle', 'the console is open');
  expect(page.url()).toBe(daemon.url);
  expect(await page.evaluate(() => document.cookie)).toBe('');
  const other = await openPage(browser, link, {width: 800, height: 600});
  expect(await other.page.locator('[role=alert]').innerText()).toContain('opened already');
  // The token opens it too, by the page's own form.
  await other.page.fill('input[name=token]', 'this is another token');
  await other.page.keyboard.press('Enter');
  await until(() => other.page.locator('[role=alert]').innerText(), words => words === 'That is not the token.', 'it is refused');
  await other.page.fill('input[name=token]', daemon.token);
  await other.page.keyboard.press('Enter');
  await until(() => other.page.locator('h1').first().innerText(), words => words === 'Idle', 'the token opens the console');
  expect(other.page.url()).toBe(daemon.url);
  await other.page.context().close();
});

test('idle: eleven cameras are live, the disk has room', async () => {
  await until(() => text('h1'), words => words === 'Idle', 'the rig is idle');
  await until(() => page.evaluate(() => window.emberlockDiagnostics.shown.size), cameras => cameras === kCameras, 'all are shown');
  await agrees('the cameras', () => tiles(tile => tile.id), status => status.cameras.map(camera => camera.id));
  await follows('how many frames they lost', async () => (await tiles(tile => tile.lost)).reduce((sum, lost) => sum + lost, 0), lostBy, 0);
  await agrees('the reason and what to do next', () => Promise.all([text('.phase .reason'), text('.next .next-step')]), status => [status.reason, status.next_step]);
  await follows('minutes left on the disk', async () => number(await text('.disk')), status => status.storage!.minutes_left, 1);
});

test('the strobe does what it is told, and says so', async () => {
  await page.fill('#strobe-rate', '23.976');
  await page.fill('#strobe-width', '50');
  await page.locator('label[for=strobe-FLASHING]').click();
  await page.locator('#strobe button[type=submit]').click();
  const words = await until(() => text('#strobe .read-back'), now => /^Reads back: .* Hz, phase .*, width 50 µs, flashing$/.test(now), 'it reads back');
  const told = await daemon.call<{output: string; rate_hz: number; width_s: number}>('Strobe/Get');
  expect(told.output).toBe('FLASHING');
  expect(told.width_s).toBeCloseTo(50e-6, 9);
  expect(Math.abs(told.rate_hz - 23.976)).toBeLessThanOrEqual(0.002);  // a strobe has steps
  expect(number(words)).toBe(rounded(told.rate_hz, 3));
});

test('aligning: who is being reset is the same everywhere', async () => {
  await page.fill('#tolerance', `${kTolerance}rows`);
  await page.locator('#alignment button[type=submit]').click();
  await until(() => text('h1'), words => words === 'Aligning', 'it aligns');
  // Read in one go: it changes from round to round.
  const {step, marked} = await until(() => page.evaluate(() => ({
    step: document.querySelector('.next .next-step')!.textContent!,
    marked: [...document.querySelectorAll<HTMLElement>('.tile:has(.next-mark:not([hidden]))')].map(tile => [tile.dataset.camera!, tile.querySelector('.word')!.textContent!]),
  })), now => now.marked.length > 0, 'one is to be reset');
  expect(step).toBe(`${marked.map(([id]) => id).join(', ')} ${marked.length > 1 ? 'are' : 'is'} being reset by command.`);
  expect(marked.map(([, word]) => word)).not.toContain('in tolerance');
  await screenshot(page, 'aligning');
});

/** Of each tile, in the daemon's order. */
async function tiles<T>(read: (tile: {id: string; word: string; light: string; rows: number; micros: number; drift: number; trials: number; lost: number}) => T): Promise<T[]> {
  const all = await page.locator('.tile').evaluateAll(list => list.map(tile => {
    const words = (selector: string) => tile.querySelector(selector)!.textContent!;
    return {id: (tile as HTMLElement).dataset.camera!, light: (tile as HTMLElement).dataset.light!, word: words('.word'), rows: words('.error-rows'),
            time: words('.error-time'), facts: [...tile.querySelectorAll('dd')].map(each => each.textContent!)};
  }));
  return all.sort((a, b) => (a.id < b.id ? -1 : 1)).map(({id, light, word, rows, time, facts: [drift, , trials, lost]}) =>
    read({id, light, word, rows: number(rows), micros: number(time), drift: number(drift!), trials: number(trials!), lost: number(lost!)}));
}

test('locked: every camera green, its offset in rows and microseconds, its dot in the band', async () => {
  await until(() => text('h1'), words => words === 'Locked', 'all are locked');
  await agrees('offsets, drifts and resets', () => tiles(({lost, ...tile}) => tile), status => status.cameras.map(camera => ({
    id: camera.id, light: 'GREEN', word: 'in tolerance', rows: rounded(camera.error_rows, 1), micros: rounded(camera.error_s! * 1e6, 0),
    drift: rounded(camera.drift_ppm, 1), trials: camera.resets,
  })));
  for (const {rows} of await tiles(tile => tile)) expect(Math.abs(rows)).toBeLessThanOrEqual(kTolerance);
  const bands = () => page.locator('.tile').evaluateAll(list => list.sort((a, b) => ((a as HTMLElement).dataset.camera! < (b as HTMLElement).dataset.camera! ? -1 : 1)).map(tile =>
    [...tile.querySelectorAll<SVGRectElement>('.band')].map(({y, height}) => [y.baseVal.value, height.baseVal.value].map(value => Math.round(10 * value)))));
  await agrees('the bands of tolerance', bands, status => status.cameras.map(camera => camera.band.map(({first, last}) => [first + 0.5, last - first].map(value => Math.round(10 * value)))));
  // A round that looks for one camera may pass the others' dots by; the next shows them.
  const dots = await until(() => page.locator('.tile').evaluateAll(list => list.flatMap(tile => {
    const spans = [...tile.querySelectorAll<SVGRectElement>('.band')].map(({y, height}) => [y.baseVal.value, y.baseVal.value + height.baseVal.value] as const);
    return [...tile.querySelectorAll<SVGPathElement>('.dots path')].map(dot => dot.getBBox().y + dot.getBBox().height / 2)
      .map(dot => ({camera: (tile as HTMLElement).dataset.camera, dot, spans, inside: spans.some(([first, last]) => dot >= first - 2 && dot <= last + 2)}));
  })), shown => shown.length > kCameras / 2, 'most cameras show their dot');
  expect(dots.filter(({inside}) => !inside)).toEqual([]);
  await agrees('the sums of the alignment', async () => {
    const shown = await facts(page.locator('#alignment .numbers'));
    return [shown['tolerance ±']!.split('(')[1], shown.policy, number(shown.resets!), number(shown.checks!)];
  }, ({alignment}) => [`${kTolerance.toFixed(kTolerance < 99.5 ? 1 : 0)} rows)`, alignment!.policy, alignment!.resets, alignment!.checks]);
  await follows('time left in tolerance', async () => seconds((await facts(page.locator('#alignment .numbers')))['time left']!), status => status.alignment!.time_left_s ?? 0, 1);
  await screenshot(page, 'locked');
});

test('at phone width nothing is wider than the screen', async () => {
  const phone = await openPage(browser, daemon.link(), {width: 360, height: 800});
  await phone.page.waitForSelector('.tile[data-light=GREEN]');
  await phone.page.waitForFunction(() => window.emberlockDiagnostics.shown.size > 0);
  expect(await phone.page.evaluate(() => document.documentElement.scrollWidth)).toBe(360);
  await screenshot(phone.page, 'phone');
  expect(phone.complaints).toEqual([]);
  await phone.page.context().close();
});

test('pictures are seen no sooner than they came', async () => {
  const {seen, rates, late, known_ms} = await frameToScreen(page, kCameras, 50);
  figures['live tiles'] = `${rates.length}, ${(rates.reduce((a, b) => a + b, 0) / rates.length).toFixed(1)} pictures a second each, the slowest ${Math.min(...rates).toFixed(1)}`;
  figures['frame to screen, median'] = `${late[Math.floor(late.length / 2)]!.toFixed(0)} ms of ${seen} pictures (clocks known to ${known_ms.toFixed(1)} ms)`;
  figures['frame to screen, 95 %'] = `${late[Math.floor(0.95 * late.length)]!.toFixed(0)} ms`;
  expect(late[0]).toBeGreaterThan(-2 * known_ms);
});

let frames = 0;
let lost = 0;

test('recorded: what is shown is what the daemon, its files and its books say', async () => {
  await page.locator('#record summary').click();
  await page.fill('#record input[name=name]', 'walk');
  await page.locator('#record summary').click();
  await page.locator('button.record').click();
  await until(() => text('h1'), words => words === 'Recording', 'it records');
  const shown = async (name: string) => number((await facts(page.locator('#record .numbers')))[name]!);
  await follows('frames', () => shown('frames safe'), status => status.recording!.frames, 0);
  await follows('the clock', async () => number((await text('.record-line .clock')).replace('0:', '')), status => status.recording!.seconds, 0.1);
  await agrees('losses', async () => numbers(await text('.drops')).reduce((all, frames) => all + frames, 0), totalLost);
  await until(() => shown('frames safe'), now => now > kCameras * 30, 'some seconds are recorded');
  await screenshot(page, 'recording');
  await page.locator('button.record').dblclick();  // the first press arms, the second within 5 s stops
  await until(() => page.locator('#record').getAttribute('data-recording'), state => state === 'COMPLETE' || state === 'FAILED', 'it ends');
  expect(await page.locator('#record').getAttribute('data-recording'), await text('#record .verdict')).toBe('COMPLETE');
  await agrees('frames and verdict at the end', async () => [await shown('frames safe'), await text('#record .verdict')], ({recording}) => [recording!.frames, recording!.verdict]);
  await follows('megabytes written', () => shown('written'), status => status.recording!.bytes / 1e6, 0.6);
  await follows('minutes left on the disk', async () => number(await text('.disk')), status => status.storage!.minutes_left, 1);
  frames = await shown('frames safe');
  const manifest = decode('Manifest', await daemon.call('Sessions/Get', {session: 'walk'})) as Manifest;
  expect(manifest.cameras).toHaveLength(kCameras);
  expect(manifest.cameras.reduce((sum, camera) => sum + camera.counts!.recorded, 0)).toBe(frames);
  const status = await daemon.status();
  const {cameras, lost: sum, verdict} = status.recording!;
  lost = totalLost(status);
  expect(cameras.reduce((sum, camera) => sum + camera.recorded, 0)).toBe(frames);
  expect(sum!.recorded).toBe(frames);
  expect(number(verdict)).toBe(frames);
  figures['recorded'] = `${frames} frames of ${kCameras} cameras, ${lost} lost`;
});

test('the session is listed, and verified', async () => {
  const row = page.locator('tr[data-session=walk]');
  await row.waitFor();
  await until(() => row.locator('.state').innerText(), words => words.trim() === (lost > 0 ? 'complete, frames lost' : 'complete'), 'complete');
  const [told] = (decode('ListSessionsResponse', await daemon.call('Sessions/List')) as ListSessionsResponse).sessions;
  const cell = async (name: string) => number(await row.locator(`td[data-name=${name}]`).innerText());
  expect([await cell('Cameras'), await cell('Frames'), await cell('Lost')]).toEqual([told!.cameras, told!.frames, told!.lost]);
  expect(told).toMatchObject({cameras: kCameras, frames, lost, calibrated: true});
  await page.getByRole('button', {name: 'Verify walk'}).click();
  await until(() => row.locator('.job').getAttribute('data-ok'), ok => ok !== null, 'verified');
  expect(await row.locator('.job').getAttribute('data-ok'), await row.locator('.job').innerText()).toBe('true');
});

/** What the page shows of a reconstruction, each time that it changes. */
interface Sight { word: string; iterations: number; error: string; captured: number; rendered: number }

async function watchReconstruction(): Promise<() => Promise<Sight[]>> {
  await page.evaluate(() => {
    const place = document.querySelector('#reconstruction')!;
    const sights: Sight[] = [];
    const at = (kind: number) => Number(place.querySelectorAll('.pair canvas')[kind]!.getAttribute('data-iteration') ?? -1);
    new MutationObserver(() => {
      const latest = place.querySelector('.latest')!;
      const sight = {word: place.querySelector('header .word')!.textContent!, iterations: Number(latest.getAttribute('data-iterations')), error: latest.textContent!, captured: at(0), rendered: at(1)};
      if (JSON.stringify(sight) !== JSON.stringify(sights.at(-1))) sights.push(sight);
    }).observe(place, {subtree: true, childList: true, characterData: true, attributes: true});
    Object.assign(window, {sights});
  });
  return () => page.evaluate(() => (window as unknown as {sights: Sight[]}).sights);
}

test('reconstructed: iteration after iteration, the error falls, the rendered view comes to be the captured one', async () => {
  const sights = await watchReconstruction();
  await page.getByRole('button', {name: 'Reconstruct walk'}).click();
  await until(() => text('#reconstruction > header .word'), words => words === 'done' || words === 'failed', 'it ends');
  expect(await text('#reconstruction > header .word'), await text('#reconstruction')).toBe('done');
  const {iterations, result} = (await daemon.status()).reconstruction!;
  const errors = iterations.map(iteration => iteration.input_rmse);
  expect(errors.at(-1)).toBeLessThan(errors[0]!);
  const seen = await sights();
  expect(new Set(seen.filter(({word}) => word === 'running').map(sight => sight.iterations)).size, 'seen while it ran').toBeGreaterThan(2);
  for (const {iterations: many, error} of seen) {
    if (many > 0) expect(error).toContain(`Iteration ${iterations[many - 1]!.iteration}: error ${errors[many - 1]!.toFixed(2)} of 255`);
  }
  expect(seen.at(-1)).toMatchObject({iterations: iterations.length, captured: iterations.at(-1)!.iteration, rendered: iterations.at(-1)!.iteration});
  expect(await text('.result')).toBe(`Written to ${result}`);
  expect(existsSync(`${result}/volume.vdb`)).toBe(true);
  const line = await plotted(page.locator('.progress .chart canvas').first());
  expect(line.first, 'the line begins high').toBeLessThan(line.last);
  const [captured, rendered] = await Promise.all([grey(page, page.locator('.pair canvas').nth(0)), grey(page, page.locator('.pair canvas').nth(1))]);
  expect(Math.max(...captured.levels)).toBeGreaterThan(40);
  const alike = correlation(captured.levels, rendered.levels);
  expect(alike).toBeGreaterThan(0.9);
  figures['reconstructed'] = `${iterations.length} iterations in ${iterations.at(-1)!.seconds.toFixed(1)} s, error ${errors[0]!.toFixed(2)} to ${errors.at(-1)!.toFixed(2)} of 255, views alike to ${alike.toFixed(3)}`;
});

/** How high the plotted line stands where it begins and ends: pixels from the top. */
async function plotted(canvas: Locator): Promise<{first: number; last: number}> {
  return canvas.evaluate((place: HTMLCanvasElement) => {
    const {width, height} = place;
    const bytes = place.getContext('2d')!.getImageData(0, 0, width, height).data;
    const columns: number[] = [];
    for (let x = 0; x < width; ++x) {
      for (let y = 0; y < height; ++y) {
        const at = 4 * (y * width + x);
        if (bytes[at + 3]! > 200 && Math.abs(bytes[at]! - 0x56) + Math.abs(bytes[at + 1]! - 0xb4) + Math.abs(bytes[at + 2]! - 0xe9) < 30) {
          columns.push(y);
          break;
        }
      }
    }
    return {first: columns[0] ?? NaN, last: columns.at(-1) ?? NaN};
  });
}

test('the volume is seen, and turns by mouse and by key', async () => {
  const volume = page.locator('.volume[data-voxels]');
  await volume.waitFor();
  await volume.scrollIntoViewIfNeeded();
  const look = () => grey(page, volume);
  const changed = (a: number[], b: number[]) => a.filter((level, at) => Math.abs(level - b[at]!) > 8).length / a.length;
  let before = await until(look, ({levels}) => levels.filter(level => level > 60).length > 0.005 * levels.length, 'a flame is drawn');
  const turned = async (how: string) => {
    const now = await until(look, ({levels}) => changed(levels, before.levels) > 0.005, `it turned ${how}`);
    before = now;
  };
  await page.keyboard.press('2');
  await screenshot(page, 'reconstruction');
  const box = (await volume.boundingBox())!;
  await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
  await page.mouse.down();
  await page.mouse.move(box.x + box.width / 2 + 40, box.y + box.height / 2 + 90, {steps: 5});
  await page.mouse.up();
  await turned('by mouse');
  for (const key of ['ArrowUp', 'ArrowUp', 'ArrowUp']) await volume.press(key);
  await turned('by key');
});

test('two frames, one after the other, are played', async () => {
  const {cameras, frames} = (decode('ListSessionsResponse', await daemon.call('Sessions/List')) as ListSessionsResponse).sessions.find(({session}) => session === 'walk')!;
  const middle = Math.floor(frames / cameras / 2);
  // Next to a browser, cameras in real time lose frames: some instants are not known to all of them.
  let first = middle;
  let ended: ReconstructionStatus | undefined;
  for (const away of [0, 5, -5, 10, -10, 15, -15, 20, -20]) {
    first = middle + away;
    await page.getByLabel('Frame of walk to reconstruct', {exact: true}).fill(String(first));
    await page.getByLabel('Last frame of walk to reconstruct, of several').fill(String(first + 1));
    await page.getByRole('button', {name: 'Reconstruct walk'}).click();
    ended = await until(async () => (await daemon.status()).reconstruction!, ({frames: two, state}) => two[0]?.frame === first && state !== 'RUNNING', 'both have ended');
    if (lost === 0 || !ended.error.includes('has no complete frame')) break;
  }
  expect(ended!.state, ended!.error).toBe('DONE');
  await until(() => text('.sequence .tally'), words => words === 'Frames: 2 of 2 done', 'both are done');
  await until(() => text('.player .label'), words => words.startsWith(`frame ${first + 1}, 2 of 2: error `), 'the last one is shown');
  await page.getByRole('slider', {name: 'Frame of the sequence'}).press('Home');
  await until(() => text('.player .label'), words => words.startsWith(`frame ${first}, 1 of 2: error `), 'the first one is shown');
  expect(await page.locator('.toast').count()).toBe(0);
});

test('the daemon gone is told', async () => {
  expect(watched.complaints).toEqual([]);
  daemon.kill();
  await page.waitForSelector('.connection-lost:not([hidden])');
  expect(await text('.connection-lost')).toMatch(/What is shown is old/);
});
