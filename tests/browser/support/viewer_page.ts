// SPDX-License-Identifier: Apache-2.0
// Pages as `emberlock view` writes them, of volumes that tests make; and the browser that opens them from the disk.
import {readFileSync, writeFileSync} from 'node:fs';
import {fileURLToPath, pathToFileURL} from 'node:url';
import {deflateSync} from 'node:zlib';

import type {Browser, Page} from 'playwright-core';

import {kHangGuard} from './chromium';
import {type Channel, type Contents, type Frame, kBrick, type Triple, type View} from '../../../daemon/console/src/viewer/contents';

export const kViewer = process.env.EMBERLOCK_CONSOLE ?? fileURLToPath(new URL('../../../build/release/console', import.meta.url));
export const kPrograms = process.env.EMBERLOCK_BIN ?? fileURLToPath(new URL('../../../build/release/bin', import.meta.url));

/** A float32 block of report/viewer_page.h, before it is deflated. */
export function packed([nx, ny, nz]: Triple, lanes: 1 | 3, values: Float32Array): Uint8Array {
  const [bx, by, bz] = [nx, ny, nz].map(n => Math.ceil(n / kBrick)) as [number, number, number];
  const mask = new Uint8Array(Math.ceil(bx * by * bz / 8));
  const filled: number[] = [];
  for (let brick = 0; brick < bx * by * bz; ++brick) {
    const [i0, j0, k0] = [brick % bx, Math.floor(brick / bx) % by, Math.floor(brick / (bx * by))].map(b => kBrick * b) as [number, number, number];
    const inside: number[] = [];
    for (let k = k0; k < k0 + kBrick; ++k) for (let j = j0; j < j0 + kBrick; ++j) for (let i = i0; i < i0 + kBrick; ++i) for (let c = 0; c < lanes; ++c) {
      inside.push(i < nx && j < ny && k < nz ? values[lanes * (i + nx * (j + ny * k)) + c]! : 0);
    }
    if (inside.every(value => Object.is(value, 0))) continue;
    mask[brick >> 3]! |= 1 << (brick & 7);
    filled.push(...inside);
  }
  const bytes = new Uint8Array(Float32Array.from(filled).buffer);
  const out = new Uint8Array(mask.length + bytes.length);
  out.set(mask);
  for (let at = 0; at < bytes.length; ++at) out[mask.length + (at % 4) * filled.length + (at >> 2)] = bytes[at]!;
  return out;
}

export interface Made {
  points: Triple;
  frame?: number;
  views?: View[];
  channels: {name: string; unit: string; lanes: 1 | 3; values: Float32Array}[];
}

/** Key points 1 cm apart, around the origin. */
export function htmlOf(volumes: readonly Made[], more: Partial<Contents> = {}): string {
  const blocks: string[] = [];
  const frames: Frame[] = volumes.map(({points, frame, views, channels}) => ({
    frame: frame ?? null, views: views ?? [], points, edge: 0.01, origin: points.map(n => -0.01 * (n - 1) / 2) as unknown as Triple,
    channels: channels.map(({name, unit, lanes, values}): Channel => {
      blocks.push(deflateSync(packed(points, lanes, values)).toString('base64'));
      return {name, unit, lanes, type: 'float32', scale: 1, block: blocks.length - 1};
    }),
  }));
  const contents: Contents = {version: 1, title: 'Emberlock: made', input: 'nowhere', up: [0, 0, 1], frames, cameras: [], trace: [], ...more};
  const file = (name: string) => readFileSync(`${kViewer}/${name}`, 'utf8');
  return `<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>made</title><style>${file('viewer.css')}</style></head><body>
<script type="application/json" id="emberlock-result">${JSON.stringify(contents).replaceAll('<', '\\u003c')}</script>
${blocks.map(block => `<script type="application/octet-stream" class="emberlock-block">${block}</script>`).join('\n')}
<script>${file('viewer.js')}</script></body></html>`;
}

/** Opens a page from the disk and waits for its first picture; what the browser complains of, and what is asked of any server, is kept. */
export async function openFile(browser: Browser, path: string, search = '', size = {width: 1280, height: 900}): Promise<{page: Page; complaints: string[]}> {
  const page = await (await browser.newContext({viewport: size, acceptDownloads: true})).newPage();
  page.setDefaultTimeout(1000 * kHangGuard);
  const complaints: string[] = [];
  page.on('pageerror', error => complaints.push(`script: ${error.message}`));
  page.on('console', message => { if (message.type() === 'error') complaints.push(message.text()); });
  page.on('request', request => { if (!/^(file|data|blob):/.test(request.url())) complaints.push(`asks elsewhere: ${request.url()}`); });
  await page.goto(pathToFileURL(path).href + search);
  await page.waitForFunction(() => 'emberlockViewer' in window || document.querySelector('.fault:not([hidden])') !== null);
  return {page, complaints};
}

export async function openMade(browser: Browser, path: string, volumes: readonly Made[], more: Partial<Contents> = {}, search = ''): Promise<{page: Page; complaints: string[]}> {
  writeFileSync(path, htmlOf(volumes, more));
  return openFile(browser, path, search);
}

/** A value at every key point, by its place from -1 to 1 on each axis. */
export function sampled([nx, ny, nz]: Triple, lanes: 1 | 3, value: (x: number, y: number, z: number, lane: number) => number): Float32Array {
  const out = new Float32Array(nx * ny * nz * lanes);
  let at = 0;
  for (let k = 0; k < nz; ++k) for (let j = 0; j < ny; ++j) for (let i = 0; i < nx; ++i) for (let c = 0; c < lanes; ++c) {
    out[at++] = value(2 * i / (nx - 1) - 1, 2 * j / (ny - 1) - 1, 2 * k / (nz - 1) - 1, c);
  }
  return out;
}

/** A flame of n x n x n key points that fills about a seventh of its box: a body that flickers, red through yellow, with soot in it. */
export function flame(n: number): Made {
  const points: Triple = [n, n, n];
  const body = (x: number, y: number, z: number) => {
    const [cx, cy] = [0.12 * Math.sin(4 * z), 0.1 * Math.cos(5 * z)];
    const radius = 0.5 * Math.max(0, 1 - ((z + 0.15) / 0.95) ** 2) ** 0.6 * (1 + 0.18 * Math.sin(9 * z + 3 * Math.atan2(y, x)));
    const share = radius > 0 ? Math.hypot(x - cx, y - cy) / radius : 2;
    return share < 1 ? (1 - share * share) * (0.6 + 0.4 * Math.sin(14 * x + 11 * z) * Math.cos(13 * y - 7 * z)) : 0;
  };
  const kelvin = (x: number, y: number, z: number) => {
    const b = body(x, y, z);
    return b > 0 ? 1300 + 700 * Math.sqrt(b) : 0;
  };
  return {points, channels: [
    {name: 'emission', unit: 'grey levels (0..255) per metre', lanes: 3, values: sampled(points, 3, (x, y, z, c) => [900, 420, 110][c]! * body(x, y, z))},
    {name: 'density', unit: '1/m', lanes: 1, values: sampled(points, 1, (x, y, z) => 3 * body(x, y, z))},
    {name: 'temperature', unit: 'K', lanes: 1, values: sampled(points, 1, kelvin)},
    {name: 'temperature_sigma', unit: 'K', lanes: 1, values: sampled(points, 1, (x, y, z) => kelvin(x, y, z) > 0 ? 20 + 60 * (1 - body(x, y, z)) : 0)},
  ]};
}
