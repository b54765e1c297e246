// SPDX-License-Identifier: Apache-2.0
// A view as it was captured, as the volume renders it, and their difference.
import {el, set, setText, show} from '../dom';
import {type FilmingCamera, type Frame, kDifferenceGain, type View} from './contents';

async function pixels(address: string): Promise<ImageData> {
  const image = new Image();
  image.src = address;
  await image.decode();
  const canvas = el('canvas', {width: image.naturalWidth, height: image.naturalHeight});
  const context = canvas.getContext('2d')!;
  context.drawImage(image, 0, 0);
  return context.getImageData(0, 0, canvas.width, canvas.height);
}

/** How far apart two pictures of one size are, `gain` times. */
export function difference(a: Uint8ClampedArray, b: Uint8ClampedArray, gain: number): Uint8ClampedArray {
  const out = new Uint8ClampedArray(a.length);
  for (let at = 0; at < a.length; ++at) out[at] = at % 4 === 3 ? 255 : gain * Math.abs(a[at]! - b[at]!);
  return out;
}

/** The root of the mean square of views' errors by role and over R, G and B, grey levels; null where none is told. */
export function errorOf({views}: Frame, cameras: readonly FilmingCamera[], role: FilmingCamera['role']): number | null {
  const squares = views.flatMap(({rmse}, n) => rmse && cameras[n]?.role === role ? rmse.map(v => v * v) : []);
  return squares.length > 0 ? Math.sqrt(squares.reduce((sum, v) => sum + v, 0) / squares.length) : null;
}

function title(camera: FilmingCamera): string {
  return camera.role === 'held_out' ? `${camera.name}, held out` : camera.name;
}

export class Compare {
  private readonly select = el('select', {'aria-label': 'View', onchange: () => this.choose(Number(this.select.value))});
  private readonly captured = el('img', {alt: 'captured'});
  private readonly rendered = el('img', {alt: 'rendered'});
  private readonly apart = el('canvas', {role: 'img', 'aria-label': 'difference', width: 1, height: 1});
  private readonly error = el('figcaption');
  private readonly three: HTMLElement;
  private shown = -1;
  private views: readonly View[] = [];
  readonly root: HTMLElement;

  /** `chosen` is told which view is looked at; `follow` wants to see the volume as that camera does. */
  constructor(private readonly cameras: readonly FilmingCamera[], private readonly chosen: (index: number) => void, follow: (index: number) => void) {
    const order = cameras.map((_, n) => n).sort((a, b) => Number(cameras[b]!.role === 'held_out') - Number(cameras[a]!.role === 'held_out') || a - b);
    this.select.append(...order.map(n => el('option', {value: n}, title(cameras[n]!))));
    this.three = el('div', {class: 'three'},
      el('figure', {}, this.captured, el('figcaption', {}, 'captured')),
      el('figure', {}, this.rendered, el('figcaption', {}, 'rendered from the volume')),
      el('figure', {}, this.apart, this.error));
    this.root = el('section', {class: 'part', 'aria-label': 'Captured, rendered, difference'}, el('h2', {}, 'Captured, rendered, difference'),
      el('p', {class: 'line'}, el('label', {}, 'View ', this.select), el('button', {type: 'button', onclick: () => follow(this.shown)}, 'Look from there')), this.three);
    if (order.length > 0) this.choose(order[0]!);
    show(this.root, order.length > 0);
  }

  /** Of a frame, as each camera saw it. */
  show(views: readonly View[]): void {
    if (views === this.views) return;
    this.views = views;
    this.draw();
  }

  choose(index: number): void {
    if (!this.cameras[index] || index === this.shown) return;
    this.shown = index;
    this.select.value = String(index);
    this.draw();
    this.chosen(index);
  }

  private draw(): void {
    const view = this.views[this.shown];
    show(this.three, view !== undefined);
    if (!view) return;
    set(this.captured, 'src', view.captured ?? undefined);
    set(this.rendered, 'src', view.rendered ?? undefined);
    show(this.captured.parentElement!, view.captured !== null);
    show(this.rendered.parentElement!, view.rendered !== null);
    const both = view.captured !== null && view.rendered !== null;
    show(this.apart.parentElement!, both);
    const rmse = view.rmse ? `, RMS ${view.rmse.map(v => v.toFixed(2)).join(' / ')} of 255 (R / G / B)` : '';
    setText(this.error, `difference, ${kDifferenceGain} times as bright${rmse}`);
    if (both) void this.subtract(view, view.captured!, view.rendered!);
  }

  private async subtract(view: View, captured: string, rendered: string): Promise<void> {
    const [a, b] = await Promise.all([pixels(captured), pixels(rendered)]);
    if (view !== this.views[this.shown] || a.width !== b.width || a.height !== b.height) return;
    Object.assign(this.apart, {width: a.width, height: a.height});
    this.apart.getContext('2d')!.putImageData(new ImageData(difference(a.data, b.data, kDifferenceGain) as Uint8ClampedArray<ArrayBuffer>, a.width, a.height), 0, 0);
    set(this.apart, 'data-view', this.shown);
  }
}
