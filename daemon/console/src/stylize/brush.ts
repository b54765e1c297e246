// SPDX-License-Identifier: Apache-2.0
// A stroke in a view's picture that adds light, subtracts it, or erases.
import {el, show} from '../dom';
import {choice, NumberField, valid} from './fields';
import {type Bench, distance, place, type Point, type Tool} from './tool';

const kColours: Record<string, string> = {add: '255 236 170', subtract: '90 170 255', erase: '255 120 200'};

export class Brush implements Tool {
  readonly name = 'Brush';
  readonly hint = 'Draw on the picture. The wheel changes the radius.';
  private readonly mode = choice('Light is', {add: 'added', subtract: 'subtracted', erase: 'erased'}, () => this.showStrength());
  private readonly radius = new NumberField('Radius', 20, {min: 0.1, max: 10000}, 'px', () => this.bench.redraw());
  private readonly strength = new NumberField('Strength', 80, {min: 0, max: 10000}, 'of 255');
  private stroke: Point[] = [];
  private sent: Point[][] = [];  // and not yet seen in the picture
  readonly root = el('div', {}, this.mode.root, this.radius.root, this.strength.root);

  constructor(private readonly bench: Bench) {}

  down(at: Point): void {
    if (valid(this.radius, this.strength)) this.stroke = [at];
  }

  drag(at: Point): void {
    const last = this.stroke.at(-1);
    if (last && distance(last, at) >= 1) this.stroke.push(at);
  }

  up(at: Point): void {
    this.drag(at);
    const {stroke, bench} = this;
    if (stroke.length === 0) return;
    this.stroke = [];
    this.sent.push(stroke);
    const mode = this.mode.select.value;
    const strength = mode === 'erase' ? {} : {strength: this.strength.value};
    void bench.send({op: 'brush', view: bench.view!.name, points: stroke.map(place), radius: this.radius.value, mode, ...strength}).then(() => {
      this.sent = this.sent.filter(other => other !== stroke);
      bench.redraw();
    });
  }

  wheel(by: number): void {
    this.radius.value = Math.max(1, Math.round(this.radius.value * 1.1 ** by));
  }

  draw(context: CanvasRenderingContext2D, unit: number, pointer?: Point): void {
    const radius = this.radius.value || 0;
    context.lineCap = context.lineJoin = 'round';
    context.strokeStyle = `rgb(${kColours[this.mode.select.value]} / 45%)`;
    context.lineWidth = 1.5 * radius;  // it fades from half of the radius on
    for (const points of [...this.sent, this.stroke]) {
      if (points.length === 0) continue;
      context.beginPath();
      for (const {x, y} of [points[0]!, ...points]) context.lineTo(x, y);
      context.stroke();
    }
    if (!pointer) return;
    context.beginPath();
    context.arc(pointer.x, pointer.y, radius, 0, 2 * Math.PI);
    context.strokeStyle = '#fff';
    context.lineWidth = 1.5 * unit;
    context.stroke();
  }

  private showStrength(): void {
    show(this.strength.root, this.mode.select.value !== 'erase');
    this.bench.redraw();
  }
}
