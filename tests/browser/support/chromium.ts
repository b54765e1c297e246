// SPDX-License-Identifier: Apache-2.0
// Debian's Chromium, driven by Playwright.
import {mkdirSync, writeFileSync} from 'node:fs';

import {type Browser, chromium, type Page} from 'playwright-core';

/** The longest wait for what must come, in seconds, on the busiest machine: it only ends a test that hangs. */
export const kHangGuard = 600;

export async function startChromium(more: readonly string[] = []): Promise<Browser> {
  return chromium.launch({
    executablePath: process.env.EMBERLOCK_CHROMIUM ?? '/usr/bin/chromium',
    args: ['--headless', '--no-sandbox', '--disable-quic', '--no-first-run', '--disable-background-networking',
           '--disable-component-update', '--disable-sync',
           // Without a GPU: WebGL by SwiftShader, for the volume alone; composing the page so would take most of a processor.
           '--disable-gpu-compositing', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', ...more],
  });
}

/** A page that remembers what the browser complained of: scripts that failed, rules of content security that were broken, requests elsewhere. */
export interface Watched {
  page: Page;
  complaints: string[];
}

export async function openPage(browser: Browser, url: string, size: {width: number; height: number}, options: {reducedMotion?: 'reduce'} = {}): Promise<Watched> {
  const context = await browser.newContext({viewport: size, reducedMotion: options.reducedMotion ?? 'reduce'});
  const page = await context.newPage();
  page.setDefaultTimeout(1000 * kHangGuard);
  const complaints: string[] = [];
  page.on('pageerror', error => complaints.push(`script: ${error.message}`));
  // A refused request is told here too; tests that refuse on purpose look at what the page shows instead.
  page.on('console', message => {
    if (message.type() === 'error' && !/Failed to load resource|WebSocket connection/.test(message.text())) complaints.push(message.text());
  });
  const host = new URL(url).host;
  page.on('request', request => {
    const to = new URL(request.url());
    if (to.host !== host && !['blob:', 'data:'].includes(to.protocol)) complaints.push(`asks elsewhere: ${request.url()}`);
  });
  await page.goto(url);
  return {page, complaints};
}

/** As WebP into EMBERLOCK_SCREENSHOTS, if that is set. */
export async function screenshot(page: Page, name: string, fullPage = false): Promise<void> {
  const folder = process.env.EMBERLOCK_SCREENSHOTS;
  if (!folder) return;
  const png = (await page.screenshot({fullPage, timeout: 60_000})).toString('base64');
  const bytes = await page.evaluate(async data => {
    const bitmap = await createImageBitmap(new Blob([Uint8Array.from(atob(data), letter => letter.charCodeAt(0))]));
    const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
    canvas.getContext('2d')!.drawImage(bitmap, 0, 0);
    return [...new Uint8Array(await (await canvas.convertToBlob({type: 'image/webp', quality: 0.8})).arrayBuffer())];
  }, png);
  mkdirSync(folder, {recursive: true});
  writeFileSync(`${folder}/${name}.webp`, Uint8Array.from(bytes));
}

/** Waits until what is read is as wanted; what it was at last stands in the message. */
export async function until<T>(read: () => Promise<T> | T, wanted: (value: T) => boolean, words: string): Promise<T> {
  let value = await read();
  for (const end = Date.now() + 1000 * kHangGuard; !wanted(value) && Date.now() < end; value = await read()) await new Promise(resolve => setTimeout(resolve, 30));
  if (!wanted(value)) throw new Error(`not so within ${kHangGuard} s: ${words}; it is ${JSON.stringify(value)?.slice(0, 4000)}`);
  return value;
}
