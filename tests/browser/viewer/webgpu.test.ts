// SPDX-License-Identifier: Apache-2.0
// The viewer by WebGPU shows what it shows by WebGL, and goes on by WebGL where it can't. Skipped where no adapter answers.
import {mkdtempSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';

import type {Browser, Page} from 'playwright-core';
import {afterAll, beforeAll, expect, test, type TestContext} from 'vitest';

import {screenshot, startChromium, until} from '../support/chromium';
import {flame, openMade} from '../support/viewer_page';

const folder = mkdtempSync(join(tmpdir(), 'emberlock-webgpu-'));
let browser: Browser;
let places = 0;
const made = flame(33);
const thin = {...made, channels: made.channels.filter(({name}) => name !== 'density')};

beforeAll(async () => { browser = await startChromium(['--enable-unsafe-webgpu', '--use-webgpu-adapter=swiftshader', '--enable-features=Vulkan', '--use-vulkan=swiftshader']); }, 60_000);
afterAll(async () => {
  await browser.close();
  rmSync(folder, {recursive: true});
});

const open = (search: string, volumes = [made]) => openMade(browser, join(folder, `${places++}.html`), volumes, {}, search);
const renderer = (page: Page) => page.locator('canvas.stage').getAttribute('data-renderer');

/** As WebGPU draws it; the test is left out where that doesn't answer. */
async function byWebGpu(context: TestContext, volumes = [made]) {
  const opened = await open('?renderer=webgpu', volumes);
  const answers = await opened.page.evaluate(async () => 'gpu' in navigator && await navigator.gpu.requestAdapter() !== null);
  if (!answers) context.skip('this browser has no adapter of WebGPU');
  expect(await renderer(opened.page)).toBe('webgpu');
  return opened;
}

function picture(page: Page): Promise<number[]> {
  return page.evaluate(() => {
    const canvas = document.querySelector('canvas')!;
    canvas.style.cssText = 'width: 240px; height: 180px; min-height: 0';
    window.emberlockViewer!.drawAt(30);
    const gl = canvas.getContext('webgl2')!;
    const pixels = new Uint8Array(4 * canvas.width * canvas.height);
    gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    return [...pixels];
  });
}

async function look(page: Page, quantity: string, isotherms: number): Promise<number[]> {
  await page.getByLabel('What is shown').selectOption(quantity);
  await page.waitForSelector(`canvas[data-shown$=" ${quantity}"]`);
  if (quantity !== 'emission') await page.getByLabel('How many isotherms').fill(String(isotherms));
  return picture(page);
}

test('pictures of both agree within a grey level', async context => {
  for (const volumes of [[made], [thin]]) {
    const gpu = await byWebGpu(context, volumes);
    const gl = await open('?renderer=webgl', volumes);
    expect(await renderer(gl.page)).toBe('webgl');
    for (const [quantity, isotherms] of [['emission', 0], ['temperature', 0], ['temperature', 3], ['temperature', 4]] as const) {
      const [a, b] = [await look(gpu.page, quantity, isotherms), await look(gl.page, quantity, isotherms)];
      expect(a.length).toBe(b.length);
      expect(b.filter((value, at) => at % 4 !== 3 && value > 30).length, quantity).toBeGreaterThan(500);
      const apart = a.map((value, at) => Math.abs(value - b[at]!));
      // But where a ray has one step more by rounding, or grazes a surface.
      expect(apart.filter(value => value > 1).length / a.length, `${quantity} with ${isotherms} isotherms`).toBeLessThan(1e-4);
    }
    expect(await renderer(gpu.page), 'it went on').toBe('webgpu');
    await screenshot(gpu.page, 'viewer-webgpu');
    expect([...gpu.complaints, ...gl.complaints]).toEqual([]);
    await gpu.page.context().close();
    await gl.page.context().close();
  }
});

test('where the device is lost it goes on by WebGL', async context => {
  const {page, complaints} = await byWebGpu(context);
  const before = await picture(page);
  await page.evaluate(() => (window.emberlockViewer as unknown as {stage: {march: {device: GPUDevice}}}).stage.march.device.destroy());
  await until(() => renderer(page), name => name === 'webgl', 'the other one');
  await until(async () => (await picture(page)).filter((value, at) => Math.abs(value - before[at]!) > 1).length, count => count < 100, 'the same picture');
  expect(complaints).toEqual([]);
  await page.context().close();
});

test('software isn’t chosen unasked', async () => {
  const {page} = await open('');
  expect(await renderer(page)).toBe('webgl');
  await page.context().close();
});
