// SPDX-License-Identifier: Apache-2.0
// An object's picture, laid into one view's picture or into all: its grey becomes green light, which burns.
import {el, set, setText} from '../dom';
import {choice, NumberField, order, valid} from './fields';
import {type ObjectPicture, readPicture} from './picture_file';
import {type Bench, place, type Point, type Tool} from './tool';
import type {StylizationStatus_View as View} from '../api.gen';

const kBegin = 0.4;  // of the picture's width and height, at most

export class ObjectTool implements Tool {
  readonly name = 'Object';
  readonly hint = 'Choose a picture and drag it to its place; the wheel scales it. Light that is new needs its place in all views.';
  private readonly file = el('input', {type: 'file', accept: 'image/*', onchange: () => void this.choose()});
  private readonly scale = new NumberField('Scale', 1, {min: 0.001, max: 1000}, '', () => this.touch());
  private readonly rotation = new NumberField('Rotation', 0, {min: -360, max: 360}, '° clockwise', () => this.touch());
  private readonly opacity = new NumberField('Opacity', 1, {min: 0, max: 1}, '0 to 1', () => this.touch());
  private readonly strength = new NumberField('Strength', 1, {min: 0, max: 10000}, '× its grey', () => this.touch());
  private readonly combine = choice('Where both shine', {max: 'the brighter', over: 'the object', add: 'the sum'});
  private readonly here = order('Put into this view', () => this.put([this.bench.view!]), 'primary');
  private readonly everywhere = order('Put into all views', () => this.put(this.bench.inputs));
  private object?: ObjectPicture;
  private green?: HTMLCanvasElement;
  private at: Point = {x: 0, y: 0};
  private held?: Point;  // from its middle
  private placed = false;  // it is part of the picture: its frame alone is drawn
  readonly root = el('div', {},
    el('label', {class: 'field file'}, el('span', {}, 'Picture'), this.file),
    this.scale.root, this.rotation.root, this.opacity.root, this.strength.root, this.combine.root,
    el('div', {class: 'tool-orders'}, this.here, this.everywhere));

  constructor(private readonly bench: Bench) {
    this.enable();
  }

  down(at: Point): void {
    if (!this.object) return;
    // What is clicked beside it brings it there.
    const reach = Math.max(this.object.canvas.width, this.object.canvas.height) * this.scale.value / 2;
    if (Math.hypot(at.x - this.at.x, at.y - this.at.y) > reach) this.at = at;
    this.held = {x: this.at.x - at.x, y: this.at.y - at.y};
  }

  drag(at: Point): void {
    if (!this.held) return;
    this.at = {x: at.x + this.held.x, y: at.y + this.held.y};
    this.placed = false;
  }

  up(at: Point): void {
    this.drag(at);
    this.held = undefined;
  }

  wheel(by: number): void {
    this.scale.value = Number((this.scale.value * 1.1 ** by).toPrecision(3));
    this.placed = false;
  }

  draw(context: CanvasRenderingContext2D, unit: number): void {
    if (!this.object || !this.green) return;
    const {width, height} = this.green;
    context.save();
    context.translate(this.at.x, this.at.y);
    context.rotate((this.rotation.value || 0) * Math.PI / 180);
    context.scale(this.scale.value || 1, this.scale.value || 1);
    context.globalAlpha = Math.min(1, Math.max(0, this.opacity.value || 0));
    if (!this.placed) context.drawImage(this.green, -width / 2, -height / 2);
    context.globalAlpha = 1;
    context.strokeStyle = '#fff';
    context.lineWidth = 1.5 * unit / (this.scale.value || 1);
    context.strokeRect(-width / 2, -height / 2, width, height);
    context.restore();
  }

  changed(): void {
    this.enable();
  }

  private touch(): void {
    this.placed = false;
    this.bench.redraw();
  }

  private async choose(): Promise<void> {
    const file = this.file.files?.[0];
    if (!file) return;
    this.object = await readPicture(file).catch(() => undefined);
    this.file.setCustomValidity(this.object ? '' : 'This is no picture that the browser reads.');
    this.file.reportValidity();
    this.enable();
    const {view} = this.bench;
    if (!this.object || !view) return this.bench.redraw();
    const {width, height} = this.object.canvas;
    this.at = {x: view.width / 2, y: view.height / 2};
    this.scale.value = Number(Math.min(kBegin * view.width / width, kBegin * view.height / height).toPrecision(3));
    this.green = greenOf(this.object.canvas);
    this.touch();
  }

  /** A step for each; of another size at the same part of the picture. */
  private put(views: readonly View[]): void {
    const {object, at, bench} = this;
    if (!object || !bench.view || !valid(this.scale, this.rotation, this.opacity, this.strength)) return;
    const seen = (taken: boolean): void => {
      this.placed = taken;
      bench.redraw();
    };
    for (const view of views) {
      const by = view.width / bench.view.width;
      const position = place({x: at.x * by, y: at.y * view.height / bench.view.height});
      void bench.send({op: 'object', view: view.name, position, scale: this.scale.value * by, rotation: this.rotation.value, strength: this.strength.value,
        opacity: this.opacity.value, combine: this.combine.select.value}, {picture: object.picture, mask: object.mask}).then(seen);
    }
  }

  private enable(): void {
    const {inputs} = this.bench;
    this.here.disabled = !this.object;
    this.everywhere.disabled = !this.object || inputs.length < 2;
    setText(this.everywhere, inputs.length < 2 ? 'Put into all views' : `Put into all ${inputs.length} views`);
    set(this.everywhere, 'title', 'At the same place of each picture, a step for each.');
  }
}

/** What its grey makes of it (ITU-R BT.601, as the daemon takes it), to be laid over a picture: the darker, the clearer. */
function greenOf(canvas: HTMLCanvasElement): HTMLCanvasElement {
  const {width, height} = canvas;
  const image = canvas.getContext('2d')!.getImageData(0, 0, width, height);
  for (let at = 0; at < image.data.length; at += 4) {
    const [r, g, b] = [image.data[at]!, image.data[at + 1]!, image.data[at + 2]!];
    image.data.set([0, 255, 0, (0.299 * r + 0.587 * g + 0.114 * b) * image.data[at + 3]! / 255], at);
  }
  const green = document.createElement('canvas');
  green.width = width;
  green.height = height;
  green.getContext('2d')!.putImageData(image, 0, 0);
  return green;
}
