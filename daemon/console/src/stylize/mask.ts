// SPDX-License-Identifier: Apache-2.0
// A polygon in a view's picture, outside or inside of which it becomes black.
import {el, setText} from '../dom';
import {plural} from '../format';
import {order} from './fields';
import {type Bench, distance, place, type Point, type Tool} from './tool';

export class Mask implements Tool {
  readonly name = 'Mask';
  readonly hint = 'Click corners on the picture, or draw around what is meant. Then keep it, or cut it out.';
  private corners: Point[] = [];
  private readonly many = el('p', {class: 'note', role: 'status'}, 'No corner yet.');
  private readonly keep = order('Keep inside', () => this.apply('keep'));
  private readonly cut = order('Cut inside', () => this.apply('cut'));
  private readonly anew = order('Start again', () => this.forget(), 'quiet');
  readonly root = el('div', {}, this.many, el('div', {class: 'tool-orders'}, this.keep, this.cut, this.anew));

  constructor(private readonly bench: Bench) {
    this.tell();
  }

  down(at: Point): void {
    this.corners.push(at);
    this.tell();
  }

  drag(at: Point): void {
    const {width} = this.bench.view!;
    if (distance(this.corners.at(-1)!, at) < width / 100) return;
    this.corners.push(at);
    this.tell();
  }

  changed(): void {
    this.forget();
  }

  draw(context: CanvasRenderingContext2D, unit: number): void {
    if (this.corners.length === 0) return;
    context.beginPath();
    for (const {x, y} of this.corners) context.lineTo(x, y);
    context.closePath();
    context.fillStyle = 'rgb(86 180 233 / 20%)';
    context.fill();
    context.strokeStyle = '#fff';
    context.lineWidth = 1.5 * unit;
    context.stroke();
    context.fillStyle = '#fff';
    for (const {x, y} of this.corners) context.fillRect(x - 2.5 * unit, y - 2.5 * unit, 5 * unit, 5 * unit);
  }

  private apply(part: 'keep' | 'cut'): void {
    const polygon = this.corners.map(place);
    void this.bench.send({op: 'mask', view: this.bench.view!.name, polygon, part}).then(taken => { if (taken) this.forget(); });
  }

  private forget(): void {
    this.corners = [];
    this.tell();
    this.bench.redraw();
  }

  private tell(): void {
    const {length} = this.corners;
    setText(this.many, length === 0 ? 'No corner yet.' : length < 3 ? `${plural(length, 'corner')} of three at least.` : `${plural(length, 'corner')}.`);
    this.keep.disabled = this.cut.disabled = length < 3;
    this.anew.disabled = length === 0;
  }
}
