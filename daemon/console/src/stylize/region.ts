// SPDX-License-Identifier: Apache-2.0
// A region of the volume, by numbers: made brighter or darker, cut out, or kept alone. Its outline stands on the picture.
import {el} from '../dom';
import {choice, NumberField, order, valid} from './fields';
import {ellipses, edgesOf, type Triple} from './outline';
import type {Bench, Operation, Tool} from './tool';

const kAxes = ['x', 'y', 'z'];
const kPerMetre = 1000;  // millimetres, as flames are measured

export class RegionTool implements Tool {
  readonly name = 'Region';
  readonly hint = 'A part of the volume, by its middle and size; yellow on the picture.';
  private readonly shape = choice('Shape', {ellipsoid: 'ellipsoid', box: 'box'}, () => this.bench.redraw());
  private readonly center = kAxes.map(axis => new NumberField(axis, 0, {min: -1e6, max: 1e6}, '', () => this.bench.redraw()));
  private readonly size = kAxes.map(axis => new NumberField(axis, 100, {min: 0.01, max: 1e6}, '', () => this.bench.redraw()));
  private readonly edge = new NumberField('Soft edge', 0, {min: 0, max: 1e6}, 'mm');
  private readonly factor = new NumberField('Brightness', 2, {min: 0, max: 10000}, '×');
  private box: unknown;
  readonly root = el('div', {}, this.shape.root,
    el('fieldset', {class: 'three'}, el('legend', {}, 'Middle, mm'), ...this.center.map(field => field.root)),
    el('fieldset', {class: 'three'}, el('legend', {}, 'Size, mm'), ...this.size.map(field => field.root)),
    this.factor.root, this.edge.root, el('div', {class: 'tool-orders'}, order('Set brightness', () => this.apply('brightness'), 'primary')),
    el('div', {class: 'tool-orders'}, order('Keep only this', () => this.apply('keep')), order('Cut this out', () => this.apply('cut'))));

  constructor(private readonly bench: Bench) {}

  /** It begins in the middle of the volume. */
  changed(): void {
    const {box} = this.bench;
    if (!box || box === this.box) return;
    this.box = box;
    kAxes.forEach((_, axis) => {
      this.center[axis]!.value = Math.round(10 * kPerMetre * box.center[axis]!) / 10;
      this.size[axis]!.value = Math.round(10 * kPerMetre * box.size[axis]! / 2) / 10;
    });
    this.bench.redraw();
  }

  draw(context: CanvasRenderingContext2D, unit: number): void {
    const {view, box} = this.bench;
    if (!view || view.pixel_from_world.length !== 12) return;
    const region = {center: this.metres(this.center), size: this.metres(this.size)};
    const lines = this.shape.select.value === 'box' ? edgesOf(region, view.pixel_from_world) : ellipses(region, view.pixel_from_world);
    const all: [typeof lines, string][] = [[lines, '#f0e442']];
    if (box) all.unshift([edgesOf({center: box.center as Triple, size: box.size as Triple}, view.pixel_from_world), 'rgb(255 255 255 / 35%)']);
    for (const [paths, colour] of all) {
      context.strokeStyle = colour;
      context.lineWidth = 1.5 * unit;
      for (const path of paths) {
        context.beginPath();
        for (const {x, y} of path) context.lineTo(x, y);
        context.stroke();
      }
    }
  }

  private metres(fields: NumberField[]): Triple {
    return fields.map(field => (field.value || 0) / kPerMetre) as Triple;
  }

  private apply(op: 'brightness' | 'keep' | 'cut'): void {
    if (!valid(...this.center, ...this.size)) return;
    const region: Record<string, unknown> = {shape: this.shape.select.value, center: this.metres(this.center), size: this.metres(this.size)};
    const operation: Operation = {op, region};
    if (op === 'brightness') {
      if (!valid(this.factor, this.edge)) return;
      region.edge = this.edge.value / kPerMetre;
      operation.factor = this.factor.value;
    }
    void this.bench.send(operation);
  }
}
