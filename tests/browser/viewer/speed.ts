// SPDX-License-Identifier: Apache-2.0
// `npm run speed`: how fast the viewer draws 128 x 128 x 128 voxels at 640 x 480 here, and how soon the first picture is there.
import {mkdtempSync, readdirSync, readFileSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';

import {startChromium} from '../support/chromium';
import {flame, openMade} from '../support/viewer_page';

/** Seconds that processors have worked for what this process started: on a busy machine they tell more than the clock. */
function worked(): number {
  const all = readdirSync('/proc').filter(name => /^\d+$/.test(name)).flatMap(pid => {
    try {
      const told = readFileSync(`/proc/${pid}/stat`, 'utf8');
      const [, parent, ...rest] = told.slice(told.lastIndexOf(')') + 2).split(' ');
      return [{pid: Number(pid), parent: Number(parent), seconds: (Number(rest[9]) + Number(rest[10])) / 100}];
    } catch {
      return [];  // it has ended
    }
  });
  const ours = new Set([process.pid]);
  for (let before = 0; before < ours.size;) {
    before = ours.size;
    for (const {pid, parent} of all) if (ours.has(parent)) ours.add(pid);
  }
  return all.filter(({pid}) => ours.has(pid) && pid !== process.pid).reduce((sum, {seconds}) => sum + seconds, 0);
}

const folder = mkdtempSync(join(tmpdir(), 'emberlock-speed-'));
const browser = await startChromium();
const {page} = await openMade(browser, join(folder, 'flame.html'), [flame(129)]);
const renderer = await page.evaluate(() => {
  const gl = document.createElement('canvas').getContext('webgl2')!;
  return String(gl.getParameter(gl.getExtension('WEBGL_debug_renderer_info')?.UNMASKED_RENDERER_WEBGL ?? gl.RENDERER));
});
console.log(`${renderer}; first picture after ${((await page.evaluate(() => window.emberlockFirstPicture!)) / 1000).toFixed(2)} s`);
await page.addStyleTag({content: '.viewer .stage { width: 640px; height: 480px; min-height: 0; }'});
for (const [value, name] of [['emission', 'colour'], ['density', 'extinction'], ['temperature', 'temperature'], ['temperature', 'three isotherms']] as const) {
  await page.getByLabel('What is shown').selectOption(value);
  await page.waitForSelector(`canvas[data-shown$=" ${value}"]`);
  if (name === 'three isotherms') await page.getByLabel('How many isotherms').fill('3');
  const before = worked();
  const took = await page.evaluate(() => {
    window.emberlockViewer!.drawAt(0);
    const begin = performance.now();
    for (let n = 0; n < 24; ++n) window.emberlockViewer!.drawAt(15 * n);
    return (performance.now() - begin) / 24;
  });
  const cpu = 1000 * (worked() - before) / 25;
  const size = await page.evaluate(() => [document.querySelector('canvas')!.width, document.querySelector('canvas')!.height]);
  console.log(`${name.padEnd(16)} ${took.toFixed(1)} ms a picture of ${size.join(' x ')}, ${(1000 / took).toFixed(1)} a second; ${cpu.toFixed(0)} ms of processors`);
}
await browser.close();
rmSync(folder, {recursive: true});
