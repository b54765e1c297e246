// SPDX-License-Identifier: Apache-2.0
// Pictures for the mock, painted by the browser itself: a lamp, its smear, the dot; and a flame with its volume.
import type {Browser} from 'playwright-core';

/** `count` pictures of a lamp whose dot stands at the target, each a little different. */
export async function lampPictures(browser: Browser, count: number): Promise<Uint8Array[]> {
  return paint(browser, count, (context, at) => {
    context.fillStyle = '#101216';
    context.fillRect(0, 0, 640, 480);
    for (let i = 0; i < 900; ++i) {
      context.fillStyle = `rgba(255,255,255,${0.05 * Math.random()})`;
      context.fillRect(640 * Math.random(), 480 * Math.random(), 2, 2);
    }
    context.fillStyle = 'rgba(255,240,220,0.16)';
    context.fillRect(308, 0, 24, 480);
    const glow = context.createRadialGradient(320, 400, 2, 320, 400, 60);
    glow.addColorStop(0, '#fff');
    glow.addColorStop(0.4, '#ffe9c8');
    glow.addColorStop(1, 'rgba(255,220,180,0)');
    context.fillStyle = glow;
    context.fillRect(240, 320, 160, 160);
    context.fillStyle = '#fff';
    context.fillRect(308, 206 + (at % 3), 24, 9);
  });
}

/** `filter` is the canvas's: "grayscale(1)" for a grey camera's. */
export async function flamePictures(browser: Browser, count: number, filter = 'none'): Promise<Uint8Array[]> {
  return paint(browser, count, (context, at) => {
    context.fillStyle = '#020203';
    context.fillRect(0, 0, 640, 480);
    context.globalCompositeOperation = 'lighter';
    for (let i = 0; i < 60; ++i) {
      const height = i / 60;
      const x = 320 + 40 * Math.sin(6 * height + i) * height;
      const radius = (70 * (1 - height) + 12) * Math.min(1, (at + 2) / 8);
      const glow = context.createRadialGradient(x, 430 - 330 * height, 1, x, 430 - 330 * height, radius);
      glow.addColorStop(0, `rgba(255,${180 - 90 * height},${90 - 70 * height},0.16)`);
      glow.addColorStop(1, 'rgba(120,20,0,0)');
      context.fillStyle = glow;
      context.fillRect(0, 0, 640, 480);
    }
  }, filter);
}

export async function paint(browser: Browser, count: number, picture: (context: CanvasRenderingContext2D, at: number) => void, filter = 'none'): Promise<Uint8Array[]> {
  const page = await browser.newPage();
  const urls = await page.evaluate(([source, many, by]) => {
    const draw = new Function(`return (${source})`)() as (context: CanvasRenderingContext2D, at: number) => void;
    const canvas = document.createElement('canvas');
    canvas.width = 640;
    canvas.height = 480;
    const context = canvas.getContext('2d')!;
    return Array.from({length: many}, (_, at) => {
      context.globalCompositeOperation = 'source-over';
      context.filter = by;
      draw(context, at);
      return canvas.toDataURL('image/jpeg', 0.8);
    });
  }, [picture.toString(), count, filter] as const);
  await page.close();
  return urls.map(url => Buffer.from(url.slice(url.indexOf(',') + 1), 'base64'));
}

export function flameVolume(n = 32): {header: object; bytes: Uint8Array} {
  const bytes = new Uint8Array(n * n * n);
  for (let z = 0; z < n; ++z) {
    for (let y = 0; y < n; ++y) {
      for (let x = 0; x < n; ++x) {
        const height = z / n;
        const dx = x / n - 0.5 - 0.1 * Math.sin(7 * height) * height;
        const dy = y / n - 0.5 - 0.08 * Math.cos(5 * height) * height;
        const width = 0.2 * (1 - height) + 0.03;
        bytes[x + n * (y + n * z)] = Math.round(255 * Math.exp(-(dx * dx + dy * dy) / (width * width)) * (1 - 0.6 * height));
      }
    }
  }
  return {header: {kind: 'volume', nx: n, ny: n, nz: n, box: {center: [0, 0, 0.2], size: [0.3, 0.3, 0.4]}, brightest: 812}, bytes};
}

/** The same with a temperature: 1400 K above to 1900 K below; and its error, where it is the result. */
export function hotFlameVolume(quick: boolean, n = 32): {header: object; bytes: Uint8Array} {
  const {header, bytes} = flameVolume(n);
  const layers = [{kind: 'TEMPERATURE', low: 1400, high: 1900, quick}, ...(quick ? [] : [{kind: 'TEMPERATURE_SIGMA', low: 0, high: 40, quick}])];
  const all = new Uint8Array((1 + layers.length) * bytes.length);
  all.set(bytes);
  bytes.forEach((light, at) => {
    if (light < 13) return;
    all[bytes.length + at] = 255 - Math.floor(254 * Math.floor(at / (n * n)) / n);
    if (!quick) all[2 * bytes.length + at] = 30 + Math.floor(200 * Math.floor(at / (n * n)) / n);
  });
  return {header: {...header, layers}, bytes: all};
}
