// SPDX-License-Identifier: Apache-2.0
// How a camera's picture is exposed and focused, from its live picture as shown (8 bits): histogram, clipped and dark pixels, sharpness.
import {el, set, setText, show, svg} from './dom';
import {fixed, percent} from './format';

export const kClipped = 253;  // grey levels from which on a pixel counts as clipped: JPEG moves 255 by a little
export const kDark = 2;       // up to which it holds no light
const kBins = 64;
const kWidest = 480;          // px: larger pictures are thinned out, not smoothed, so that clipped pixels stay so
const kPeriod = 250;          // ms between two looks

export interface Figures {
  bins: number[];    // parts of all pixels, by brightness
  clipped: number;   // part of all pixels, in any colour
  dark: number;      // part of all pixels, in every colour
  median: number;    // grey levels
  brightest: number; // the level that one pixel of a thousand exceeds
  sharpness: number; // squared gradient over variance: the same at any exposure, greatest in focus
}

/** Of a picture's RGBA, row by row. */
export function measure(rgba: Uint8ClampedArray, width: number, height: number): Figures {
  const count = width * height;
  const levels = new Uint32Array(256);
  const grey = new Float32Array(count);
  let clipped = 0;
  let dark = 0;
  for (let at = 0; at < count; ++at) {
    const [r, g, b] = [rgba[4 * at]!, rgba[4 * at + 1]!, rgba[4 * at + 2]!];
    const most = Math.max(r, g, b);
    clipped += most >= kClipped ? 1 : 0;
    dark += most <= kDark ? 1 : 0;
    grey[at] = 0.299 * r + 0.587 * g + 0.114 * b;
    ++levels[Math.round(grey[at]!)]!;
  }
  const bins = new Array<number>(kBins).fill(0);
  levels.forEach((many, level) => { bins[Math.floor((level * kBins) / 256)]! += many / count; });
  const quantile = (part: number): number => {
    let below = 0;
    for (let level = 0; level < 256; ++level) if ((below += levels[level]!) > part * count) return level;
    return 255;
  };
  return {bins, clipped: clipped / count, dark: dark / count, median: quantile(0.5), brightest: quantile(0.999), sharpness: sharpness(grey, width, height)};
}

/** Mean squared gradient (Tenengrad; Krotkov, Int. J. Computer Vision 1, 1988) over the variance, which takes the exposure out. */
export function sharpness(grey: Float32Array, width: number, height: number): number {
  let sum = 0;
  let squares = 0;
  for (const value of grey) {
    sum += value;
    squares += value * value;
  }
  const variance = squares / grey.length - (sum / grey.length) ** 2;
  if (!(variance > 1)) return 0;  // nothing to be seen but noise
  let gradient = 0;
  for (let y = 1; y < height - 1; ++y) {
    for (let x = 1; x < width - 1; ++x) {
      const at = y * width + x;
      const p = (dx: number, dy: number): number => grey[at + dy * width + dx]!;
      const gx = p(1, -1) + 2 * p(1, 0) + p(1, 1) - p(-1, -1) - 2 * p(-1, 0) - p(-1, 1);
      const gy = p(-1, 1) + 2 * p(0, 1) + p(1, 1) - p(-1, -1) - 2 * p(0, -1) - p(1, -1);
      gradient += (gx * gx + gy * gy) / 64;
    }
  }
  return gradient / ((width - 2) * (height - 2)) / variance;
}

/** What to do about the exposure; where the lamp isn't seen, that comes first. */
export function exposureAdvice(f: Figures, lampMissing: boolean): string {
  if (lampMissing && f.brightest < 100) return 'Too dark for the lamp: expose for longer, open the aperture, or turn the camera to it.';
  if (f.clipped > 0.02) return 'Large parts are clipped: expose for a shorter time, close the aperture, or lower the gain.';
  if (f.brightest < 60) return 'Dark: expose for longer, open the aperture, or raise the gain.';
  if (f.clipped > 0.001) return 'Some pixels are clipped: a flame\'s brightness is lost there. A lamp may be.';
  return 'Nothing is clipped, and the picture is bright enough.';
}

/** Marks clipped pixels with stripes, and dark ones with a few dots: what is marked stays to be seen between them. */
export function marks(rgba: Uint8ClampedArray, width: number, height: number): Uint8ClampedArray<ArrayBuffer> {
  const out = new Uint8ClampedArray(4 * width * height);
  for (let y = 0; y < height; ++y) {
    for (let x = 0; x < width; ++x) {
      const at = 4 * (y * width + x);
      const most = Math.max(rgba[at]!, rgba[at + 1]!, rgba[at + 2]!);
      if (most >= kClipped && (x + y) % 4 < 2) out.set([255, 0, 160, 255], at);
      else if (most <= kDark && x % 6 === 0 && y % 6 === 0) out.set([60, 130, 255, 255], at);
    }
  }
  return out;
}

export class Exposure {
  readonly marks = el('canvas', {class: 'marks', 'aria-hidden': 'true', width: 4, height: 3});
  private readonly bars = svg('path', {class: 'bars'});
  private readonly graph = svg('svg', {class: 'histogram', viewBox: `0 0 ${kBins} 32`, preserveAspectRatio: 'none', role: 'img', 'aria-label': 'Histogram'},
                               svg('rect', {class: 'dark-end', x: 0, y: 0, width: 1, height: 32}), svg('rect', {class: 'clipped-end', x: kBins - 1, y: 0, width: 1, height: 32}), this.bars);
  private readonly words = el('p', {class: 'exposure-words'});
  private readonly advice = el('p', {class: 'exposure-advice'});
  private readonly meter = el('meter', {min: 0, max: 1, value: 0, 'aria-label': 'Focus, against the best seen'});
  private readonly focus = el('span');
  private readonly toggle = el('input', {type: 'checkbox', id: 'exposure-marks', checked: true, onchange: () => this.look()});
  private readonly small = document.createElement('canvas');
  readonly root = el('section', {class: 'exposure', 'aria-labelledby': 'exposure-title'},
    el('h3', {id: 'exposure-title'}, 'Exposure and focus'), this.graph, this.words, this.advice,
    el('div', {class: 'focus'}, el('span', {}, 'Focus'), this.meter, this.focus,
      el('button', {type: 'button', class: 'quiet', onclick: () => this.forget()}, 'Anew')),
    el('label', {class: 'marks-label', for: 'exposure-marks'}, this.toggle, ' mark clipped ', el('span', {class: 'key clipped', 'aria-hidden': 'true'}, '▨'), ' and dark ', el('span', {class: 'key dark', 'aria-hidden': 'true'}, '⋅'), ' pixels'));
  lampMissing = false;
  private best = 0;
  private timer?: number;

  constructor(private readonly source: HTMLCanvasElement) {}

  /** Looks four times a second until `stop`. */
  start(): void {
    this.forget();
    this.stop();
    this.timer = window.setInterval(() => this.look(), kPeriod);
  }

  stop(): void {
    clearInterval(this.timer);
    this.timer = undefined;
  }

  /** While something is drawn into the pictures, they tell nothing of the camera's. */
  pause(paused: boolean): void {
    if (paused === this.root.hidden) return;
    show(this.root, !paused);
    if (paused) show(this.marks, false);
    else this.forget();
  }

  private forget(): void {
    this.best = 0;
    this.look();
  }

  private look(): void {
    if (this.root.hidden) return;
    const scale = Math.min(1, kWidest / this.source.width);
    const [width, height] = [Math.round(this.source.width * scale), Math.round(this.source.height * scale)];
    if (width < 32 || height < 24) return;  // no picture yet
    if (this.small.width !== width || this.small.height !== height) {
      this.small.width = width;
      this.small.height = height;
    }
    const context = this.small.getContext('2d', {willReadFrequently: true})!;
    context.imageSmoothingEnabled = false;
    context.drawImage(this.source, 0, 0, width, height);
    const {data} = context.getImageData(0, 0, width, height);
    this.show(measure(data, width, height));
    show(this.marks, this.toggle.checked);
    if (!this.toggle.checked) return;
    if (this.marks.width !== width || this.marks.height !== height) {
      this.marks.width = width;
      this.marks.height = height;
    }
    this.marks.getContext('2d')!.putImageData(new ImageData(marks(data, width, height), width, height), 0, 0);
  }

  private show(f: Figures): void {
    // The root, so that a small lamp shows beside a dark room.
    const high = f.bins.map(part => 30 * Math.sqrt(part / Math.max(...f.bins)));
    set(this.bars, 'd', `M0 32${high.map((y, at) => `L${at} ${(32 - y).toFixed(2)}h1`).join('')}V32z`);
    const part = (value: number): string => (value > 0 && value < 0.0995 ? `${fixed(100 * value, value < 0.00995 ? 2 : 1)} %` : percent(value));
    setText(this.words, `Clipped ${part(f.clipped)}, dark ${part(f.dark)}; median ${f.median}, brightest ${f.brightest} of 255`);
    set(this.graph, 'aria-label', `Histogram: ${this.words.textContent}`);
    set(this.words, 'data-clipped', f.clipped > 0.001);
    setText(this.advice, exposureAdvice(f, this.lampMissing));
    this.best = Math.max(this.best, f.sharpness);
    this.meter.value = this.best > 0 ? f.sharpness / this.best : 0;
    setText(this.focus, this.best > 0 ? `${percent(f.sharpness / this.best)} of the best` : 'nothing to focus on');
  }
}
